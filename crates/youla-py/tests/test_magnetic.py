"""The bridge to ROSS: poles, unbalance response, and a rotor that is identified in closed loop."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import youla
from youla.rotor import magnetic_loop, sensitivity_zones

SAMPLES, DT = 8000, 2e-4


@pytest.fixture(scope="module")
def rotor() -> Any:
    ross = pytest.importorskip("ross", reason="ross-rotordynamics is not installed (pip install 'youla[rotor]')")
    control = pytest.importorskip("control")
    s = control.TransferFunction.s
    found = ross.rotor_assembly.rotor_amb_example(3000 + 15 * s / (1 + s / 6000))
    for element in found.shaft_elements:
        element.beta = 2e-5
    return found


def test_the_plant_has_the_poles_of_ross(rotor: Any) -> None:
    """Poles of the rotor of ROSS with springs of stiffness ks in place of the bearings, gyroscopic terms included."""
    import ross

    speed = 300.0
    loop = magnetic_loop(rotor, dt=DT, speed=speed)
    springs = [ross.BearingElement(n=b.n, kxx=b.ks, kyy=b.ks, cxx=0.0, cyy=0.0) for b in rotor.bearing_elements]
    bare = ross.Rotor(rotor.shaft_elements, rotor.disk_elements, springs)
    exact = np.linalg.eigvals(bare.A(speed=speed, frequency=0.0))
    found = np.log(loop.plant.poles.astype(complex)) / DT
    slow = found[np.abs(found) < 2 * np.pi * 800]
    assert len(slow) == 20  # two planes of two rigid and three bending modes
    for pole in slow:
        assert np.min(np.abs(exact - pole)) < 2e-3 * abs(pole) + 0.05


def test_the_unbalance_response_is_that_of_ross(rotor: Any) -> None:
    """Within 2 % of ROSS, which has an analog controller in the place of the sampled one."""
    speed = 2 * np.pi * 40
    loop = magnetic_loop(rotor, dt=2e-5, speed=speed)
    found = loop.unbalance_response([40.0], node=29, magnitude=1e-5)[0]
    of_ross = rotor.run_unbalance_response(29, 1e-5, 0.0, np.array([speed - 1.0, speed]))
    x, y = (of_ross.forced_resp[6 * 12 + k, 1] for k in (0, 1))
    exact = np.array([x + y, y - x]) / np.sqrt(2)
    assert np.all(np.abs(np.abs(found[:2]) / np.abs(exact) - 1) < 0.02)


def peaks(loop: youla.rotor.MagneticLoop) -> np.ndarray:
    w = np.geomspace(1, np.pi / DT, 200_000)
    open_loop = loop.plant.frequency_response(w).values @ loop.controller.frequency_response(w).values
    return np.abs(np.diagonal(np.linalg.inv(np.eye(2) + open_loop), axis1=1, axis2=2)).max(axis=0)


def test_a_rotor_is_identified_in_closed_loop(rotor: Any) -> None:
    """Peak within 3 % of the exact one, zone right or undecided, modes within 1 %, unbalance response within 2 %."""
    loop = magnetic_loop(rotor, dt=DT, plane=True)
    nominal = magnetic_loop(rotor, dt=DT, plane=True, order=8)
    assert nominal.plant.order == 8
    d = youla.excite(loop.plant, loop.controller, feedback="negative", amplitude=0.02, band=[1, 1000], samples=SAMPLES).signal
    _, clean = youla.simulate_loop(loop.plant, loop.controller, feedback="negative", excitation=d)
    noise = 0.02 * clean.std(axis=0) * np.random.default_rng(1).standard_normal(clean.shape)
    u, y = youla.simulate_loop(loop.plant, loop.controller, feedback="negative", excitation=d, noise=noise)
    log = youla.Record(np.hstack([u, y, d]), inputs=[0, 1], outputs=[2, 3], excitation=[4, 5], dt=DT)
    run = youla.identify(log, nominal=nominal.plant, controller=loop.controller, feedback="negative")
    zones = sensitivity_zones(run)
    assert [zone.peak for zone in zones] == pytest.approx(peaks(loop), rel=0.03)
    assert zones[0].zone in ("undecided", "B") and zones[1].zone in ("undecided", "A")
    near = [min(run.modes(), key=lambda m: abs(m.hz - hz)).hz / hz for hz in (104.194, 400.416)]
    assert np.allclose(near, 1, atol=0.01)
    hz = np.linspace(5, 60, 12)
    given = {"node": 29, "magnitude": 1e-5}
    true, by_model = loop.unbalance_response(hz, **given), loop.unbalance_response(hz, **given, model=run.recommended)
    assert np.max(np.abs(by_model - true) / np.abs(true)) < 0.02


def test_refusals_name_argument_and_remedy() -> None:
    with pytest.raises(youla.InputError, match="rotor must be a ross.Rotor all of whose bearings"):
        magnetic_loop(3, dt=DT)
