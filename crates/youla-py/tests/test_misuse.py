"""Arguments that can be meant, but mean something else: refused with what is meant, never taken silently."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import loop

import youla

KNOWN: dict[str, Any] = {"controller": 2.0, "feedback": "negative"}
Call = Callable[[youla.Run], Any]

#: Calls on a run, with what they are told.
CASES: dict[str, tuple[Call, str]] = {
    # redesign
    "limit of another structure": (
        lambda run: youla.redesign(run, structure="pid", peak_sensitivity=1.1),
        r"^peak_sensitivity is not used with structure='pid'; give pid=\{'peak_sensitivity': 1.1\}$",
    ),
    "method of another structure": (lambda run: youla.redesign(run, structure="pid", method="lqg"), "^method is not used with structure='pid'; leave it out$"),
    "weights of another structure": (lambda run: youla.redesign(run, structure="pid", input_weights=[1.0]), "^input_weights is not used"),
    "limits without structure": (lambda run: youla.redesign(run, pid={"peak_sensitivity": 1.5}), "^pid is not used without structure='pid'; give structure='pid' too"),
    "limit beside pid": (lambda run: youla.redesign(run, structure="pid", phase_margin=40), r"phase_margin is a key of pid; .*pid=\{'phase_margin': 40\}"),
    "phase margin in radians": (lambda run: youla.redesign(run, structure="pid", pid={"phase_margin": 0.7}), r"pid\['phase_margin'\] is 0.7, but is in degrees: give at least 5"),
    "misspelt limit": (lambda run: youla.redesign(run, structure="pid", pid={"gain_margn": 3}), "pid has no argument 'gain_margn'; did you mean 'gain_margin'"),
    "structure": (lambda run: youla.redesign(run, structure="lead-lag"), "structure is 'lead-lag', but must be 'pid'"),
    "model in place of a run": (lambda run: youla.redesign(run.recommended), "run is a Model, but must be a youla.Run.*give the youla.Run that holds this model"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_misuse_is_refused(case: str, run: youla.Run) -> None:
    call, says = CASES[case]
    with pytest.raises(youla.InputError, match=says) as told:
        call(run)
    assert "run.toml" not in str(told.value)


def refused(call: Callable[[], Any]) -> str:
    with pytest.raises(youla.InputError) as told:
        call()
    return str(told.value)


def test_runs_of_missing_samples_leave_parts_without_them() -> None:
    table = loop(5, 1000)
    table[500:503, 1] = np.nan
    table[501:504, 0] = np.inf
    log = youla.Record(table, inputs=0, outputs=1, excitation=2, dt=0.01)
    told = refused(lambda: youla.identify(log, **KNOWN))
    assert "'u' is not finite at samples 501 to 503, counted from 0; " in told
    assert "[record[:500], record[504:]]" in told
    youla.identify([log[:500], log[504:]], **KNOWN)
    empty = youla.Record(np.full_like(table, np.nan), inputs=0, outputs=1, dt=0.01)
    assert "'u' is not finite at samples 0 to 999, counted from 0; check its column" in refused(lambda: youla.identify(empty, **KNOWN))


def test_a_masked_array_is_cut_by_rows() -> None:
    table = loop(5, 1000)
    masked = np.ma.array(table, mask=np.zeros_like(table, dtype=bool))
    masked[500:503, 1] = masked[0, 0] = np.ma.masked
    told = refused(lambda: youla.Record(masked, inputs=0, outputs=1, dt=0.01))
    assert "data has masked values at sample 0, counted from 0, and at 1 more place; " in told
    assert "data[1:500], data[503:], and give identify their list" in told
    assert youla.Record(masked[1:500], inputs=0, outputs=1, dt=0.01).samples == 499
    scattered = np.ma.array(table[:, 0], mask=np.arange(1000) % 100 == 50)
    told = refused(lambda: youla.Record({"u": scattered, "y": table[:, 1]}, inputs="u", outputs="y", dt=0.01))
    assert "data[:50], data[51:150], data[151:250], data[251:350], ..., and give" in told
    assert "synchronise(dt=) fills single samples" in told


def test_a_log_in_the_place_of_settings_names_its_columns(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time_s,inj,pos,torque\n0,1,2,3\n")
    told = refused(lambda: youla.identify(log, **KNOWN))
    assert told == "record is log.csv, a log; give youla.Record('log.csv', inputs=, outputs=, time=) in its place; its columns are time_s, inj, pos, torque"
    log.write_text("0;1,5;2;3\n")
    assert refused(lambda: youla.identify(log)).endswith("in its place")
    np.savez(tmp_path / "log.npz", u=[1.0])
    assert "record is log.npz, a log" in refused(lambda: youla.identify(tmp_path / "log.npz"))


def frame(samples: int = 500) -> Any:
    pd = pytest.importorskip("pandas")
    return pd.DataFrame(loop(5, samples), columns=["u", "y", "d"], index=pd.Index(0.01 * np.arange(samples), name="t"))


def of_frame(data: Any, **changes: Any) -> youla.Record:
    return youla.Record(data, **{"inputs": "u", "outputs": "y", **changes})


def test_an_index_is_named_where_it_holds_the_time_or_falls() -> None:
    data = frame()
    dated = data.set_axis(np.datetime64("2026-01-01") + np.arange(500) * np.timedelta64(10, "ms"))
    shuffled = data.iloc[[1, 0, *range(2, 500)]]
    for call, says in (
        (lambda: of_frame(data), "dt is missing: give time='index', which takes the index of data"),
        (lambda: of_frame(dated), "dt is missing: give time='index'"),
        (lambda: of_frame(data.reset_index()), "dt is missing: give the sample time in seconds, or time= with the column"),
        (lambda: of_frame(data[::-1], time="index"), "^the index of data falls, newest row first; give data.sort_index"),
        (lambda: of_frame(dated[::-1], time="index"), "^the index of data falls, newest row first; give data.sort_index"),
        (lambda: of_frame(data.reset_index()[::-1], time="t"), r"^time 't' falls, newest row first; give data\[::-1\]"),
        (lambda: of_frame(data.assign(t=1.0), time="t"), "^time 't' stands still; give the time of every row, or the sample time as dt=$"),
        (lambda: of_frame(data[::-1], dt=0.01), r"^the index of data falls, newest row first; give data.sort_index\(\), or data.reset_index"),
        (lambda: of_frame(data.reset_index()[::-1], dt=0.01), "^the index of data falls, newest row first"),
        (lambda: of_frame(dated[::-1], dt=0.01), "^the index of data falls, newest row first"),
        (lambda: of_frame(shuffled, dt=0.01), "^the index of data falls at some rows"),
    ):
        with pytest.raises(youla.InputError, match=says):
            call()
    for good in (data, dated, data.set_axis(list("ab") * 250), data.iloc[100:]):
        assert of_frame(good, dt=0.01).dt == 0.01


def test_a_channel_is_no_array() -> None:
    data, table = frame(), loop(5, 500)
    for call, says in (
        (lambda: youla.Record(table, inputs=0, outputs=1, excitation=table[:, 2], dt=0.01), r"^excitation is an array of 500 values, .*; put it into data as a column, by numpy.column_stack or data\['d'\] = ..., and name that column$"),
        (lambda: of_frame(data, inputs=data["u"], dt=0.01), "^inputs is an array of 500 values"),
        (lambda: of_frame(data, reference=np.zeros(500, dtype=int), dt=0.01), "^reference is an array of 500 values"),
    ):
        with pytest.raises(youla.InputError, match=says):
            call()
    assert of_frame(data, inputs=data.columns[:1], dt=0.01).inputs == ("u",)
    assert youla.Record(table, inputs=np.array([0]), outputs=1, dt=0.01).inputs == ("u",)


def test_a_verdict_says_which_defect_it_is(table: np.ndarray, record: youla.Record, run: youla.Run) -> None:
    exchanged = youla.Record(table, inputs=1, outputs=0, excitation=2, dt=0.01)
    for log, feedback, says in (
        (record, "positive", "with the opposite sign: change feedback= between \"negative\" and \"positive\", or the sign of the outputs."),
        (exchanged, "negative", "with inputs and outputs exchanged: u was measured and y was applied."),
    ):
        found = youla.identify(log, controller=2.0, feedback=feedback)
        (defect,) = found.verdict.defects
        assert defect.startswith(f"Defect of {log.name}: the declared controller does not explain ")
        assert defect.endswith(says)
        assert all(defect in shown for shown in (str(found.verdict), repr(found.verdict)))
        assert says.rstrip(".") in str(youla.check(log, controller=2.0, feedback=feedback))
    assert run.verdict.defects == ()


#: Controllers and options of identify, with what they are told.
ARGUMENTS: dict[str, tuple[dict[str, Any], str]] = {
    "numerator and denominator": ({"controller": ([1, 2], [1, 3])}, r"of a numerator and a denominator give control.tf\(numerator, denominator, dt\)$"),
    "ragged": ({"controller": ([2.0], [1, -0.5])}, r"controller is a tuple, .*; of a numerator and a denominator give control.tf"),
    "three gains": ({"controller": [127, 381, 3.81]}, r"a gain of 1 x 3, but must be 1 x 1; of the gains of a PID give \{'pid': \{'kp': 127, 'ki': 381, 'kd': 3.81, 'discretisation': 'tustin'\}\}, or"),
    "gains without a form": ({"controller": {"kp": 127.0, "ki": 2}}, r"but has \['kp', 'ki'\]; give \{'pid': \{'kp': 127.0, 'ki': 2\}\}$"),
    "discretisation": ({"controller": {"pid": {"kp": 2.0}}}, r"controller\['pid'\] lacks 'discretisation'; give 'backward-euler' \(backward differences\) or 'tustin'"),
    "order 0": ({"recommended": {"order": 0}}, r"^recommended\['order'\] is 0, but must be a whole number of at least 1, or 'auto'$"),
    "order -1": ({"recommended": {"order": -1}}, r"^recommended\['order'\] is -1, but must be a whole number of at least 1, or 'auto'$"),
    "order -1 of hansen": ({"hansen": {"order": -1}}, r"^hansen\['order'\] is -1, but must be a whole number of at least 1, or 'auto'$"),
    "order beyond the record": ({"recommended": {"order": 1000}}, r"4000 samples are too few.*; or ask for a lower order than recommended\['order'\] = 1000$"),
}  # fmt: skip


@pytest.mark.parametrize("case", ARGUMENTS)
def test_an_argument_of_identify_is_refused_with_what_is_meant(case: str, record: youla.Record) -> None:
    given, says = ARGUMENTS[case]
    with pytest.raises(youla.InputError, match=says):
        youla.identify(record, **{**KNOWN, **given})


@pytest.mark.parametrize("order", [0, -1])
def test_the_order_of_a_subspace_estimate(record: youla.Record, order: int) -> None:
    with pytest.raises(youla.InputError, match=f"^order is {order}, but must be a whole number of at least 1, or 'auto'$"):
        youla.subspace(record, order=order)


@pytest.mark.parametrize(("name", "place"), [("export", "youla export folder --to c"), ("commission", "youla commission campaign.toml"), ("plot", "run.plot.bode()")])
def test_what_is_elsewhere_is_named(name: str, place: str) -> None:
    with pytest.raises(AttributeError, match=f"module 'youla' has no attribute '{name}'; ") as told:
        getattr(youla, name)
    assert place in str(told.value)
    with pytest.raises(AttributeError, match="has no attribute 'nowhere'$"):
        _ = youla.nowhere


def test_a_number_is_no_signal(nominal: youla.Model) -> None:
    for signal, says in (
        ("noise", r"^noise is the number 0.01, but must be a signal, samples x 1; give 0.01 \* numpy.random.default_rng\(1\).standard_normal\(\(samples, 1\)\)$"),
        ("reference", r"^reference is the number 0.01, .*; give 0.01 \* numpy.ones\(\(samples, 1\)\)$"),
    ):
        with pytest.raises(youla.InputError, match=says):
            youla.simulate_loop(nominal, 2.0, feedback="negative", samples=100, **{signal: 0.01})


def test_machines_with_other_channels_are_named(run: youla.Run, tmp_path: Path) -> None:
    levitation, bearing = youla.demo(), youla.demo("bearing")
    with pytest.raises(youla.InputError, match=r"runs\[1\] has the inputs u_h, u_v and the outputs y_h, y_v, but runs\[0\] has the inputs u and the outputs y; "):
        youla.compare([run, bearing.save(tmp_path / "bearing")])
    renamed = youla.Record(loop(2), inputs=0, outputs=1, excitation=2, dt=0.01, name="log").to_frame()
    other = youla.identify(youla.Record(renamed.set_axis(["torque", "pos", "d"], axis=1), inputs="torque", outputs="pos", excitation="d", time="index"), **KNOWN)
    with pytest.warns(UserWarning, match=r"runs\[1\] has the inputs torque and the outputs pos, but runs\[0\] has the inputs u and"):
        found = youla.compare([run, other])
    assert {"from", "to", "nu_gap"} <= found.distances[0].keys()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        youla.compare([levitation, levitation])


PIDS: dict[str, dict[str, Any]] = {
    "backward": {"pid": {"kp": 2.0, "ki": 3.0, "kd": 0.01, "derivative_filter": 0.02, "discretisation": "backward-euler"}},
    "tustin": {"pid": {"kp": 2.0, "ki": 3.0, "kd": 0.01, "derivative_filter": 0.02, "discretisation": "tustin", "delay": 2}},
    "ideal": {"ideal_pid": {"kp": 2.0, "ti": 0.5, "td": 0.01, "derivative_filter": 0.02, "discretisation": "tustin"}},
    "ideal without an integral": {"ideal_pid": {"kp": 2.0, "td": 0.01, "discretisation": "backward-euler", "delay": 1}},
    "cascade": {"cascade": {"position": {"kp": 20.0}, "velocity": {"kp": 0.02, "ki": 0.1}, "discretisation": "backward-euler"}},
}


@pytest.mark.parametrize("form", PIDS)
def test_a_pid_in_a_loop_is_that_of_identify(form: str, record: youla.Record) -> None:
    run = youla.identify(record, controller=PIDS[form], feedback="negative")
    theirs = youla.certify(run.recommended, run.model("controller"), feedback="positive")
    ours = youla.certify(run.recommended, PIDS[form], feedback="negative")
    assert (ours.stable, ours.peak_sensitivity) == (theirs.stable, pytest.approx(theirs.peak_sensitivity, rel=1e-9))
    assert np.allclose(np.sort_complex(ours.poles), np.sort_complex(theirs.poles), atol=1e-6)


def test_pids_of_several_loops_and_files_in_a_loop(nominal: youla.Model, tmp_path: Path) -> None:
    plant = youla.Model(np.diag([0.95, 0.9]), 0.1 * np.eye(2), np.eye(2), np.zeros((2, 2)), dt=0.01)
    both = youla.certify(plant, {"pid": {"kp": [2.0, 1.0], "ki": [1.0, 0.0], "discretisation": "tustin"}}, feedback="negative")
    alone = [
        youla.certify(youla.Model([[a]], [[0.1]], [[1]], [[0]], dt=0.01), {"pid": {"kp": kp, "ki": ki, "discretisation": "tustin"}}, feedback="negative").poles
        for a, kp, ki in ((0.95, 2.0, 1.0), (0.9, 1.0, 0.0))
    ]
    assert np.allclose(np.sort_complex(both.poles), np.sort_complex(np.concatenate(alone)))
    youla.Model([], [], [], 2.0, dt=0.01).save(tmp_path / "k.json")
    nominal.save(tmp_path / "g.json")
    found = youla.certify(tmp_path / "g.json", str(tmp_path / "k.json"), feedback="negative")
    assert found.poles.tolist() == youla.certify(nominal, 2.0, feedback="negative").poles.tolist()
    (tmp_path / "k.csv").write_text("t,u")
    for call, says in (
        (lambda: youla.certify(nominal, str(tmp_path / "k.csv"), feedback="negative"), "k.csv, which holds no model .*; give a file that model.save wrote"),
        (lambda: youla.certify(PIDS["tustin"], 2.0, feedback="negative"), "plant is a mapping, of which the sample time is not known"),
        (lambda: youla.certify(nominal, {"pid": {"kp": 2, "discretisation": "zoh"}}, feedback="negative"), "the choices are backward-euler, tustin"),
        (lambda: youla.certify(nominal, {"transfer_function": {}}, feedback="negative"), "domain"),
    ):
        with pytest.raises(youla.InputError, match=says):
            call()


def test_a_redesign_asked_for_before_is_checked_alike(record: youla.Record) -> None:
    with pytest.raises(youla.InputError, match="peak_sensitivity is not used with structure='pid'"):
        youla.identify(record, controller=2.0, feedback="negative", redesign={"structure": "pid", "peak_sensitivity": 1.1})


def test_a_page_replaces_only_a_page(run: youla.Run, tmp_path: Path) -> None:
    log, page = tmp_path / "log.csv", tmp_path / "page.html"
    log.write_text("t,u,y\n")
    page.write_text("<html>mine</html>")
    (tmp_path / "data.json").write_text('{"runs": 3}')
    data = tmp_path / "data.html"
    for call, says in (
        (lambda: run.report(log), r"log.csv, but the page is an HTML file; give .*log.html"),
        (lambda: run.report(page), r"page.html, a file that is there and that youla did not write; give another name, or replace=True"),
        (lambda: youla.compare([run, run], page=page), "page is .*page.html, a file that is there"),
        (lambda: youla.compare([run, run], page=data), "whose data go into .*data.json, a file that is there"),
    ):
        with pytest.raises(youla.InputError, match=says):
            call()
    assert (log.read_text(), page.read_text(), data.exists()) == ("t,u,y\n", "<html>mine</html>", False)
    run.report(page, replace=True)
    run.report(page)
    youla.compare([run, run], page=data, replace=True)
    youla.compare([run, run], page=data)
    assert '"distances"' in (tmp_path / "data.json").read_text()
