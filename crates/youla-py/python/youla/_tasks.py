"""Many independent tasks on an executor, in order of their index, with finished tasks kept in a folder.

A task is a pure function of its payload and index, on one core. Its row is JSON, so that rows from a folder are equal to those
just computed. The engine decides neither order nor bits.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sized
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from ._checks import callback, folder_of, kind
from ._errors import Error, InputError
from ._optional import need
from ._parquet import write
from ._record import Record

Row = dict[str, Any]
Task = Callable[[Any, Any, int], Row]

@dataclass(frozen=True, eq=False)
class Done:
    """Finished tasks as a function of progress gets them.

    Attributes
    ----------
    count : int
        Finished tasks.
    total : int or None
        All tasks; None where their number is not known.
    seconds : float
        Time since the start.
    """

    count: int
    total: int | None
    seconds: float

    def __int__(self) -> int:
        return self.count

    def __str__(self) -> str:
        if self.total is None:
            return f"{self.count} done, {self.seconds:.1f} s"
        bar = "#" * (20 * self.count // max(self.total, 1))
        left = self.seconds * (self.total - self.count) / max(self.count, 1)
        return f"[{bar:<20}] {self.count} of {self.total}, {self.seconds:.1f} s, {left:.1f} s left"


#: True draws a line; a function is called with what is done.
Progress = bool | Callable[[Done], None]


class _Clock:
    """Tells a function, or the terminal and notebook, what is done."""

    def __init__(self, progress: Progress | None, total: int | None) -> None:
        self._progress, self._total, self._start = progress, total, time.monotonic()

    def tell(self, rows: Mapping[int, Row]) -> None:
        if self._progress is None or self._progress is False:
            return
        done = Done(len(rows), self._total, time.monotonic() - self._start)
        if callable(self._progress):
            self._progress(done)
        else:
            end = "\n" if done.count == self._total else ""
            print(f"\r{done}  ", end=end, file=sys.stderr, flush=True)


#: Most tasks of one call: their files in a folder have six digits.
MOST_TASKS = 1_000_000

#: Tasks that are handed to an executor at a time: memory does not grow with the number of tasks.
_WINDOW = 256


@dataclass(frozen=True)
class Rows:
    """Rows of tasks by index; the row of a failed task has `error` with the reason.

    Attributes
    ----------
    rows : tuple of dict
        One for each task.
    computed : int
        Tasks that were computed in this call; the others were in the folder.
    """

    rows: tuple[Row, ...]
    computed: int

    def __repr__(self) -> str:
        lines = [f"<youla.{type(self).__name__}: {len(self.rows)} rows, {len(self.failed)} failed>"]
        for row in self.rows[:4]:
            shown = ", ".join(f"{key} {value:.6g}" if isinstance(value, float) else f"{key} {value}" for key, value in flat(row).items() if not isinstance(value, (dict, list)))
            lines.append(f"  {shown}"[:160])
        return "\n".join([*lines, *(["  ..."] if len(self.rows) > 4 else [])])

    @property
    def failed(self) -> tuple[Row, ...]:
        """Rows of tasks that failed."""
        return tuple(row for row in self.rows if "error" in row)

    @property
    def succeeded(self) -> tuple[Row, ...]:
        """Rows of tasks that did not fail."""
        return tuple(row for row in self.rows if "error" not in row)

    def to_frame(self) -> Any:
        """Return a pandas data frame with a row for each task."""
        pd = need("pandas")
        return pd.DataFrame([flat(row) for row in self.rows])

    def to_parquet(self, folder: str | os.PathLike[str], *, replace: bool = False) -> str:
        """Write a Parquet data set with a row for each task.

        The columns ``hz`` and ``zeta`` hold the oscillating modes as lists, ``real_poles`` the real poles in z, ``a``, ``b``, ``c`` and ``d`` the matrices of the model, and
        ``error`` the reason of a task that failed. Folders of several calls read as one data set.

        Parameters
        ----------
        folder : path
            Folder of the data set; made where it does not exist.
        replace : bool
            Whether to replace a data set that this method wrote before.

        Returns
        -------
        str
            Path of the folder.

        Raises
        ------
        InputError
            Where the folder holds something else, or pyarrow is not installed.

        Examples
        --------
        >>> import tempfile, pandas as pd, youla
        >>> rows = youla.identify_many(["absent.csv"], read={"inputs": "u", "outputs": "y", "dt": 0.01})
        >>> with tempfile.TemporaryDirectory() as parent:
        ...     folder = rows.to_parquet(f"{parent}/fleet")
        ...     pd.read_parquet(folder)["error"].tolist()
        ['absent.csv: no such file']
        """
        return write(self.rows, folder, replace)

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)


def flat(row: Row) -> Row:
    """A row with modes and real poles as columns, and without matrices."""
    found = {key: value for key, value in row.items() if key not in ("modes", "real_poles", "model")}
    found |= {f"pole_{k + 1}": pole for k, pole in enumerate(row.get("real_poles", []))}
    for k, mode in enumerate(row.get("modes", [])):
        found |= {f"hz_{k + 1}": mode[0], f"zeta_{k + 1}": mode[1]}
    return found


def run_tasks(
    task: Task,
    payload: Any,
    items: Iterable[Any],
    *,
    key: str,
    executor: Executor | None,
    folder: str | os.PathLike[str] | None,
    progress: Progress | None,
) -> Rows:
    """Compute the rows of all items; `key` names the payload in the folder."""
    _check_executor(executor)
    if not isinstance(progress, bool):
        callback(progress, "progress")
    single = isinstance(items, (str, bytes, os.PathLike, Mapping, Record)) or getattr(items, "shape", None) == ()
    if single or not isinstance(items, Iterable):
        raise InputError(f"records is {kind(items)}, but must be a list of them or of paths")
    kept = None if folder is None else _prepared(folder, key)
    clock = _Clock(progress, _size(items))
    rows: dict[int, Row] = {}
    missing = ((k, item) for k, item in _counted(items) if not _known(kept, k, item, rows))
    if executor is None:
        computed = 0
        for k, item in missing:
            rows[k] = call(task, payload, item, k, kept)
            computed += 1
            clock.tell(rows)
    else:
        computed = _submit(executor, task, payload, missing, kept, rows, clock)
    return Rows(tuple(rows[k] for k in sorted(rows)), computed)


def _size(items: Iterable[Any]) -> int | None:
    """How many items there are, where that is known."""
    try:
        return len(items) if isinstance(items, Sized) else None
    except OverflowError:  # range(10**30)
        return sys.maxsize


def _counted(items: Iterable[Any]) -> Iterator[tuple[int, Any]]:
    """The items with their numbers; an iterable without end ends at the limit."""
    for k, item in enumerate(items):
        if k >= MOST_TASKS or (_size(items) or 0) > MOST_TASKS:
            raise InputError(f"there are more than {MOST_TASKS} tasks, the most of one call; give parts of them")
        yield k, item


def _check_executor(executor: Any) -> None:
    if executor is None:
        return
    if hasattr(executor, "get_executor"):
        raise InputError("executor is a Dask client; give client.get_executor()")
    if isinstance(executor, type) or not hasattr(executor, "submit"):
        name = executor.__name__ if isinstance(executor, type) else type(executor).__name__
        raise InputError(f"executor is {name}, but must be a concurrent.futures.Executor, or None")


def _submit(
    executor: Executor,
    task: Task,
    payload: Any,
    missing: Iterator[tuple[int, Any]],
    kept: str | None,
    rows: dict[int, Row],
    clock: _Clock,
) -> int:
    computed, running = 0, dict[Future[Row], int]()
    try:
        while True:
            for k, item in islice(missing, _WINDOW - len(running)):
                try:
                    running[executor.submit(call, task, payload, item, k, kept)] = k
                except RuntimeError as error:
                    raise InputError(f"executor takes no tasks ({error}); give one that is open and whose workers live") from None
            if not running:
                return computed
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                index = running.pop(future)
                rows[index] = _checked(future.result(), index, f"{type(executor).__name__} gave as row {index}")
                computed += 1
            clock.tell(rows)
    finally:
        for future in running:
            future.cancel()


def _checked(row: Any, index: int, what: str) -> Row:
    """A row as `call` makes it: of this index, with the modes that were found or an error, of plain numbers and texts."""
    if isinstance(row, dict) and row.get("index") == index and isinstance(row.get("error", row.get("modes")), (str, list)):
        try:
            json.dumps(row)
            return row
        except (TypeError, ValueError, RecursionError):
            pass
    raise InputError(f"{what} {repr(row)[:80]}, but must be a row of the task that was submitted; use an executor that runs what it is given")


def call(task: Task, payload: Any, item: Any, index: int, folder: str | None) -> Row:
    """Compute the row of one task and keep it; runs in a worker.

    Dask computes the tasks of a worker that died again, also those that had finished; their rows are in the folder.
    """
    finished: dict[int, Row] = {}
    if _known(folder, index, item, finished):
        return finished[index]
    try:
        row = {"index": index, **task(payload, item, index)}
    except Error as error:
        row = {"index": index, "error": str(error)}
    text = json.dumps(row)
    if folder is not None:
        _write(os.path.join(folder, f"{index:06d}.json"), json.dumps({"item": name_of(item), "row": row}))
    kept: Row = json.loads(text)
    return kept


def _known(folder: str | None, index: int, item: Any, rows: dict[int, Row]) -> bool:
    """Take the row of a finished task from the folder."""
    if folder is None:
        return False
    path = os.path.join(folder, f"{index:06d}.json")
    try:
        with open(path, encoding="utf-8") as file:
            found = json.load(file)
    except (FileNotFoundError, ValueError):  # absent, or written while the machine failed
        return False
    if not isinstance(found, dict) or not {"item", "row"} <= set(found):
        raise InputError(f"{path} is no row of a task; give another folder, or delete this file")
    if found["item"] != name_of(item):
        raise InputError(f"{path} holds the result of {found['item']}, not of {name_of(item)}; give another folder")
    rows[index] = _checked(found["row"], index, f"{path} holds")
    return True


def name_of(item: Any) -> str:
    """Return the name by which a folder knows an item."""
    if isinstance(item, Record):
        name, dt, channels, data = item._log()
        return f"{name}, {key_of(dt, channels, np.ascontiguousarray(data))}"
    return str(item)


def _prepared(folder: str | os.PathLike[str], key: str) -> str:
    """Make the folder, or refuse one with tasks of other settings."""
    path = folder_of(folder, "folder")
    name = os.path.join(path, "tasks.json")
    try:
        with open(name, encoding="utf-8") as file:
            found = json.load(file).get("key")
    except ValueError:
        raise InputError(f"{name} cannot be read; give another folder, or delete this one") from None
    except FileNotFoundError:
        _write(name, json.dumps({"key": key}))
        return path
    if found != key:
        raise InputError(f"folder {path} holds tasks of other settings, records or seed; give another folder, or delete this one")
    return path


def _write(path: str, text: str) -> None:
    """Write a file whole or not at all."""
    handle, name = tempfile.mkstemp(dir=os.path.dirname(path), suffix=".part")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(text)
    os.replace(name, path)


def key_of(*parts: Any) -> str:
    """A name of settings, systems and arrays: SHA-256 of their content."""
    found = hashlib.sha256()
    for part in parts:
        for content in _content(part):
            found.update(content)
    return found.hexdigest()


#: Attributes that define a system: of youla and SciPy or python-control, in the order in which they are looked for.
_SYSTEMS = (("a", "b", "c", "d"), ("A", "B", "C", "D"), ("num", "den"), ("zeros", "poles", "gain"))


def _content(value: Any) -> Iterator[bytes]:
    """The bytes that define a value; a `repr` would round arrays and leave the matrices of models out."""
    if isinstance(value, Mapping):
        for key in sorted(value, key=str):
            yield repr(key).encode()
            yield from _content(value[key])
    elif isinstance(value, (list, tuple)):
        yield f"{len(value)}:".encode()
        for part in value:
            yield from _content(part)
    elif isinstance(value, (np.ndarray, np.generic)):
        yield f"{value.dtype}{value.shape}".encode()
        if value.dtype.hasobject:
            yield from _content(value.tolist())
        else:
            yield value.tobytes()
    else:
        names = next((n for n in _SYSTEMS if all(hasattr(value, name) for name in n)), None)
        yield repr(value).encode() if names is None else type(value).__name__.encode()
        for name in (*names, "dt") if names else ():
            yield from _content(getattr(value, name, None))
