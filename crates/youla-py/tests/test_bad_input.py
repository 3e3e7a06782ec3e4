"""Bad input: each an exception that names the argument and the remedy. No panic reaches Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from conftest import loop

import youla

control = pytest.importorskip("control")
pd = pytest.importorskip("pandas")
pl = pytest.importorskip("polars")
signal = pytest.importorskip("scipy.signal")

TABLE = loop(3, 400)
U, Y, D = TABLE.T
GOOD = {"inputs": 0, "outputs": 1, "excitation": 2, "dt": 0.01}
NAMED = {"inputs": "u", "outputs": "y", "dt": 0.01}
FRAME = pd.DataFrame({"u": U, "y": Y, "d": D})
NOMINAL = youla.Model([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)


def rec(data: Any = TABLE, **changes: Any) -> youla.Record:
    return youla.Record(data, **{**GOOD, **changes})


def ident(record: Any = None, **changes: Any) -> youla.Run:
    given = {"nominal": NOMINAL, "controller": 2.0, "feedback": "negative", **changes}
    return youla.identify(rec() if record is None else record, **given)


def with_nan() -> np.ndarray:
    table = TABLE.copy()
    table[17, 1] = np.nan
    return table


def gaps() -> Any:
    frame = FRAME.copy()
    frame["t"] = np.arange(len(frame)) * 0.01
    frame.loc[200:, "t"] += 0.5
    return frame


def dates() -> Any:
    index = pd.date_range("2026-01-01", periods=len(FRAME), freq="10ms")
    return FRAME.set_index(index.delete(5).insert(399, index[-1] + pd.Timedelta("1s")))


CASES: dict[str, tuple[Callable[[], Any], str]] = {
    # data
    "no dt": (lambda: rec(dt=None), "dt is missing: give the sample time"),
    "zero dt": (lambda: rec(dt=0.0), "dt is 0.0, but must be a positive number"),
    "dt as text": (lambda: rec(dt="fast"), "dt is 'fast', but must be a positive number"),
    "no inputs": (lambda: rec(inputs=None), "inputs is missing: name at least one channel"),
    "no outputs": (lambda: rec(outputs=[]), "outputs is missing"),
    "column beyond": (lambda: rec(inputs=7), "inputs has column 7, but data has columns 0 to 2"),
    "name in an array": (lambda: rec(inputs="u"), "choose by number"),
    "boolean column": (lambda: rec(inputs=[True]), "inputs has True; channels are chosen by name or column number"),
    "one dimension": (lambda: rec(U), "use numpy.column_stack"),
    "three dimensions": (lambda: rec(TABLE.reshape(-1, 3, 1)), "must be samples x channels"),
    "channels x time": (lambda: rec(TABLE.T), "give data.T"),
    "objects": (lambda: rec(TABLE.astype(object)), "data holds Python objects, but must hold real numbers"),
    "text": (lambda: rec(TABLE.astype(str)), "data holds text"),
    "complex": (lambda: rec(TABLE.astype(complex)), "data holds complex numbers"),
    "ragged": (lambda: rec([[1.0, 2.0, 3.0], [1.0]]), "give rows of equal length"),
    "masked": (lambda: rec(np.ma.masked_greater(TABLE, 1.0)), "data has masked values at sample"),
    "NaN": (lambda: ident(rec(with_nan())), "not finite at sample 17"),
    "one sample": (lambda: rec({"u": [1.0], "y": [1.0]}, inputs="u", outputs="y", excitation=None), "at least 2"),
    "lengths differ": (lambda: youla.Record({"u": U, "y": Y[:-1]}, **NAMED), "channels differ in length"),
    "matrix as a channel": (lambda: youla.Record({"u": TABLE, "y": Y}, **NAMED), "'u' has 2 dimensions"),
    "unknown name": (lambda: youla.Record(FRAME, inputs="v", outputs="y", dt=0.01), "inputs names 'v', which is no channel"),
    "number in a frame": (lambda: youla.Record(FRAME, inputs=0, outputs="y", dt=0.01), "chosen by name: u, y, d"),
    "dates as a channel": (lambda: youla.Record(dates().reset_index(names="u2"), inputs="u2", outputs="y", dt=0.01), "dates"),
    "gap in time": (lambda: youla.Record(gaps(), inputs="u", outputs="y", time="t"), "sample 200, counted from 0"),
    "dates with a gap": (lambda: youla.Record(dates(), inputs="u", outputs="y", time="index"), "sample 5, counted from 0"),
    "dt against time": (lambda: youla.Record(gaps()[:100], inputs="u", outputs="y", time="t", dt=0.02), "sample time"),
    "lazy frame": (lambda: youla.Record(pl.LazyFrame({"u": U}), inputs="u", outputs="u", dt=0.01), "give data.collect()"),
    "units of no channel": (lambda: rec(units={"w": "V"}), "units names ['w'], which are no channels"),
    "missing file": (lambda: youla.Record("no.csv", **NAMED), "no.csv"),
    "step in a slice": (lambda: rec()[::2], "resample the data before"),
    "share beyond 1": (lambda: rec().split(1.5), "share is 1.5, but must be between 0 and 1"),
    # loop
    "no controller": (lambda: ident(controller=None), "controller is missing; give 0 where no controller ran"),
    "no nominal": (lambda: ident(nominal=None, hansen={}), "deviation from a nominal model; add nominal="),
    "wrong feedback": (lambda: ident(feedback="minus"), "feedback is 'minus', but must be 'negative'"),
    "text as a controller": (lambda: ident(controller=object()), "controller is a object, but must be"),
    "form of a controller": (lambda: ident(controller={"pdi": {}}), "exactly one key of difference_equation"),
    "gain of wrong shape": (lambda: ident(controller=[[1.0, 2.0]]), "controller is a gain of 1 x 2, but must be 1 x 1"),
    "continuous controller": (lambda: ident(controller=control.tf([1], [1, 1])), "give hold='tustin' or hold='zoh'"),
    "hold of a gain": (lambda: ident(hold="zoh"), "leave hold out"),
    "sample times differ": (
        lambda: ident(nominal=control.ss(0.9, 0.1, 1, 0, 0.02)),
        "nominal has the sample time 0.02 s, but the record has 0.01 s",
    ),
    "time of a system unknown": (lambda: ident(nominal=control.ss(0.9, 0.1, 1, 0, None)), "nominal has dt=None; state dt=0"),
    "ports of the nominal": (lambda: ident(nominal=np.ones((2, 1))), "nominal is a gain of 2 x 1, but must be 1 x 1"),
    "record is an array": (lambda: ident(TABLE), "record is ndarray, but must be a youla.Record"),
    "no record": (lambda: ident([]), "record is an empty list"),
    "records differ": (lambda: ident([rec(), rec(TABLE, inputs=[0, 1], outputs=2, excitation=None)]), "record 2 has other inputs or outputs"),
    "one record twice": (lambda: ident(verify=rec()), "from which the models are identified"),
    "unknown option": (lambda: ident(hanson={}), "identify has no argument 'hanson'; did you mean 'hansen'?"),
    "option is no mapping": (lambda: ident(hansen=8), "hansen is int, but must be a mapping"),
    "unknown key": (lambda: ident(hansen={"horizn": 20}), "horizon"),
    "value of a wrong type": (lambda: ident(hansen={"order": "many"}), "hansen={'order': ...} is \"many\", but must be a whole number"),
    "option that is no number": (lambda: ident(hansen={"order": object()}), "hansen.order is <object"),
    "run.toml with arguments": (lambda: youla.identify("run.toml", nominal=1.0), "a run.toml states everything"),
    # models and results
    "matrices do not fit": (lambda: youla.Model(np.eye(2), [[1.0]], [[1.0]], [[0.0]], dt=0.1), "b is 1 x 1, but must be 2 x 1"),
    "matrix with infinity": (lambda: youla.Model([[np.inf]], [[1.0]], [[1.0]], [[0.0]], dt=0.1), "a has an entry"),
    "frequencies": (lambda: NOMINAL.frequency_response([-1.0]), "omega must be a list of finite angular frequencies"),
    "inputs of a simulation": (lambda: NOMINAL.simulate(np.zeros((10, 2))), "inputs is 10 x 2, but must be samples x 1"),
    "length of a simulation": (lambda: youla.simulate_loop(NOMINAL, 1.0, feedback="negative"), "give signals of one length, or samples="),
    "continuous plant": (lambda: youla.certify(signal.StateSpace(-1, 1, 1, 0), 1.0), "plant states no sample time"),
    "length twice": (
        lambda: youla.excite(NOMINAL, 1.0, feedback="negative", amplitude=1, band=[1, 10], seconds=1.0, samples=9),
        "give either seconds= or samples=",
    ),
    "machine": (lambda: youla.demo("rocket"), 'machine is "rocket", but must be "levitation" or "bearing"'),
    "seed": (lambda: youla.demo(seed=-1), "seed is -1, but must be a whole number of at least 0"),
    "bootstrap of nothing": (lambda: youla.bootstrap(None, 3, seed=1), "run is None, but must be a youla.Run"),
    "grid": (lambda: youla.scan(rec(), {"order": 3}), "grid['order'] must be a list of values of a key 'table.key'"),
    "executor": (
        lambda: youla.scan(rec(), {"hansen.order": [1]}, executor=4, nominal=NOMINAL, controller=2.0, feedback="negative"),
        "executor is int, but must be a concurrent.futures.Executor",
    ),
}


def refuses(call: Callable[[], Any], sentence: str) -> None:
    """The call ends in an exception of the package with this sentence in it."""
    with pytest.raises(youla.InputError) as raised:
        call()
    assert sentence in str(raised.value)
    assert "panicked" not in str(raised.value)
    assert isinstance(raised.value, ValueError)
    assert isinstance(raised.value, youla.Error)


@pytest.mark.parametrize("case", CASES)
def test_names_argument_and_remedy(case: str) -> None:
    refuses(*CASES[case])


def test_there_are_forty() -> None:
    assert len(CASES) >= 40


def test_nominal_that_is_not_stabilised_is_refused_with_its_cause() -> None:
    """The sign of the controller is wrong: the scheme is refused and says so, the recommended model remains."""
    unstable = youla.Model([[1.05]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    run = ident(nominal=unstable, feedback="positive")
    assert "with the opposite sign it would" in run.summary["refused"]["factors"]


def test_constant_channel_is_numerical() -> None:
    with pytest.raises(youla.Error) as raised:
        youla.subspace(rec(np.ones((400, 3))))
    assert "constant" in str(raised.value) or "excit" in str(raised.value)


@pytest.mark.parametrize("convert", [np.asfortranarray, lambda x: x.astype(">f8"), lambda x: x.astype(np.float32)])
def test_layouts_of_arrays_are_taken(convert: Callable[[np.ndarray], np.ndarray]) -> None:
    """Fortran order and big-endian numbers give the same record; float32 that of its rounded values."""
    table = convert(TABLE)
    before = table.copy()
    assert np.array_equal(rec(table).y[:, 0], table[:, 1].astype(float))
    youla.subspace(rec(table), order=1, horizon=5)
    assert np.array_equal(table, before)
