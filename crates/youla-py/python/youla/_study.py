"""Bootstrap, scans of options and fleets of machines on any executor."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from inspect import signature
from itertools import product
from math import prod
from typing import Any

import numpy as np

from . import _native
from ._arrays import Array, seeded, whole
from ._checks import kind, known, share, table
from ._errors import Error, InputError, NumericalError
from ._identify import Records, prepare
from ._kept import again
from ._model import Model
from ._options import OPTIONS, check_options, plain
from ._record import Record
from ._result import Run
from ._systems import check_hold, sign_of
from ._tasks import MOST_TASKS, Progress, Row, Rows, key_of, run_tasks
from ._types import Log

Payload = dict[str, Any]
Folder = str | os.PathLike[str] | None


@dataclass(frozen=True, repr=False)
class Bootstrap(Rows):
    """Replicates of a recommended model; see `bootstrap`.

    Attributes
    ----------
    rows : tuple of dict
        One for each replicate.
    computed : int
        Replicates that were computed in this call; the others were in the folder.

    Examples
    --------
    >>> import youla
    >>> row = {"index": 0, "modes": [[8.0, 0.05]], "ts": 0.01}
    >>> youla.Bootstrap((row, {**row, "index": 1, "modes": [[8.2, 0.05]]}), 2).intervals(0.5)[0, 0].round(2).tolist()
    [8.05, 8.15]
    """

    def models(self) -> list[Model]:
        """Return the models of the replicates that did not fail."""
        return [Model(*(r["model"][x] for x in "abcd"), dt=r["ts"]) for r in self.succeeded]

    def modes(self) -> Array:
        """Return frequency in Hz and damping ratio of the oscillating modes, replicates x modes x 2, of replicates with their usual number."""
        found = _usual([r["modes"] for r in self.succeeded])
        return np.array(found, dtype=np.float64).reshape(len(found), -1, 2) if found and found[0] else np.empty((len(found), 0, 2))

    def real_poles(self) -> Array:
        """Return the real poles in z, replicates x poles, of replicates with their usual number."""
        found = _usual([r["real_poles"] for r in self.succeeded])
        return np.array(found, dtype=np.float64).reshape(len(found), -1) if found and found[0] else np.empty((len(found), 0))

    def intervals(self, level: float = 0.95) -> Array:
        """Compute percentile intervals.

        Parameters
        ----------
        level : float
            Probability, between 0 and 1.

        Returns
        -------
        ndarray, modes x 2 x 2
            Frequency in Hz and damping ratio; low and high.

        Raises
        ------
        NumericalError
            Where every replicate failed.
        """
        level = share(level, "level")
        found = self.modes()
        if len(found) == 0:
            raise NumericalError("every replicate failed; see .failed for the reasons")
        bounds: Array = np.moveaxis(np.quantile(found, [(1 - level) / 2, (1 + level) / 2], axis=0), 0, -1)
        return bounds


def _usual(found: list[list[Any]]) -> list[list[Any]]:
    """The lists of the length that most of them have."""
    usual = max({len(m) for m in found}, key=[len(m) for m in found].count) if found else 0
    return [m for m in found if len(m) == usual]


def bootstrap(
    run: Run,
    n: int,
    *,
    seed: int | None = None,
    executor: Executor | None = None,
    folder: Folder = None,
    progress: Progress | None = None,
) -> Bootstrap:
    """Parametric bootstrap of the recommended model.

    The loop of the recommended model and its noise is simulated with the known excitations of the records, and identified
    again with order and dead time fixed.

    Parameters
    ----------
    run : Run
        A run of records: of `identify`, of a run.toml, of `demo` or of `load`.
    n : int
        Number of replicates, at most 1 000 000.
    seed : int
        Seed of the noise; the same seed gives the same bits on every executor.
    executor : concurrent.futures.Executor, optional
        Threads, processes, `distributed.Client.get_executor()`, `mpi4py.futures.MPIPoolExecutor`; it is not closed. In this
        process one after the other when absent.
    folder : path, optional
        Where finished replicates are kept; a second call computes only what is missing.
    progress : True or callable, optional
        True draws a line with the time that is left. A function is called with an object that has `count`,
        `total` and `seconds`.

    Returns
    -------
    Bootstrap
        A row for each replicate, in the order of the index.

    Raises
    ------
    InputError
        For a run of a measured response, which holds no records.
    NumericalError
        For a run without a recommended model, or without a predictor of its noise.

    Examples
    --------
    >>> import numpy as np, youla
    >>> plant = youla.Model([[0.95]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    >>> d, n = np.random.default_rng(1).standard_normal((2, 1000, 1))
    >>> u, y = youla.simulate_loop(plant, 2.0, feedback="negative", excitation=d, noise=0.02 * n)
    >>> log = youla.Record(np.hstack([u, y, d]), inputs=0, outputs=1, excitation=2, dt=0.01)
    >>> known = {"nominal": plant, "controller": 2.0, "feedback": "negative", "hansen": {"order": 1, "horizon": 5}}
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor(2) as executor:
    ...     found = youla.bootstrap(youla.identify(log, **known), 8, seed=1, executor=executor)
    >>> found.real_poles().shape, len(found.failed)
    ((8, 1), 0)
    """
    n, seed = whole(n, "n", 1, MOST_TASKS), seeded(seed)
    if not isinstance(run, Run):
        raise InputError(f"run is {kind(run)}, but must be a youla.Run, as youla.identify, youla.demo and youla.load return it")
    made_from, records, count = again(run._kept)
    predictor = run._native.predictor()
    if predictor is None:
        raise NumericalError("the run has no recommended model with a predictor; its noise cannot be simulated")
    found = run.summary["recommended"]
    fixed = {"order": found["order"], "dead_time": found["dead_time"]}
    logs = records[:count]
    data = {**made_from["data"], "verification": []}
    settings = {**made_from, "data": data, "recommended": {**made_from["recommended"], **fixed}}
    payload = {"settings": settings, "logs": logs, "predictor": predictor, "seed": seed}
    key = key_of(settings, *_bytes(logs), *predictor, seed)
    rows = run_tasks(_replicate, payload, range(n), key=key, executor=executor, folder=folder, progress=progress)
    return Bootstrap(rows.rows, rows.computed)


def _replicate(payload: Payload, item: int, index: int) -> Row:
    draw = (payload["seed"], index)
    found: Row = json.loads(_native.replicate(payload["settings"], payload["logs"], payload["predictor"], draw))
    return found


def scan(
    record: Records | Run,
    grid: Mapping[str, Sequence[Any]],
    *,
    executor: Executor | None = None,
    folder: Folder = None,
    progress: Progress | None = None,
    **arguments: Any,
) -> Rows:
    """Identify with each combination of some options.

    Parameters
    ----------
    record : Record, sequence of Record, or Run
        Records; of a run, its records and settings.
    grid : mapping
        Values to try by key, for example ``{"hansen.horizon": [20, 40], "hansen.order": [4, 6, 8]}``.
    executor, folder, progress
        As for `bootstrap`.
    **arguments
        As for `identify`: ``nominal``, ``controller``, ``verify`` and further ones.

    Returns
    -------
    Rows
        In the order of the combinations, the last key fastest: the options, `trusted`, `order`, modes (Hz and damping ratio)
        and the least fit in percent, or `error`.

    Raises
    ------
    InputError
        For a grid that is not a mapping from keys to lists of values, and for arguments that `identify` refuses.

    Examples
    --------
    >>> import numpy as np, youla
    >>> plant = youla.Model([[0.95]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    >>> d, n = np.random.default_rng(1).standard_normal((2, 1000, 1))
    >>> u, y = youla.simulate_loop(plant, 2.0, feedback="negative", excitation=d, noise=0.02 * n)
    >>> log = youla.Record(np.hstack([u, y, d]), inputs=0, outputs=1, excitation=2, dt=0.01)
    >>> known = {"nominal": plant, "controller": 2.0, "feedback": "negative", "hansen": {"order": 1, "horizon": 5}}
    >>> [row["order"] for row in youla.scan(log, {"recommended.order": [1, 2]}, **known)]
    [1, 2]
    """
    if not isinstance(grid, Mapping) or not grid:
        raise InputError("grid must map keys such as 'hansen.order' to lists of values")
    for key, values in grid.items():
        if not isinstance(key, str) or key.count(".") != 1 or isinstance(values, str) or not isinstance(values, (Sequence, np.ndarray)):
            raise InputError(f"grid[{key!r}] must be a list of values of a key 'table.key' of run.toml, such as 'hansen.order'")
        if len(values) == 0:
            raise InputError(f"grid[{key!r}] is empty; give at least one value")
        known([key.partition(".")[0]], OPTIONS, "the grid of scan")
    if isinstance(record, Run):
        if arguments:
            raise InputError(f"{', '.join(arguments)} is given for a run, which holds its settings; change them by the grid")
        settings, logs, _ = again(record._kept)
    else:
        settings, logs = _prepared(record, arguments.pop("verify", None), arguments)
    if prod(len(values) for values in grid.values()) > MOST_TASKS:
        raise InputError(f"grid has more than {MOST_TASKS} combinations, the most of one call; give fewer values")
    points = [dict(zip(grid, values, strict=True)) for values in product(*(list(v) for v in grid.values()))]
    for point in points:
        _check_point(_with(settings, point), point)
    payload = {"settings": settings, "logs": logs}
    key = key_of(settings, *_bytes(logs), points)
    return run_tasks(_point, payload, points, key=key, executor=executor, folder=folder, progress=progress)


def _check_point(settings: Mapping[str, Any], point: Mapping[str, Any]) -> None:
    """Refuse a key or a value that no run takes, before the first task."""
    try:
        _native.check_settings(settings)
    except InputError as error:
        raise InputError(f"grid with {', '.join(f'{key!r}: {value!r}' for key, value in point.items())}: {error}") from None


def _with(settings: Mapping[str, Any], point: Mapping[str, Any]) -> dict[str, Any]:
    found = {key: dict(value) if isinstance(value, Mapping) else value for key, value in settings.items()}
    for key, value in point.items():
        table, name = key.split(".")
        found.setdefault(table, {})[name] = value.item() if isinstance(value, np.generic) else value
    made: dict[str, Any] = plain(found)
    return made


def _point(payload: Payload, item: Mapping[str, Any], index: int) -> Row:
    return _identified(plain(item), lambda: (_with(payload["settings"], item), payload["logs"]))


def identify_many(
    records: Iterable[Any],
    *,
    read: Mapping[str, Any] | None = None,
    executor: Executor | None = None,
    folder: Folder = None,
    progress: Progress | None = None,
    **arguments: Any,
) -> Rows:
    """Identify many machines with the same settings; a record that cannot be used is a row with its reason.

    Parameters
    ----------
    records : iterable of Record or of paths
        One machine each. Paths are read in the workers.
    read : mapping, optional
        Arguments of `Record` for paths: ``inputs``, ``outputs``, ``dt`` and so on.
    executor, folder, progress
        As for `bootstrap`.
    **arguments
        As for `identify`: ``nominal``, ``controller`` and further ones.

    Returns
    -------
    Rows
        In the order of `records`: `record`, `trusted`, `order`, modes (Hz and damping ratio), or `error`.

    Raises
    ------
    InputError
        For arguments that no record could use. What is wrong with one record is in its row.

    Examples
    --------
    >>> import numpy as np, youla
    >>> plant = youla.Model([[0.95]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    >>> d, n = np.random.default_rng(1).standard_normal((2, 1000, 1))
    >>> u, y = youla.simulate_loop(plant, 2.0, feedback="negative", excitation=d, noise=0.02 * n)
    >>> log = youla.Record(np.hstack([u, y, d]), inputs=0, outputs=1, excitation=2, dt=0.01)
    >>> known = {"nominal": plant, "controller": 2.0, "feedback": "negative", "hansen": {"order": 1, "horizon": 5}}
    >>> rows = youla.identify_many([log, "absent.csv"], read={"inputs": "u", "outputs": "y", "dt": 0.01}, **known)
    >>> len(rows.succeeded), rows.failed[0]["error"]
    (1, 'absent.csv: no such file')
    """
    chosen = {} if read is None else table(read, "read", "{'inputs': 'u', 'outputs': 'y', 'dt': 0.01}")
    known(chosen, list(signature(Record).parameters)[1:], "Record, to which read goes,")
    others = {key: value for key, value in arguments.items() if key not in ("nominal", "controller", "feedback", "hold", "name")}
    check_options(others, "identify_many")
    sign_of(arguments.get("controller"), arguments.get("feedback"))
    check_hold(arguments.get("hold"))
    payload = {"read": chosen, "arguments": arguments}
    key = key_of(payload["read"], arguments)
    return run_tasks(_machine, payload, records, key=key, executor=executor, folder=folder, progress=progress)


def _machine(payload: Payload, item: Any, index: int) -> Row:
    def prepared() -> tuple[dict[str, Any], list[Log]]:
        record = item if isinstance(item, Record) else Record(item, **payload["read"])
        return _prepared(record, None, payload["arguments"])

    path = isinstance(item, (str, os.PathLike))
    name = item.name if isinstance(item, Record) else str(item) if path else f"record {index}"
    return _identified({"record": name}, prepared)


def _identified(labels: Row, prepared: Callable[[], tuple[dict[str, Any], list[Log]]]) -> Row:
    """The labels of a task with the row of its run on one core, or with the reason why there is none."""
    try:
        settings, logs = prepared()
        return {**labels, **_row(Run(_native.identify(settings, logs, True)))}
    except Error as error:
        return {**labels, "error": str(error)}


def _row(run: Run) -> Row:
    found = run.summary["recommended"]
    if found is None:
        return {"error": str(run.summary["refused"].get("recommended", "no model is recommended"))}
    model = run.recommended
    fits = [f for record in run.fits.get("likelihood", {}).values() for f in record if f is not None]
    return {
        "trusted": found["trusted"],
        "order": found["order"],
        "dead_time": found["dead_time"],
        "least_fit": min(fits, default=None),
        "modes": [[m["hz"], m["zeta"]] for m in found["modes"]],
        "real_poles": [p["z"] for p in found["real_poles"]],
        "ts": model.dt,
        "model": {key: getattr(model, key).tolist() for key in "abcd"},
    }


def _prepared(record: Records, verify: Records | None, arguments: Mapping[str, Any]) -> tuple[dict[str, Any], list[Log]]:
    """Settings and the records, from the arguments of `identify`."""
    options = dict(arguments)
    nominal, controller, hold, name = (options.pop(key, None) for key in ("nominal", "controller", "hold", "name"))
    feedback = options.pop("feedback", None)
    return prepare(record, verify, nominal, controller, feedback, hold, name, options)


def _bytes(logs: list[Log]) -> list[Any]:
    return [part for name, dt, channels, data in logs for part in (name, dt, channels, np.ascontiguousarray(data))]
