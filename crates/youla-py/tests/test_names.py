"""docs/names.md: every expression of its column "here" runs."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ROOT

import youla



def expressions() -> list[str]:
    """Code of the column `here` of all tables."""
    found: list[str] = []
    column = None
    for line in (ROOT / "docs/names.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")] if line.startswith("|") else []
        if "here" in cells:
            column = cells.index("here")
        elif cells and column is not None and not cells[column].startswith("---"):
            code = cells[column].split("`")[1::2]
            assert code or cells[column] == "none", line
            found += code
    return list(dict.fromkeys(found))


@pytest.fixture(scope="module")
def names(record: youla.Record, fresh: youla.Record) -> dict[str, object]:
    control = pytest.importorskip("control")
    pytest.importorskip("matplotlib").use("Agg")
    model = youla.Model([[0.9, 0.0], [0.0, 0.5]], [[0.1], [0.01]], [[1.0, 1.0]], [[0.0]], dt=0.01)
    nominal, controller = control.ss(0.9, 0.1, 1.0, 0.0, 0.01), control.ss([], [], [], 2.0, 0.01)
    u = np.random.default_rng(1).standard_normal(200)
    structure = {"parameters": {"pole": {"initial": 4.0}, "gain": {"initial": 8.0}}, "a": [["-pole"]], "b": [["gain"]], "c": [[1]]}
    response = control.forced_response(control.ss(0.9, 0.1, 1.0, 0.0, 0.01), inputs=u)
    run = youla.identify(record, nominal=nominal, controller=controller, feedback="negative", verify=fresh, frequency_response={"window": 512})
    small = {"u": u, "y": u, "t1": 0.01 * np.arange(200), "t2": 0.01 * np.arange(200), "G": nominal, "K": controller, "structure": structure, "response": response}
    return {"youla": youla, "log": record, "run": run, "model": model, **small}


@pytest.mark.parametrize("expression", expressions())
def test_an_expression_runs(expression: str, names: dict[str, object]) -> None:
    assert eval(expression, dict(names)) is not None


def test_there_are_expressions() -> None:
    assert len(expressions()) >= 30
