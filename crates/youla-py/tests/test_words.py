"""What objects show of themselves, what progress tells, and what a misuse is told."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from conftest import loop

import youla

TABLE = loop(5, samples=1000)
KNOWN = {"nominal": youla.Model([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=0.01), "controller": 2.0, "feedback": "negative", "hansen": {"order": 1, "horizon": 5}}
SHORT = {"amplitude": 1.0, "band": [0.5, 10.0], "seconds": 10}


def log(table: np.ndarray = TABLE) -> youla.Record:
    return youla.Record(table, inputs=0, outputs=1, excitation=2, dt=0.01)


def test_every_object_shows_itself_in_ten_lines(run: youla.Run) -> None:
    plant = run.recommended
    objects = [
        run, run.verdict, plant, run.modes(), run.frequency_response(), run.predictions, run.plot, run.summary and log(),
        youla.bootstrap(run, 6, seed=1), youla.study(plant, 2.0, [SHORT], feedback="negative", n=2, noise=0.1, seed=1), youla.check(log()),
        youla.scan(log(), {"hansen.horizon": [5]}, **KNOWN), youla.certify(plant, 2.0, feedback="negative"), youla.reduce(plant, order=0),
        youla.excite(plant, 2.0, feedback="negative", **SHORT), youla.subspace(log(), order=1), youla.compare([run, run]), youla.redesign(youla.demo("bearing")),
        youla.Response([1.0], g=[1j]),
    ]  # fmt: skip
    for shown in map(repr, objects):
        assert 1 <= len(shown.splitlines()) <= 10, shown
        assert len(shown) < 1500, shown
    assert "youla.Verdict: trusted; tests: " in repr(run.verdict)


def test_progress_has_total_and_time(run: youla.Run, capsys: pytest.CaptureFixture[str]) -> None:
    told: list = []
    youla.bootstrap(run, 3, seed=1, progress=told.append)
    assert [(done.count, done.total) for done in told] == [(1, 3), (2, 3), (3, 3)]
    assert told[-1].seconds >= told[0].seconds >= 0
    youla.bootstrap(run, 2, seed=1, progress=True)
    assert "2 of 2" in capsys.readouterr().err


def with_nan() -> np.ndarray:
    table = TABLE.copy()
    table[17, 1] = np.nan
    return table


def uneven() -> dict[str, np.ndarray]:
    t = np.arange(1000) * 0.01
    t[500:] += 0.5
    return {"t": t, "u": TABLE[:, 0], "y": TABLE[:, 1]}


def improper() -> object:
    control = pytest.importorskip("control")
    return youla.identify(log(), nominal=1.0, controller=control.tf([1, 2, 1], [1, 1]), feedback="negative", hold="tustin")


CASES = {
    "above Nyquist": (lambda run: run.frequency_response([1e4]), "omega reaches 10000 rad/s.*Nyquist frequency of 314.159 rad/s"),
    "above Nyquist of a model": (lambda run: run.recommended.frequency_response([400.0]), "leave these frequencies out"),
    "key of a scan": (lambda run: youla.scan(log(), {"hansen.hozizon": [5]}, **KNOWN), "grid with 'hansen.hozizon': 5.*did you mean `horizon`"),
    "constant input": (lambda run: youla.identify(log(TABLE * [0, 1, 1]), **KNOWN), "the input 'u' is constant .0. in every record; excite it"),
    "NaN": (lambda run: youla.identify(log(with_nan()), **KNOWN), r"'y' is not finite at sample 17.*\[record\[:17\], record\[18:\]\]"),
    "uneven time": (lambda run: youla.Record(uneven(), inputs="u", outputs="y", time="t"), "comes 0.51 s after.*one clock"),
    "improper": (lambda run: improper(), "controller is improper: its numerator has degree 2, its denominator 1"),
    "no sign": (lambda run: youla.identify(log(), controller=2.0), r"feedback is missing: give feedback='negative' for u = K \(r - y\).*; the log "),
    "no seed": (lambda run: youla.bootstrap(run, 3), "seed is missing; give"),
    "no seed of a study": (lambda run: youla.study(run, 2.0, [SHORT], feedback="negative"), "seed is missing; give"),
    "key of a condition": (lambda run: youla.study(run, 2.0, [{**SHORT, "shap": 1}], feedback="negative", seed=1), r"conditions\[0\] has no argument 'shap'; did you mean 'shape'"),
    "value of a condition": (lambda run: youla.study(run, 2.0, [{**SHORT, "band": [1, 80]}], feedback="negative", seed=1), r"conditions\[0\]: .*half the sample rate"),
    "no end of samples": (lambda run: youla.Record(np.broadcast_to(0.0, (10**11, 2)), inputs=0, outputs=1, dt=1.0), "data has 200000000000 numbers, but may have at most 125000000"),
    "no end of a column": (lambda run: youla.Record({"u": range(10**30), "y": [1.0]}, inputs="u", outputs="y", dt=1.0), "channel 'u' has .* at most 125000000"),
    "no end of replicates": (lambda run: youla.bootstrap(run, 10**12, seed=1), "n is 1000000000000, but must be at most 1000000"),
    "no end of a grid": (lambda run: youla.scan(log(), {f"hansen.{key}": range(1, 1100) for key in ("order", "horizon")}, **KNOWN), "grid has more than 1000000 combinations"),
    "no end of records": (lambda run: youla.identify_many(range(10**30), **KNOWN), "there are more than 1000000 tasks"),
    "one column for two roles": (lambda run: youla.Record(TABLE, inputs=0, outputs=1, excitation=1, dt=0.01), "excitation names 'd', which is an input or output already"),
    "samples twice": (lambda run: (lambda r: youla.identify([r[:300], r[200:]], **KNOWN))(log()), r"share samples 200 to 299 of the first, counted from 0, which would count twice; .*record\.split"),
    "samples that verify": (lambda run: (lambda r: youla.identify(r, verify=r[100:200], **KNOWN))(log()), "share samples 100 to 199 of the first.*they would verify nothing"),
    "a copy that verifies": (lambda run: youla.identify(log(), verify=log(TABLE.copy()), **KNOWN), "share all samples"),
    "time in ms": (lambda run: youla.Record({"t_ms": [0, 1, 2], "u": [1, 2, 3], "y": [1, 3, 2]}, inputs="u", outputs="y", time="t_ms"), r"time 't_ms' is in milliseconds by its name.*data\['t_ms'\] / 1e3.*dt="),
    "key of a controller": (lambda run: youla.identify(log(), controller={"pid": {"Kp": 1.0, "discretisation": "tustin"}}, feedback="negative"), "`Kp` is not a key of controller={'pid': ...}"),
    "order as text": (lambda run: youla.identify(log(), **KNOWN, recommended={"order": "4"}), "recommended={'order': ...} is \"4\", but must be"),
    "no nominal model": (lambda run: youla.identify(log(), **{**KNOWN, "nominal": None}), "hansen= identifies the deviation from a nominal model; add nominal="),
    "no such trend": (lambda run: youla.identify(log(), **KNOWN, data={"detrend": "constant"}), "not a choice of data={'detrend': ...}"),
    "key of another table": (lambda run: youla.identify(log(), **KNOWN, verification={"order": 3}), "`order` is a key of recommended= and direct= and hansen="),
    "key of excite": (lambda run: youla.excite(run.recommended, 2.0, feedback="negative", **SHORT, shap=1), "excite has no argument 'shap'"),
}


@pytest.mark.parametrize("case", CASES)
def test_a_misuse_is_told_in_words_of_python(case: str, run: youla.Run) -> None:
    call, says = CASES[case]
    with pytest.raises(youla.InputError, match=says) as told:
        call(run)
    assert "run.toml" not in str(told.value)
    assert not re.search(r"\[(data|controller|nominal|recommended|hansen|verification)\b", str(told.value))


def test_an_existing_folder_names_replace(run: youla.Run, tmp_path: Path) -> None:
    run.save(tmp_path / "run")
    with pytest.raises(youla.InputError, match="holds a run: give replace=True"):
        run.save(tmp_path / "run")
    assert youla.load(run.save(tmp_path / "run", replace=True)) == run
    (tmp_path / "note.txt").write_text("mine")
    with pytest.raises(youla.InputError, match="is not empty"):
        run.save(tmp_path)
