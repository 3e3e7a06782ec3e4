"""From records to models: the whole run, and the settings that all stages share."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _native
from ._arrays import Array, whole
from ._errors import InputError
from ._model import FrequencyResponse
from ._record import Record
from ._result import Run
from ._systems import controller_table, nominal_table
from ._types import Log

Records = Record | Sequence[Record]

#: Tables of run.toml that are keywords.
OPTIONS = (
    "recommended", "factors", "hansen", "deviation", "direct", "reduction", "grey_box", "certificate", "redesign",
    "verification", "check", "frequency_response", "data",
)  # fmt: skip


def identify(
    record: Records | str | os.PathLike[str],
    *,
    nominal: Any = None,
    controller: Any = None,
    feedback: str = "negative",
    hold: str | None = None,
    verify: Records | None = None,
    name: str | None = None,
    **options: Mapping[str, Any],
) -> Run:
    """Identify the plant of a loop from its records.

    Parameters
    ----------
    record : Record, sequence of Record, or path
        Records to identify from; several are several experiments. The path of a run.toml does what
        ``youla identify run.toml`` does, and takes no other argument.
    nominal : Model, python-control or SciPy system, number, matrix, mapping or path
        A rough model of the plant. A continuous-time system is discretised by a zero-order hold. A mapping is the table
        ``[nominal]`` of run.toml.
    controller : as `nominal`
        The controller that ran; 0 where none ran. A mapping is the table ``[controller]``, for example
        ``{"pid": {"kp": 2.0, "discretisation": "tustin"}}``.
    feedback : {"negative", "positive"}
        Sign with which the controller is written: ``u = K (r - y)`` or ``u = K (y - r)``.
    hold : {"tustin", "zoh"}, optional
        How a controller in continuous time was discretised; needed there, and only there.
    verify : Record or sequence of Record, optional
        Records to verify on; never used to identify.
    name : str, optional
        Name of the machine; that of the first record when absent.
    **options : mapping
        Tables of run.toml as keywords: ``recommended``, ``hansen``, ``direct``, ``reduction``, ``grey_box``,
        ``certificate``, ``redesign``, ``verification``, ``check``, ``factors``, ``deviation``, ``frequency_response``, and
        ``data`` for ``detrend`` and ``disturbance``.

    Returns
    -------
    Run
        Models with their evidence.

    Raises
    ------
    InputError
        For arguments that cannot be used.
    NumericalError
        Where no method gives a model.

    Examples
    --------
    >>> import numpy as np, youla
    >>> rng = np.random.default_rng(1)
    >>> d, y, u = rng.standard_normal(4000), np.zeros(4000), np.zeros(4000)
    >>> for k in range(3999):
    ...     u[k] = -0.5 * y[k] + d[k]
    ...     y[k + 1] = 0.9 * y[k] + 0.1 * u[k] + 0.01 * rng.standard_normal()
    >>> log = youla.Record({"u": u, "y": y, "d": d}, inputs="u", outputs="y", excitation="d", dt=0.01)
    >>> nominal = youla.Model([[0.8]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    >>> run = youla.identify(log, nominal=nominal, controller=0.5)
    >>> run.recommended.order, bool(abs(run.recommended.a[0, 0] - 0.9) < 0.01)
    (1, True)
    """
    if isinstance(record, (str, os.PathLike)):
        if nominal is not None or controller is not None or verify is not None or options:
            raise InputError("a run.toml states everything; leave the other arguments out, or give a youla.Record")
        return Run(_native.identify_file(os.fspath(record)))
    settings, logs = prepare(record, verify, nominal, controller, feedback, hold, name, options)
    return Run(_native.identify(json.dumps(settings), logs), (settings, logs))


def prepare(
    record: Records,
    verify: Records | None,
    nominal: Any,
    controller: Any,
    feedback: str,
    hold: str | None,
    name: str | None,
    options: Mapping[str, Any],
) -> tuple[dict[str, Any], list[Log]]:
    """Return run.toml as nested dictionaries, and the records in its order."""
    estimation, fresh = records_of(record, "record"), records_of(verify, "verify")
    if not estimation:
        raise InputError("record is an empty list, but must hold at least one youla.Record")
    first = estimation[0]
    for k, other in enumerate([*estimation, *fresh]):
        if (other.inputs, other.outputs) != (first.inputs, first.outputs):
            raise InputError(f"record {k + 1} has other inputs or outputs than the first; give the same names in all")
    for key, table in options.items():
        if key not in OPTIONS:
            raise InputError(f"identify has no argument {key!r}; options are {', '.join(OPTIONS)}")
        if not isinstance(table, Mapping):
            raise InputError(f"{key} is {type(table).__name__}, but must be a mapping as the table [{key}] of run.toml")
    m, p = len(first.inputs), len(first.outputs)
    tables = {key: dict(table) for key, table in options.items()}
    labels = _labels([*estimation, *fresh])
    data = {
        "sample_time": first.dt,
        **first._tables(),
        "estimation": [{"file": label, "name": label} for label in labels[: len(estimation)]],
        "verification": [{"file": label, "name": label} for label in labels[len(estimation) :]],
        **tables.pop("data", {}),
    }
    settings = {
        "name": name or first.name,
        "data": data,
        "nominal": nominal_table(nominal, first.dt, (p, m)),
        "controller": controller_table(controller, feedback, hold, first.dt, (m, p)),
        **tables,
    }
    return _plain(settings), [r._log() for r in [*estimation, *fresh]]


def records_of(given: Records | None, what: str) -> list[Record]:
    listed = [] if given is None else [given] if isinstance(given, Record) else given
    if not isinstance(listed, Sequence) or not all(isinstance(r, Record) for r in listed):
        raise InputError(f"{what} is {type(given).__name__}, but must be a youla.Record or a list of them")
    return list(listed)


def _labels(records: list[Record]) -> list[str]:
    """Names of records, numbered where one is there twice."""
    names = [r.name for r in records]
    return [n if names.count(n) == 1 else f"{n}-{names[: k + 1].count(n)}" for k, n in enumerate(names)]


def _plain(value: Any) -> Any:
    """Settings as JSON has them; what is None is absent."""
    if isinstance(value, Mapping):
        return {str(key): _plain(v) for key, v in value.items() if v is not None}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, (str, bool, int, float)):
        return value
    raise InputError(f"an option is {value!r}, but options are numbers, text, lists and mappings")


def options_json(options: Mapping[str, Any]) -> str:
    """Options of a stage as JSON."""
    return json.dumps(_plain(options))


def demo(machine: str = "levitation", *, seed: int = 1) -> Run:
    """Simulate a machine under feedback and identify it, as ``youla demo`` does.

    Parameters
    ----------
    machine : {"levitation", "bearing"}
        A levitated mass, unstable, or the gas bearing of the paper.
    seed : int
        Seed of excitation and noise, at least 0.

    Returns
    -------
    Run
        As `identify` returns it.

    Raises
    ------
    InputError
        For another machine or a seed that is not a whole number.

    Examples
    --------
    >>> import youla
    >>> [round(float(abs(p)), 2) for p in youla.demo().recommended.poles if abs(p) > 1]
    [1.04]
    """
    return Run(_native.demo(machine, whole(seed, "seed", 0)))


def with_region(w: Array, values: Any, known: Any, name: str) -> FrequencyResponse:
    """A frequency response of the native module."""
    if known is None:
        return FrequencyResponse(w, values, name=name)
    covariance, magnitude, ellipse = known
    return FrequencyResponse(w, values, magnitude[..., 0], magnitude[..., 1], covariance, ellipse, name)
