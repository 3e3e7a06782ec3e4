"""Arguments of wrong types, sizes and places: each an `InputError` with the argument, what it is and the remedy."""

from __future__ import annotations

import datetime
import io
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import loop
from test_bad_input import FRAME, NOMINAL, TABLE, U, Y, ident, rec, refuses

import youla

control = pytest.importorskip("control")
pd = pytest.importorskip("pandas")
pl = pytest.importorskip("polars")

KNOWN: dict[str, Any] = {"nominal": NOMINAL, "controller": 2.0, "feedback": "negative"}
READ = {"inputs": "u", "outputs": "y", "dt": 0.01}
EXCITE: dict[str, Any] = {"amplitude": 1.0, "band": [1, 10]}
LEVELS = pd.DataFrame(TABLE, columns=pd.MultiIndex.from_tuples([("a", "u"), ("a", "y"), ("b", "d")]))
FIELDS = np.zeros(400, dtype=[("u", "f8"), ("y", "f8")])
RESPONSE = control.frd([1, 2, 3], [1, 2, 3], dt=0.01)
STATIC: dict[str, Any] = {"inputs": 1, "outputs": 1, "states": 1, "dt": 0.01}


class Tensor:
    """Behaves as a tensor of torch that requires a gradient."""

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        raise RuntimeError("use tensor.detach().numpy() instead")


def named(data: Any, **changes: Any) -> youla.Record:
    return youla.Record(data, **{**READ, **changes})


def indexed(index: Any) -> youla.Record:
    return named(FRAME.set_index(index), time="index", dt=None)


def closed() -> ThreadPoolExecutor:
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    return executor


def scan(**changes: Any) -> youla.Rows:
    return youla.scan(rec(), **{"grid": {"hansen.order": [1]}, **KNOWN, **changes})


def fleet(records: Any, **changes: Any) -> youla.Rows:
    return youla.identify_many(records, **{"read": READ, **KNOWN, **changes})


CASES: dict[str, tuple[Callable[[], Any], str]] = {
    # data
    "nothing": (lambda: rec(None), "data is None, but must be an array"),
    "a number": (lambda: rec(np.array(3.0)), "data is a ndarray, but must be samples x channels, a mapping, a data frame"),
    "a generator": (lambda: rec(row for row in TABLE), "data is a generator, but must be an array or a list"),
    "a column as generator": (lambda: named({"u": (x for x in U), "y": Y}), "channel 'u' is a generator"),
    "a set": (lambda: rec({1.0, 2.0}), "data is a set"),
    "a record": (lambda: rec(rec()), "data is already a youla.Record; use it as it is"),
    "fields": (lambda: rec(FIELDS), "records with fields, but must hold real numbers; give a mapping"),
    "complex column": (lambda: named({"u": U + 0j, "y": Y}), "channel 'u' holds complex numbers, but must hold real numbers; a frequency response"),
    "masked column": (lambda: named({"u": np.ma.masked_greater(U, 1), "y": Y}), "channel 'u' has masked values at sample"),
    "durations": (lambda: rec(TABLE.astype("m8[s]")), "data holds durations, but must hold real numbers; name the column with the time"),
    "tensor": (lambda: rec(Tensor()), "data is a Tensor that is no NumPy array: use tensor.detach().numpy() instead"),
    "empty": (lambda: rec(np.zeros((0, 3))), "data has no samples"),
    "empty frame": (lambda: named(FRAME[:0]), "data has 0 samples, but a record needs at least 2"),
    "levels of columns": (lambda: named(LEVELS), "data.columns = data.columns.map('_'.join)"),
    "numbers as columns": (lambda: youla.Record(pd.DataFrame(TABLE), inputs=0, outputs=1, dt=0.01), "give data.to_numpy() to choose by number"),
    "columns of one name": (lambda: named(FRAME.set_axis(["u", "y", "y"], axis=1)), "two columns of one name: ['y']; rename one"),
    "missing value of pandas": (lambda: ident(named(FRAME.astype("Float64").mask(FRAME > 2))), "is not finite at sample"),
    "null of polars": (lambda: ident(named(pl.DataFrame({"u": [None, *U[1:]], "y": Y}))), "channel 'u' is not finite at sample 0"),
    "categories": (lambda: named(FRAME.assign(u=pd.Categorical(["a", "b"] * 200))), "channel 'u' holds Python objects"),
    "folder": (lambda: named(Path()), "data is the folder ., but a record is one file; give youla.identify_many its files"),
    "path that is not there": (lambda: named(Path("none/x.csv")), "none/x.csv: no such file"),
    "open file": (lambda: named(io.StringIO("u,y")), "data is a StringIO"),
    "huge values": (lambda: ident(rec(TABLE * 1e200)), "values above 1e100 cannot be used; check its units"),
    # channels, time, labels
    "channel as float": (lambda: rec(inputs=1.0), "inputs is 1.0, but must be a list of names or column numbers"),
    "channels as mapping": (lambda: rec(inputs={"u": 0}), "inputs is {'u': 0}; channels are chosen by name"),
    "channel twice": (lambda: rec(inputs=[0, 0]), "column 0 is chosen twice as input or output"),
    "input as output": (lambda: named(FRAME, outputs="u"), "u is chosen twice as input or output; choose each channel once"),
    "negative dt": (lambda: rec(dt=-0.01), "dt is -0.01, but must be a positive number of seconds"),
    "dt as text": (lambda: rec(dt="0.01"), "dt is '0.01', but must be a positive number of seconds"),
    "dt as truth": (lambda: rec(dt=True), "dt is True"),
    "dt as duration": (lambda: rec(dt=datetime.timedelta(seconds=1)), "dt is datetime.timedelta(seconds=1)"),
    "two dt": (lambda: rec(dt=np.array([0.01, 0.02])), "dt is array([0.01, 0.02])"),
    "time as list": (lambda: rec(time=[0], dt=None), "time is [0], but must be the name or number of a column, or 'index'"),
    "time as truth": (lambda: rec(time=True, dt=None), "time is True, but must be the name or number"),
    "periods": (lambda: indexed(pd.period_range("2026", periods=400, freq="s")), "the index of data is a PeriodIndex, but must hold seconds"),
    "index of texts": (lambda: indexed(pd.Index([str(k) for k in range(400)])), "the index of data is a Index, but must hold seconds"),
    "units as text": (lambda: rec(units="V"), "units is a str, but must be a mapping such as {'u': 'V'}"),
    "unit as number": (lambda: rec(units={"u": 3}), "units['u'] is 3, but must be a text such as 'V'"),
    "new name": (lambda: rec().named(""), "name is '', but must be a text"),
    "cut by seconds": (lambda: rec()[0.5:3.0], "not by 0.5:3.0; divide seconds by dt"),
    "share as text": (lambda: rec().split("half"), "share is 'half', but must be between 0 and 1"),
    # systems
    "swapped controller": (lambda: ident(controller=control.ss([], [], [], np.ones((2, 1)), 0.01)), "controller has 2 outputs and 1 inputs"),
    "large nominal": (lambda: ident(nominal=youla.Model([], [], [], np.ones((2, 2)), dt=0.01)), "nominal has 2 outputs and 2 inputs"),
    "other dt": (lambda: ident(controller=control.tf([1], [1, 0.5], 0.02)), "controller has the sample time 0.02 s, but the record has 0.01 s"),
    "measured response": (lambda: ident(nominal=RESPONSE), "nominal is a FrequencyResponseData; give a state-space system"),
    "response in a loop": (lambda: youla.certify(RESPONSE, 1.0, feedback="negative"), "plant is a FrequencyResponseData without a state-space form"),
    "nonlinear": (lambda: ident(nominal=control.nlsys(lambda t, x, u, p: -x, **STATIC)), "nominal is a NonlinearIOSystem, but must be"),
    "improper": (lambda: youla.certify(control.tf([1, 0, 0], [1, 1], 0.01), 1.0), "give a proper model"),
    "nan as gain": (lambda: ident(controller=float("nan")), "controller has an entry that is not finite"),
    "nan in a system": (lambda: ident(nominal=control.ss(np.nan, 1, 1, 0, 0.01)), "nominal has an entry that is not finite"),
    "four matrices": (lambda: ident(nominal=([[0.9]], [[0.1]], [[1]], [[0]])), "nominal is a tuple, but must be a youla.Model"),
    "function as controller": (lambda: ident(controller=lambda y: y), "controller is a function, but must be a youla.Model"),
    "model file": (lambda: ident(nominal="nominal.json"), "nominal.json: no such file; nominal is read from the folder"),
    "empty path": (lambda: ident(nominal=""), "nominal is '', but must be a path"),
    "plant as text": (lambda: youla.certify("g", 1.0), "g: no such file; plant is read from the folder"),
    "plant of another dt": (lambda: youla.certify(NOMINAL, control.ss([], [], [], 2.0, 0.02)), "but the plant has 0.01 s"),
    "names of a model": (lambda: youla.Model(0.5, 1, 1, 0, dt=1, inputs=3), "inputs is 3, but must be a list of names"),
    "empty d": (lambda: youla.Model([], [], [], [], dt=1), "d is empty"),
    "infinite d": (lambda: youla.Model([], [], [], np.inf, dt=1), "d has an entry that is not finite"),
    # options
    "misspelt argument": (lambda: ident(verfy=rec()), "identify has no argument 'verfy'; did you mean 'verify'?"),
    "nan as option": (lambda: ident(hansen={"order": float("nan")}), "hansen.order is nan, but must be finite"),
    "nothing in a list": (lambda: ident(data={"detrend": [None]}), "data.detrend is None"),
    "name as number": (lambda: ident(name=5), "name is 5, but must be a text"),
    "verify of another dt": (lambda: ident(verify=rec(loop(9, 400), dt=0.02)), "record 2 has the sample time 0.02 s, the first has 0.01 s"),
    "folder for run.toml": (lambda: youla.identify("."), "record is the folder ., but must be a file"),
    "structure as list": (lambda: youla.greybox(rec(), structure=[1], **KNOWN), "structure is a list, but must be a mapping such as"),
    "seed beyond 64 bits": (lambda: youla.demo(seed=2**70), "but must be below 2^64"),
    "machine as number": (lambda: youla.demo(3), "machine is 3, but must be a text"),
    "no samples": (lambda: youla.simulate_loop(NOMINAL, 1.0, feedback="negative", samples=0), "samples is 0, but must be a whole number of at least 1"),
    "samples beyond memory": (lambda: youla.simulate_loop(NOMINAL, 1.0, feedback="negative", samples=10**16), "samples is 10000000000000000, but must be at most 125000000"),
    "band of one": (lambda: youla.excite(NOMINAL, 1.0, feedback="negative", **{**EXCITE, "band": 10, "seconds": 1}), "band has 1 entries, but must be the lowest"),
    "amplitude as text": (lambda: youla.excite(NOMINAL, 1.0, feedback="negative", **{**EXCITE, "amplitude": "big", "seconds": 1}), "amplitude is a str"),
    "seconds as text": (lambda: youla.excite(NOMINAL, 1.0, feedback="negative", **EXCITE, seconds="1"), "seconds is '1', but must be a positive number"),
    "negative seed": (lambda: youla.excite(NOMINAL, 1.0, feedback="negative", **EXCITE, seconds=1, seed=-1), "seed is -1, but must be a whole number"),
    "one run to compare": (lambda: youla.compare("run"), "runs is 'run', but must be a list of at least two"),
    "number to compare": (lambda: youla.compare([1, 2]), "runs[0] is 1, but must be a path"),
    "order below 0": (lambda: youla.reduce(NOMINAL, order=-1), "order is -1, but must be a whole number"),
    "place of a model": (lambda: NOMINAL.save("."), "path is ., which cannot be written (Is a directory); give another place"),
    # many tasks
    "closed executor": (lambda: scan(executor=closed()), "executor takes no tasks (cannot schedule new futures after shutdown)"),
    "class of executors": (lambda: scan(executor=ThreadPoolExecutor), "executor is ThreadPoolExecutor, but must be"),
    "progress": (lambda: scan(progress=3), "progress is 3, but must be True, or a function of the number of finished tasks"),
    "file as folder": (lambda: scan(folder=__file__), "is no folder and cannot be made (File exists); give another folder"),
    "key of a grid": (lambda: scan(grid={3: [1]}), "grid[3] must be a list of values of a key"),
    "no values": (lambda: scan(grid={"hansen.order": []}), "grid['hansen.order'] is empty; give at least one value"),
    "misspelt table": (lambda: scan(grid={"hanson.order": [1]}), "has no argument 'hanson'; did you mean 'hansen'?"),
    "one path": (lambda: fleet("a.csv"), "records is a str, but must be a list of them or of paths"),
    "one record": (lambda: fleet(rec()), "records is a Record, but must be a list"),
    "misspelt read": (lambda: fleet([], read={"input": "u"}), "has no argument 'input'; did you mean 'inputs'?"),
    "read as text": (lambda: fleet([], read="u"), "read is a str, but must be a mapping"),
    "sign of a fleet": (lambda: fleet([], feedback="minus"), "feedback is 'minus', but must be 'negative'"),
    "rows to a file": (lambda: youla.Rows((), 0).to_parquet(__file__), "give the folder of the data set"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_names_argument_and_remedy(case: str) -> None:
    refuses(*CASES[case])


def test_a_damaged_folder_is_no_obstacle(tmp_path: Path) -> None:
    """A row that was cut off is computed again; a damaged list of the settings is refused with its path."""
    first = scan(folder=tmp_path)
    (tmp_path / "000000.json").write_text('{"item"')
    assert scan(folder=tmp_path).rows == first.rows
    (tmp_path / "tasks.json").write_text("{")
    with pytest.raises(youla.InputError, match=r"tasks\.json cannot be read"):
        scan(folder=tmp_path)


def test_what_is_no_record_is_a_row(tmp_path: Path) -> None:
    """An array without names, a folder and a number: the rest of the fleet is identified."""
    found = fleet([rec(name="good"), TABLE, tmp_path, 3], hansen={"order": 1, "horizon": 5})
    assert [row["record"] for row in found] == ["good", "record 1", str(tmp_path), "record 3"]
    assert [row["index"] for row in found.failed] == [1, 2, 3]
    assert "name" in found.failed[0]["error"] or "number" in found.failed[0]["error"]
    assert "is the folder" in found.failed[1]["error"]


@pytest.mark.parametrize("data", [TABLE.tolist(), TABLE.astype(np.float16), TABLE.astype(np.longdouble), TABLE > 0])
def test_what_can_be_read_is_taken(data: Any) -> None:
    assert np.array_equal(rec(data).u[:, 0], np.asarray(data)[:, 0].astype(float).ravel())
