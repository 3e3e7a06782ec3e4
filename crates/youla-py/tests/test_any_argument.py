"""Each argument of each function, in turn, with values of all kinds: taken, or refused by an exception of the package."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import loop

import youla

pd = pytest.importorskip("pandas")
control = pytest.importorskip("control")
matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")

TABLE = loop(3, 300)
FRAME = pd.DataFrame(TABLE, columns=["u", "y", "d"])
NOMINAL = youla.Model([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
CHANNELS: dict[str, Any] = {"inputs": 0, "outputs": 1, "excitation": 2, "dt": 0.01}
RECORD, FRESH = (youla.Record(loop(k, 300), **CHANNELS, name=f"log {k}") for k in (3, 4))
KNOWN: dict[str, Any] = {"nominal": NOMINAL, "controller": 2.0, "feedback": "negative", "hansen": {"order": 1, "horizon": 5}}
RUN = youla.identify(RECORD, verify=FRESH, **KNOWN)
LOOP = {"feedback": "negative", "hold": None}
TASKS: dict[str, Any] = {"executor": None, "folder": None}
STRUCTURE = {"parameters": {"p": {"initial": 4.0}}, "a": [["-p"]], "b": [["2"]], "c": [[1]]}
EXCITATION = {"amplitude": 1, "band": [1, 10], "seconds": 1.0, "seed": 1, "shape": "prbs", "noise": 0.1}

CONDITION = {"amplitude": 1.0, "band": [1, 10], "samples": 200}
TURN = 0.9 * np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
STUDY = youla.study(youla.Model(TURN, [[0], [1]], [[1, 0]], [[0]], dt=0.01), 0.0, [CONDITION], n=2, seed=1, noise=0.1)

VALUES = [
    None, -1, 1.5, float("nan"), True, 10**40, 1j, "x", "", b"x", [], [None], [[1, 2], [3]], {1: 2}, {"x": {}}, object(), int,
    np.array(1.0), np.array([]), np.array([None, 1], dtype=object), np.ones((2, 3)), np.zeros((2, 2, 2)), FRAME, FRAME["u"], pd.NA,
    pd.NaT, control.frd([1, 2], [1, 2]), RECORD, NOMINAL, RUN, Path("nowhere"), range(3), slice(1, 2), np,
]  # fmt: skip

#: Functions with arguments that they take.
CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "Record": (youla.Record, {"data": TABLE, **CHANNELS, "reference": None, "time": None, "name": "n", "units": None}),
    "Record, frame": (youla.Record, {"data": FRAME, "inputs": "u", "outputs": "y", "excitation": "d", "dt": 0.01, "time": None}),
    "Record.split": (RECORD.split, {"share": 0.5}),
    "Record.named": (RECORD.named, {"name": "x"}),
    "Record[]": (RECORD.__getitem__, {"rows": slice(1, 50)}),
    "Model": (youla.Model, {"a": 0.5, "b": 1, "c": 1, "d": 0, "dt": 1, "inputs": None, "outputs": None, "name": "m"}),
    "Model.frequency_response": (NOMINAL.frequency_response, {"omega": [1.0]}),
    "Model.simulate": (NOMINAL.simulate, {"inputs": np.ones(5), "x0": None}),
    "Model.save": (NOMINAL.save, {"path": "m.json"}),
    "identify": (youla.identify, {"record": RECORD, **KNOWN, **LOOP, "verify": None, "name": None, "recommended": {}, "data": {}}),
    "check": (youla.check, {"record": RECORD, "nominal": NOMINAL, "controller": 2.0, "feedback": "negative", **LOOP, "check": {}}),
    "subspace": (youla.subspace, {"record": RECORD, "order": 1, "horizon": 5, "method": "n4sid", "past": 5, "stability": "allow"}),
    "greybox": (youla.greybox, {"record": RECORD, "structure": STRUCTURE, "grey_box": None, **KNOWN}),
    "certify": (youla.certify, {"plant": NOMINAL, "controller": 2.0, "feedback": "negative", "feedback": "negative"}),
    "simulate_loop": (youla.simulate_loop, {"plant": NOMINAL, "controller": 2.0, "feedback": "negative", "samples": None, "excitation": np.ones(9), "noise": None}),
    "workbench": (youla.workbench, {"record": RECORD, "height": 400}),
    "reduce": (youla.reduce, {"system": NOMINAL, "output_scale": None, "order": 1, "method": "balanced-truncation"}),
    "redesign": (youla.redesign, {"run": RUN, "method": "youla", "peak_sensitivity": 2.0}),
    "excite": (youla.excite, {"nominal": NOMINAL, "controller": 2.0, "feedback": "negative", "dt": None, **EXCITATION, **LOOP}),
    "compare": (youla.compare, {"runs": [RUN, RUN], "model": "likelihood"}),
    "demo": (youla.demo, {"machine": "rocket", "seed": 1}),
    "bootstrap": (youla.bootstrap, {"run": RUN, "n": 1, "seed": 1, **TASKS}),
    "scan": (youla.scan, {"record": RECORD, "grid": {"hansen.order": [1]}, "verify": None, **TASKS, **KNOWN}),
    "identify_many": (youla.identify_many, {"records": [RECORD], "read": None, **TASKS, **KNOWN, **LOOP}),
    "study": (youla.study, {"plant": NOMINAL, "controller": 2.0, "feedback": "negative", "conditions": [CONDITION], "n": 1, "seed": 1, "noise": 0.1, **TASKS}),
    "Study.cheapest": (STUDY.cheapest, {"zeta": 0.1, "mode": 0}),
    "Study.plot": (STUDY.plot, {"ax": None, "mode": 0, "wanted": 0.1}),
    "Run.model": (RUN.model, {"name": "likelihood"}),
    "Run.modes": (RUN.modes, {"model": "likelihood"}),
    "Run.frequency_response": (RUN.frequency_response, {"omega": [1.0], "model": "likelihood"}),
    "Run.report": (RUN.report, {"path": "r.html"}),
    "Run.save": (RUN.save, {"folder": "run", "replace": True}),
    "Plots.bode": (RUN.plot.bode, {"models": None, "ax": None, "omega": None, "output": 0, "input": 0}),
    "Plots.nyquist": (RUN.plot.nyquist, {"model": "likelihood", "ax": None, "omega": [1.0]}),
    "Plots.poles": (RUN.plot.poles, {"models": None, "ax": None}),
    "Plots.fit": (RUN.plot.fit, {"record": 0, "ax": None, "model": "likelihood", "output": 0}),
    "Bootstrap.intervals": (youla.bootstrap(RUN, 2, seed=1).intervals, {"level": 0.9}),
    "Rows.to_parquet": (youla.Rows((), 0).to_parquet, {"folder": "rows", "replace": True}),
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", CALLS)
def test_any_value_is_taken_or_refused(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    call, good = CALLS[name]
    wrong = []
    for argument in good:
        for value in VALUES:
            try:
                call(**{**good, argument: value})
            except youla.Error as error:
                if "panicked" in str(error) or "no JSON" in str(error):
                    wrong.append(f"{argument}={value!r}: {error}")
            except Exception as error:
                wrong.append(f"{argument}={value!r}: {error!r} {traceback.extract_tb(error.__traceback__)[-1]}")
            matplotlib.pyplot.close("all")
    assert not wrong, "\n".join(wrong)
