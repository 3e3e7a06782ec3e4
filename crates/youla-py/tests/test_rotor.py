"""Zones of the stability margin of rotors: exact peaks, intervals that hold them, refusals."""

from __future__ import annotations

import numpy as np
import pytest

import youla
from youla.rotor import LIMITS, sensitivity_zones

DT = 2e-4


def _mode(hz: float, zeta: float) -> np.ndarray:
    p = np.exp((-zeta + 1j * np.sqrt(1 - zeta**2)) * 2 * np.pi * hz * DT)
    return np.array([[p.real, p.imag], [-p.imag, p.real]])


A = np.zeros((4, 4))
A[:2, :2], A[2:, 2:] = _mode(90, 0.04), _mode(130, 0.03)
ROTOR = youla.Model(A, [[0, 0], [0.05, 0.01], [0, 0], [-0.01, 0.06]], [[1, 0, 0.2, 0], [-0.1, 0, 1, 0]], np.zeros((2, 2)), dt=DT)


def _controller(gain: float) -> youla.Model:
    """PD with a filter on each axis, negative feedback."""
    direct, late = gain + 0.3, -0.7 * gain - 0.3
    return youla.Model(0.7 * np.eye(2), np.eye(2), (late + 0.7 * direct) * np.eye(2), direct * np.eye(2), dt=DT)


def _run(seed: int, controller: youla.Model, noise: float) -> youla.Run:
    draws = np.random.default_rng(seed)
    d = draws.choice([-1.0, 1.0], (1000, 2)).repeat(4, 0)
    u, y = youla.simulate_loop(ROTOR, controller, feedback="negative", excitation=d, noise=noise * draws.standard_normal(d.shape))
    log = youla.Record(np.hstack([u, y, d]), inputs=[0, 1], outputs=[2, 3], excitation=[4, 5], dt=DT)
    return youla.identify(log, nominal=ROTOR, controller=controller, feedback="negative")


def _exact(controller: youla.Model) -> np.ndarray:
    omega = np.linspace(2 * np.pi, np.pi / DT, 200_000)
    g, k = ROTOR.frequency_response(omega).values, controller.frequency_response(omega).values
    s = np.linalg.inv(np.eye(2) + g @ k)
    return np.abs(np.moveaxis(s, 0, -1)[[0, 1], [0, 1]]).max(axis=1)


def test_the_peaks_are_exact_without_noise() -> None:
    zones = sensitivity_zones(_run(1, _controller(0.5), 1e-6))
    exact = _exact(_controller(0.5))
    assert [zone.peak for zone in zones] == pytest.approx(exact, rel=1e-4)
    assert [zone.zone for zone in zones] == ["A", "A"]
    assert [zone.axis for zone in zones] == ["y1", "y2"]
    assert "dB at" in str(zones[0])


def test_intervals_hold_the_peaks() -> None:
    """Of 24 intervals of 95 % at least 20 hold the truth with a probability of 99.4 %."""
    exact = _exact(_controller(0.5))
    found = [sensitivity_zones(_run(seed, _controller(0.5), 0.3)) for seed in range(12)]
    held = [zone.interval[0] <= peak <= zone.interval[1] for zones in found for zone, peak in zip(zones, exact, strict=True)]
    assert sum(held) >= 20
    for zones in found:
        for zone in zones:
            limits = [limit for limit in LIMITS.values() if zone.interval[0] <= limit < zone.interval[1]]
            assert (zone.zone == "undecided") == bool(limits)


def test_what_has_no_margin_is_refused() -> None:
    with pytest.raises(youla.InputError, match=r"must be a youla\.Run"):
        sensitivity_zones(ROTOR)  # type: ignore[arg-type]
    draws = np.random.default_rng(1)
    u = draws.standard_normal((1000, 1))
    y = youla.Model([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=DT).simulate(u) + 0.01 * draws.standard_normal((1000, 1))
    run = youla.identify(youla.Record(np.hstack([u, y]), inputs=0, outputs=1, dt=DT), nominal=youla.Model([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=DT), controller=0.0)
    with pytest.raises(youla.InputError, match="controller="):
        sensitivity_zones(run)
