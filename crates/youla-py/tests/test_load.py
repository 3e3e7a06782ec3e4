"""A run comes back from its folder, a pickle, a copy and another process with the same bits."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

import youla

#: Frequencies beside those of the report, below and above all of them.
OMEGA = 2 * np.pi * np.geomspace(0.01, 480.0, 23)


def same(one: youla.Run, other: youla.Run) -> None:
    """Every result of both runs, bit by bit."""
    assert one == other
    assert one.models == other.models
    for key in one.models:
        a, b = one.model(key), other.model(key)
        assert all(np.array_equal(getattr(a, x), getattr(b, x)) for x in "abcd"), key
        assert (a.inputs, a.outputs, a.dt) == (b.inputs, b.outputs, b.dt)
        for omega in (None, OMEGA[OMEGA < np.pi / a.dt]):
            left, right = (run.frequency_response(omega, model=key) for run in (one, other))
            for part in ("omega", "values", "low", "high", "covariance"):
                a, b = getattr(left, part), getattr(right, part)
                if key != "grey_box":
                    assert np.array_equal(a, b), (key, part)
                elif omega is None:  # its region is kept at the frequencies of the report
                    assert np.allclose(a, b, rtol=1e-9, atol=1e-15), (key, part)
    assert (one.verdict, one.modes(), one.fits) == (other.verdict, other.modes(), other.fits)
    for left, right in zip(one.predictions, other.predictions, strict=True):
        assert np.array_equal(left.measured, right.measured)
        assert left.predicted.keys() == right.predicted.keys()
        assert all(np.array_equal(left.predicted[key], right.predicted[key]) for key in left.predicted)
    if one.measured_response is not None:
        assert np.array_equal(one.measured_response.values, other.measured_response.values)


@pytest.fixture(scope="module", params=["levitation", "bearing"])
def demo(request: pytest.FixtureRequest) -> youla.Run:
    return youla.demo(request.param)


def test_a_saved_run_loads(demo: youla.Run, tmp_path: Path) -> None:
    loaded = youla.load(demo.save(tmp_path / "run"))
    same(demo, loaded)
    same(demo, youla.load(loaded.save(tmp_path / "again")))
    loaded.report(tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text() == (tmp_path / "run/report.html").read_text()
    assert np.array_equal(youla.redesign(demo).controller.a, youla.redesign(loaded).controller.a)


def test_a_run_of_the_program_loads(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "youla", "demo", "--out", str(tmp_path / "run")]
    subprocess.run(command, check=True, capture_output=True)
    same(youla.demo(), youla.load(tmp_path / "run"))


def test_a_physical_structure_loads(run: youla.Run, record: youla.Record, nominal: youla.Model, tmp_path: Path) -> None:
    structure = {"parameters": {"pole": {"initial": 4.0, "min": 0.1, "max": 50.0}, "gain": {"initial": 8.0}}}
    structure |= {"a": [["-pole"]], "b": [["gain"]], "c": [[1.0]]}
    hansen = {"order": 1, "horizon": 5}
    found = youla.greybox(record, structure=structure, nominal=nominal, controller=2.0, feedback="negative", hansen=hansen)
    assert found.frequency_response(model="grey_box").covariance is not None
    same(found, youla.load(found.save(tmp_path / "run")))


def test_every_result_pickles_and_copies(run: youla.Run, record: youla.Record) -> None:
    for again in (pickle.loads(pickle.dumps(run)), copy.deepcopy(run), copy.copy(run)):
        same(run, again)
    model = pickle.loads(pickle.dumps(run.recommended))
    assert np.array_equal(model.a, run.recommended.a)
    assert not model.a.flags.writeable
    assert pickle.loads(pickle.dumps(record)).y.tobytes() == record.y.tobytes()
    short = {"amplitude": 1.0, "band": [0.5, 10.0], "seconds": 10}
    results = [
        run.verdict,
        run.modes(),
        youla.check(record),
        youla.bootstrap(run, 2, seed=1),
        youla.study(run.recommended, 2.0, [short], feedback="negative", n=1, noise=0.05, seed=1),
    ]
    for result in results:
        assert pickle.loads(pickle.dumps(result)) == result
        assert copy.deepcopy(result) == result
    arrays = [
        (run.frequency_response(), lambda r: r.covariance),
        (youla.subspace(record, order=1), lambda r: r.model.a),
        (youla.certify(run.recommended, 2.0, feedback="negative"), lambda r: r.poles),
        (youla.excite(run.recommended, 2.0, feedback="negative", **short), lambda r: r.signal),
        (youla.reduce(run.recommended, order=0), lambda r: r.hankel),
    ]
    for result, of in arrays:
        for again in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
            assert np.array_equal(of(again), of(result))


def of_process(run: youla.Run) -> tuple[youla.Run, bytes]:
    return run, run.frequency_response(OMEGA[:15]).covariance.tobytes()


def test_a_process_has_the_same_bits(run: youla.Run) -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        back, covariance = pool.submit(of_process, run).result()
    same(run, back)
    assert covariance == run.frequency_response(OMEGA[:15]).covariance.tobytes()


def test_runs_differ(run: youla.Run) -> None:
    assert youla.demo(seed=1) != youla.demo(seed=2)
    assert run != 1


def test_every_run_can_be_repeated(demo: youla.Run, run: youla.Run, tmp_path: Path) -> None:
    """A demonstration, a loaded run, the run of a file and one from memory."""
    loaded = youla.load(demo.save(tmp_path / "run"))
    of_file = youla.identify(tmp_path / "run/run.toml")
    rows = [youla.bootstrap(one, 2, seed=1) for one in (demo, loaded, of_file)]
    assert not rows[0].failed
    assert rows[0].rows == rows[1].rows
    # The file's nominal model is in continuous time, and the mean, some 1e-17, is subtracted again: the search stops elsewhere.
    omega = np.geomspace(1.0, np.pi / demo.recommended.dt, 50)
    for one, other in zip(rows[0].models(), rows[2].models(), strict=True):
        assert np.allclose(one.frequency_response(omega).values, other.frequency_response(omega).values, rtol=1e-3)
    grid = {"hansen.horizon": [20]}
    scans = [youla.scan(one, grid) for one in (demo, loaded, run)]
    assert all(not rows.failed for rows in scans)
    assert scans[0].rows == scans[1].rows
    short = {"amplitude": 0.1, "band": [0.5, 50.0], "seconds": 2}
    studies = [youla.study(one, "own", [short], n=1, seed=1) for one in (demo, loaded)]
    assert studies[0] == studies[1]


def test_settings_that_were_changed_after_the_run_are_refused(tmp_path: Path, run: youla.Run) -> None:
    settings = Path(run.save(tmp_path / "run")) / "run.toml"
    ran = settings.read_text()
    assert "horizon = 10" in ran
    for changed in (ran.replace("horizon = 10", "horizon = 11"), ran + "[data"):
        settings.write_text(changed)
        with pytest.raises(youla.InputError, match="run.toml was changed after the run, whose results are of other settings; identify anew"):
            youla.load(tmp_path / "run")
    settings.write_text("# mine\n" + ran.replace("\n", "\r\n"))
    assert youla.load(tmp_path / "run").recommended.order == run.recommended.order


def test_what_is_no_run_folder(tmp_path: Path, run: youla.Run) -> None:
    with pytest.raises(youla.InputError, match="is not there, but must be a run folder"):
        youla.load(tmp_path / "absent")
    with pytest.raises(youla.InputError, match="is no run folder"):
        youla.load(tmp_path)
    place = Path(run.save(tmp_path / "run"))
    for name, content in (("4-identify/region.json", '{"ts": 1}'), ("summary.json", "{"), ("4-identify/region.json", None)):
        whole = (place / name).read_bytes()
        (place / name).unlink() if content is None else (place / name).write_text(content)
        with pytest.raises(youla.InputError, match=name):
            youla.load(place).frequency_response()
        (place / name).write_bytes(whole)
