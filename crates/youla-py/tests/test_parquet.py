"""Rows of tasks as Parquet data sets: read back by pandas and pyarrow with the same figures."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import loop

import youla

pytest.importorskip("pyarrow")
pd = pytest.importorskip("pandas")

NOMINAL = youla.Model([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
OPTIONS = {"nominal": NOMINAL, "controller": 2.0, "feedback": "negative", "hansen": {"order": 1, "horizon": 5}}
READ = {"inputs": "u", "outputs": "y", "dt": 0.01}


@pytest.fixture(scope="module")
def fleet() -> youla.Rows:
    log = youla.Record(loop(7, 400), inputs=0, outputs=1, excitation=2, dt=0.01, name="good")
    return youla.identify_many([log, "absent.csv"], read=READ, **OPTIONS)


def test_a_fleet_reads_back(fleet: youla.Rows, tmp_path: Path) -> None:
    """Figures, matrices and modes are equal to those of the rows, bit by bit; an error is a row."""
    folder = fleet.to_parquet(tmp_path / "fleet" / "today")
    frame = pd.read_parquet(folder)
    row = fleet.rows[0]
    assert frame["record"].tolist() == ["good", "absent.csv"]
    assert frame["error"][0] is None or pd.isna(frame["error"][0])
    assert frame["error"][1] == "absent.csv: no such file"
    assert frame["order"][0] == row["order"]
    assert frame["least_fit"].isna().tolist() == [True, True]
    assert list(frame["hz"][0]) == [m[0] for m in row["modes"]]
    assert np.array_equal(np.vstack(frame["a"][0]), row["model"]["a"])


def test_data_sets_of_several_calls_are_one(fleet: youla.Rows, tmp_path: Path) -> None:
    """The types of the columns do not depend on the rows: one of errors only reads with one of models."""
    only_errors = youla.identify_many(["other.csv"], read=READ, **OPTIONS)
    fleet.to_parquet(tmp_path / "all" / "first")
    only_errors.to_parquet(tmp_path / "all" / "second")
    assert len(pd.read_parquet(tmp_path / "all")) == 3


def test_values_of_several_types_are_text(tmp_path: Path) -> None:
    rows = youla.Rows(({"index": 0, "recommended.order": 2}, {"index": 1, "recommended.order": "auto"}), 2)
    frame = pd.read_parquet(rows.to_parquet(tmp_path / "scan"))
    assert frame["recommended.order"].tolist() == ["2", '"auto"']


def test_nothing_is_overwritten(fleet: youla.Rows, tmp_path: Path) -> None:
    folder = tmp_path / "fleet"
    fleet.to_parquet(folder)
    with pytest.raises(youla.InputError, match="give another folder, or replace=True"):
        fleet.to_parquet(folder)
    fleet.to_parquet(folder, replace=True)
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(youla.InputError, match="holds notes.txt; give another folder"):
        fleet.to_parquet(folder, replace=True)
    with pytest.raises(youla.InputError, match="is a file"):
        fleet.to_parquet(folder / "notes.txt")


@pytest.mark.parametrize(
    ("module", "extra", "call"),
    [
        ("pyarrow", "parquet", lambda rows: rows.to_parquet("nowhere")),
        ("pandas", "frames", lambda rows: rows.to_frame()),
        ("control", "control", lambda rows: NOMINAL.to_control()),
        ("scipy.signal", "control", lambda rows: NOMINAL.to_scipy()),
        ("matplotlib.pyplot", "plot", lambda rows: NOMINAL.frequency_response([1.0]).plot()),
    ],
)
def test_an_absent_package_names_its_extra(
    module: str, extra: str, call: object, fleet: youla.Rows, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(youla.InputError, match=rf"is not installed.*pip install 'youla\[{extra}\]'"):
        call(fleet)
    assert not Path("nowhere").exists()


def test_a_record_from_parquet(tmp_path: Path) -> None:
    """The columns that are named, with dates as seconds from the first row."""
    data = loop(7, 400)
    clock = pd.to_datetime("2026-11-24") + pd.to_timedelta(0.01 * np.arange(400), unit="s")
    file = tmp_path / "log.parquet"
    pd.DataFrame({"t": clock, "u": data[:, 0], "y": data[:, 1], "note": "x"}).to_parquet(file)
    log = youla.Record(file, inputs="u", outputs="y", time="t")
    assert log.dt == pytest.approx(0.01) and log.samples == 400
    assert np.array_equal(log.u[:, 0], data[:, 0]) and np.array_equal(log.y[:, 0], data[:, 1])
    with pytest.raises(youla.InputError, match="which is no channel; the channels are t, u, y, note"):
        youla.Record(file, inputs="v", outputs="y", time="t")
