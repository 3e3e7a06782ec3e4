"""The same rows with the same bits on every executor; finished tasks are not computed again."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from conftest import loop

import youla
from youla import _tasks

N = 12
ARGUMENTS = {"nominal": youla.Model([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=0.01), "controller": 2.0, "feedback": "negative"}
OPTIONS = {**ARGUMENTS, "hansen": {"order": 1, "horizon": 5}}


@pytest.fixture(scope="module")
def small() -> youla.Record:
    return youla.Record(loop(102, 1000), inputs=0, outputs=1, excitation=2, dt=0.01, name="small")


@pytest.fixture(scope="module")
def of_small(small: youla.Record) -> youla.Run:
    return youla.identify(small, **OPTIONS)


@pytest.fixture(scope="module")
def serial(of_small: youla.Run, small: youla.Record) -> youla.Bootstrap:
    return youla.bootstrap(of_small, N, seed=1)


def processes() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(2, mp_context=get_context("spawn"))


def bits(rows: youla.Rows) -> str:
    return json.dumps(rows.rows)


def test_threads_and_processes_give_the_bits_of_one(
    serial: youla.Bootstrap, of_small: youla.Run
) -> None:
    for executor in (ThreadPoolExecutor(2), processes()):
        with executor:
            found = youla.bootstrap(of_small, N, seed=1, executor=executor)
            assert bits(found) == bits(serial)
            assert executor.submit(int, "3").result() == 3  # what was handed in is not closed
    other = youla.bootstrap(of_small, 2, seed=2)
    assert other.rows != serial.rows[:2]


def test_dask_gives_the_same_bits_and_survives_the_death_of_a_worker(
    serial: youla.Bootstrap, of_small: youla.Run, tmp_path: Path
) -> None:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        executor: Executor = client.get_executor()
        victim = next(iter(client.run(os.getpid).values()))
        killed = []

        def kill_once(done: int) -> None:
            if not killed:
                os.kill(victim, signal.SIGKILL)
                killed.append(done)

        found = youla.bootstrap(
            of_small, N, seed=1, executor=executor, folder=tmp_path / "rows", progress=kill_once
        )
    assert killed
    assert bits(found) == bits(serial)
    assert len(list((tmp_path / "rows").glob("0*.json"))) == N


def test_mpi_gives_the_same_bits(serial: youla.Bootstrap, tmp_path: Path) -> None:
    pytest.importorskip("mpi4py")
    mpiexec = Path(sys.executable).parent / "mpiexec"
    if not mpiexec.is_file():
        pytest.skip("mpiexec is absent (pip install mpich)")
    script = tmp_path / "mpi.py"
    script.write_text(
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "import json, youla\n"
        "from conftest import loop\n"
        "from mpi4py.futures import MPIPoolExecutor\n"
        "if __name__ == '__main__':\n"
        "    small = youla.Record(loop(102, 1000), inputs=0, outputs=1, excitation=2, dt=0.01, name='small')\n"
        "    g = youla.Model([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)\n"
        "    options = dict(nominal=g, controller=2.0, feedback='negative', hansen={'order': 1, 'horizon': 5})\n"
        "    run = youla.identify(small, **options)\n"
        "    with MPIPoolExecutor() as executor:\n"
        f"        rows = youla.bootstrap(run, {N}, seed=1, executor=executor)\n"
        f"    open({str(tmp_path / 'rows.json')!r}, 'w').write(json.dumps(rows.rows))\n"
    )
    command = [str(mpiexec), "-n", "3", sys.executable, "-m", "mpi4py.futures", str(script)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "rows.json").read_text() == bits(serial)


def test_finished_replicates_are_kept(
    serial: youla.Bootstrap, of_small: youla.Run, tmp_path: Path
) -> None:
    folder = tmp_path / "rows"
    first = youla.bootstrap(of_small, 5, seed=1, folder=folder)
    assert first.computed == 5
    (folder / "000002.json").unlink()
    again = youla.bootstrap(of_small, N, seed=1, folder=folder)
    assert again.computed == N - 4
    assert bits(again) == bits(serial)
    with pytest.raises(youla.InputError, match="holds tasks of other settings"):
        youla.bootstrap(of_small, N, seed=2, folder=folder)


def test_a_task_whose_row_is_kept_is_not_computed_again_by_its_worker(tmp_path: Path) -> None:
    """An engine that hands out a finished task once more, as Dask does with those of a worker that died."""
    computed = []

    def task(payload: None, item: int, index: int) -> dict[str, object]:
        computed.append(index)
        return {"square": item**2, "modes": []}

    again = [_tasks.call(task, None, 3, 7, str(tmp_path)) for _ in range(2)]
    assert again == [{"index": 7, "square": 9, "modes": []}] * 2
    assert computed == [7]


class Garbage(Executor):
    """Answers each task with the same row."""

    def __init__(self, row: object) -> None:
        self.row = row

    def submit(self, *_: object, **__: object) -> Future:
        future: Future = Future()
        future.set_result(self.row)
        return future


@pytest.mark.parametrize("row", [None, 5, "row", {}, {"index": 1, "modes": []}, {"index": 0, "other": 1}, {"index": 0, "modes": [], "x": object()}])
def test_a_row_that_is_none_names_executor_and_row(row: object, of_small: youla.Run, tmp_path: Path) -> None:
    with pytest.raises(youla.InputError, match="Garbage gave as row 0 .*must be a row of the task"):
        youla.bootstrap(of_small, 1, seed=1, executor=Garbage(row))


def test_a_row_in_the_folder_that_is_none_names_its_file(of_small: youla.Run, tmp_path: Path) -> None:
    youla.bootstrap(of_small, 1, seed=1, folder=tmp_path)
    file = tmp_path / "000000.json"
    kept = json.loads(file.read_text())
    for content in (5, {}, {**kept, "row": {"index": 1}}, {**kept, "row": None}):
        file.write_text(json.dumps(content))
        with pytest.raises(youla.InputError, match="000000.json"):
            youla.bootstrap(of_small, 1, seed=1, folder=tmp_path)


def test_a_killed_client_loses_nothing_that_was_finished(
    serial: youla.Bootstrap, of_small: youla.Run, small: youla.Record, tmp_path: Path
) -> None:
    """SIGKILL of the process in the middle; the next call computes only what is missing."""
    folder, script = tmp_path / "rows", tmp_path / "long.py"
    script.write_text(
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "import test_executors as t, youla, time\n"
        "small = youla.Record(t.loop(102, 1000), inputs=0, outputs=1, excitation=2, dt=0.01, name='small')\n"
        "run = youla.identify(small, **t.OPTIONS)\n"
        f"youla.bootstrap(run, t.N, seed=1, folder={str(folder)!r}, progress=lambda k: time.sleep(0.2))\n"
    )
    with subprocess.Popen([sys.executable, str(script)]) as child:
        deadline = time.monotonic() + 60
        while len(list(folder.glob("0*.json"))) < 3 and time.monotonic() < deadline:
            time.sleep(0.02)
        child.kill()
    finished = len(list(folder.glob("0*.json")))
    assert 3 <= finished < N
    again = youla.bootstrap(of_small, N, seed=1, folder=folder)
    assert again.computed == N - finished
    assert bits(again) == bits(serial)


def test_replicates_scatter_as_the_interval_says(of_small: youla.Run) -> None:
    """60 replicates: their spread of the frequency is that of the interval within a factor of 1.5."""
    pytest.importorskip("pandas")
    with ThreadPoolExecutor(2) as executor:
        found = youla.bootstrap(of_small, 60, seed=3, executor=executor)
    assert not found.failed
    (pole,) = of_small.real_poles()
    assert pole.hz_interval is not None
    deviation = (pole.hz_interval[1] - pole.hz_interval[0]) / 3.92
    hz = -np.log(found.real_poles()[:, 0]) / (2 * np.pi * 0.01)
    assert 1 / 1.5 < hz.std() / deviation < 1.5
    low, high = np.quantile(hz, [0.025, 0.975])
    assert low < pole.hz < high
    assert found.modes().shape == (60, 0, 2)  # a real pole has no damping ratio
    frame = found.to_frame()
    assert list(frame["index"]) == list(range(60))
    assert "pole_1" in frame
    assert len(found.models()) == 60


def test_scan_is_in_order(small: youla.Record) -> None:
    grid = {"hansen.horizon": [5, 8], "recommended.order": np.array([1, 2])}
    alone = youla.scan(small, grid, **OPTIONS)
    with ThreadPoolExecutor(2) as executor:
        assert bits(youla.scan(small, grid, executor=executor, **OPTIONS)) == bits(alone)
    assert [(r["hansen.horizon"], r["recommended.order"]) for r in alone] == [(5, 1), (5, 2), (8, 1), (8, 2)]
    assert [r["order"] for r in alone] == [1, 2, 1, 2]
    with pytest.raises(youla.InputError, match="did you mean `horizon`"):
        youla.scan(small, {"hansen.horizn": [1]}, **OPTIONS)


def test_a_fleet_with_broken_files(tmp_path: Path) -> None:
    """20 files, 4 of them broken in different ways: 16 results and 4 rows with their reason."""
    for k in range(20):
        table = loop(200 + k, 400)
        if k == 3:
            table[7, 1] = np.nan
        np.savetxt(tmp_path / f"{k:02}.csv", table, delimiter=",", header="u,y,d", comments="")
    (tmp_path / "05.csv").write_text("")
    (tmp_path / "11.csv").write_text("u,y\n1,2\n")
    (tmp_path / "17.csv").unlink()
    read = {"inputs": "u", "outputs": "y", "excitation": "d", "dt": 0.01}
    files = [tmp_path / f"{k:02}.csv" for k in range(20)]
    with ThreadPoolExecutor(2) as executor:
        found = youla.identify_many(iter(files), read=read, executor=executor, **OPTIONS)
    assert [row["index"] for row in found.failed] == [3, 5, 11, 17]
    assert len(found.succeeded) == 16
    assert all(row["error"] for row in found.failed)
    assert found.rows[4]["record"] == str(files[4])
    kept = youla.identify_many(files[:2], read=read, folder=tmp_path / "rows", **OPTIONS)
    assert bits(kept) == json.dumps(found.rows[:2])
    with pytest.raises(youla.InputError, match=r"not of .*01\.csv; give another folder"):
        youla.identify_many(files[1:3], read=read, folder=tmp_path / "rows", **OPTIONS)


def test_a_folder_knows_the_nominal_model_by_its_matrices(small: youla.Record, tmp_path: Path) -> None:
    """Another pole of the same order, or a controller of python-control that differs in its last digit, is another folder."""
    control = pytest.importorskip("control")
    known = {**OPTIONS, "controller": control.ss([], [], [], 2.0, 0.01)}
    first = youla.identify_many([small], folder=tmp_path / "rows", **known)
    assert youla.identify_many([small], folder=tmp_path / "rows", **known).computed == 0
    assert first.computed == 1
    other_pole = youla.Model([[0.91]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    other_gain = control.ss([], [], [], 2.0 + 1e-12, 0.01)
    for change in ({"nominal": other_pole}, {"controller": other_gain}):
        with pytest.raises(youla.InputError, match="holds tasks of other settings"):
            youla.identify_many([small], folder=tmp_path / "rows", **{**known, **change})


def _order(record: youla.Record) -> int:
    return youla.identify(record, **OPTIONS).recommended.order


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="processes are forked on Linux only")
def test_a_forked_process_computes(small: youla.Record, of_small: youla.Run) -> None:
    """The parent has computed on its threads (the fixture), which do not follow a fork."""
    with get_context("fork").Pool(1) as pool:
        assert pool.apply_async(_order, (small,)).get(timeout=60) == of_small.recommended.order
