"""One PID for several operating points of a machine, and one for each of its loops."""

from __future__ import annotations

import numpy as np
import pytest

import youla

DT = 0.01


def plant(pole: float, gain: float) -> youla.Model:
    return youla.Model([[pole]], [[gain]], [[1.0]], [[0.0]], dt=DT)


def run_at(pole: float, gain: float, seed: int, kp: float = 2.0) -> youla.Run:
    rng = np.random.default_rng(seed)
    d = rng.standard_normal((4000, 1))
    controller = {"pid": {"kp": kp, "ki": 5.0, "discretisation": "backward-euler"}}
    k = youla.Model([[1.0]], [[1.0]], [[5.0 * DT]], [[kp + 5.0 * DT]], dt=DT)
    u, y = youla.simulate_loop(plant(pole, gain), k, feedback="negative", excitation=d, noise=0.02 * rng.standard_normal((4000, 1)))
    record = youla.Record({"u": u[:, 0], "y": y[:, 0], "d": d[:, 0]}, inputs="u", outputs="y", excitation="d", dt=DT)
    return youla.identify(record, controller=controller, feedback="negative")


@pytest.fixture(scope="module")
def runs() -> list[youla.Run]:
    return [run_at(0.98, 0.02, 1), run_at(0.96, 0.05, 2)]


def test_one_controller_keeps_the_limits_at_every_point(runs: list[youla.Run], tmp_path) -> None:
    chosen = {"structure": "pid", "pid": {"terms": "pi"}}
    both = youla.redesign(runs, **chosen)
    assert both.promised["proof"]["holds"] and "proved on" in repr(both), both.promised["proof"]
    for pole, gain in ((0.98, 0.02), (0.96, 0.05)):
        found = youla.certify(plant(pole, gain), both.controller, feedback="positive")
        assert found.stable and found.peak_sensitivity < 2.0, (pole, found)
    # A finished run alone gives its own; the slower of the points decides for both. A run from its folder gives the same bits.
    alone = [youla.redesign(run, **chosen) for run in runs]
    assert both.promised["rejections"][0] < 1.02 * min(a.promised["rejections"][0] for a in alone)
    runs[1].save(tmp_path / "second")
    again = youla.redesign([runs[0], youla.load(tmp_path / "second")], **chosen)
    assert again.promised == both.promised


def test_runs_that_do_not_belong_together_are_refused(runs: list[youla.Run]) -> None:
    with pytest.raises(youla.InputError, match=r"run\[1\] had another controller"):
        youla.redesign([runs[0], run_at(0.96, 0.05, 2, kp=1.5)], structure="pid")
    with pytest.raises(youla.InputError, match="structure='pid'"):
        youla.redesign(runs)
    with pytest.raises(youla.InputError, match="run is empty"):
        youla.redesign([])
    with pytest.raises(youla.InputError, match="must be a youla.Run"):
        youla.redesign([runs[0], 3], structure="pid")


def test_each_loop_of_a_machine_gets_a_pid() -> None:
    rng = np.random.default_rng(3)
    tanks = youla.Model([[0.98, 0.0], [0.0, 0.95]], [[0.02, 0.006], [0.012, 0.04]], np.eye(2), np.zeros((2, 2)), dt=DT)
    ki = np.array([5.0, 3.0])
    k = youla.Model(np.eye(2), np.eye(2), np.diag(ki * DT), np.diag(2.0 + ki * DT), dt=DT)
    d = rng.standard_normal((4000, 2))
    u, y = youla.simulate_loop(tanks, k, feedback="negative", excitation=d, noise=0.02 * rng.standard_normal((4000, 2)))
    record = youla.Record(
        {"u1": u[:, 0], "u2": u[:, 1], "y1": y[:, 0], "y2": y[:, 1], "d1": d[:, 0], "d2": d[:, 1]},
        inputs=["u1", "u2"], outputs=["y1", "y2"], excitation=["d1", "d2"], dt=DT,
    )
    controller = {"pid": {"kp": 2.0, "ki": ki, "discretisation": "backward-euler"}}
    new = youla.redesign(youla.identify(record, controller=controller, feedback="negative"), structure="pid", pid={"terms": "pi"})
    assert new.promised["proof"]["holds"] and [round(c["ki"], 6) for c in new.promised["running"]] == [5.0, 3.0]
    assert min(new.promised["rejections"]) > 1.5 and {f["loop"] for f in new.promised["figures"]} == {1, 2}
    assert repr(new).count("kp ") == 2 and "proved on" in repr(new)
    assert youla.certify(tanks, new.controller, feedback="positive").stable
