"""The same tasks on several engines: bits, seconds, what a task costs beside its computation, and the death of workers and clients.

``python benches/engines.py [TASKS]`` prints a table for docs/performance.md. ``PYTHONPATH`` must hold this folder for the workers,
which the program sees to. Each task writes its index to a log, so that a task that is computed twice is counted.
"""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Iterator

import numpy as np

import youla
from youla import _study, _tasks

HERE = Path(__file__).resolve().parent
DT = 0.01


def payload(samples: int, log: str) -> dict[str, Any]:
    """What `youla.bootstrap` hands to its tasks, and where they write down their index."""
    rng = np.random.default_rng(1)
    plant = youla.Model([[0.95]], [[0.1]], [[1.0]], [[0.0]], dt=DT)
    d, e = rng.standard_normal((2, samples, 1))
    u, y = youla.simulate_loop(plant, 2.0, feedback="negative", excitation=d, noise=0.02 * e)
    record = youla.Record(np.hstack([u, y, d]), inputs=0, outputs=1, excitation=2, dt=DT)
    found: dict[str, Any] = {}

    def keep(task: Any, given: dict[str, Any], *_: Any, **__: Any) -> youla.Rows:
        found.update(given)
        return youla.Rows((), 0)

    run = youla.identify(record, nominal=plant, controller=2.0, feedback="negative", hansen={"order": 1, "horizon": 5})
    _study.run_tasks, kept = keep, _study.run_tasks
    try:
        youla.bootstrap(run, 1, seed=1)
    finally:
        _study.run_tasks = kept
    return {**found, "log": log}


def replicate(given: dict[str, Any], item: int, index: int) -> dict[str, Any]:
    """A replicate of the bootstrap that leaves a trace; the seconds are kept beside the row, for they are no part of its bits."""
    start = time.perf_counter()
    row = _study._replicate(given, item, index)
    line = f"{index} {time.perf_counter() - start:.6f} {os.getpid()}\n"
    handle = os.open(given["log"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    os.write(handle, line.encode())
    os.close(handle)
    return row


def run(given: dict[str, Any], tasks: int, executor: Executor | None, folder: str | None = None, progress: Any = None) -> youla.Rows:
    return _tasks.run_tasks(replicate, given, range(tasks), key="bench", executor=executor, folder=folder, progress=progress)


def lines(log: str) -> list[list[str]]:
    return [line.split() for line in Path(log).read_text().splitlines()] if Path(log).is_file() else []


def bits(rows: youla.Rows) -> str:
    return hashlib.sha256(json.dumps(rows.rows).encode()).hexdigest()[:12]


@contextmanager
def dask(workers: int) -> Iterator[Any]:
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        yield client


def measured(name: str, given: dict[str, Any], tasks: int, executor: Executor | None, workers: int) -> None:
    if executor is not None:  # workers import the package before the clock runs
        list(executor.map(abs, range(8 * workers)))
        _tasks.run_tasks(replicate, {**given, "log": os.devnull}, range(8 * workers), key="w", executor=executor, folder=None, progress=None)
    Path(given["log"]).unlink(missing_ok=True)
    start = time.perf_counter()
    rows = run(given, tasks, executor)
    wall = time.perf_counter() - start
    inside = sum(float(line[1]) for line in lines(given["log"]))
    beside = 1e3 * (wall - inside / workers) / tasks
    print(f"| {name} | {workers} | {bits(rows)} | {wall:.2f} | {1e3 * inside / tasks:.2f} | {beside:.2f} |", flush=True)


def mpi(samples: int, tasks: int, workers: int, where: Path) -> None:
    script = where / "mpi.py"
    script.write_text(
        f"import engines\nfrom mpi4py.futures import MPIPoolExecutor\nif __name__ == '__main__':\n"
        f"    given = engines.payload({samples}, {str(where / 'mpi.log')!r})\n"
        f"    with MPIPoolExecutor() as executor:\n        engines.measured('MPI', given, {tasks}, executor, {workers})\n"
    )
    mpiexec = Path(sys.executable).parent / "mpiexec"
    subprocess.run([str(mpiexec), "-n", str(workers + 1), sys.executable, "-m", "mpi4py.futures", str(script)], check=True)


def table(samples: int, tasks: int, where: Path) -> None:
    print(f"\n{tasks} replicates of {samples} samples\n")
    print("| engine | workers | bits | wall, s | computation of a task, ms | beside it, ms per task |\n|---|---|---|---|---|---|")
    given = payload(samples, str(where / "log"))
    measured("this process", given, tasks, None, 1)
    with ThreadPoolExecutor(2) as executor:
        measured("threads", given, tasks, executor, 2)
    for workers in (1, 2):
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as executor:
            measured("processes", given, tasks, executor, workers)
    for workers in (1, 2):
        with dask(workers) as client:
            measured("Dask", given, tasks, client.get_executor(), workers)
    for workers in (1, 2):
        mpi(samples, tasks, workers, where)


def worker_dies(samples: int, tasks: int, where: Path) -> None:
    """SIGKILL of one of two Dask workers after a fifth of the tasks."""
    given = payload(samples, str(where / "worker.log"))
    with dask(2) as client:
        victim, killed = next(iter(client.run(os.getpid).values())), []

        def kill(done: int) -> None:
            if not killed and done >= tasks // 5:
                os.kill(victim, signal.SIGKILL)
                killed.append(done)

        rows = run(given, tasks, client.get_executor(), str(where / "worker"), kill)
    report(f"worker killed after {killed[0]}", given["log"], rows, tasks)


def client_dies(samples: int, tasks: int, where: Path) -> None:
    """SIGKILL of the process that holds the client and the scheduler, and the same call again."""
    folder, log = str(where / "client"), str(where / "client.log")
    script = where / "client.py"
    script.write_text(
        f"import engines\nif __name__ == '__main__':\n    given = engines.payload({samples}, {log!r})\n"
        f"    with engines.dask(2) as client:\n"
        f"        engines.run(given, {tasks}, client.get_executor(), {folder!r})\n"
    )
    with subprocess.Popen([sys.executable, str(script)]) as child:
        while len(list(Path(folder).glob("[0-9]*.json"))) < tasks // 5 and child.poll() is None:
            time.sleep(0.01)
        child.kill()
    time.sleep(3)  # workers end when their scheduler does not answer
    finished = {int(p.stem) for p in Path(folder).glob("[0-9]*.json")}
    given = payload(samples, log)
    with dask(2) as client:
        rows = run(given, tasks, client.get_executor(), folder)
    again = [k for k, n in Counter(int(line[0]) for line in lines(log)).items() if n > 1 and k in finished]
    report(f"client killed; {len(finished)} finished before, {rows.computed} computed after, finished ones computed again: {len(again)}", log, rows, tasks)


def report(what: str, log: str, rows: youla.Rows, tasks: int) -> None:
    counted = Counter(int(line[0]) for line in lines(log))
    twice = sum(n > 1 for n in counted.values())
    print(f"{what}: {len(rows)} of {tasks} rows, {len(rows.failed)} failed, {twice} computed twice, bits {bits(rows)}", flush=True)


def main(tasks: int) -> None:
    os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])
    chosen: list[Callable[[int, int, Path], None]] = [worker_dies, client_dies]
    for samples, of in ((1000, tasks), (20_000, tasks // 10)):
        with tempfile.TemporaryDirectory() as folder:
            table(samples, of, Path(folder))
    for each in chosen:
        with tempfile.TemporaryDirectory() as folder:
            each(1000, tasks, Path(folder))


if __name__ == "__main__":
    sys.path.insert(0, str(HERE))
    # Tasks are pickled by the name of their module, which must not be __main__.
    import engines

    engines.main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
