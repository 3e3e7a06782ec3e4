"""The notebooks of docs/notebooks run from the first cell to the last, and what their text claims is true."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from conftest import ROOT

FOLDER = ROOT / "docs/notebooks"

#: What the text of a notebook says, as a last cell.
CLAIMS = {
    "first-log": """
assert run.verdict.trusted and run.recommended.order == 3
assert abs(run.modes()[0].hz - 29.77) < 0.1 and abs(run.fits["likelihood"]["record-verification"][0] - 90) < 5
""",
    "unstable-machine": """
assert direct.poles.real.max() < 1 < run.recommended.poles.real.max()
assert abs(run.recommended.poles.real.max() - true_pole) < 0.003
assert by_noise.groupby("noise, µm")["direct CVA"].mean().is_monotonic_increasing
assert by_length["direct CVA"].min() > 0.03, "a bias"
assert both["interval holds"].sum() >= 13
assert abs(peak / exact - 1) < 0.03
""",
    "grey-box": """
assert all(np.abs(value - 1) < 0.05) and not wrong.summary["methods"]["grey_box"]["residuals"]["record-verification"]["independent"]
assert abs(fits.loc["grey_box", "two inertias"] - fits.loc["likelihood", "two inertias"]) < 1
assert abs(fits.loc["grey_box", "rigid"] - fits.loc["nominal", "rigid"]) < 1
""",
    "choosing-an-experiment": """
bound = row(youla.excite(machine, controller, feedback="negative", amplitude=0.05, band=[5, 100], seconds=8, noise=sensor, shape="prbs"))
assert len(modes) == 30 and 0.6 < zeta.std(ddof=1) / bound["deviation of damping"] < 1.5
deviations = {shape: row(plan)["deviation of damping"] for shape, plan in plans.items()}
assert max(deviations["prbs"], deviations["square"]) < min(deviations["multisine"], deviations["chirp"])
""",
    "cluster": """
assert again.computed == 20 and here.rows == trials.rows[:3]
assert len(fleet.failed) == 2 and len(fleet.succeeded) == 10
assert table["trusted"].tolist() == [False] * 2 + [True] * 6 and (table["mode near 8 Hz"][2:] - 8).abs().max() < 0.02
halves = np.array([mode.hz_interval, mode.zeta_interval]) - trials.intervals(0.95)[0]
assert np.abs(halves).max() < 0.002
""",
}


@pytest.mark.parametrize("name", CLAIMS)
def test_a_notebook_runs(name: str, tmp_path: Path) -> None:
    """At most 60 s each, in a kernel of its own and an empty folder."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    for module in ("ipykernel", "control", "pandas", "matplotlib", "distributed", "pyarrow"):
        pytest.importorskip(module)
    notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    notebook.cells.append(nbformat.v4.new_code_cell(CLAIMS[name]))
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=60, kernel_name="python3", resources=resources).execute()
    errors = [o.text for cell in notebook.cells for o in cell.get("outputs", []) if o.get("name") == "stderr"]
    assert not errors, "a notebook warns"


def test_notebooks_are_kept_without_outputs() -> None:
    """Each is in CLAIMS, ends with what to do next and has no output, so that a change shows as text."""
    found = sorted(FOLDER.glob("*.ipynb"))
    assert [path.stem for path in found] == sorted(CLAIMS)
    for path in found:
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert all(not cell.get("outputs") and cell.get("execution_count") is None for cell in cells), path
        assert "## What to do next" in "".join(cells[-1]["source"]), path
        text = "".join("".join(cell["source"]) for cell in cells)
        for other in [part.split("`")[0] for part in text.split("`")[1::2] if part.endswith(".ipynb")]:
            assert (FOLDER / other).is_file(), f"{path}: {other}"
