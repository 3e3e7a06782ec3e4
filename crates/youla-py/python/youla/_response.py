"""Measured frequency responses as data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ._arrays import Array, as_floats, limited, positive
from ._checks import kind, text
from ._errors import InputError
from ._model import Complex, FrequencyResponse, _names
from ._sources import _is
from ._types import Table


class Response:
    """A measured frequency response: of a loop from its excitation d to u and y, or of the plant alone.

    Parameters
    ----------
    omega : array_like, (n,), or FrequencyResponse or control.FrequencyResponseData
        Angular frequencies, rad/s, increasing; or a response of the plant with its frequencies.
    hz : array_like, (n,), optional
        Frequencies in Hz, in place of `omega`.
    ud, yd : array_like of complex, optional
        Responses of the loop from the excitation d at the plant input to u, (n, m, m), and to y, (n, p, m); (n,) for one channel. With
        repetitions first, (r, n, m, m) and (r, n, p, m), their mean is taken, and its standard deviation where r is 2 or more.
    g : array_like of complex, optional
        Response of the plant from u to y, (n, p, m), in place of `ud` and `yd`; with repetitions first as well.
    sd : float, array_like or pair of them, optional
        Standard deviation, root mean square of the complex error: of `g`, or the pair of those of `ud` and `yd`.
    coherence : array_like or pair of them, optional
        Coherences, above 0 and at most 1, in the shape of `sd` and in place of it.
    dt : float, optional
        Sample time of the controller that samples the plant, seconds; that of nominal model or controller when absent.
    inputs, outputs : sequence of str, optional
        Names of the channels.
    name : str
        Name in reports.

    Examples
    --------
    >>> import numpy as np, youla
    >>> plant = youla.Model([[0.95]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    >>> hz = np.geomspace(0.1, 40, 60)
    >>> g = plant.frequency_response(2 * np.pi * hz).values[:, 0, 0]
    >>> s, rng = 1 / (1 + 2.0 * g), np.random.default_rng(1)
    >>> e, f = 1e-3 * rng.standard_normal((2, 60, 2)) @ [1, 1j]
    >>> measured = youla.Response(hz=hz, ud=s + e, yd=g * s + f, sd=2**0.5 * 1e-3)
    >>> run = youla.identify(measured, nominal=plant, controller=2.0, feedback="negative")
    >>> run.verdict.trusted, run.recommended.order
    (True, 1)
    """

    def __init__(
        self,
        omega: Any = None,
        *,
        hz: Any = None,
        ud: Any = None,
        yd: Any = None,
        g: Any = None,
        sd: Any = None,
        coherence: Any = None,
        dt: float | None = None,
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
        name: str = "response",
    ) -> None:
        if isinstance(omega, FrequencyResponse) or _is(omega, "control", "FrequencyResponseData"):
            if any(x is not None for x in (hz, ud, yd, g)):
                raise InputError(f"omega is {kind(omega)}, which holds frequencies and values; leave hz, ud, yd and g out")
            omega, g, sd, dt = _of_plant(omega, sd, coherence, dt)
        if (omega is None) == (hz is None):
            raise InputError("the frequencies are given twice or not at all; give either omega= in rad/s or hz=")
        if (g is None) == (ud is None and yd is None):
            raise InputError("give ud= and yd=, the responses of the loop, or g=, that of the plant")
        if g is None and (ud is None or yd is None):
            raise InputError(f"{'ud' if ud is None else 'yd'} is missing: a loop is told by both, from d to u and from d to y")
        if sd is not None and coherence is not None:
            raise InputError("sd and coherence are both given; leave one of them out")
        what = "omega" if hz is None else "hz"
        w = np.ravel(as_floats(omega if hz is None else hz, what)) * (1.0 if hz is None else 2 * np.pi)
        if w.size == 0 or not np.isfinite(w).all() or (w <= 0).any() or (np.diff(w) <= 0).any():
            raise InputError(f"{what} must be finite frequencies above 0, each above the one before it; sort them and leave 0 out")
        given = [("g", g)] if g is not None else [("ud", ud), ("yd", yd)]
        found = [_values(x, key, len(w)) for key, x in given]
        columns = found[0][0].shape[2]
        if any(x.shape[2] != columns for x, _ in found) or (g is None and found[0][0].shape[1] != columns):
            shapes = " and ".join(f"{key} is {x.shape}" for (key, _), (x, _) in zip(given, found, strict=True))
            raise InputError(f"{shapes}, but ud must be (n, m, m) and yd (n, p, m), with one excitation for each input")
        self._of_loop, self._in_hz, self.omega = g is None, hz is not None, w
        self.values: Complex = np.concatenate([x for x, _ in found], axis=1)
        self._variance, self._known = self._errors(sd, coherence, found)
        self.dt = None if dt is None else positive(dt, "dt")
        self.name = text(name, "name")
        self.inputs = _names(inputs, "inputs", "u", columns)
        self.outputs = _names(outputs, "outputs", "y", found[-1][0].shape[1])

    def _errors(self, sd: Any, coherence: Any, found: list[tuple[Complex, Array | None]]) -> tuple[Array | None, bool]:
        """Variances of all entries, and whether they are known in full."""
        shapes = [x.shape for x, _ in found]
        if sd is not None:
            deviation = np.concatenate(_parts(sd, "sd", shapes), axis=1)
            if not (np.isfinite(deviation).all() and (deviation >= 0).all()):
                raise InputError("sd must be finite and not negative: the root mean square of the complex error of each entry")
            return deviation**2, True
        if coherence is not None:
            share = np.concatenate(_parts(coherence, "coherence", shapes), axis=1)
            if not ((share > 0) & (share <= 1)).all():
                raise InputError("coherence must be above 0 and at most 1; leave out frequencies at which nothing is coherent")
            # (1 - c) / (2 n c) of the square, n the number of averages (Bendat and Piersol); 1 is rounded.
            return np.maximum(1 - share, 1e-6) / share * np.abs(self.values) ** 2, False
        if all(v is not None for _, v in found):
            return np.concatenate([v for _, v in found if v is not None], axis=1), True
        return None, False

    @property
    def hz(self) -> Array:
        """Frequencies, Hz."""
        return self.omega / (2 * np.pi)

    def __len__(self) -> int:
        return len(self.omega)

    def __repr__(self) -> str:
        of = "loop from d to u and y" if self._of_loop else "plant from u to y"
        errors = "unknown errors" if self._variance is None else "known errors" if self._known else "coherence"
        clock = "" if self.dt is None else f", dt={self.dt:g} s"
        band = f"{self.hz[0]:.4g} to {self.hz[-1]:.4g} Hz"
        return f"<youla.Response {self.name!r}: {len(self)} frequencies, {band}, {of}, {errors}{clock}>"

    def _table(self, dt: float) -> Table:
        above = self.omega > np.pi / dt * (1 + 1e-9)
        if above.any():
            unit = ", or give omega= in place of hz= where they are in rad/s" if self._in_hz else ""
            raise InputError(
                f"{self.name} reaches {self.hz[-1]:.4g} Hz, above the Nyquist frequency of {0.5 / dt:.4g} Hz of dt={dt:g} s; "
                f"leave these frequencies out, or check dt{unit}"
            )
        variance = None if self._variance is None else np.ascontiguousarray(self._variance)
        return self.omega, np.ascontiguousarray(self.values), variance, self._known, self._of_loop


def _of_plant(data: Any, sd: Any, coherence: Any, dt: float | None) -> tuple[Any, Any, Any, float | None]:
    """Frequencies, values, deviations and sample time of a response of youla or python-control."""
    if isinstance(data, FrequencyResponse):
        if sd is None and coherence is None and data.covariance is not None:
            sd = np.sqrt(data.covariance[..., 0] + data.covariance[..., 2])
        return data.omega, data.values, sd, dt
    own = getattr(data, "dt", None)
    own = None if own is None or isinstance(own, bool) or own == 0 else float(own)
    if dt is not None and own is not None and abs(own / dt - 1) > 1e-6:
        raise InputError(f"dt is {dt:g} s, but the response states {own:g} s; leave dt out")
    return data.omega, np.moveaxis(np.asarray(data.frdata), -1, 0), sd, own if dt is None else dt


def _values(given: Any, what: str, count: int) -> tuple[Complex, Array | None]:
    """A response, (n, rows, columns), and its variance where there are repetitions."""
    limited(given, what)
    try:
        array = np.asarray(given, dtype=np.complex128)
    except (TypeError, ValueError):
        raise InputError(f"{what} is {kind(given)}, but must be an array of complex numbers, (n, rows, columns)") from None
    array = array.reshape(-1, 1, 1) if array.ndim == 1 else array
    if array.ndim not in (3, 4) or array.shape[-3] != count:
        raise InputError(f"{what} is {array.shape}, but must be ({count}, rows, columns) for {count} frequencies; (n,) for one channel")
    bad = ~np.isfinite(array).all(axis=tuple(k for k in range(array.ndim) if k != array.ndim - 3))
    if bad.any():
        raise InputError(f"{what} is not finite at frequency {int(np.argmax(bad))}, counted from 0; leave this frequency out")
    if count > 1 and not array.imag.any():
        raise InputError(
            f"{what} is real at all frequencies, but a response has a phase; of dB and degrees give 10 ** (db / 20) * numpy.exp(1j * numpy.deg2rad(deg))"
        )
    if array.ndim == 3:
        return array, None
    repetitions = len(array)
    variance = None if repetitions < 2 else np.sum(np.abs(array - array.mean(0)) ** 2, axis=0) / (repetitions - 1) / repetitions
    return array.mean(axis=0), variance


def _parts(given: Any, what: str, shapes: list[tuple[int, ...]]) -> list[Array]:
    """Deviations or coherences in the shapes of the responses: one for all, or one for each."""
    pair = isinstance(given, (tuple, list)) and len(given) == len(shapes) == 2
    parts = list(given) if pair else [given] * len(shapes)
    found = []
    for part, shape in zip(parts, shapes, strict=True):
        array = as_floats(part, what)
        array = array.reshape(-1, 1, 1) if array.ndim == 1 else array
        try:
            found.append(np.broadcast_to(array, shape))
        except ValueError:
            raise InputError(
                f"{what} is {np.shape(part)}, but must be a number, or {shape} as the response; of ud and yd a pair"
            ) from None
    return found


def data_of(record: Any) -> Response | None:
    """A response where the data are one."""
    if isinstance(record, Response):
        return record
    if isinstance(record, FrequencyResponse) or _is(record, "control", "FrequencyResponseData"):
        return Response(record)
    return None
