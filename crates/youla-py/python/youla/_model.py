"""Discrete-time models and frequency responses."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import Array, as_floats, as_matrix, positive
from ._checks import listed, text, write_file
from ._errors import InputError
from ._optional import need
from ._types import Matrices

Complex = npt.NDArray[np.complex128]


@dataclass(frozen=True)
class Mode:
    """An oscillating mode of a model: a pair of poles. Real poles are apart, as `RealPole`.

    Attributes
    ----------
    hz : float
        Natural frequency, Hz.
    zeta : float
        Damping ratio; negative where the mode is unstable.
    hz_interval, zeta_interval : tuple of float, optional
        95 % intervals where they are known.
    """

    hz: float
    zeta: float
    hz_interval: tuple[float, float] | None = None
    zeta_interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class RealPole:
    """A real pole of a model: a time constant, an integrator or a growth.

    Attributes
    ----------
    z : float
        The pole in z; beyond 1 the model grows.
    hz : float
        Corner frequency ``|ln z| / (2 pi dt)``, Hz; the time constant is ``1 / (2 pi hz)``.
    hz_interval : tuple of float, optional
        95 % interval where it is known.
    """

    z: float
    hz: float
    hz_interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class FrequencyResponse:
    """A frequency response with its confidence region.

    Attributes
    ----------
    omega : ndarray, (n,)
        Angular frequencies, rad/s.
    values : ndarray of complex, (n, p, m)
        Response.
    low, high : ndarray, (n, p, m), optional
        Bounds of the magnitude at the level of the uncertainty.
    covariance : ndarray, (n, p, m, 3), optional
        Covariance of real and imaginary part: re re, re im, im im.
    ellipse : float, optional
        Bound of ``d' V^-1 d`` for the region of a complex value.
    name : str
        Name of the model.
    """

    omega: Array
    values: Complex
    low: Array | None = None
    high: Array | None = None
    covariance: Array | None = None
    ellipse: float | None = None
    name: str = "model"

    @property
    def hz(self) -> Array:
        """Frequencies, Hz."""
        return self.omega / (2 * np.pi)

    @property
    def magnitude(self) -> Array:
        """Magnitude, (n, p, m)."""
        return np.abs(self.values)

    @property
    def phase(self) -> Array:
        """Phase, radians, continuous over the frequencies, (n, p, m)."""
        found: Array = np.unwrap(np.angle(self.values), axis=0)
        return found

    def __repr__(self) -> str:
        n, p, m = self.values.shape
        band = f"{self.hz.min():.4g} to {self.hz.max():.4g} Hz"
        return f"<youla.FrequencyResponse {self.name!r}: {n} frequencies, {band}, {p} x {m}, {'no' if self.low is None else 'with a'} region>"

    def to_control(self) -> Any:
        """Return a `control.FrequencyResponseData`."""
        control = need("control")
        return control.FrequencyResponseData(np.moveaxis(self.values, 0, -1), self.omega)

    def to_frame(self) -> Any:
        """Return a pandas data frame with a row for each frequency, output and input."""
        pd = need("pandas")
        n, p, m = self.values.shape
        k, i, j = (index.ravel() for index in np.indices((n, p, m)))
        columns: dict[str, Any] = {"hz": self.hz[k], "output": i, "input": j}
        columns |= {"magnitude": self.magnitude.ravel(), "phase": self.phase.ravel()}
        if self.low is not None and self.high is not None:
            columns |= {"low": self.low.ravel(), "high": self.high.ravel()}
        return pd.DataFrame(columns)

    def plot(self, ax: Any = None, *, region: bool = True) -> Any:
        """Draw magnitude in dB and phase in degrees over the frequency in Hz.

        Parameters
        ----------
        ax : pair of matplotlib axes, optional
            Where to draw.
        region : bool
            Whether to draw the bounds of the magnitude.

        Returns
        -------
        ndarray of matplotlib axes
            Magnitude and phase.
        """
        from ._plot import bode

        return bode([self], ax, region=region)


class Model:
    """A discrete-time state-space model ``x+ = A x + B u, y = C x + D u``.

    Parameters
    ----------
    a, b, c, d : array_like
        Matrices, n x n, n x m, p x n, p x m.
    dt : float
        Sample time, seconds.
    inputs, outputs : sequence of str, optional
        Names.
    name : str
        Name in figures.

    Examples
    --------
    >>> import youla
    >>> model = youla.Model([[0.5]], [[1.0]], [[1.0]], [[0.0]], dt=0.1)
    >>> model.order, model.poles.tolist()
    (1, [(0.5+0j)])
    >>> float(abs(model.frequency_response([0.0]).values[0, 0, 0]))
    2.0
    """

    def __init__(
        self,
        a: Any,
        b: Any,
        c: Any,
        d: Any,
        *,
        dt: float,
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
        name: str = "model",
    ) -> None:
        self._dead_time: tuple[int, ...] = ()
        d = as_matrix(d, "d")
        p, m = d.shape
        if d.size == 0:
            raise InputError("d is empty, but states the numbers of outputs and inputs; give zeros((p, m)) where nothing feeds through")
        a, b, c = (as_matrix(x, what) for x, what in ((a, "a"), (b, "b"), (c, "c")))
        if a.size == 0:
            a, b, c = np.zeros((0, 0)), np.zeros((0, m)), np.zeros((p, 0))
        n = a.shape[0]
        for what, matrix, shape in (("a", a, (n, n)), ("b", b, (n, m)), ("c", c, (p, n)), ("d", d, (p, m))):
            if matrix.shape != shape:
                found = " x ".join(map(str, matrix.shape))
                raise InputError(f"{what} is {found}, but must be {shape[0]} x {shape[1]} (d is {p} x {m})")
            if not np.isfinite(matrix).all():
                raise InputError(f"{what} has an entry that is not finite")
        self._matrices = tuple(_frozen(x) for x in (a, b, c, d))
        self._dt, self.name = positive(dt, "dt"), text(name, "name")
        self.inputs = _names(inputs, "inputs", "u", m)
        self.outputs = _names(outputs, "outputs", "y", p)

    @property
    def a(self) -> Array:
        """A, n x n; read-only."""
        return self._matrices[0]

    @property
    def b(self) -> Array:
        """B, n x m; read-only."""
        return self._matrices[1]

    @property
    def c(self) -> Array:
        """C, p x n; read-only."""
        return self._matrices[2]

    @property
    def d(self) -> Array:
        """D, p x m; read-only."""
        return self._matrices[3]

    @property
    def dt(self) -> float:
        """Sample time, seconds."""
        return self._dt

    @property
    def order(self) -> int:
        """Number of states without those of the dead time."""
        return int(self.a.shape[0]) - sum(self.dead_time)

    @property
    def dead_time(self) -> tuple[int, ...]:
        """Dead time of each input in samples, of which the model holds a state each; empty where none is stated."""
        return self._dead_time

    @property
    def poles(self) -> Complex:
        """Poles in z, in the order of the modes."""
        found = [complex(re, im) for _, _, re, im in _native.modes(self._native())]
        both = [q for p in found for q in ([p, p.conjugate()] if p.imag != 0 else [p])]
        return np.array(both, dtype=np.complex128)

    def modes(self) -> tuple[Mode, ...]:
        """Return the oscillating modes by natural frequency; real poles have no damping ratio, see `real_poles`."""
        return tuple(Mode(hz, zeta) for hz, zeta, _, im in _native.modes(self._native()) if im != 0)

    def real_poles(self) -> tuple[RealPole, ...]:
        """Return the real poles by corner frequency, without those at z = 0, which are dead time."""
        found = _native.modes(self._native())
        return tuple(RealPole(z, hz) for hz, _, z, im in found if im == 0 and np.isfinite(hz))

    def frequency_response(self, omega: Any) -> FrequencyResponse:
        """Return the frequency response.

        Parameters
        ----------
        omega : array_like, (n,)
            Angular frequencies, rad/s.

        Returns
        -------
        FrequencyResponse
            Values of the shape (n, p, m), without a region.
        """
        w = frequencies(omega, self._dt)
        values = _native.frequency_response(self._native(), w / (2 * np.pi))
        return FrequencyResponse(w, values, name=self.name)

    def simulate(self, inputs: Any, x0: Any = None) -> Array:
        """Simulate the model.

        Parameters
        ----------
        inputs : array_like, samples x m
            Inputs; one input may be a list of numbers.
        x0 : array_like, (n,), optional
            State before the first sample; zero when absent.

        Returns
        -------
        ndarray, samples x p
            Outputs.
        """
        u = _signal(inputs, "inputs", self.d.shape[1])
        states = self.a.shape[0]
        state = np.zeros(states) if x0 is None else as_floats(x0, "x0").ravel()
        if len(state) != states:
            raise InputError(f"x0 has {len(state)} entries, but the model has {states} states")
        return _native.simulate(self._native(), u, state.tolist())

    def to_control(self) -> Any:
        """Return a `control.StateSpace` with the same matrices, sample time and names."""
        control = need("control")
        return control.StateSpace(
            *self._matrices, self._dt, inputs=list(self.inputs), outputs=list(self.outputs), name=_plain(self.name)
        )

    def to_scipy(self) -> Any:
        """Return a discrete `scipy.signal.StateSpace` with the same matrices."""
        return need("scipy.signal").StateSpace(*self._matrices, dt=self._dt)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model as JSON, which ``--nominal`` and ``model_file`` of the program read.

        Parameters
        ----------
        path : path
            File; one of that name is replaced.
        """
        matrices = dict(zip("abcd", (m.tolist() for m in self._matrices), strict=True))
        write_file(path, "path", json.dumps({"name": self.name, "ts": self._dt, **matrices, "provenance": None}))

    def __repr__(self) -> str:
        p, m = self.d.shape
        dead_time = f" and dead time {list(self.dead_time)}" if any(self.dead_time) else ""
        return f"<youla.Model {self.name!r}: order {self.order}{dead_time}, {m} inputs, {p} outputs, dt={self._dt:g} s>"

    def __eq__(self, other: object) -> bool:
        """Whether another model has the same matrices, bit by bit, sample time, names and dead time."""
        if not isinstance(other, Model):
            return NotImplemented
        own, its = ((m._dt, m.inputs, m.outputs, m.name, m._dead_time) for m in (self, other))
        return own == its and all(np.array_equal(a, b) for a, b in zip(self._matrices, other._matrices, strict=True))

    def __hash__(self) -> int:
        return hash((self._dt, self.inputs, self.outputs, self.name))

    def __reduce__(self) -> Any:
        return _model_of, (self._matrices, self._dt, self.inputs, self.outputs, self.name, self._dead_time)

    def _native(self) -> Matrices:
        a, b, c, d = self._matrices
        return (a, b, c, d, self._dt)


def _model_of(
    matrices: Sequence[Array], dt: float, inputs: Sequence[str], outputs: Sequence[str], name: str, dead_time: Sequence[int] = ()
) -> Model:
    """A model from its state."""
    a, b, c, d = matrices
    model = Model(a, b, c, d, dt=dt, inputs=inputs, outputs=outputs, name=name)
    model._dead_time = tuple(dead_time)
    return model


def frequencies(omega: Any, dt: float | None = None) -> Array:
    """Angular frequencies of an argument; up to that of Nyquist where a sample time is given."""
    w = np.ascontiguousarray(np.atleast_1d(as_floats(omega, "omega")), dtype=np.float64)
    if w.ndim != 1 or w.size == 0 or not np.isfinite(w).all() or (w < 0).any():
        raise InputError("omega must be a list of finite angular frequencies in rad/s, none of them negative")
    if dt is not None and w.max() > np.pi / dt * (1 + 1e-9):
        raise InputError(
            f"omega reaches {w.max():.6g} rad/s, but a model of dt={dt:g} s shows nothing above its Nyquist frequency of {np.pi / dt:.6g} rad/s "
            f"({0.5 / dt:.6g} Hz); leave these frequencies out"
        )
    return w


def _frozen(x: Array) -> Array:
    copy = np.array(x, dtype=np.float64, order="C")
    copy.flags.writeable = False
    return copy


def _names(given: Any, what: str, letter: str, count: int) -> tuple[str, ...]:
    """Names of channels; numbered where none are given."""
    if given is None:
        return tuple(_numbered(letter, count))
    names = tuple(listed(given, what, "names"))
    if not all(isinstance(name, str) for name in names):
        raise InputError(f"{what} is {given!r}, but must be a list of names")
    if len(names) != count:
        raise InputError(f"{what} has {len(names)} names, but d has {count}")
    return names


def _numbered(letter: str, count: int) -> list[str]:
    return [letter] if count == 1 else [f"{letter}{k + 1}" for k in range(count)]


def _plain(name: str) -> str:
    """Names of python-control have no dots."""
    return name.replace(".", "_").replace(" ", "_")


def _signal(values: Any, what: str, channels: int) -> Array:
    """A signal, samples x channels; one channel may be a list."""
    array = as_floats(values, what)
    if array.ndim == 0:
        made = f"numpy.random.default_rng(1).standard_normal((samples, {channels}))" if what == "noise" else f"numpy.ones((samples, {channels}))"
        raise InputError(f"{what} is the number {array:g}, but must be a signal, samples x {channels}; give {array:g} * {made}")
    array = array.reshape(-1, 1) if array.ndim == 1 and channels == 1 else array
    if array.ndim != 2 or array.shape[1] != channels:
        found = " x ".join(map(str, array.shape))
        raise InputError(f"{what} is {found}, but must be samples x {channels}")
    return array
