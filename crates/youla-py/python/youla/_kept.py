"""A run folder in memory: what a run is where it was loaded, copied or sent to another process.

One mechanism for all: the state of a run is the files that `youla identify` writes.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from . import _native
from ._arrays import Array
from ._errors import InputError, NumericalError
from ._types import Log, Matrices

Files = dict[str, bytes]

#: Files of the models, in the order in which a run names them.
_MODELS = {
    "likelihood": "4-identify/recommended",
    "nominal": "2-factor/nominal",
    "direct": "4-identify/direct",
    "hansen": "5-recombine/hansen",
    "hansen_reduced": "6-reduce/hansen_reduced",
    "grey_box": "4-identify/grey_box",
    "true_plant": "2-factor/true_plant",
    "controller": "2-factor/controller",
    "deviation": "4-identify/deviation",
    "new_controller": "8-redesign/new_controller",
}

#: Groups of channels in [data] of run.toml with their names in the files of the records.
_GROUPS = {"inputs": "u", "outputs": "y", "input_excitation": "input_excitation", "reference": "reference", "alpha": "alpha"}


class Results(Protocol):
    """What a run takes its results from: the extension module, or its files."""

    def summary(self) -> str: ...
    def settings(self) -> str: ...
    def models(self) -> list[str]: ...
    def model(self, key: str) -> Matrices | None: ...
    def ports(self) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]: ...
    def hz(self) -> Array: ...
    def response(self, key: str, hz: Array) -> Any: ...
    def deviation_along(self, hz: float, slopes: Any) -> float | None: ...
    def measured_response(self) -> Any: ...
    def predictions(self) -> list[tuple[str, Array, dict[str, Array]]]: ...
    def predictor(self) -> list[Array] | None: ...
    def page(self) -> str: ...
    def html(self) -> str: ...
    def write(self, folder: str, replace: bool) -> str: ...
    def redesign(self, chosen: Mapping[str, Any]) -> tuple[str, Matrices]: ...


def files_of(run: Results) -> Files:
    """The files of a run; those of one in memory are written once and read."""
    if isinstance(run, Kept):
        return run.files
    with tempfile.TemporaryDirectory() as parent:
        return read_folder(run.write(os.path.join(parent, "run"), False))


def read_folder(folder: str) -> Files:
    """The files that a run wrote; drawings that others made are left out, and the report, which is drawn again."""
    listed = os.path.join(folder, "files.txt")
    if not os.path.isdir(folder):
        what = "a file" if os.path.exists(folder) else "not there"
        raise InputError(f"folder {folder} is {what}, but must be a run folder, which run.save or the program `youla identify` writes")
    if not os.path.isfile(listed):
        raise InputError(f"folder {folder} is no run folder (there is no files.txt in it); give one that run.save or `youla identify` wrote")
    with open(listed, encoding="utf-8") as file:
        names = [name for name in file.read().splitlines() if name and name != "report.html"]
    found: Files = {}
    for name in names:
        path = os.path.join(folder, name)
        if os.path.isabs(name) or ".." in name.split("/"):
            raise InputError(f"{listed} names {name}, which is not below the folder; identify the run again")
        try:
            with open(path, "rb") as file_of:
                found[name.replace(os.sep, "/")] = file_of.read()
        except OSError as error:
            raise InputError(f"{path} cannot be read ({error.strerror}), but files.txt names it; identify the run again") from None
    for name in ("summary.json", "report.json", "run.toml", "4-identify/frequencies.mat"):
        if name not in found:
            raise InputError(f"folder {folder} holds no {name}: another version of youla wrote it; identify the run again from its run.toml")
    kept = Kept(found)
    kept._json("summary.json")
    if _settings_differ(kept.settings(), kept._json("report.json").get("settings")):
        raise InputError(f"{os.path.join(folder, 'run.toml')} was changed after the run, whose results are of other settings; identify anew, or undo the change")
    return found


def _settings_differ(found: str, ran: str | None) -> bool:
    """Whether settings say something else than those of the report; comments and spaces may differ."""
    if ran is None or found == ran:
        return False
    try:
        return bool(json.loads(_native.settings_json(found)) != json.loads(_native.settings_json(ran)))
    except InputError:
        return True


class Kept:
    """A run that was kept in files, with the methods of `_native.Run`."""

    def __init__(self, files: Files) -> None:
        self.files = files
        self._parsed: dict[str, Any] = {}

    def __reduce__(self) -> Any:
        return Kept, (self.files,)

    def _text(self, name: str) -> str:
        return self.files[name].decode("utf-8")

    def _json(self, name: str) -> Any:
        if name not in self._parsed:
            try:
                self._parsed[name] = json.loads(self._text(name))
            except ValueError as error:
                raise InputError(f"{name} of this run cannot be read ({error}); identify the run again") from None
        return self._parsed[name]

    def _mat(self, name: str) -> dict[str, Array]:
        if name not in self._parsed:
            self._parsed[name] = _native.read_mat(self.files[name], name)
        found: dict[str, Array] = self._parsed[name]
        return found

    def summary(self) -> str:
        return self._text("summary.json")

    def settings(self) -> str:
        return self._text("run.toml")

    def page(self) -> str:
        return self._text("report.json")

    def html(self) -> str:
        return _native.report_html(self.page())

    def models(self) -> list[str]:
        return [key for key, name in _MODELS.items() if f"{name}.mat" in self.files]

    def model(self, key: str) -> Matrices | None:
        name = _MODELS.get(key)
        if f"{name}.mat" not in self.files:
            return None
        found = self._json(f"{name}.json")
        m, p, n = len(found["inputs"]), len(found["outputs"]), len(found["a"])
        shapes = {"a": (n, n), "b": (n, m), "c": (p, n), "d": (p, m)}
        a, b, c, d = (np.array(found[x], dtype=np.float64).reshape(shape) for x, shape in shapes.items())
        return a, b, c, d, float(found["ts"])

    def ports(self) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
        found = self._json("1-record/records.json")
        u, y = ([(c["name"], c["unit"]) for c in found[group]] for group in ("inputs", "outputs"))
        return u, y

    def hz(self) -> Array:
        return self._mat("4-identify/frequencies.mat")["hz"].ravel()

    def _region(self) -> _native.Region | None:
        if "4-identify/region.json" not in self.files:
            return None
        if "region" not in self._parsed:
            self._parsed["region"] = _native.Region(self._text("4-identify/region.json"))
        found: _native.Region = self._parsed["region"]
        return found

    def response(self, key: str, hz: Array) -> Any:
        model = self.model(key)
        assert model is not None  # a run asks for models that are there
        region = self._region()
        if key == "likelihood" and region is not None:
            return region.response(model, hz)
        known = self._structure(hz) if key == "grey_box" else None
        return _native.frequency_response(model, hz), known

    def _structure(self, hz: Array) -> Any:
        """The region of the physical structure, at the frequencies of the report."""
        name = "4-identify/grey_box_uncertainty.json"
        if name not in self.files or len(hz) != len(self.hz()) or not np.allclose(hz, self.hz(), rtol=1e-12, atol=0):
            return None
        found = self._json(name)
        u, y = (len(channels) for channels in self.ports())
        covariance, magnitude = np.empty((len(hz), y, u, 3)), np.empty((len(hz), y, u, 2))
        for entry in found["entries"]:
            at = (slice(None), entry["output"], entry["input"])
            covariance[at], magnitude[at] = entry["covariance"], entry["magnitude"]
        return covariance, magnitude, found["ellipse"]

    def deviation_along(self, hz: float, slopes: Any) -> float | None:
        region, model = self._region(), self.model("likelihood")
        if region is None or model is None or np.shape(slopes) != model[3].shape:
            return None
        return region.along(hz, slopes)

    def measured_response(self) -> Any:
        found = self._mat("4-identify/frequencies.mat")
        if "measured_re" not in found:
            return None
        u, y = (len(channels) for channels in self.ports())
        values = found["measured_re"] + 1j * found["measured_im"]
        return found["measured_omega"].ravel() / (2 * np.pi), values.reshape(-1, y, u)

    def predictions(self) -> list[tuple[str, Array, dict[str, Array]]]:
        found = []
        for record in self._json("1-record/records.json")["verification"]:
            of = dict(self._mat(f"7-validate/{record['name']}.mat"))
            of.pop("ts")
            found.append((record["name"], of.pop("measured"), of))
        return found

    def predictor(self) -> list[Array] | None:
        if "4-identify/recommended.mat" not in self.files:
            return None
        found = self._json("4-identify/recommended.json")["details"]["predictor"]
        if found["k"] is None:
            return None
        p = len(found["covariance"])
        n, m = len(found["a"]), len(self.ports()[0])
        shapes = {"a": (n, n), "b": (n, m), "c": (p, n), "d": (p, m), "k": (n, p), "covariance": (p, p)}
        return [np.array(found[key], dtype=np.float64).reshape(shape) for key, shape in shapes.items()]

    def write(self, folder: str, replace: bool) -> str:
        return _native.write_files(folder, replace, {**self.files, "report.html": self.html().encode()})

    def point(self) -> tuple[Matrices, _native.Region]:
        """Plant and region, on which a controller is designed."""
        plant, region = self.model("likelihood"), self._region()
        if plant is None or region is None:
            raise NumericalError("the run has no recommended model, on which a controller is designed; see its summary['refused']")
        return plant, region

    def redesign(self, chosen: Mapping[str, Any]) -> tuple[str, Matrices]:
        plant, region = self.point()
        settings, logs, _ = again(self)
        model = self.model("hansen_reduced") or plant
        return _native.redesign(settings, logs, [plant, model], region, chosen)


def again(run: Kept) -> tuple[dict[str, Any], list[Log], int]:
    """Settings and records with which a run is repeated, and how many records are those to identify from.

    The records are those that were used: cut and detrended. Nominal model and controller are given by their matrices, so that
    no file is needed.
    """
    settings = json.loads(_native.settings_json(run.settings()))
    data = settings["data"]
    if data.get("response"):
        raise InputError("this run was identified from a measured response and holds no records; give the youla.Response or its arrays")
    groups = {key: [{"name": c["name"], "unit": c.get("unit", "")} for c in data.get(key) or []] for key in _GROUPS}
    records = run._json("1-record/records.json")
    logs: list[Log] = []
    for purpose in ("estimation", "verification"):
        for record in records[purpose]:
            found = run._mat(f"1-record/{purpose}-{record['name']}.mat")
            parts = [(key, found[_GROUPS[key]]) for key in groups if groups[key] and _GROUPS[key] in found]
            channels = [(c["name"], c["unit"]) for key, _ in parts for c in groups[key]]
            table = np.ascontiguousarray(np.hstack([values for _, values in parts]))
            logs.append((record["name"], records["sample_time"], [(n, unit, k) for k, (n, unit) in enumerate(channels)], table))
    named = {purpose: [{"file": r["name"], "name": r["name"]} for r in records[purpose]] for purpose in ("estimation", "verification")}
    settings["data"] = {"sample_time": records["sample_time"], **{k: g for k, g in groups.items() if g}, **named, "detrend": "none"}
    nominal = run.model("nominal")
    if nominal is not None:
        settings["nominal"] = {"state_space": _matrices(nominal)}
    if "observer" not in settings["controller"]:
        settings["controller"] = {"state_space": {"feedback": "positive", **_matrices(run.model("controller"))}}
    found_settings: dict[str, Any] = _without_none(settings)
    return found_settings, logs, len(records["estimation"])


def _matrices(model: Matrices | None) -> dict[str, Any]:
    assert model is not None  # every run has a controller
    a, b, c, d, _ = model
    return {"domain": "discrete", "a": a.tolist(), "b": b.tolist(), "c": c.tolist(), "d": d.tolist()}


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_none(inner) for key, inner in value.items() if inner is not None}
    return [_without_none(inner) for inner in value] if isinstance(value, list) else value
