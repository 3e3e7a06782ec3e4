"""Figures of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _plot
from ._arrays import Array, as_floats
from ._checks import kind, listed, place, text
from ._errors import InputError
from ._model import Complex, FrequencyResponse
from ._names import NO_PLANTS, RECOMMENDED, label_of

if TYPE_CHECKING:
    from ._result import Run

#: Samples of a record that can be told apart in a figure.
_READABLE = 800


class Plots:
    """Figures of a run; each returns matplotlib axes."""

    def __init__(self, run: Run) -> None:
        self._run = run

    def __repr__(self) -> str:
        return "<youla.Plots: bode, nyquist, loop, poles, parts, fit, compare>"

    def _labels(self) -> _plot.Labels:
        """Names of outputs and inputs with their units."""
        named = [[f"{name}, {unit}" if unit else name for name, unit in channels] for channels in self._run._native.ports()]
        return named[1], named[0]

    def bode(
        self,
        models: Any = None,
        ax: Any = None,
        *,
        omega: Any = None,
        output: int | str | None = None,
        input: int | str | None = None,
        region: bool = True,
    ) -> Any:
        """Draw magnitude and phase of models with their regions, beside the measured response, as points.

        Parameters
        ----------
        models : str or list of str, optional
            Names; the recommended and the nominal model when absent.
        ax : matplotlib axes, optional
            Where to draw: a pair for one entry, 2 p x m for all.
        omega : array_like, optional
            Angular frequencies, rad/s.
        output, input : int or str, optional
            Channels, by name or counted from 0; all when absent.
        region : bool
            Whether to draw the 95 % bands.

        Returns
        -------
        ndarray of matplotlib axes
            Magnitude above phase, (2,) for one entry and (2 p, m) for several.
        """
        names = self._names(models, (RECOMMENDED, "nominal"))
        responses = [self._run.frequency_response(omega, model=key) for key in names]
        measured = self._run.measured_response
        coherence = None if measured is None else self._coherence(measured.values.shape)
        entry = self._entry(output, input)
        return _plot.bode(responses, ax, *entry, region=region, measured=measured, coherence=coherence, labels=self._labels())

    def _number(self, channel: Any, what: str) -> Any:
        """The number of a channel that is named; another value as it is."""
        names = [name for name, _ in self._run._native.ports()[what == "output"]]
        if not isinstance(channel, str):
            return channel
        if channel not in names:
            raise InputError(f"{what} is {channel!r}, but the {what}s are {', '.join(names)}")
        return names.index(channel)

    def _entry(self, output: Any, input: Any) -> tuple[Any, Any]:
        return self._number(output, "output"), self._number(input, "input")

    def _names(self, models: Any, usual: Sequence[str]) -> list[str]:
        there = self._run.models
        return [key for key in usual if key in there] if models is None else listed(models, "models", "names of models")

    def _coherence(self, shape: tuple[int, ...]) -> Array | None:
        """The coherence of the measured response as the report has it."""
        found: Array = np.ones(shape)
        for entry in self._run._page["frequency"]["indirect"]:
            values = np.array([np.nan if c is None else c for c in entry["coherence"]], dtype=np.float64)
            if len(values) != len(found):
                return None
            found[:, entry["output"], entry["input"]] = values
        return found

    def _loop(self, model: str, omega: Any) -> tuple[Array, Complex, Complex, Any]:
        """Frequencies in Hz, loop gain of each output with all other loops closed, G K, and the response of the model."""
        if text(model, "model") in NO_PLANTS:
            plants = [key for key in self._run.models if key not in NO_PLANTS]
            raise InputError(f"model {model!r} is no plant of the loop; choose of {', '.join(plants)}")
        found = self._run.frequency_response(omega, model=model)
        k = self._run.model("controller").frequency_response(found.omega).values
        if not np.any(k):
            raise InputError("the controller of this run is 0, so that there is no loop; draw run.plot.bode()")
        # The controller has positive feedback: the loop gain of the usual convention is -G K.
        gain = -found.values @ k
        s = np.linalg.inv(np.eye(gain.shape[1]) + gain)
        alone: Complex = np.asarray(1 / np.diagonal(s, axis1=1, axis2=2) - 1, dtype=np.complex128)
        return found.hz, alone, gain, found

    def nyquist(self, model: str = RECOMMENDED, ax: Any = None, *, omega: Any = None, output: int | str | None = None) -> Any:
        """Draw the loop gain in the complex plane with -1, its margins, and the 95 % ellipses of a loop of one channel.

        Parameters
        ----------
        model : str
            Name of the model of the plant.
        ax : matplotlib axes, optional
            Where to draw.
        omega : array_like, optional
            Angular frequencies, rad/s; those of the report when absent.
        output : int or str, optional
            Channel at which the loop is opened, all others closed, by name or counted from 0; each of them when absent.

        Returns
        -------
        matplotlib axes
            With the convention of negative feedback: -1 is the critical point.
        """
        hz, alone, gain, found = self._loop(model, omega)
        columns = self._opened(output, alone.shape[1])
        ellipses = None
        if gain.shape[1:] == (1, 1) == found.values.shape[1:] and found.covariance is not None and found.ellipse is not None:
            k = gain[:, 0, 0] / found.values[:, 0, 0]
            rr, ri, ii = found.covariance[:, 0, 0].T * found.ellipse
            # dL = k dG turns and stretches the ellipse.
            a, b = k.real, k.imag
            turned = (a * a * rr - 2 * a * b * ri + b * b * ii, a * b * (rr - ii) + (a * a - b * b) * ri, b * b * rr + 2 * a * b * ri + a * a * ii)
            ellipses = np.stack(turned, axis=1)
        names, shown = self._named(columns), alone[:, columns]
        return _plot.nyquist(shown, ellipses, names, [_margins(hz, x) for x in shown.T], ax)

    def _opened(self, output: int | str | None, count: int) -> list[int]:
        number = self._number(output, "output")
        return list(range(count)) if number is None else [place(number, "output", count, f"the loop has {count} outputs")]

    def _named(self, columns: list[int]) -> list[str]:
        outputs = [name for name, _ in self._run._native.ports()[1]]
        return ["loop gain"] if len(outputs) == 1 else [f"opened at {outputs[k]}" for k in columns]

    def loop(self, model: str = RECOMMENDED, ax: Any = None, *, omega: Any = None, output: int | str | None = None) -> Any:
        """Draw the loop gain with its margins, and sensitivity S and complementary sensitivity T with their peaks.

        Parameters
        ----------
        model, omega, output
            As for `nyquist`.
        ax : three matplotlib axes, optional
            Where to draw.

        Returns
        -------
        ndarray of matplotlib axes, (3,)
            Magnitude, phase, and largest singular values of ``S = (I + L)^-1`` and ``T = I - S``.
        """
        hz, alone, gain, _ = self._loop(model, omega)
        columns = self._opened(output, alone.shape[1])
        s = np.linalg.inv(np.eye(gain.shape[1]) + gain)
        sizes = [(name, np.linalg.norm(x, 2, axis=(1, 2))) for name, x in (("S", s), ("T", np.eye(gain.shape[1]) - s))]
        shown = alone[:, columns]
        return _plot.loop(hz, shown, sizes, self._named(columns), [_margins(hz, x) for x in shown.T], ax)

    def parts(self, ax: Any = None, *, output: int | str | None = None, input: int | str | None = None) -> Any:
        """Draw the deviation of the recommended response by its causes, beside its magnitude.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Where to draw, p x m for all entries.
        output, input : int or str, optional
            Channels, by name or counted from 0; all when absent.

        Returns
        -------
        ndarray of matplotlib axes, p x m
            Noise of the records, choice of the model, variation between records, distortion, and the whole, in dB.
        """
        found = self._run.summary["recommended"]
        if found is None:
            raise InputError(f"the run has no recommended model: {self._run.summary['refused'].get('recommended', '')}")
        of = {"deviation": found["response_deviation"]["absolute"], **found["parts"]}
        deviations = {name: np.array(values, dtype=np.float64) for name, values in of.items()}
        hz = np.array(found["response_deviation"]["hz"])
        model = self._run.frequency_response(2 * np.pi * hz)
        return _plot.parts(hz, model, deviations, self._labels(), ax, *self._entry(output, input))

    def compare(
        self, runs: Any, ax: Any = None, *, model: str = RECOMMENDED, omega: Any = None, output: int | str | None = None, input: int | str | None = None
    ) -> Any:
        """Draw the responses of one model of this and other runs with their regions.

        Parameters
        ----------
        runs : Run or sequence of Run
            The other runs, with the same numbers of inputs and outputs.
        model : str
            Name of the model.
        ax, omega, output, input
            As for `bode`.

        Returns
        -------
        ndarray of matplotlib axes
            As of `bode`.
        """
        others = [runs] if hasattr(runs, "frequency_response") else listed(runs, "runs", "youla.Run")
        for run in others:
            if not hasattr(run, "recommended"):
                raise InputError(f"runs has {kind(run)}, but must be a youla.Run or a list of them")
        responses: list[FrequencyResponse] = []
        for k, run in enumerate([self._run, *others]):
            response = run.frequency_response(omega, model=model)
            shapes = [x.values.shape[1:] for x in (response, *responses)]
            if shapes[0] != shapes[-1]:
                raise InputError(f"runs[{k - 1}] is {shapes[0][0]} x {shapes[0][1]}, but this run {shapes[-1][0]} x {shapes[-1][1]}; compare runs of one machine")
            label = run.name if [r.name for r in (self._run, *others)].count(run.name) == 1 else f"{run.name} ({k + 1})"
            responses.append(replace(response, name=label))
        return _plot.bode(responses, ax, *self._entry(output, input), labels=self._labels())

    def poles(self, models: Any = None, ax: Any = None) -> Any:
        """Draw the poles of models in the z plane.

        Parameters
        ----------
        models : str or list of str, optional
            Names; the recommended, the nominal and the Hansen model when absent.
        ax : matplotlib axes, optional
            Where to draw.

        Returns
        -------
        matplotlib axes
        """
        names = self._names(models, (RECOMMENDED, "nominal", "hansen"))
        return _plot.poles([self._run.model(key) for key in names], ax)

    def fit(
        self, record: int = 0, ax: Any = None, *, model: str = RECOMMENDED, output: int | str = 0, seconds: Any = None
    ) -> Any:
        """Draw a verification record beside its prediction by a model.

        Parameters
        ----------
        record : int
            Verification record, counted from 0.
        ax : matplotlib axes, optional
            Where to draw.
        model : str
            Name of the model.
        output : int or str
            Channel, by name or counted from 0.
        seconds : pair of float, optional
            Part of the record that is drawn, from its start; its middle 800 samples when absent.

        Returns
        -------
        matplotlib axes
            The time in seconds.
        """
        predictions = self._run.predictions
        held = f"the run has {len(predictions)} verification records (verify= of identify)"
        found = predictions[place(record, "record", len(predictions), held)]
        model = self._run._key(model)
        if model not in found.predicted:
            raise InputError(f"model {model!r} predicts nothing on {found.record!r}; choose of {', '.join(found.predicted)}")
        count = found.measured.shape[1]
        at = place(self._number(output, "output"), "output", count, f"the record has {count} outputs")
        t: Array = np.arange(len(found.measured), dtype=np.float64) * self._run.model("controller").dt
        rows = _part(t, seconds)
        fits = self._run.fits.get(model, {}).get(found.record)
        value = "" if fits is None or fits[at] is None else f", fit {fits[at]:.1f} % of {t[-1]:.3g} s"
        labels = (f"{found.record}{value}", self._labels()[0][at], label_of(model))
        return _plot.fit(t[rows], found.measured[rows, at], found.predicted[model][rows, at], labels, ax)


def _part(t: Array, seconds: Any) -> slice:
    """Rows of a record that are drawn."""
    if seconds is None:
        first = max(0, (len(t) - _READABLE) // 2)
        return slice(first, first + _READABLE)
    edges = np.ravel(as_floats(seconds, "seconds"))
    if edges.size != 2 or not 0 <= edges[0] < edges[1]:
        raise InputError(f"seconds is {seconds!r}, but must be the start and the end of a part of the record, such as (0, 2)")
    first, last = np.searchsorted(t, edges)
    if last - first < 2:
        raise InputError(f"seconds is {seconds!r}, but the record lasts {t[-1]:.4g} s; give a part of it")
    return slice(int(first), int(last))


def _margins(hz: Array, gain: Complex) -> list[tuple[float, complex, str]]:
    """Where the loop gain crosses the unit circle and the negative real axis nearest to -1: frequency, value, margin."""
    found: list[tuple[float, complex, str]] = []
    crossed = np.flatnonzero(np.diff(np.sign(np.abs(gain) - 1))).tolist()
    at_one = [_between(hz, gain, np.abs(gain) - 1, k) for k in crossed]
    if at_one:
        at, value = min(at_one, key=lambda x: abs(x[1] + 1))
        found.append((at, value, f"phase margin {abs(np.degrees(np.angle(-value))):.3g}°"))
    turned = [k for k in np.flatnonzero(np.diff(np.sign(gain.imag))).tolist() if gain[k].real < 0 and gain[k + 1].real < 0]
    at_axis = [_between(hz, gain, gain.imag, k) for k in turned]
    above = [x for x in at_axis if -1 < x[1].real < 0]
    below = [x for x in at_axis if x[1].real < -1]
    for side in (above, below):
        if side:
            at, value = min(side, key=lambda x: abs(x[1] + 1))
            found.append((at, value, f"gain margin {1 / abs(value):.3g}"))
    return found


def _between(hz: Array, gain: Complex, level: Array, k: int) -> tuple[float, complex]:
    """Frequency and value where a level changes its sign between two points, linearly."""
    share = level[k] / (level[k] - level[k + 1])
    at = np.exp(np.log(hz[k]) + share * (np.log(hz[k + 1]) - np.log(hz[k]))) if hz[k] > 0 else hz[k + 1]
    return float(at), complex(gain[k] + share * (gain[k + 1] - gain[k]))
