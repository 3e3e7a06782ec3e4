"""Nominal models and controllers of users as the tables [nominal] and [controller] of run.toml."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _native
from ._arrays import as_matrix
from ._checks import choice, file_of, kind
from ._errors import InputError
from ._model import Model
from ._optional import need
from ._options import plain
from ._sources import _is
from ._types import Feedback, Hold

Table = dict[str, Any]

#: Forms of [controller] and [nominal] in run.toml.
CONTROLLERS = ("difference_equation", "transfer_function", "state_space", "pid", "ideal_pid", "cascade", "model_file", "observer")
NOMINALS = ("transfer_function", "state_space", "model_file")


def nominal_table(nominal: Any, dt: float, ports: tuple[int, int]) -> Table:
    """Return [nominal] of a model of any kind; `ports` are the numbers of outputs and inputs."""
    if isinstance(nominal, Mapping):
        return _named(nominal, NOMINALS, "nominal")
    if isinstance(nominal, (str, os.PathLike)):
        return {"model_file": {"file": os.path.abspath(file_of(nominal, "nominal"))}}
    form, table = _system(nominal, dt, ports, "nominal")
    return {form: table}


def controller_table(controller: Any, feedback: Feedback | None, hold: Hold | None, dt: float, ports: tuple[int, int]) -> Table:
    """Return [controller]; `ports` are the numbers of inputs and outputs of the plant."""
    feedback = sign_of(controller, feedback)
    check_hold(hold)
    if isinstance(controller, Mapping):
        form, table = _form(controller)
        return {form: {"feedback": feedback, **table}}
    if isinstance(controller, (str, os.PathLike)):
        return {"model_file": {"feedback": feedback, "file": os.path.abspath(file_of(controller, "controller"))}}
    form, table = _system(controller, dt, ports, "controller")
    if table["domain"] == "continuous":
        if hold is None:
            raise InputError("controller is in continuous time: give hold='tustin' or hold='zoh', as it was discretised")
        table["hold"] = hold
    elif hold is not None:
        raise InputError("hold is for a controller in continuous time, but this one is in discrete time; leave hold out")
    return {form: {"feedback": feedback, **table}}


def _form(controller: Mapping[str, Any]) -> tuple[str, Table]:
    """The form of a controller with its keys."""
    ((form, table),) = _named(controller, CONTROLLERS, "controller").items()
    if form in ("pid", "ideal_pid", "cascade") and "discretisation" not in table:
        raise InputError(f"controller[{form!r}] lacks 'discretisation'; give 'backward-euler' (backward differences) or 'tustin', as the machine computes it")
    return form, table


class UnstatedSign(InputError):
    """A controller whose sign nobody states."""


#: The signs with their equations.
SIGNS = ("negative (u = K (r - y))", "positive (u = K (y - r))")


def sign_of(controller: Any, feedback: Any) -> Feedback:
    """Return the sign with which a controller is written; it is never guessed. No controller, 0 or None, has none."""
    if feedback is None:
        inner = next(iter(controller.values()), None) if isinstance(controller, Mapping) else None
        if isinstance(inner, Mapping) and "feedback" in inner:
            feedback = inner["feedback"]
        elif controller is None or (isinstance(controller, (int, float, np.ndarray)) and not np.any(controller)):
            return "negative"
        else:
            raise UnstatedSign("feedback is missing: give feedback='negative' for u = K (r - y), or feedback='positive' for u = K (y - r)")
    choice(feedback, "feedback", SIGNS)
    return "negative" if feedback == "negative" else "positive"


def check_hold(hold: Any) -> None:
    """Refuse another hold."""
    if hold is not None:
        choice(hold, "hold", ("zoh", "tustin"))


def as_model(system: Any, what: str, dt: float | None = None) -> Model:
    """Return a discrete-time model of a Model, a python-control or SciPy system in discrete time, a gain or a file; with `dt`, of a PID too."""
    if isinstance(system, Model):
        return system
    if isinstance(system, Mapping):
        if dt is None:
            raise InputError(f"{what} is a mapping, of which the sample time is not known; give a youla.Model or a discrete-time system of python-control")
        return _of_mapping(system, dt)
    if isinstance(system, (str, os.PathLike)):
        return _of_file(system, what)
    if _is(system, "scipy.signal", "lti"):
        raise InputError(f"{what} states no sample time, being in continuous time; discretise it first by to_discrete(dt)")
    known = _is(system, "control", "LTI") or _is(system, "scipy.signal", "dlti")
    gain = None if known else _numbers(system, what)
    if dt is None:
        dt = getattr(system, "dt", None)
        if dt is None or isinstance(dt, bool) or dt <= 0:
            raise InputError(f"{what} states no sample time; give a youla.Model or a discrete-time system with dt")
    if gain is not None:
        return Model([], [], [], gain, dt=float(dt))
    system = _state_space(system, what)
    _check_time(_domain(system, what), system, float(dt), what, "plant")
    if _domain(system, what) == "continuous":
        raise InputError(f"{what} is in continuous time; discretise it first, for example with control.c2d(system, dt)")
    return Model(system.A, system.B, system.C, system.D, dt=float(dt))


def _of_mapping(controller: Mapping[str, Any], dt: float) -> Model:
    """A controller that `identify` takes as a mapping, as it is written."""
    form, table = _form(controller)
    if form == "model_file" and "file" in table:
        return _of_file(table["file"], "controller['model_file']['file']")
    loops = max((np.size(value) for value in table.values()), default=1) if form in ("pid", "ideal_pid") else 1
    ports = {group: [{"name": f"{letter}{k}"} for k in range(loops)] for group, letter in (("inputs", "u"), ("outputs", "y"))}
    data = {"sample_time": dt, **ports, "estimation": [{"file": "none"}]}
    settings = plain({"name": "loop", "data": data, "controller": {form: {**table, "feedback": "positive"}}})
    a, b, c, d, dt = _native.controller_model(settings, dt)
    return Model(a, b, c, d, dt=dt, name="controller")


def _of_file(path: Any, what: str) -> Model:
    """A model that `Model.save` wrote, or one of a run folder."""
    place = file_of(path, what)
    with open(place, "rb") as file:
        content = file.read()
    try:
        found = _native.read_mat(content, place) if place.endswith(".mat") else json.loads(content)
        d, n = as_matrix(found["d"], "d"), len(found["a"])
        shapes = {"a": (n, n), "b": (n, d.shape[1]), "c": (d.shape[0], n)}
        a, b, c = (np.reshape(as_matrix(found[key], key), shape) for key, shape in shapes.items())
        return Model(a, b, c, d, dt=float(np.ravel(found["ts"])[0]), name=os.path.basename(place))
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{what} is {place}, which holds no model ({error}); give a file that model.save wrote") from None


def _state_space(system: Any, what: str) -> Any:
    """A system of python-control or SciPy in state space."""
    try:
        return need("control").ss(system) if _is(system, "control", "LTI") else system.to_ss()
    except (TypeError, ValueError, NotImplementedError) as error:
        raise InputError(f"{what} is {kind(system)} without a state-space form ({error}); give a proper model") from None


def _numbers(system: Any, what: str) -> Any:
    """A gain as a matrix, or what can be a system."""
    if system is None:
        remedy = "give 0 where no controller ran" if what == "controller" else f"give a rough {what}: a youla.Model, control.tf(...), or a gain"
        raise InputError(f"{what} is missing; {remedy}")
    try:
        gain = as_matrix(system, what)
    except InputError:
        remedy = "; of a youla.Run give run.recommended or run.model('controller')" if hasattr(system, "recommended") else _meant(system)
        kinds = "a youla.Model, a python-control or SciPy system, a number, a matrix, a mapping as in run.toml, or a file"
        raise InputError(f"{what} is a {type(system).__name__}, but must be {kinds}{remedy}") from None
    if not np.isfinite(gain).all():
        raise InputError(f"{what} has an entry that is not finite")
    return gain


def _meant(system: Any) -> str:
    """What lists of numbers may mean that are no gains of the loop."""
    if not isinstance(system, (list, tuple)):
        return ""
    if len(system) == 2 and all(isinstance(x, (list, tuple, np.ndarray)) for x in system):
        return "; of a numerator and a denominator give control.tf(numerator, denominator, dt)"
    if len(system) == 3 and all(isinstance(x, (int, float)) for x in system):
        gains = {**dict(zip(("kp", "ki", "kd"), system, strict=True)), "discretisation": "tustin"}
        return f"; of the gains of a PID give {{'pid': {gains}}}, or 'backward-euler' where the machine computes backward differences"
    return ""


def _named(table: Mapping[str, Any], forms: tuple[str, ...], what: str) -> Table:
    if len(table) != 1 or next(iter(table)) not in forms:
        remedy = f"; give {{'pid': {dict(table)!r}}}" if "kp" in table and what == "controller" else ""
        raise InputError(f"{what} as a mapping must have exactly one key of {', '.join(forms)}, but has {list(table)}{remedy}")
    form, inner = next(iter(table.items()))
    if not isinstance(inner, Mapping):
        raise InputError(f"{what}[{form!r}] is {type(inner).__name__}, but must be a mapping as run.toml has it")
    return {form: dict(inner)}


def _system(system: Any, dt: float, ports: tuple[int, int], what: str) -> tuple[str, Table]:
    """A system as a table with its domain; the form is that in which it is given."""
    if isinstance(system, Model):
        _check_time("discrete", system, dt, what)
        _check_ports(np.shape(system.d), ports, what)
        return "state_space", _matrices(system.a, system.b, system.c, system.d, "discrete")
    known = _is(system, "control", "LTI") or _is(system, "scipy.signal", "lti") or _is(system, "scipy.signal", "dlti")
    if not known:
        return "state_space", _gain(system, ports, what)
    domain = _domain(system, what)
    _check_time(domain, system, dt, what)
    if hasattr(system, "A"):
        _check_ports(np.shape(system.D), ports, what)
        if not all(np.isfinite(x).all() for x in (system.A, system.B, system.C, system.D)):
            raise InputError(f"{what} has an entry that is not finite")
        return "state_space", _matrices(system.A, system.B, system.C, system.D, domain)
    if hasattr(system, "zeros") and hasattr(system, "gain"):
        system = system.to_tf()
    if not hasattr(system, "num"):
        raise InputError(f"{what} is a {type(system).__name__}; give a state-space system or a transfer function")
    numerator, denominator = system.num, system.den
    if _is(system, "control", "LTI"):
        numerator, denominator = ([[np.asarray(x).tolist() for x in row] for row in y] for y in (numerator, denominator))
        _check_ports((len(numerator), len(numerator[0])), ports, what)
        single = len(numerator) == len(numerator[0]) == 1
        if single:
            numerator, denominator = numerator[0][0], denominator[0][0]
    else:
        numerator, denominator = np.atleast_1d(numerator).tolist(), np.atleast_1d(denominator).tolist()
        if isinstance(numerator[0], list):
            numerator = [[row] for row in numerator]
    _check_proper(numerator, denominator, what)
    return "transfer_function", {"domain": domain, "numerator": numerator, "denominator": denominator}


def _check_proper(numerator: Any, denominator: Any, what: str) -> None:
    """Refuse a numerator of a higher degree than its denominator; both may be nested by outputs and inputs."""
    if numerator and isinstance(numerator[0], list):
        for row, below in zip(numerator, denominator if isinstance(denominator[0], list) else [denominator] * len(numerator), strict=True):
            _check_proper(row, below, what)
        return
    n, d = (max(len(np.trim_zeros(np.asarray(x, dtype=float), "f")) - 1, 0) for x in (numerator, denominator))
    if n > d:
        raise InputError(
            f"{what} is improper: its numerator has degree {n}, its denominator {d}; give what ran, with the filter of its derivative or its delay"
        )


def _domain(system: Any, what: str) -> str:
    dt = getattr(system, "dt", None)
    if _is(system, "scipy.signal", "lti") or (dt is not None and not isinstance(dt, bool) and dt == 0):
        return "continuous"
    if dt is None and _is(system, "control", "LTI"):
        raise InputError(f"{what} has dt=None; state dt=0 for continuous time or its sample time")
    return "discrete"


def _check_ports(shape: tuple[int, ...], ports: tuple[int, int], what: str) -> None:
    """Numbers of outputs and inputs."""
    if tuple(shape) != ports:
        whose = "takes the outputs of the plant and gives its inputs" if what == "controller" else "takes u and gives y"
        found = f"{shape[0]} outputs and {shape[1]} inputs" if len(shape) == 2 else f"the shape {shape}"
        raise InputError(f"{what} has {found}, but must have {ports[0]} and {ports[1]}: it {whose}")


def _check_time(domain: str, system: Any, dt: float, what: str, other: str = "record") -> None:
    own = getattr(system, "dt", None)
    if domain == "continuous" or own is None or isinstance(own, bool):
        return
    if abs(own / dt - 1.0) > 1e-6:
        raise InputError(f"{what} has the sample time {own:g} s, but the {other} has {dt:g} s; resample one of them")


def _matrices(a: Any, b: Any, c: Any, d: Any, domain: str) -> Table:
    a, b, c, d = (np.asarray(x, dtype=float) for x in (a, b, c, d))
    if a.size == 0:
        return {"domain": domain, "a": [], "b": [], "c": [[] for _ in range(d.shape[0])], "d": d.tolist()}
    return {"domain": domain, "a": a.tolist(), "b": b.tolist(), "c": c.tolist(), "d": d.tolist()}


def _gain(system: Any, ports: tuple[int, int], what: str) -> Table:
    gain = _numbers(system, what)
    if gain.shape == (1, 1):
        gain = np.full(ports, gain[0, 0]) if ports == (1, 1) or gain[0, 0] == 0 else gain
    if gain.shape != ports:
        found = " x ".join(map(str, gain.shape))
        raise InputError(f"{what} is a gain of {found}, but must be {ports[0]} x {ports[1]}{_meant(system)}")
    return _matrices(np.zeros((0, 0)), [], [], gain, "discrete")
