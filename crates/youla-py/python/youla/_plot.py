"""Figures as matplotlib axes. matplotlib is imported when a figure is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ._arrays import Array
from ._checks import place, truth
from ._errors import InputError
from ._model import Complex, FrequencyResponse, Model
from ._optional import need

#: Most measured points of an entry: more of them hide the models.
_POINTS = 200
#: Measured points of less coherence are drawn pale, and their phase, which is noise, not at all.
_COHERENT = 0.5
#: Names of outputs and inputs with their units.
Labels = tuple[Sequence[str], Sequence[str]]
#: Entries of coherence, (n, p, m), beside a measured response.
Coherence = Array | None


def _axes(ax: Any, size: tuple[float, float] = (6.4, 4.8)) -> Any:
    """Axes of the caller, or new ones."""
    if ax is None:
        return need("matplotlib.pyplot").subplots(layout="constrained", figsize=size)[1]
    if not hasattr(ax, "semilogx") or not hasattr(ax, "name"):
        raise InputError(f"ax is {ax!r}, but must be matplotlib axes, as plt.subplots() returns")
    if ax.name != "rectilinear":
        raise InputError(f"ax has the projection {ax.name!r}, but the figure needs rectangular axes; leave projection= and polar= out of plt.subplots()")
    return ax


def grid(ax: Any, rows: int, columns: int, size: tuple[float, float]) -> Any:
    """Axes of the caller, or new ones, rows x columns; `size` is that of one of them in inches."""
    if ax is None:
        figure = (max(6.4, 1 + size[0] * columns), max(4.8, size[1] * rows))
        return need("matplotlib.pyplot").subplots(rows, columns, sharex=True, squeeze=False, figsize=figure, layout="constrained")[1]
    flat = ax.ravel().tolist() if isinstance(ax, np.ndarray) else list(ax) if isinstance(ax, (list, tuple)) else [ax]
    if len(flat) != rows * columns:
        what = "a pair of axes, for magnitude and phase" if (rows, columns) == (2, 1) else f"{rows} x {columns} axes"
        raise InputError(f"ax must be {what}, as plt.subplots({rows}, {columns}) returns; or choose output= and input=")
    return np.array([_axes(one) for one in flat], dtype=object).reshape(rows, columns)


def chosen(response: FrequencyResponse, output: int | None, input: int | None) -> tuple[list[int], list[int]]:
    """Outputs and inputs that are drawn: all, or one."""
    _, p, m = response.values.shape
    named = (("output", output, p), ("input", input, m))
    outputs, inputs = (
        list(range(count)) if value is None else [place(value, what, count, f"the model has {count} {what}s")]
        for what, value, count in named
    )
    return outputs, inputs


def bode(
    responses: Sequence[FrequencyResponse],
    ax: Any = None,
    output: int | None = None,
    input: int | None = None,
    *,
    region: bool = True,
    measured: FrequencyResponse | None = None,
    coherence: Coherence = None,
    labels: Labels | None = None,
) -> Any:
    """Draw magnitude above phase of every entry over the frequency in Hz; returns the axes, (2,) for one entry and (2 p, m) for several."""
    region = truth(region, "region")
    both = [*responses, *([] if measured is None else [measured])]
    if not both:
        raise InputError("models is empty; name at least one model of the run")
    outputs, inputs = chosen(both[0], output, input)
    axes = grid(ax, 2 * len(outputs), len(inputs), (3.6, 1.8))
    for row, i in enumerate(outputs):
        for column, j in enumerate(inputs):
            upper, lower = axes[2 * row, column], axes[2 * row + 1, column]
            if measured is not None:
                _measured(upper, lower, measured, responses, (i, j), None if coherence is None else coherence[:, i, j])
            for response in responses:
                _entry(upper, lower, response, (i, j), region)
            if labels is not None:
                upper.set_title(f"{labels[1][j]} → {labels[0][i]}", fontsize="medium")
            for one in (upper, lower):
                one.grid(True, which="both", color="0.9", linewidth=0.5)
            if column == 0:
                upper.set_ylabel("magnitude, dB")
                lower.set_ylabel("phase, degrees")
    for one in axes[-1]:
        one.set_xlabel("frequency, Hz")
    axes[0, -1].legend(fontsize="small")
    return axes.ravel() if axes.size == 2 else axes


def _entry(upper: Any, lower: Any, response: FrequencyResponse, entry: tuple[int, int], region: bool) -> None:
    at = (slice(None), *entry)
    db = _db(response.magnitude[at])
    (line,) = upper.semilogx(response.hz, db, label=response.name)
    lower.semilogx(response.hz, np.degrees(response.phase[at]), color=line.get_color())
    if region and response.low is not None and response.high is not None:
        low, high = _db(response.low[at]), _db(response.high[at])
        upper.fill_between(response.hz, np.maximum(low, db - 60), high, color=line.get_color(), alpha=0.25, linewidth=0)


def _measured(
    upper: Any, lower: Any, measured: FrequencyResponse, models: Sequence[FrequencyResponse], entry: tuple[int, int], coherence: Any
) -> None:
    """Points, as many in each decade; the phase within half a turn of the first model."""
    values, w = measured.values[:, entry[0], entry[1]], measured.omega
    keep = np.flatnonzero(w > 0)
    if keep.size > _POINTS:
        steps = np.geomspace(w[keep[0]], w[keep[-1]], _POINTS)
        keep = np.unique(np.clip(np.searchsorted(w, steps), keep[0], keep[-1]))
    # A coherence that is not known counts as one.
    shown = np.ones(len(w)) if coherence is None else np.nan_to_num(coherence, nan=1.0)
    good, poor = keep[shown[keep] >= _COHERENT], keep[shown[keep] < _COHERENT]
    style = {"linestyle": "none", "marker": ".", "markersize": 4, "zorder": 1}
    upper.semilogx(w[poor] / (2 * np.pi), _db(np.abs(values[poor])), color="0.85", **style)
    upper.semilogx(w[good] / (2 * np.pi), _db(np.abs(values[good])), color="0.45", label=measured.name, **style)
    phase = np.unwrap(np.angle(values[good]))
    if models:
        reference = np.interp(w[good], models[0].omega, models[0].phase[:, entry[0], entry[1]])
        phase = reference + np.angle(values[good] * np.exp(-1j * reference))
    lower.semilogx(w[good] / (2 * np.pi), np.degrees(phase), color="0.45", **style)


def _db(magnitude: Array) -> Array:
    found: Array = 20 * np.log10(np.maximum(magnitude, 1e-300))
    return found


def nyquist(gains: Complex, ellipses: Array | None, names: Sequence[str], margins: Sequence[Any], ax: Any = None) -> Any:
    """Draw loop gains, (n, channels), with -1, the unit circle and equal axes; `ellipses` are covariances with their size; returns the axes."""
    ax = _axes(ax, (8.5, 5.2))
    circle = np.exp(2j * np.pi * np.linspace(0, 1, 361))
    ax.plot(circle.real, circle.imag, color="0.8", linewidth=0.8, zorder=0)
    reach = 2.0
    for k, name in enumerate(names):
        gain = gains[:, k]
        (line,) = ax.plot(gain.real, gain.imag, label=name)
        ax.plot(gain.real, -gain.imag, color=line.get_color(), linewidth=0.6, linestyle=":")
        if ellipses is not None and k == 0:
            _ellipses(ax, gain, ellipses, line.get_color())
        for hz, value, label in margins[k]:
            ax.plot(value.real, value.imag, "o", color=line.get_color(), markersize=5, label=f"{label} at {hz:.3g} Hz")
            reach = max(reach, 1.2 * abs(value)) if abs(value) < 6 else reach
    ax.plot(-1, 0, "k+", markersize=12, markeredgewidth=2, label="-1")
    ax.axhline(0, color="0.9", linewidth=0.6, zorder=0)
    ax.axvline(0, color="0.9", linewidth=0.6, zorder=0)
    ax.set_aspect("equal")
    ax.set_xlim(-reach - 0.5, reach - 0.5)
    ax.set_ylim(-reach, reach)
    ax.set_xlabel("real part of the loop gain")
    ax.set_ylabel("imaginary part")
    _beside(ax)
    return ax


def _ellipses(ax: Any, gain: Complex, covariances: Array, color: Any) -> None:
    from matplotlib.patches import Ellipse

    for value, (rr, ri, ii) in zip(gain, covariances, strict=True):
        sizes, axes = np.linalg.eigh(np.array([[rr, ri], [ri, ii]]))
        width, height = 2 * np.sqrt(np.maximum(sizes, 0))
        angle = np.degrees(np.arctan2(axes[1, 0], axes[0, 0]))
        ax.add_patch(Ellipse((value.real, value.imag), width, height, angle=angle, color=color, alpha=0.1, linewidth=0))


def loop(hz: Array, gains: Complex, sensitivities: Sequence[tuple[str, Array]], names: Sequence[str], margins: Sequence[Any], ax: Any) -> Any:
    """Draw loop gains, their phase, and sensitivities with their peaks; returns three axes."""
    axes = grid(ax, 3, 1, (7.4, 2.1)).ravel()
    for k, name in enumerate(names):
        (line,) = axes[0].semilogx(hz, _db(np.abs(gains[:, k])), label=name)
        phase = np.degrees(np.unwrap(np.angle(gains[:, k])))
        axes[1].semilogx(hz, phase, color=line.get_color())
        for at, value, label in margins[k]:
            axes[0].plot(at, _db(np.abs(np.array([value])))[0], "o", color=line.get_color(), markersize=5, label=f"{label} at {at:.3g} Hz")
            axes[1].plot(at, np.interp(at, hz, phase), "o", color=line.get_color(), markersize=5)
    axes[0].axhline(0, color="0.4", linewidth=0.8)
    for name, values in sensitivities:
        peak = int(np.argmax(values))
        label = f"{name}, peak {values[peak]:.3g} at {hz[peak]:.3g} Hz"
        (line,) = axes[2].semilogx(hz, _db(values), label=label)
        axes[2].plot(hz[peak], _db(values)[peak], "o", color=line.get_color(), markersize=5)
    for one, label in zip(axes, ("loop gain, dB", "phase, degrees", "sensitivity, dB"), strict=True):
        one.set_ylabel(label)
        one.grid(True, which="both", color="0.9", linewidth=0.5)
    axes[2].set_xlabel("frequency, Hz")
    _beside(axes[0])
    _beside(axes[2])
    return axes


def parts(hz: Array, model: FrequencyResponse, deviations: dict[str, Array], labels: Labels, ax: Any, output: Any, input: Any) -> Any:
    """Draw the magnitude of the model beside its deviation by causes, (n, p, m) each; returns the axes, p x m."""
    outputs, inputs = chosen(model, output, input)
    axes = grid(ax, len(outputs), len(inputs), (3.6, 2.6))
    for row, i in enumerate(outputs):
        for column, j in enumerate(inputs):
            one = axes[row, column]
            one.semilogx(model.hz, _db(model.magnitude[:, i, j]), color="0.7", linewidth=2, label="magnitude of the model")
            for name, values in deviations.items():
                style = {"color": "k", "linewidth": 1.5} if name == "deviation" else {"linewidth": 1.0}
                shown = np.where(values[:, i, j] > 0, values[:, i, j], np.nan)
                one.semilogx(hz, 20 * np.log10(shown), label=name, **style)
            one.set_title(f"{labels[1][j]} → {labels[0][i]}", fontsize="medium")
            one.grid(True, which="both", color="0.9", linewidth=0.5)
        axes[row, 0].set_ylabel("dB")
    for one in axes[-1]:
        one.set_xlabel("frequency, Hz")
    _beside(axes[0, -1])
    return axes


def poles(models: Sequence[Model], ax: Any = None) -> Any:
    """Draw poles in the z plane with the unit circle; returns the axes."""
    ax = _axes(ax, (7.4, 5.2))
    circle = np.exp(2j * np.pi * np.linspace(0, 1, 361))
    ax.plot(circle.real, circle.imag, color="0.7", linewidth=0.8, zorder=0)
    for k, model in enumerate(models):
        marker = "x+12"[k % 4]
        ax.plot(model.poles.real, model.poles.imag, linestyle="none", marker=marker, markersize=9 - k % 4, label=model.name)
    ax.set_aspect("equal")
    ax.set_xlabel("real part of z")
    ax.set_ylabel("imaginary part of z")
    _beside(ax)
    return ax


def _beside(ax: Any) -> None:
    """The legend beside the axes, where it hides nothing."""
    if ax.get_legend_handles_labels()[1]:
        ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, fontsize="small")


def fit(t: Array, measured: Array, predicted: Array, labels: tuple[str, str, str], ax: Any = None) -> Any:
    """Draw measured and predicted output and their difference over time; returns the axes."""
    ax = _axes(ax, (8.5, 4.0))
    title, output, model = labels
    ax.plot(t, measured, label="measured", color="0.45", linewidth=1.2)
    ax.plot(t, predicted, label=f"predicted, {model}", linewidth=1.0)
    ax.plot(t, measured - predicted, label="difference", color="C3", linewidth=0.6)
    ax.set_xlim(t[0], t[-1])
    ax.set_title(title, fontsize="medium")
    ax.set_xlabel("time, s")
    ax.set_ylabel(output)
    _beside(ax)
    return ax
