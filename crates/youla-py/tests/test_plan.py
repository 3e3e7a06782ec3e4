"""Experiment planning on a simulated loop: equal rows everywhere, deviations that fall with the length, refusals by name."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import loop

import youla

RADIUS, ANGLE = 0.98, 0.2
PLANT = youla.Model(
    RADIUS * np.array([[np.cos(ANGLE), np.sin(ANGLE)], [-np.sin(ANGLE), np.cos(ANGLE)]]), [[0.0], [0.2]], [[1.0, 0.0]], [[0.0]], dt=0.01
)
SHORT: dict[str, Any] = {"amplitude": 1.0, "band": [0.5, 10.0], "seconds": 10}
CONDITIONS = [SHORT, {**SHORT, "seconds": 40}]


@pytest.fixture(scope="module")
def found() -> youla.Study:
    return youla.study(PLANT, 0.1, CONDITIONS, feedback="negative", n=16, noise=0.05, seed=1)


def test_four_times_the_record_gives_half_of_the_deviation(found: youla.Study) -> None:
    short, long = found.table()
    assert (short["runs"], short["failed"], short["found_1"], short["trusted"]) == (16, 0, 1.0, 1.0)
    assert 1.6 < short["zeta_stated_1"] / long["zeta_stated_1"] < 2.5
    assert long["response_error"] < short["response_error"] < 0.02
    for row in (short, long):
        # The scatter of sixteen runs is known to 18 %; a factor of 2 is beyond four deviations.
        assert 0.5 < row["zeta_stated_1"] / row["zeta_deviation_1"] < 2
        assert row["zeta_coverage_1"] >= 0.75  # 95 % of 16 runs, at least 12 with a probability of 99.9 %
        assert abs(row["peak_bias"]) < 3 * row["peak_deviation"]


def test_the_cheapest_condition_is_the_shortest_that_suffices(found: youla.Study) -> None:
    short, long = found.table()
    zeta = found.modes[0][1]
    between = np.sqrt(short["zeta_deviation_1"] * long["zeta_deviation_1"]) / zeta
    assert found.cheapest(between) == long
    assert found.cheapest(1.0) == short
    assert found.cheapest(1e-9) is None


@pytest.mark.parametrize("part", [5, -0.05, 0, float("nan"), True, "5 %"])
def test_a_percentage_is_no_part(found: youla.Study, part: Any) -> None:
    for call in (lambda: found.cheapest(part), lambda: found.plot(wanted=part)):
        with pytest.raises(youla.InputError, match="is the wanted standard deviation as a part of the damping ratio, above 0 and at most 1; 5 % is 0.05"):
            call()


def test_rows_are_equal_on_every_executor_and_are_kept(found: youla.Study, tmp_path: Path) -> None:
    few = {"n": 2, "noise": 0.05, "seed": 1}
    serial = youla.study(PLANT, 0.1, [SHORT], feedback="negative", **few, folder=tmp_path)
    assert serial.rows == tuple({**row, "index": k} for k, row in enumerate(found.rows[:2]))
    with ThreadPoolExecutor(2) as threads, ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
        for executor in (threads, processes):
            assert youla.study(PLANT, 0.1, [SHORT], feedback="negative", **few, executor=executor).rows == serial.rows
    assert youla.study(PLANT, 0.1, [SHORT], feedback="negative", **few, folder=tmp_path).computed == 0


def test_a_run_is_its_own_twin() -> None:
    log = youla.Record(loop(102, 1000), inputs=0, outputs=1, excitation=2, dt=0.01)
    known = {"nominal": youla.Model([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=0.01), "controller": 2.0, "feedback": "negative"}
    run = youla.identify(log, **known)
    found = youla.study(run, 2.0, [{"amplitude": 1.0, "band": [0.5, 20], "samples": 1000}], feedback="negative", n=4, seed=1)
    row = found.table()[0]
    assert (found.modes, row["failed"]) == ((), 0)
    assert row["response_error"] < 0.2
    with pytest.raises(youla.InputError, match=r"no oscillating mode.*\.table\(\)"):
        found.cheapest(0.1)
    with pytest.raises(youla.InputError, match=r"noise is given for a run.*run\.recommended"):
        youla.study(run, 2.0, [SHORT], feedback="negative", seed=1, noise=0.1)


def test_frame_and_figure(found: youla.Study) -> None:
    frame = found.to_frame()
    assert list(frame["seconds"]) == [10, 40]
    axes = found.plot(wanted=0.01)
    assert [line.get_label() for line in axes.lines] == ["multisine, amplitude 1", "wanted"]
    assert axes.get_title() == "mode at 3.2 Hz"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"conditions": 3}, "conditions is 3"),
        ({"conditions": []}, "conditions is empty; give at least one"),
        ({"conditions": [{"band": [1, 10], "seconds": 5}]}, r"conditions\[0\] lacks 'amplitude'"),
        ({"conditions": [{**SHORT, "dt": 0.1}]}, r"conditions\[0\].*dt"),
        ({"conditions": [{**SHORT, "band": [1, 1000]}]}, "band|Nyquist"),
        ({"noise": None}, "noise is not given"),
        ({"noise": [0.1, 0.2]}, "noise must be one standard deviation, or 1"),
        ({"noise": -1.0}, "not below zero"),
        ({"controller": -30.0}, "does not stabilise.*feedback="),
        ({"n": 0}, "n "),
        ({"seed": -1}, "seed"),
    ],
)
def test_bad_input_is_named(change: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"conditions": [SHORT], "noise": 0.05, "controller": 0.1, "feedback": "negative", "n": 1, "seed": 1, **change}
    with pytest.raises(youla.InputError, match=message):
        youla.study(PLANT, given.pop("controller"), given.pop("conditions"), **given)
