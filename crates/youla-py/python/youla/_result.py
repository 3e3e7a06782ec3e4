"""The result of a run."""

from __future__ import annotations

import json
import os
from functools import cached_property
from typing import Any

import numpy as np

from ._arrays import Array
from ._checks import path_of, truth, write_file
from ._errors import InputError
from ._figures import Plots
from ._kept import Kept, Results, files_of, read_folder
from ._model import FrequencyResponse, Mode, Model, RealPole, _model_of, frequencies
from ._names import RECOMMENDED, key_of, label_of
from ._options import in_python
from ._optional import need
from ._pages import place_of_page
from ._verdict import Evidence, Prediction, Verdict, VerdictTest, defect


class Run:
    """Models of a plant with their evidence; made by `youla.identify` and `youla.demo`.

    Notes
    -----
    Models are named ``likelihood`` (the recommended one, also by ``recommended``), ``nominal``, ``hansen``, ``hansen_reduced``, ``direct``,
    ``grey_box``, ``true_plant`` (simulations), ``controller`` (positive feedback, u = K y), ``deviation`` (S) and
    ``new_controller``.

    Examples
    --------
    >>> import youla
    >>> run = youla.demo()
    >>> run.verdict.trusted, run.recommended.order
    (True, 2)
    >>> run.real_poles()[0].hz_interval is not None
    True
    """

    def __init__(self, native: Results) -> None:
        self._native = native

    @cached_property
    def _kept(self) -> Kept:
        """The files of the run: its state in a pickle, a copy and a bootstrap."""
        return Kept(files_of(self._native))

    def __reduce__(self) -> Any:
        return Run, (self._kept,)

    def __eq__(self, other: object) -> bool:
        """Whether another run has the same settings, records and results, bit by bit; the times of the stages may differ."""
        if not isinstance(other, Run):
            return NotImplemented
        return self is other or _results(self) == _results(other)

    def __hash__(self) -> int:
        return hash((self.name, self.settings))

    @cached_property
    def summary(self) -> dict[str, Any]:
        """summary.json: the figures of the run."""
        found: dict[str, Any] = json.loads(self._native.summary())
        return found

    @cached_property
    def _page(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self._native.page())
        return found

    @property
    def name(self) -> str:
        """Name of the machine."""
        return str(self.summary["name"])

    @property
    def settings(self) -> str:
        """The settings of the run as the text of a run.toml."""
        return self._native.settings()

    @cached_property
    def _dt(self) -> float:
        return self.model("controller").dt

    @property
    def models(self) -> tuple[str, ...]:
        """Names of the models that exist."""
        return tuple(self._native.models())

    def model(self, name: str = RECOMMENDED) -> Model:
        """Return a model by its name.

        Parameters
        ----------
        name : str
            One of `models`, or ``"recommended"``.

        Returns
        -------
        Model
            With the names of the channels and the sample time in seconds.

        Raises
        ------
        InputError
            For a model that does not exist.
        NumericalError
            For a model that was asked for and is impossible, with the reason.
        """
        key = self._key(name, "name")
        found = self._native.model(key)
        assert found is not None
        a, b, c, d, dt = found
        u, y = ([channel for channel, _ in channels] for channels in self._native.ports())
        if key in ("controller", "new_controller"):
            u, y = y, u
        elif key == "deviation":
            u, y = [f"alpha of {n}" for n in u], [f"beta of {n}" for n in y]
        dead_time = self.summary["recommended"]["dead_time"] if key == RECOMMENDED else ()
        return _model_of((a, b, c, d), dt, u, y, label_of(key), dead_time)

    def _key(self, name: Any, what: str = "model") -> str:
        return key_of(name, what, self.models, self.summary["refused"])

    @property
    def recommended(self) -> Model:
        """The recommended model; see `verdict` for whether it can be trusted."""
        return self.model()

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the recommended model can be trusted, with the evidence."""
        lines = tuple(in_python(line["text"]) for line in self._page["verdict"])
        defects = tuple(defect(f) for f in self._page.get("findings", ()) if f["status"] == "bad")
        found = self.summary["recommended"]
        if found is None:
            return Verdict(False, (str(self.summary["refused"].get("recommended", "no model is recommended")),), (), lines, defects=defects)
        evidence = tuple(Evidence(e["question"], e["figure"], e["limit"], e["holds"]) for e in found["evidence"])
        tests = tuple(VerdictTest(**{**test, "hz": test["hz"] and tuple(test["hz"])}) for test in found["tests"])
        bands = tuple((low, high) for low, high in found["bands"])
        ratio = (found["loop_ratio"], found["loop_ratio_hz"])
        return Verdict(found["trusted"], tuple(found["reasons"]), evidence, lines, tests, bands, *ratio, found.get("description"), defects)

    @property
    def fits(self) -> dict[str, dict[str, list[float | None]]]:
        """Fit in percent by model, verification record and output."""
        found = {key: entry["fit"] for key, entry in self.summary["methods"].items()}
        nominal = self.summary["nominal"]
        return found if nominal is None else {"nominal": nominal["fit"], **found}

    @property
    def predictions(self) -> tuple[Prediction, ...]:
        """Verification records beside the predictions of the models."""
        return tuple(Prediction(*found) for found in self._native.predictions())

    def modes(self, model: str = RECOMMENDED) -> tuple[Mode, ...]:
        """Return the oscillating modes of a model; `real_poles` are apart.

        Parameters
        ----------
        model : str
            One of `models`.

        Returns
        -------
        tuple of Mode
            Natural frequencies in Hz and damping ratios, with 95 % intervals where they are known.
        """
        found = self._listed(model, "modes")
        if found is None:
            return self.model(model).modes()
        return tuple(Mode(_number(m["hz"]), _number(m["zeta"]), _interval(m, "hz"), _interval(m, "zeta")) for m in found)

    def real_poles(self, model: str = RECOMMENDED) -> tuple[RealPole, ...]:
        """Return the real poles of a model.

        Parameters
        ----------
        model : str
            One of `models`.

        Returns
        -------
        tuple of RealPole
            Poles in z and their corner frequencies in Hz, with 95 % intervals where they are known.
        """
        found = self._listed(model, "real_poles")
        if found is None:
            return self.model(model).real_poles()
        return tuple(RealPole(p["z"], _number(p["hz"]), _interval(p, "hz")) for p in found)

    def _listed(self, model: str, key: str) -> list[dict[str, Any]] | None:
        """What summary.json lists of a model; `None` for one that it does not describe."""
        name = self._key(model)
        entry = self.summary["methods"].get(name)
        found: list[dict[str, Any]] | None = None if entry is None else (self.summary["recommended"] if name == RECOMMENDED else entry)[key]
        return found

    def frequency_response(self, omega: Any = None, *, model: str = RECOMMENDED) -> FrequencyResponse:
        """Return the response of a model with its confidence region where one is known.

        Parameters
        ----------
        omega : array_like, optional
            Angular frequencies, rad/s; those of the report when absent.
        model : str
            Name of the model.

        Returns
        -------
        FrequencyResponse
        """
        from ._identify import with_region

        w = frequencies(self._native.hz() * (2 * np.pi) if omega is None else omega, self._dt)
        key = self._key(model)
        values, known = self._native.response(key, w / (2 * np.pi))
        return with_region(w, values, known, label_of(key))

    @property
    def measured_response(self) -> FrequencyResponse | None:
        """The response that rests on no model, where an excitation is known and the record is longer than its window.

        The window, in samples, is ``frequency_response={"window": ...}`` of `identify`; unless stated it fits the record.
        """
        found = self._native.measured_response()
        if found is None:
            return None
        hz, values = found
        return FrequencyResponse(hz * (2 * np.pi), values, name="measured")

    def to_control(self, model: str = RECOMMENDED) -> Any:
        """Convert a model to python-control.

        Parameters
        ----------
        model : str
            One of `models`.

        Returns
        -------
        control.StateSpace
            In discrete time, with the names of the channels.
        """
        return self.model(model).to_control()

    def to_scipy(self, model: str = RECOMMENDED) -> Any:
        """Convert a model to SciPy.

        Parameters
        ----------
        model : str
            One of `models`.

        Returns
        -------
        scipy.signal.StateSpace
            In discrete time.
        """
        return self.model(model).to_scipy()

    def to_frame(self) -> Any:
        """Return a pandas data frame with a row for each model, verification record and output."""
        pd = need("pandas")
        rows = []
        outputs = [name for name, _ in self._native.ports()[1]]
        for key, entry in self.summary["methods"].items():
            about = {"model": key, "order": entry["order"], "stabilised": entry["stabilised_by_controller"]}
            fits = [(r, o, f) for r, of in entry["fit"].items() for o, f in zip(outputs, of, strict=True)]
            rows += [{**about, "record": r, "output": o, "fit": f} for r, o, f in fits] or [about]
        return pd.DataFrame(rows)

    def report(self, path: str | os.PathLike[str], *, replace: bool = False) -> None:
        """Write the report.

        Parameters
        ----------
        path : path
            HTML file that needs nothing else. A page of youla of that name is replaced.
        replace : bool
            Whether to replace any other file as well.

        Raises
        ------
        InputError
            For a name that does not end in .html, and where a file is there that youla did not write, unless `replace` is true.
        """
        write_file(place_of_page(path, "path", replace), "path", self._native.html())

    def save(self, folder: str | os.PathLike[str], *, replace: bool = False) -> str:
        """Write the run folder that ``youla identify`` writes.

        Parameters
        ----------
        folder : path
            A new folder.
        replace : bool
            Whether to replace a run that is there.

        Returns
        -------
        str
            Path of the folder.

        Raises
        ------
        InputError
            Where `folder` exists, unless `replace` is true and it holds a run.
        """
        place = path_of(folder, "folder")
        if os.path.isfile(place):
            raise InputError(f"folder is the file {place}; give a folder that is not there yet")
        if not truth(replace, "replace") and os.path.isdir(place) and os.listdir(place):
            what = "holds a run: give replace=True to replace it" if os.path.isfile(os.path.join(place, "files.txt")) else "is not empty: empty it"
            raise InputError(f"folder {place} {what}, or give another folder")
        return self._native.write(place, truth(replace, "replace"))

    @property
    def plot(self) -> Plots:
        """Figures as matplotlib axes: ``run.plot.bode()``, ``nyquist``, ``loop``, ``poles``, ``parts``, ``fit``, ``compare``."""
        return Plots(self)

    def __repr__(self) -> str:
        trusted = "trusted" if self.verdict else "not trusted"
        found = self.summary["recommended"]
        order = "no recommended model" if found is None else f"recommended order {found['order']}, {trusted}"
        return f"<youla.Run {self.name!r}: {order}; models {', '.join(self.models)}>"

    def _repr_html_(self) -> str:
        from ._html import page

        return page(self)


def _interval(entry: dict[str, Any], key: str) -> tuple[float, float] | None:
    bounds = entry.get(f"{key}_interval")
    return None if bounds is None or None in bounds else (bounds[0], bounds[1])


def _number(value: float | None) -> float:
    return float("nan") if value is None else value


#: Files with the times of the stages, or drawn from other files.
_TIMED = ("summary.json", "report.json", "report.html", "files.txt")


def _results(run: Run) -> tuple[dict[str, Any], dict[str, bytes]]:
    files = {name: content for name, content in run._kept.files.items() if name not in _TIMED}
    return {key: value for key, value in run.summary.items() if key != "seconds"}, files


def load(folder: str | os.PathLike[str]) -> Run:
    """Load a run from its folder.

    Parameters
    ----------
    folder : path
        A run folder that `Run.save` wrote, or ``youla identify`` and ``youla demo``.

    Returns
    -------
    Run
        Equal to the run that was saved, bit by bit. Only files of the folder are read; nothing is identified again.

    Raises
    ------
    InputError
        For what is no run folder, and for one of an older version of youla.

    Examples
    --------
    >>> import tempfile, youla
    >>> run = youla.demo()
    >>> with tempfile.TemporaryDirectory() as parent:
    ...     youla.load(run.save(f"{parent}/run")) == run
    True
    """
    return Run(Kept(read_folder(path_of(folder, "folder"))))
