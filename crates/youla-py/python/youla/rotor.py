"""Rotors on controlled bearings: stability margins after ISO 14839-3, and models of the package ROSS.

The zones of ISO 14839-3:2006, Mechanical vibration, Vibration of rotating machinery equipped with active magnetic bearings, Part 3,
Evaluation of stability margin, Table 1: the largest magnitude of the sensitivity of each controlled axis, with all loops closed, is at
most 3 (9.5 dB) in zone A, 4 (12 dB) in zone B, 5 (14 dB) in zone C, and above in zone D.

`magnetic_loop` takes a rotor of ``ross-rotordynamics``, which ``pip install 'youla[rotor]'`` installs; the rest needs no further package.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._arrays import Array
from ._errors import InputError, NumericalError
from ._magnetic import MagneticLoop, magnetic_loop
from ._model import Complex, Model
from ._result import Run

__all__ = ["LIMITS", "MagneticLoop", "Zone", "magnetic_loop", "sensitivity_zones"]

#: Upper limits of the zones A, B and C.
LIMITS = {"A": 3.0, "B": 4.0, "C": 5.0}
#: Quantile of the normal distribution for 95 %.
_Z95 = 1.959963984540054
#: Frequencies of the first search of a peak, from a ten thousandth of the Nyquist frequency up; a peak narrower than their distance
#: belongs to a mode, whose frequency is added to them.
_FREQUENCIES = 1000


@dataclass(frozen=True)
class Zone:
    """Peak of the sensitivity of one axis.

    Attributes
    ----------
    axis : str
        Name of the output.
    peak : float
        Largest magnitude of the sensitivity.
    hz : float
        Where it is, Hz.
    interval : tuple of float
        95 % interval of the peak; the upper bound is infinite where the record does not exclude an unstable loop.
    zone : str
        ``"A"``, ``"B"``, ``"C"`` or ``"D"`` of ISO 14839-3, ``"undecided"`` where the interval holds a limit.
    """

    axis: str
    peak: float
    hz: float
    interval: tuple[float, float]
    zone: str

    def __str__(self) -> str:
        low, high = (f"{20 * np.log10(x):.1f}" for x in self.interval)
        return f"{self.axis}: {20 * np.log10(self.peak):.1f} dB at {self.hz:.4g} Hz (95 %: {low} to {high} dB), zone {self.zone}"


def sensitivity_zones(run: Run) -> tuple[Zone, ...]:
    """Evaluate the stability margin of each axis of the identified loop.

    The sensitivity is that at the sensors, ``S = (I + G K)^-1``, with the recommended model G and the controller K of the run.
    Its diagonal entry i is what an analyser measures at axis i with all loops closed. The interval comes from the covariance
    of all entries of G at the peak: to first order ``d(1 / S_ii) = sum over a, b of (S_ia / S_ii) dG_ab (K S)_bi / S_ii``.

    Parameters
    ----------
    run : Run
        A run in closed loop with a recommended model.

    Returns
    -------
    tuple of Zone
        One for each output.

    Raises
    ------
    InputError
        For a run without a controller.
    NumericalError
        For a run without a recommended model, or with one that its controller does not stabilise.

    Examples
    --------
    >>> import youla
    >>> from youla.rotor import sensitivity_zones
    >>> zone, = sensitivity_zones(youla.demo())
    >>> zone.interval[0] < zone.peak < zone.interval[1]
    True
    """
    if not isinstance(run, Run):
        raise InputError(f"run is {run!r}, but must be a youla.Run, as youla.identify returns")
    if run.summary["recommended"] is None:
        raise NumericalError("the run has no recommended model; see run.summary['refused']")
    plant, controller = run.recommended, _controller(run)
    stable = run.summary["methods"]["likelihood"].get("stabilised_by_controller")
    if not stable:
        raise NumericalError("the controller of the run does not stabilise the recommended model, so that no margin exists")
    return tuple(_zone(run, plant, controller, i) for i in range(plant.d.shape[0]))


def _controller(run: Run) -> Model:
    found = run.model("controller") if "controller" in run.models else None
    if found is None or not (np.any(found.c) or np.any(found.d)):
        raise InputError("the run has no controller, so that there is no loop; give controller= to youla.identify")
    return found


def _zone(run: Run, plant: Model, controller: Model, i: int) -> Zone:
    nyquist = np.pi / plant.dt
    resonant = [2 * np.pi * m.hz for m in plant.modes() if 0 < 2 * np.pi * m.hz < nyquist]
    grid = np.unique(np.concatenate([np.geomspace(1e-4 * nyquist, nyquist, _FREQUENCIES), resonant]))
    sizes = np.abs(_sensitivity(plant, controller, grid)[0][:, i, i])
    best = int(np.argmax(sizes))
    for _ in range(4):  # each time ten times closer around the largest
        grid = np.linspace(grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)], 21)
        sizes = np.abs(_sensitivity(plant, controller, grid)[0][:, i, i])
        best = int(np.argmax(sizes))
    omega, peak = float(grid[best]), float(sizes[best])
    deviation = _deviation(run, plant, controller, omega, i)
    low, high = 1 / (1 / peak + _Z95 * deviation), 1 / peak - _Z95 * deviation
    interval = (low, 1 / high if high > 0 else float("inf"))
    zones = {_name(bound) for bound in interval}
    names = plant.outputs
    return Zone(names[i], peak, omega / (2 * np.pi), interval, zones.pop() if len(zones) == 1 else "undecided")


def _name(peak: float) -> str:
    return next((zone for zone, limit in LIMITS.items() if peak <= limit), "D")


def _sensitivity(plant: Model, controller: Model, omega: Array) -> tuple[Complex, Complex]:
    """S and K S, with positive feedback: S = (I - G K)^-1."""
    g, k = plant.frequency_response(omega).values, controller.frequency_response(omega).values
    s: Complex = np.linalg.inv(np.eye(g.shape[1]) - g @ k).astype(np.complex128)
    return s, np.asarray(k @ s, dtype=np.complex128)


def _deviation(run: Run, plant: Model, controller: Model, omega: float, i: int) -> float:
    """Standard deviation of 1 / |S_ii|."""
    s, ks = (x[0] for x in _sensitivity(plant, controller, np.array([omega])))
    slopes = np.outer(s[i, :], ks[:, i]) / s[i, i] ** 2
    # Along 1 / S_ii, whose magnitude is wanted.
    found = run._native.deviation_along(omega / (2 * np.pi), slopes * (s[i, i] / abs(s[i, i])))
    if found is None:
        raise NumericalError("the recommended model states no deviations of its response")
    return found
