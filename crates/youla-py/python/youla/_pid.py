"""A PID as it is programmed, as a model: parallel and ideal form, one or several loops, with the dead time of its machine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ._arrays import Array
from ._model import Model

#: A, b, c, d of one input and one output.
_Part = tuple[Array, Array, Array, float]

#: Gains of the forms.
_GAINS = {"pid": ("kp", "ki", "kd", "derivative_filter"), "ideal_pid": ("kp", "ti", "td", "derivative_filter")}


def pid_model(form: str, table: Mapping[str, Any], dt: float) -> Model:
    """Return a PID as it is written, of settings that the core has checked."""
    given = {key: np.ravel(table.get(key, np.inf if key == "ti" else 0.0)).astype(np.float64) for key in _GAINS[form]}
    loops = max(map(len, given.values()))
    gains = {key: np.broadcast_to(values, loops) for key, values in given.items()}
    if form == "ideal_pid":
        gains |= {"ki": gains["kp"] / gains["ti"], "kd": gains["kp"] * gains["td"]}
    tustin, delay = table["discretisation"] == "tustin", int(table.get("delay", 0))
    parts = [_delayed(_loop([float(gains[key][k]) for key in _GAINS["pid"]], tustin, dt), delay) for k in range(loops)]
    a, b, c = (_diagonal(list(of)) for of in zip(*(part[:3] for part in parts), strict=True))
    return Model(a, b, c, np.diag([part[3] for part in parts]), dt=dt, name="controller")


def _loop(gains: list[float], tustin: bool, dt: float) -> _Part:
    """``kp + ki/s + kd s/(1 + filter s)``, each part a fraction of first degree in 1/z."""
    kp, ki, kd, filter = gains
    if tustin:
        fractions = [(ki, (dt / 2, dt / 2), (1.0, -1.0)), (kd, (2.0, -2.0), (2 * filter + dt, dt - 2 * filter))]
    else:
        fractions = [(ki, (dt, 0.0), (1.0, -1.0)), (kd, (1.0, -1.0), (filter + dt, -filter))]
    there = [(gain, b, a) for gain, b, a in fractions if gain != 0]
    poles = np.array([-a[1] / a[0] for _, _, a in there])
    through = [gain * b[0] / a[0] for gain, b, a in there]
    rest = np.array([gain * b[1] / a[0] for gain, b, a in there]) + poles * through
    return np.diag(poles), np.ones((len(there), 1)), rest.reshape(1, -1), kp + sum(through)


def _delayed(part: _Part, samples: int) -> _Part:
    """The output some samples later."""
    for _ in range(samples):
        a, b, c, d = part
        n = len(a)
        a = np.block([[a, np.zeros((n, 1))], [c, np.zeros((1, 1))]])
        part = a, np.vstack([b, [[d]]]), np.eye(1, n + 1, n), 0.0
    return part


def _diagonal(blocks: list[Array]) -> Array:
    rows, columns = (sum(block.shape[k] for block in blocks) for k in range(2))
    found, i, j = np.zeros((rows, columns)), 0, 0
    for block in blocks:
        found[i : i + block.shape[0], j : j + block.shape[1]] = block
        i, j = i + block.shape[0], j + block.shape[1]
    return found
