"""From records to models: the whole run, and the settings that all stages share."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _native
from ._arrays import Array, whole
from ._channels import Channels, Synchronised
from ._checks import file_of, text
from ._errors import InputError, NumericalError
from ._gaps import refuse_not_finite
from ._model import FrequencyResponse, _numbered
from ._options import check_options, plain
from ._record import Record
from ._response import Response, data_of
from ._result import Run
from ._sources import refuse_log
from ._systems import UnstatedSign, controller_table, nominal_table
from ._types import Feedback, Hold, Log, Table

Records = Record | Sequence[Record]


def identify(
    record: Records | Response | FrequencyResponse | str | os.PathLike[str],
    *,
    nominal: Any = None,
    controller: Any = None,
    feedback: Feedback | None = None,
    hold: Hold | None = None,
    verify: Records | None = None,
    name: str | None = None,
    **options: Mapping[str, Any],
) -> Run:
    """Identify the plant of a loop from its records.

    Parameters
    ----------
    record : Record, sequence of Record, Response, or path
        Records to identify from; several are several experiments. A measured response: `Response`, `FrequencyResponse` or
        `control.FrequencyResponseData`. The path of a run.toml does what
        ``youla identify run.toml`` does, and takes no other argument.
    nominal : Model, python-control or SciPy system, number, matrix, mapping or path, optional
        A model of the plant that you have, for comparison; it may be rough. A continuous-time system is discretised by a
        zero-order hold. A mapping is the table ``[nominal]`` of run.toml. ``hansen`` needs it.
    controller : as `nominal`
        The controller that ran; 0 where none ran. A mapping is the table ``[controller]``, for example
        ``{"pid": {"kp": 2.0, "discretisation": "tustin"}}``; lists hold the gains of a PID in each loop, ``"kp": [2.0, 1.5]``. A
        ``cascade`` of a position and a velocity loop takes the commanded position as `reference` of the record.
    feedback : {"negative", "positive"}
        Sign with which the controller is written: ``u = K (r - y)`` or ``u = K (y - r)``. Needed where a controller ran and
        its mapping does not state it; the message for a missing one says with which the record agrees.
    hold : {"tustin", "zoh"}, optional
        How a controller in continuous time was discretised; needed there, and only there.
    verify : Record or sequence of Record, optional
        Records to verify on: no model is fitted to them. Where they differ from the model its region is wider, and they may decide
        between two models.
    name : str, optional
        Name of the machine; that of the first record when absent.
    **options : mapping
        Tables of run.toml as keywords: ``recommended``, ``hansen``, ``direct``, ``reduction``, ``grey_box``,
        ``redesign``, ``verification``, ``check``, ``factors``, ``frequency_response``, and
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
    >>> run = youla.identify(log, controller=0.5, feedback="negative")
    >>> run.recommended.order, bool(abs(run.recommended.a[0, 0] - 0.9) < 0.01)
    (1, True)
    """
    if isinstance(record, (str, os.PathLike)):
        refuse_log(record, "record")
        if nominal is not None or controller is not None or verify is not None or options:
            raise InputError("a run.toml states everything; leave the other arguments out, or give a youla.Record")
        return Run(_native.identify_file(file_of(record, "record")))
    response = data_of(record)
    if response is not None:
        settings, logs, table = _of_response(response, verify, nominal, controller, feedback, hold, name, options)
        return Run(_native.identify(settings, logs, False, table))
    assert not isinstance(record, (Response, FrequencyResponse))
    settings, logs = prepare(record, verify, nominal, controller, feedback, hold, name, options)
    _check_moves(records_of(record, "record"))
    try:
        return Run(_native.identify(settings, logs))
    except (InputError, NumericalError) as error:
        raise type(error)(f"{error}{_of_order(str(error), options)}") from None


def _of_order(told: str, options: Mapping[str, Any]) -> str:
    """Of records that are too short for an order that was asked for: the order."""
    order = options.get("recommended", {}).get("order")
    return f"; or ask for a lower order than recommended['order'] = {order}" if isinstance(order, int) and "too few" in told else ""


def _of_response(
    response: Response,
    verify: Records | None,
    nominal: Any,
    controller: Any,
    feedback: Feedback | None,
    hold: Hold | None,
    name: str | None,
    options: Mapping[str, Any],
) -> tuple[dict[str, Any], list[Log], Table]:
    """run.toml as nested dictionaries, the records to verify on, and the response."""
    clocks = [response.dt, *(getattr(system, "dt", None) for system in (controller, nominal))]
    known = [float(dt) for dt in clocks if dt is not None and not isinstance(dt, bool) and dt > 0]
    if not known:
        raise InputError("dt is missing, which a response does not show: give that of the controller, youla.Response(..., dt=0.001)")
    m, p, dt = len(response.inputs), len(response.outputs), known[0]
    empty = Record(np.zeros((m + p + m + 1, m + p + m)), inputs=list(range(m)), outputs=list(range(m, m + p)), dt=dt)
    settings, _ = prepare(empty, None, nominal, controller, feedback, hold, name or response.name, options)
    named = {"inputs": response.inputs, "outputs": response.outputs}
    if response._of_loop:
        named["input_excitation"] = tuple(_numbered("d", m))
    groups = {key: [{"name": label} for label in labels] for key, labels in named.items()}
    fresh = records_of(verify, "verify")
    for k, other in enumerate(fresh):
        if (other.inputs, other.outputs) != (response.inputs, response.outputs):
            raise InputError(f"verify[{k}] has other inputs or outputs than the response; give Response its names by inputs= and outputs=")
    labels = _labels(fresh)
    verification = [{"file": label, "name": label} for label in labels]
    data = {**settings["data"], **groups, "estimation": [], "verification": verification}
    data["response"] = [{"file": response.name, "name": response.name}]
    if fresh:
        data.update({key: of for key, of in fresh[0]._tables().items()})
    return {**settings, "data": data}, [_log_of(r) for r in fresh], response._table(dt)


def prepare(
    record: Records,
    verify: Records | None,
    nominal: Any,
    controller: Any,
    feedback: Feedback | None,
    hold: Hold | None,
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
        if abs(other.dt / first.dt - 1) > 1e-6:
            raise InputError(f"record {k + 1} has the sample time {other.dt:g} s, the first has {first.dt:g} s; resample one of them")
    _check_apart(estimation, fresh)
    check_options(options, "identify")
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
        "name": first.name if name is None else text(name, "name"),
        "data": data,
        "nominal": None if nominal is None else nominal_table(nominal, first.dt, (p, m)),
        **tables,
    }
    logs = [_log_of(r) for r in [*estimation, *fresh]]
    try:
        settings["controller"] = controller_table(controller, feedback, hold, first.dt, (m, p))
    except UnstatedSign as error:
        ((form, table),) = controller_table(controller, "negative", hold, first.dt, (m, p)).items()
        unsigned = {**settings, "controller": {form: {key: value for key, value in table.items() if key != "feedback"}}}
        raise InputError(f"{error}{_native.agreement(plain(unsigned), logs)}") from None
    return plain(settings), logs


def _check_apart(estimation: list[Record], fresh: list[Record]) -> None:
    """Refuse samples that would identify twice, or identify and verify."""
    every = [*estimation, *fresh]
    labels = _labels(every)
    for k, later in enumerate(every):
        for i, earlier in enumerate(every[: min(k, len(estimation))]):
            common = _common(earlier, later)
            if common is not None:
                what = "which would count twice" if k < len(estimation) else "from which the models are identified: they would verify nothing"
                raise InputError(f"{labels[i]} and {labels[k]} share {common}, {what}; cut them apart, for example by record.split()")


def _common(a: Record, b: Record) -> str | None:
    """The samples that two records have in common, as views of one array or as equal copies."""
    x, y = (r._data[:, r._groups["outputs"][0][2]] for r in (a, b))
    if np.may_share_memory(x, y) and np.shares_memory(x, y):
        (step,), (other,) = x.strides, y.strides
        if step != other or step <= 0:
            return "samples"
        offset = (y.ctypes.data - x.ctypes.data) // step
        return f"samples {max(0, offset)} to {min(len(x), offset + len(y)) - 1} of the first, counted from 0"
    equal = len(a) == len(b) and np.array_equal(a.y, b.y) and np.array_equal(a.u, b.u)
    return "all samples" if equal else None


def _check_moves(records: list[Record]) -> None:
    """Refuse an input that never moves: nothing shows what it does."""
    for j, name in enumerate(records[0].inputs):
        if all(np.ptp(r.u[:, j]) == 0 for r in records):
            value = records[0].u[0, j] + 0.0  # no -0
            raise InputError(f"record: the input {name!r} is constant ({value:g}) in every record; excite it, check its column, or leave it out of inputs")


def _log_of(record: Record) -> Log:
    """A record for the native module; values that would overflow in squares are refused."""
    log = record._log()
    # One pass over the array as it lies in memory; a NaN fails the comparison too.
    if log[3].max() <= 1e100 and log[3].min() >= -1e100:
        return log
    bad = {name: ~np.isfinite(log[3][:, column]) for name, _, column in log[2]}
    if any(samples.any() for samples in bad.values()):
        refuse_not_finite(bad, record.name)
    columns = [log[3][:, column] for _, _, column in log[2]]
    largest = max(max(column.max(), -column.min()) for column in columns)
    if largest > 1e100 and np.isfinite(largest):
        raise InputError(f"{record.name} holds the value {largest:.3g}, but values above 1e100 cannot be used; check its units")
    return log


def records_of(given: Records | None, what: str) -> list[Record]:
    listed = [] if given is None else [given] if isinstance(given, Record) else given
    if not isinstance(listed, Sequence) or not all(isinstance(r, Record) for r in listed):
        of = {Channels: "; bring them to one clock by .synchronise(...).records", Synchronised: "; give its .records"}
        remedy = next((words for kind, words in of.items() if isinstance(given, kind)), "")
        raise InputError(f"{what} is {type(given).__name__}, but must be a youla.Record or a list of them{remedy}")
    return list(listed)


def _labels(records: list[Record]) -> list[str]:
    """Names of records, numbered where one is there twice."""
    names = [r.name for r in records]
    return [n if names.count(n) == 1 else f"{n}-{names[: k + 1].count(n)}" for k, n in enumerate(names)]


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
    return Run(_native.demo(text(machine, "machine"), whole(seed, "seed", 0)))


def with_region(w: Array, values: Any, known: Any, name: str) -> FrequencyResponse:
    """A frequency response of the native module."""
    if known is None:
        return FrequencyResponse(w, values, name=name)
    covariance, magnitude, ellipse = known
    return FrequencyResponse(w, values, magnitude[..., 0], magnitude[..., 1], covariance, ellipse, name)
