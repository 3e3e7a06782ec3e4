"""What the package adds to the library: time of calls, and memory beside a record. ``python benches/overhead.py``"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import youla
from youla import _native
from youla._identify import plain, prepare

DT = 0.01


def median(call: Callable[[], object], times: int = 7) -> float:
    """Milliseconds."""
    found = []
    for _ in range(times):
        start = time.perf_counter()
        call()
        found.append(time.perf_counter() - start)
    return 1e3 * float(np.median(found))


def resident(key: str) -> float:
    """Resident memory, MB: now (`VmRSS`) or at most since the last reset (`VmHWM`)."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(key)) / 1024


def added(call: Callable[[], object]) -> float:
    """Largest resident memory during a call beside that before it, MB."""
    before = resident("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")
    call()
    return resident("VmHWM") - before


def n4sid() -> None:
    table = np.random.default_rng(1).standard_normal((1_000_000, 4))
    kept = table.copy()
    log = youla.Record(table, inputs=[0, 1], outputs=[2, 3], dt=DT)
    made = added(lambda: youla.Record(table, inputs=[0, 1], outputs=[2, 3], dt=DT))
    print(f"record of 1e6 x 4 ({table.nbytes / 2**20:.1f} MB): {made:.1f} MB beside the array, same memory: {np.shares_memory(table, log._log()[3])}")
    options = {"method": "n4sid", "order": 4, "horizon": 20}
    print(f"memory of the first N4SID: {added(lambda: youla.subspace(log, **options)):.1f} MB beside the record")
    settings, logs = prepare(log, None, 0, 0, "positive", None, None, {})
    chosen = plain(options)
    # In turn, so that other work on the machine meets both alike.
    pairs = [(median(lambda: youla.subspace(log, **options), 1), median(lambda: _native.subspace(settings, logs, chosen), 1)) for _ in range(15)]
    whole, native = (float(np.median(x)) for x in zip(*pairs, strict=True))
    print(f"N4SID, horizon 20: {whole:.1f} ms by youla.subspace, {native:.1f} ms by the extension module; best {np.min(pairs, axis=0)}; ratio of medians {whole / native:.3f}")
    small = [median(lambda: youla.subspace(log, method="n4sid", order=1, horizon=2, past=2), 1) for _ in range(9)]
    print(f"N4SID, horizon 2: {np.median(small):.1f} ms, which is a bound of reading, checking and copying")
    assert np.array_equal(table, kept)


def identify() -> None:
    rng = np.random.default_rng(1)
    plant = youla.Model([[0.95]], [[0.1]], [[1.0]], [[0.0]], dt=DT)
    d, e = rng.standard_normal((2, 12_000, 1))
    u, y = youla.simulate_loop(plant, 2.0, feedback="negative", excitation=d, noise=0.02 * e)
    table = np.hstack([u, y, d])
    beside = []
    for _ in range(15):
        start = time.perf_counter()
        log = youla.Record(table, inputs=0, outputs=1, excitation=2, dt=DT)
        run = youla.identify(log, nominal=plant, controller=2.0, feedback="negative", hansen={"order": 1, "horizon": 5})
        beside.append(1e3 * (time.perf_counter() - start - sum(run.summary["seconds"].values())))
    print(f"identify of 12 000 samples: {np.median(beside):.1f} ms beside its stages (least of 15: {min(beside):.1f}, largest {max(beside):.1f} ms)")


if __name__ == "__main__":
    n4sid()
    identify()
