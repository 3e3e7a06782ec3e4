"""A response that an analyser measured, from arrays to a model."""

from __future__ import annotations

import numpy as np
import pytest

import youla

HZ = np.geomspace(0.1, 40.0, 60)
PLANT = youla.Model([[0.95]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
G = PLANT.frequency_response(2 * np.pi * HZ).values
KNOWN = {"nominal": PLANT, "controller": 2.0, "feedback": "negative"}


def noise(seed: int, shape: tuple[int, ...], size: float = 1e-3) -> np.ndarray:
    """Complex errors of this root mean square."""
    return size * np.random.default_rng(seed).standard_normal((*shape, 2)) @ [1, 1j] / np.sqrt(2)


def loop(seed: int, repetitions: int = 0) -> tuple[np.ndarray, np.ndarray]:
    s = 1 / (1 + 2.0 * G)
    shape = (repetitions, *G.shape) if repetitions else G.shape
    return s + noise(seed, shape), G * s + noise(seed + 1, shape)


def found(data: object, **known: object) -> None:
    run = youla.identify(data, **{**KNOWN, **known})
    assert run.verdict.trusted, run.verdict
    assert run.verdict.defects == ()
    assert run.recommended.order == 1
    assert abs(run.recommended.poles[0] - 0.95) < 2e-3


def test_two_arrays_are_enough() -> None:
    ud, yd = loop(1)
    found(youla.Response(2 * np.pi * HZ, ud=ud[:, 0, 0], yd=yd[:, 0, 0], sd=1e-3))
    found(youla.Response(hz=HZ, ud=ud, yd=yd, sd=(1e-3, 1e-3 * np.ones(60)), dt=0.01), nominal=10 / 100)


def test_repetitions_state_their_errors() -> None:
    ud, yd = loop(3, repetitions=8)
    response = youla.Response(hz=HZ, ud=ud, yd=yd)
    assert "known errors" in repr(response)
    found(response)


def test_the_plant_alone_and_objects_of_others() -> None:
    control = pytest.importorskip("control")
    values = G + noise(5, G.shape)
    frd = control.frd(np.moveaxis(values, 0, -1), 2 * np.pi * HZ)
    found(youla.Response(frd, sd=1e-3))
    ours = youla.FrequencyResponse(2 * np.pi * HZ, values, covariance=np.broadcast_to([5e-7, 0, 5e-7], (60, 1, 1, 3)))
    found(ours)
    one, other = (youla.identify(x, **KNOWN).recommended for x in (frd, youla.Response(2 * np.pi * HZ, g=values)))
    assert np.array_equal(one.a, other.a)
    # A gain has no clock; the response of a discrete system states its own.
    assert youla.Response(control.frd(np.moveaxis(values, 0, -1), 2 * np.pi * HZ, dt=0.01)).dt == 0.01


def test_a_response_without_noise_needs_its_errors() -> None:
    """What is left is rounding, which is smooth; the reason says what mends it, and it does."""
    plant = youla.Model([[1.5, -0.56], [1.0, 0.0]], [[0.06], [0.0]], [[1.0, 0.0]], [[0.0]], dt=0.01)
    g = plant.frequency_response(2 * np.pi * HZ).values
    known = {"controller": 2.0, "feedback": "negative"}
    verdict = youla.identify(youla.Response(hz=HZ, g=g, dt=0.01), **known).verdict
    assert verdict or "state the errors of the response" in " ".join(verdict.reasons)
    run = youla.identify(youla.Response(hz=HZ, g=g, dt=0.01, sd=1e-6), **known)
    assert run.verdict.trusted and run.recommended.order == 2


def test_coherence_weighs() -> None:
    ud, yd = loop(7)
    run = youla.identify(youla.Response(hz=HZ, ud=ud, yd=yd, coherence=0.999), **KNOWN)
    assert abs(run.recommended.poles[0] - 0.95) < 0.01


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"ud": G}, "yd is missing"),
        ({}, "give ud= and yd="),
        ({"g": G[:50]}, r"g is \(50, 1, 1\), but must be \(60, rows, columns\)"),
        ({"g": G, "sd": -1.0}, "sd must be finite and not negative"),
        ({"g": G, "sd": [1.0, 2.0]}, "sd is"),
        ({"g": G, "coherence": 1.5}, "coherence must be above 0 and at most 1"),
        ({"g": np.where(HZ > 39, np.nan, 1)}, "g is not finite at frequency 59"),
        ({"g": G, "hz": -HZ}, "hz must be finite frequencies above 0"),
        ({"g": G, "omega": HZ}, "the frequencies are given twice"),
        ({"g": G, "dt": 0}, "dt is 0"),
        ({"g": 20 * np.log10(np.abs(G))}, r"g is real at all frequencies, but a response has a phase; of dB and degrees give 10 \*\* \(db / 20\) \* numpy.exp"),
        ({"ud": np.abs(G), "yd": G}, "ud is real at all frequencies"),
    ],
)
def test_what_cannot_be_a_response(given: dict, says: str) -> None:
    with pytest.raises(youla.InputError, match=says):
        youla.Response(**{"hz": HZ, **given})


def test_what_does_not_fit_the_loop() -> None:
    with pytest.raises(youla.InputError, match=r"above the Nyquist frequency of 50 Hz.*, or give omega= in place of hz= where they are in rad/s$"):
        youla.identify(youla.Response(hz=2 * np.pi * HZ, g=G), **KNOWN)
    with pytest.raises(youla.InputError, match="above the Nyquist frequency of 50 Hz.*, or check dt$"):
        youla.identify(youla.Response(4 * np.pi * HZ, g=G), **KNOWN)
    with pytest.raises(youla.InputError, match="dt is missing, which a response does not show"):
        youla.identify(youla.Response(hz=HZ, g=G), nominal=0.1, controller=2.0, feedback="negative")
    control = pytest.importorskip("control")
    with pytest.raises(youla.InputError, match="frequency response, not a record"):
        youla.Record(control.frd(G[:, 0, 0], HZ), inputs=0, outputs=1, dt=0.01)
    with pytest.raises(youla.InputError, match="goes into youla.Response"):
        youla.Record(np.hstack([G[:, :, 0], G[:, :, 0]]), inputs=0, outputs=1, dt=0.01)
    run = youla.identify(youla.Response(hz=HZ, g=G, sd=1e-3), **KNOWN)
    with pytest.raises(youla.InputError, match="holds no records"):
        youla.bootstrap(run, 2, seed=1)
