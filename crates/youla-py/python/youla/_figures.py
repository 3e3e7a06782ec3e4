"""Figures of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import _plot
from ._checks import listed, place, text
from ._errors import InputError

if TYPE_CHECKING:
    from ._result import Run

#: Name of the recommended model among the models of a run.
RECOMMENDED = "likelihood"


class Plots:
    """Figures of a run; each returns matplotlib axes."""

    def __init__(self, run: Run) -> None:
        self._run = run

    def bode(
        self, models: Any = None, ax: Any = None, *, omega: Any = None, output: int = 0, input: int = 0, region: bool = True
    ) -> Any:
        """Draw magnitude and phase of models with their regions, beside the measured response.

        Parameters
        ----------
        models : str or list of str, optional
            Names; the recommended and the nominal model when absent.
        ax : pair of matplotlib axes, optional
            Where to draw.
        omega : array_like, optional
            Angular frequencies, rad/s.
        output, input : int
            Channels, counted from 0.
        region : bool
            Whether to draw the 95 % bands.

        Returns
        -------
        ndarray of matplotlib axes
            Magnitude and phase.
        """
        names = [key for key in (RECOMMENDED, "nominal") if key in self._run.models]
        if models is not None:
            names = listed(models, "models", "names of models")
        responses = [self._run.frequency_response(omega, model=key) for key in names]
        measured = self._run.measured_response
        return _plot.bode(responses, ax, region=region, output=output, input=input, measured=measured)

    def nyquist(self, model: str = RECOMMENDED, ax: Any = None, *, omega: Any = None, output: int = 0, input: int = 0) -> Any:
        """Draw the response of a model in the complex plane with its 95 % ellipses.

        Parameters
        ----------
        model : str
            Name of the model.
        ax : matplotlib axes, optional
            Where to draw.
        omega : array_like, optional
            Angular frequencies, rad/s; those of the report when absent.
        output, input : int
            Channels, counted from 0.

        Returns
        -------
        matplotlib axes
        """
        return _plot.nyquist(self._run.frequency_response(omega, model=model), ax, output=output, input=input)

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
        names = [key for key in (RECOMMENDED, "nominal", "hansen") if key in self._run.models]
        if models is not None:
            names = listed(models, "models", "names of models")
        return _plot.poles([self._run.model(key) for key in names], ax)

    def fit(self, record: int = 0, ax: Any = None, *, model: str = RECOMMENDED, output: int = 0) -> Any:
        """Draw a verification record beside its prediction by a model.

        Parameters
        ----------
        record : int
            Verification record, counted from 0.
        ax : matplotlib axes, optional
            Where to draw.
        model : str
            Name of the model.
        output : int
            Channel, counted from 0.

        Returns
        -------
        matplotlib axes
            The time in seconds.
        """
        predictions = self._run.predictions
        held = f"the run has {len(predictions)} verification records (verify= of identify)"
        found = predictions[place(record, "record", len(predictions), held)]
        if text(model, "model") not in found.predicted:
            raise InputError(f"model {model!r} predicts nothing on {found.record!r}; choose of {', '.join(found.predicted)}")
        count = found.measured.shape[1]
        place(output, "output", count, f"the record has {count} outputs")
        dt = self._run.model("controller").dt
        return _plot.fit(found.measured[:, output], found.predicted[model][:, output], dt, found.record, ax)
