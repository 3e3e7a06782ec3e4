"""A ROSS rotor on magnetic bearings in simulated closed loop: peaks of the sensitivity, their intervals, and the plant beside ARX.

``python benches/rotor.py RUNS FOLDER``; finished runs are kept in FOLDER.
"""

from __future__ import annotations

import json
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

import youla
from youla.rotor import LIMITS, MagneticLoop, magnetic_loop, sensitivity_zones

DT = 2e-4
SAMPLES = 8000
#: Orders of ARX that are tried; the best one counts.
ARX_ORDERS = (4, 6, 10, 16, 24)


def rig(proportional: float = 3000.0, derivative: float = 15.0) -> Any:
    """The test rig of ROSS with structural damping, and a PD controller on each axis."""
    import control
    from ross.rotor_assembly import rotor_amb_example

    s = control.TransferFunction.s
    rotor = rotor_amb_example(proportional + derivative * s / (1 + s / 6000))
    for element in rotor.shaft_elements:
        element.beta = 2e-5
    return rotor


def record(loop: MagneticLoop, seed: int, share: float = 0.02) -> youla.Record:
    """A log of the loop, with white noise of a share of the standard deviation of the outputs."""
    made = youla.excite(loop.plant, loop.controller, feedback="negative", amplitude=0.02, band=[1, 1000], samples=SAMPLES)
    d = made.signal
    _, clean = youla.simulate_loop(loop.plant, loop.controller, feedback="negative", excitation=d)
    draws = np.random.default_rng(seed).standard_normal(clean.shape)
    u, y = youla.simulate_loop(loop.plant, loop.controller, feedback="negative", excitation=d, noise=share * clean.std(axis=0) * draws)
    m = d.shape[1]
    channels = np.arange(3 * m).reshape(3, m).tolist()
    return youla.Record(np.hstack([u, y, d]), inputs=channels[0], outputs=channels[1], excitation=channels[2], dt=DT, name=str(seed))


def arx(u: np.ndarray, y: np.ndarray, order: int, omega: np.ndarray) -> np.ndarray:
    """Response of the least-squares ARX model of an order."""
    past = [np.hstack([y[order - k : -k], u[order - k : -k]]) for k in range(1, order + 1)]
    found = np.linalg.lstsq(np.hstack(past), y[order:], rcond=None)[0].T
    p, m = y.shape[1], u.shape[1]
    blocks = found.reshape(p, order, p + m)
    delays = np.exp(-1j * DT * omega[:, None] * np.arange(1, order + 1))
    a = np.eye(p) - np.einsum("wk,ikj->wij", delays, blocks[:, :, :p])
    return np.linalg.solve(a, np.einsum("wk,ikj->wij", delays, blocks[:, :, p:]))


def errors(found: np.ndarray, true: np.ndarray) -> list[float]:
    """Error over the band relative to the plant over the band, and root mean square of the relative errors at the frequencies."""
    wrong, whole = (np.sum(np.abs(x) ** 2, axis=(1, 2)) for x in (found - true, true))
    return [float(np.sqrt(wrong.sum() / whole.sum())), float(np.sqrt(np.mean(wrong / whole)))]


def peaks(loop: MagneticLoop) -> list[float]:
    w = np.geomspace(1, np.pi / DT, 200_000)
    open_loop = loop.plant.frequency_response(w).values @ loop.controller.frequency_response(w).values
    return np.abs(np.diagonal(np.linalg.inv(np.eye(open_loop.shape[1]) + open_loop), axis1=1, axis2=2)).max(axis=0).tolist()


def one(seed: int, folder: str) -> dict[str, Any]:
    place = Path(folder) / f"{seed:04d}.json"
    if place.is_file():
        return json.loads(place.read_text())
    rotor = rig()
    loop, nominal = magnetic_loop(rotor, dt=DT, plane=True), magnetic_loop(rotor, dt=DT, plane=True, order=8)
    log = record(loop, seed)
    run = youla.identify(log, nominal=nominal.plant, controller=loop.controller, feedback="negative")
    zones = sensitivity_zones(run)
    omega = 2 * np.pi * np.geomspace(1, 1000, 200)
    true = loop.plant.frequency_response(omega).values
    table = np.array(log.to_frame())
    found = {
        "seed": seed,
        "true": peaks(loop),
        "peaks": [zone.peak for zone in zones],
        "low": [zone.interval[0] for zone in zones],
        "high": [zone.interval[1] for zone in zones],
        "zones": [zone.zone for zone in zones],
        "trusted": run.verdict.trusted,
        "errors": errors(run.recommended.frequency_response(omega).values, true),
        # The best order for each of the two errors, which only the simulation knows.
        "arx": np.min([errors(arx(table[:, :2], table[:, 2:4], n, omega), true) for n in ARX_ORDERS], axis=0).tolist(),
    }
    place.write_text(json.dumps(found))
    return found


def main(runs: int, folder: str) -> None:
    Path(folder).mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        rows = list(executor.map(one, range(runs), [folder] * runs))
    true, peaks, low, high = (np.array([r[key] for r in rows]) for key in ("true", "peaks", "low", "high"))
    held = (low <= true) & (true <= high)
    right = [["ABCD"[int(np.searchsorted(tuple(LIMITS.values()), x))] for x in t] for t in true]
    pairs = [pair for r, names in zip(rows, right) for pair in zip(r["zones"], names)]
    print("runs", runs, "trusted", sum(r["trusted"] for r in rows))
    print("interval holds, by axis", held.mean(axis=0), "both together", held.mean())
    print("largest relative error of a peak", float(np.max(np.abs(peaks / true - 1))))
    print("zones", len(pairs), "right", sum(z == t for z, t in pairs), "undecided", sum(z == "undecided" for z, _ in pairs))
    plant, other = (np.array([r[key] for r in rows]) for key in ("errors", "arx"))
    print("median plant errors", np.median(plant, axis=0), "ARX", np.median(other, axis=0))
    print("median and largest ratio to ARX", np.median(plant / other, axis=0), np.max(plant / other, axis=0))


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
