"""What belongs to a loop: certificate, simulation, reduction, an excitation."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _native
from ._arrays import MOST_NUMBERS, Array, as_floats, positive, whole
from ._checks import known
from ._errors import InputError
from ._model import Complex, Model, _signal
from ._options import plain
from ._systems import as_model, controller_table, nominal_table, sign_of
from ._types import Feedback, Hold


#: Further options of `excite`.
EXCITE = (
    "shape", "seed", "ramp", "notch", "inputs", "periods", "limit_input", "limit_output", "scale_to_limit", "model_error", "noise",
    "damping_deviation",
)  # fmt: skip


@dataclass(frozen=True)
class Certificate:
    """Whether a controller stabilises a model.

    Attributes
    ----------
    stable : bool
        Whether every pole of the loop is inside of the unit circle.
    poles : ndarray of complex
        Poles of the loop in z.
    peak_sensitivity : float or None
        Largest singular value of the output sensitivity over all frequencies; None for an unstable loop.
    """

    stable: bool
    poles: Complex
    peak_sensitivity: float | None

    def __bool__(self) -> bool:
        return self.stable

    def __repr__(self) -> str:
        peak = "" if self.peak_sensitivity is None else f", peak sensitivity {self.peak_sensitivity:.4g}"
        largest = f"{np.abs(self.poles).max():.6g}" if len(self.poles) else "none"
        return f"<youla.Certificate: {'stable' if self.stable else 'unstable'}, {len(self.poles)} poles, largest |z| {largest}{peak}>"


def _loop(plant: Any, controller: Any, feedback: Feedback | None) -> tuple[Model, Model]:
    """Plant and controller of one sample time, the controller with positive feedback."""
    g = as_model(plant, "plant")
    p, m = g.d.shape
    k = as_model(controller, "controller", g.dt)
    if k.d.shape == (1, 1) and (m, p) != (1, 1) and k.order == 0 and k.d[0, 0] == 0:
        k = Model([], [], [], np.zeros((m, p)), dt=g.dt)
    if k.d.shape != (m, p):
        raise InputError(f"controller is {k.d.shape[0]} x {k.d.shape[1]}, but the plant needs {m} x {p}")
    if abs(k.dt / g.dt - 1) > 1e-6:
        raise InputError(f"controller has the sample time {k.dt:g} s, but the plant has {g.dt:g} s; resample one of them")
    sign = -1.0 if sign_of(controller, feedback) == "negative" else 1.0
    return g, Model(k.a, k.b, sign * k.c, sign * k.d, dt=g.dt)


def certify(plant: Any, controller: Any, *, feedback: Feedback | None = None) -> Certificate:
    """Test whether a controller stabilises a model.

    Parameters
    ----------
    plant, controller : Model or discrete-time system of python-control or SciPy
        Also the path of a file that `Model.save` wrote. The controller may also be a gain, or a PID as `identify` takes it,
        ``{"pid": {"kp": 2.0, "discretisation": "tustin"}}``.
    feedback : {"negative", "positive"}
        Sign with which the controller is written.

    Returns
    -------
    Certificate
        Stability, the poles of the loop in z and the peak of its sensitivity.

    Raises
    ------
    InputError
        For systems of other sizes or sample times, or in continuous time.
    NumericalError
        For a loop that is not well posed: its algebraic loop is singular.

    Examples
    --------
    >>> import youla
    >>> unstable = youla.Model([[1.1]], [[1.0]], [[1.0]], [[0.0]], dt=0.01)
    >>> bool(youla.certify(unstable, 0.5, feedback="negative")), bool(youla.certify(unstable, 0.05, feedback="negative"))
    (True, False)
    """
    g, k = _loop(plant, controller, feedback)
    stable, poles, peak = _native.certify(g._native(), k._native())
    return Certificate(stable, np.array([complex(*p) for p in poles]), peak)


def simulate_loop(
    plant: Any,
    controller: Any,
    *,
    samples: int | None = None,
    excitation: Any = None,
    reference: Any = None,
    noise: Any = None,
    feedback: Feedback | None = None,
) -> tuple[Array, Array]:
    """Simulate a loop ``u = K (r - y) + d`` from rest; y is measured with the noise.

    Parameters
    ----------
    plant, controller : Model or discrete-time system of python-control or SciPy
        As for `certify`; a gain is m x p.
    feedback : {"negative", "positive"}
        Sign with which the controller is written.
    samples : int, optional
        Number of samples; that of the signals when absent.
    excitation, reference, noise : array_like, optional
        d, samples x m, at the plant input; r and the noise of the outputs, samples x p. Zero when absent.

    Returns
    -------
    u, y : ndarray
        Plant inputs, samples x m, and measured outputs, samples x p.

    Raises
    ------
    InputError
        For signals of different lengths or other numbers of channels, and for systems that `certify` refuses.

    Examples
    --------
    >>> import numpy as np, youla
    >>> plant = youla.Model([[1.1]], [[1.0]], [[1.0]], [[0.0]], dt=0.01)
    >>> u, y = youla.simulate_loop(plant, 0.6, feedback="negative", reference=np.ones(200))
    >>> round(float(y[-1, 0]), 3)
    1.2
    """
    g, k = _loop(plant, controller, feedback)
    p, m = g.d.shape
    given = {"excitation": (excitation, m), "reference": (reference, p), "noise": (noise, p)}
    signals = {key: _signal(x, key, n) for key, (x, n) in given.items() if x is not None}
    lengths = {key: len(x) for key, x in signals.items()} | ({} if samples is None else {"samples": whole(samples, "samples", 1, MOST_NUMBERS)})
    if len(set(lengths.values())) != 1:
        raise InputError(f"the length of the simulation is {lengths or 'not given'}; give signals of one length, or samples=")
    count = next(iter(lengths.values()))
    try:
        three = [signals.get(key, np.zeros((count, n))) for key, (_, n) in given.items()]
    except (MemoryError, ValueError):
        raise InputError(f"samples is {count}, which memory does not hold; simulate parts of it") from None
    return _native.simulate_loop(g._native(), k._native(), three)


@dataclass(frozen=True)
class Reduction:
    """A reduced model with its Hankel singular values and, where one exists, the bound of its error."""

    model: Model
    hankel: Array
    error_bound: float | None

    def __repr__(self) -> str:
        bound = "no bound of the error" if self.error_bound is None else f"error at most {self.error_bound:.4g}"
        return f"<youla.Reduction: order {self.model.order} of {len(self.hankel)}, {bound}>"


def reduce(system: Any, *, output_scale: Sequence[float] | None = None, **options: Any) -> Reduction:
    """Remove states from a model.

    Parameters
    ----------
    system : Model or discrete-time system of python-control or SciPy
        Model.
    output_scale : sequence of float, (p,), optional
        Sizes of the outputs that matter equally, in their units.
    **options
        ``order`` (number of states), ``method``, ``stability_boundary``, as `ReductionOptions` of the library.

    Returns
    -------
    Reduction
        The reduced model with its Hankel singular values and the bound of its error.

    Raises
    ------
    InputError
        For options that do not exist, or an order above that of the system.

    Examples
    --------
    >>> import youla
    >>> plant = youla.Model([[0.9, 0], [0, 0.1]], [[1.0], [1e-3]], [[1.0, 1.0]], [[0.0]], dt=0.1)
    >>> youla.reduce(plant, method="balanced-truncation", order=1).model.order
    1
    """
    g = as_model(system, "system")
    if isinstance(options.get("order"), int):
        options["order"] = whole(options["order"], "order", 0)
    scale = None if output_scale is None else np.ravel(as_floats(output_scale, "output_scale")).tolist()
    found, hankel, bound = _native.reduce(g._native(), plain(options), scale)
    a, b, c, d, dt = found
    model = Model(a, b, c, d, dt=dt, inputs=g.inputs, outputs=g.outputs, name=f"{g.name}, reduced")
    return Reduction(model, np.array(hankel), bound)


@dataclass(frozen=True)
class Excitation:
    """An excitation: `signal`, samples x inputs, its sample time and what it is predicted to do."""

    signal: Array
    dt: float
    promised: dict[str, Any]

    def __repr__(self) -> str:
        n, m = self.signal.shape
        peak = np.abs(self.signal).max()
        return f"<youla.Excitation: {n} samples of {self.dt:g} s, {m} inputs, at most {peak:.4g}; promised {', '.join(list(self.promised)[:8])}>"


def excite(
    nominal: Any,
    controller: Any,
    *,
    dt: float | None = None,
    amplitude: Any,
    band: Sequence[float],
    seconds: float | None = None,
    samples: int | None = None,
    feedback: Feedback | None = None,
    hold: Hold | None = None,
    **options: Any,
) -> Excitation:
    """Make an excitation for the plant input of a loop.

    Parameters
    ----------
    nominal, controller, feedback, hold
        Model of the plant, p x m, and controller, m x p; see `identify`.
    dt : float, optional
        Sample time, seconds; that of `nominal` when absent.
    amplitude : float or sequence of float
        Greatest absolute value, one for all inputs or one each, in the unit of the input.
    band : pair of float
        Lowest and highest frequency, Hz.
    seconds, samples : float, int
        Length; one of the two.
    **options
        Further `ExciteOptions` of the library: ``shape`` (``"multisine"``, ``"prbs"``, ``"square"``, ``"chirp"``), ``seed``,
        ``ramp``, ``periods``, ``limit_input``, ``limit_output``, ``noise``, ``damping_deviation``.

    Returns
    -------
    Excitation
        The sequence, samples x m in the unit of the inputs, and its predicted peaks and deviations.

    Raises
    ------
    InputError
        For a band above the Nyquist frequency, and for an excitation beyond a limit, with the amplitude that keeps it.

    Examples
    --------
    >>> import youla
    >>> plant = youla.Model([[0.95]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    >>> made = youla.excite(plant, 2.0, feedback="negative", amplitude=0.5, band=[0.5, 20], seconds=10)
    >>> made.signal.shape, made.dt
    ((1000, 1), 0.01)
    """
    if (seconds is None) == (samples is None):
        raise InputError("the length is given twice or not at all; give either seconds= or samples=")
    known(options, EXCITE, "excite")
    dt = as_model(nominal, "nominal").dt if dt is None else positive(dt, "dt")
    edges = np.ravel(as_floats(band, "band"))
    if edges.size != 2:
        raise InputError(f"band has {edges.size} entries, but must be the lowest and the highest frequency in Hz")
    m, p = _ports(nominal)
    data = {
        "sample_time": dt,
        "inputs": [{"name": f"u{k + 1}"} for k in range(m)],
        "outputs": [{"name": f"y{k + 1}"} for k in range(p)],
        "input_excitation": [{"name": f"d{k + 1}"} for k in range(m)],
        "estimation": [{"file": "none"}],
    }
    settings = {
        "name": "loop",
        "data": data,
        "nominal": nominal_table(nominal, dt, (p, m)),
        "controller": controller_table(controller, feedback, hold, dt, (m, p)),
    }
    length: dict[str, float] = {"samples": whole(samples, "samples", 2, MOST_NUMBERS)} if seconds is None else {"seconds": positive(seconds, "seconds")}
    amplitudes = np.ravel(as_floats(amplitude, "amplitude")).tolist()
    chosen = {"amplitude": amplitudes, "band": edges.tolist(), "length": length, **options}
    for key in ("limit_input", "limit_output", "noise"):
        if key in chosen:
            chosen[key] = np.ravel(as_floats(chosen[key], key)).tolist()
    if "seed" in chosen:
        whole(chosen["seed"], "seed", 0)
    signal, time, promised = _native.excite(plain(settings), plain(chosen), "input")
    return Excitation(signal, time, json.loads(promised))


def _ports(system: Any) -> tuple[int, int]:
    """Numbers of inputs and outputs of a system that states them."""
    if isinstance(system, Model):
        return system.d.shape[1], system.d.shape[0]
    for inputs, outputs in (("ninputs", "noutputs"), ("inputs", "outputs")):
        m, p = getattr(system, inputs, None), getattr(system, outputs, None)
        if isinstance(m, (int, np.integer)) and isinstance(p, (int, np.integer)):
            return int(m), int(p)
    if isinstance(system, Mapping):
        raise InputError("nominal is a mapping, of which the ports are not known; give a youla.Model or a system of python-control")
    return 1, 1
