"""Figures as matplotlib axes. matplotlib is imported when a figure is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ._arrays import Array
from ._checks import place, truth
from ._errors import InputError
from ._model import FrequencyResponse, Model
from ._optional import need


def _channels(response: FrequencyResponse, output: int, input: int) -> None:
    _, p, m = response.values.shape
    for what, value, count in (("output", output, p), ("input", input, m)):
        place(value, what, count, f"the model has {count} {what}s")


def _axes(ax: Any) -> Any:
    """Axes of the caller, or new ones."""
    if ax is None:
        return need("matplotlib.pyplot").subplots(layout="constrained")[1]
    if not hasattr(ax, "semilogx"):
        raise InputError(f"ax is {ax!r}, but must be matplotlib axes, as plt.subplots() returns")
    return ax


def bode(
    responses: Sequence[FrequencyResponse],
    ax: Any = None,
    *,
    region: bool = True,
    output: int = 0,
    input: int = 0,
    measured: FrequencyResponse | None = None,
) -> Any:
    """Draw magnitude in dB and phase in degrees over the frequency in Hz; returns both axes."""
    if ax is None:
        _, ax = need("matplotlib.pyplot").subplots(2, 1, sharex=True, layout="constrained")
    pair = ax.ravel().tolist() if isinstance(ax, np.ndarray) else list(ax) if isinstance(ax, (list, tuple)) else []
    if len(pair) != 2:
        raise InputError("ax must be a pair of axes, for magnitude and phase, as plt.subplots(2, 1) returns")
    upper, lower = (_axes(one) for one in pair)
    region = truth(region, "region")
    all_of: list[tuple[FrequencyResponse, dict[str, Any]]] = [(r, {}) for r in responses]
    if measured is not None:
        all_of.append((measured, {"color": "0.6", "linewidth": 0.8, "zorder": 1}))
    for response, style in all_of:
        _channels(response, output, input)
        db = 20 * np.log10(response.magnitude[:, output, input])
        (line,) = upper.semilogx(response.hz, db, label=response.name, **style)
        phase = response.phase[:, output, input]
        if response is measured and responses:
            phase = _beside(response, responses[0], output, input)
        lower.semilogx(response.hz, np.degrees(phase), color=line.get_color(), **_but(style))
        if region and response.low is not None and response.high is not None:
            bounds = [np.maximum(b[:, output, input], 1e-300) for b in (response.low, response.high)]
            low, high = (20 * np.log10(b) for b in bounds)
            upper.fill_between(response.hz, np.maximum(low, db - 60), high, color=line.get_color(), alpha=0.25, linewidth=0)
    upper.set_ylabel("magnitude, dB")
    lower.set_ylabel("phase, degrees")
    lower.set_xlabel("frequency, Hz")
    upper.legend()
    return np.array([upper, lower])


def _beside(measured: FrequencyResponse, model: FrequencyResponse, output: int, input: int) -> Array:
    """The phase of a measured response within half a turn of that of a model: noise has no continuous phase."""
    reference = np.interp(measured.omega, model.omega, model.phase[:, output, input])
    turned = np.angle(measured.values[:, output, input] * np.exp(-1j * reference))
    found: Array = reference + turned
    return found


def _but(style: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in style.items() if key != "color"}


def nyquist(response: FrequencyResponse, ax: Any = None, *, output: int = 0, input: int = 0) -> Any:
    """Draw the response in the complex plane with its ellipses; returns the axes."""
    ax = _axes(ax)
    _channels(response, output, input)
    values = response.values[:, output, input]
    (line,) = ax.plot(values.real, values.imag, label=response.name)
    if response.covariance is not None and response.ellipse is not None:
        from matplotlib.patches import Ellipse

        for value, (rr, ri, ii) in zip(values, response.covariance[:, output, input], strict=True):
            sizes, axes = np.linalg.eigh(np.array([[rr, ri], [ri, ii]]))
            width, height = 2 * np.sqrt(np.maximum(sizes, 0) * response.ellipse)
            angle = np.degrees(np.arctan2(axes[1, 0], axes[0, 0]))
            at = (value.real, value.imag)
            ax.add_patch(Ellipse(at, width, height, angle=angle, color=line.get_color(), alpha=0.1, linewidth=0))
    ax.plot(-1, 0, "k+")
    ax.set_xlabel("real part")
    ax.set_ylabel("imaginary part")
    ax.legend()
    return ax


def poles(models: Sequence[Model], ax: Any = None) -> Any:
    """Draw poles in the z plane with the unit circle; returns the axes."""
    ax = _axes(ax)
    circle = np.exp(2j * np.pi * np.linspace(0, 1, 361))
    ax.plot(circle.real, circle.imag, color="0.7", linewidth=0.8)
    for model in models:
        ax.plot(model.poles.real, model.poles.imag, "x", label=model.name)
    ax.set_aspect("equal")
    ax.set_xlabel("real part of z")
    ax.set_ylabel("imaginary part of z")
    ax.legend()
    return ax


def fit(measured: Array, predicted: Array, dt: float, record: str, ax: Any = None) -> Any:
    """Draw measured and predicted output over time; returns the axes."""
    ax = _axes(ax)
    t = np.arange(len(measured)) * dt
    ax.plot(t, measured, label=f"measured, {record}", linewidth=0.8)
    ax.plot(t, predicted, label="predicted", linewidth=0.8)
    ax.set_xlabel("time, s")
    ax.legend()
    return ax
