"""What a record can be made of: arrays, frames, responses of python-control, files."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _native
from ._arrays import Array, as_floats
from ._checks import file_of, kind, path_of
from ._errors import InputError
from ._gaps import refuse_masked
from ._optional import need
from ._wrapped import refuse_wrapped


@dataclass(frozen=True)
class Source:
    """Columns with their names, units and sample time."""

    data: Array
    dt: float
    names: list[str]
    units: list[str]
    default: dict[str, list[str | int]] = field(default_factory=dict)

    def column(self, place: str | int, group: str) -> int:
        """Return the index of a column by name or number."""
        if isinstance(place, str):
            if place in self.names:
                return self.names.index(place)
            known = ", ".join(name for name in self.names if name) or "without names; choose by number"
            raise InputError(f"{group} names {place!r}, which is no channel; the channels are {known}")
        if not 0 <= place < self.data.shape[1]:
            raise InputError(f"{group} has column {place}, but data has columns 0 to {self.data.shape[1] - 1}")
        return int(place)


def source_of(data: Any, chosen: dict[str, list[str | int]], time: str | int | None, dt: float | None) -> Source:
    """Recognise `data` by its type."""
    if isinstance(data, (str, os.PathLike)):
        return _of_file(data, chosen, time, dt)
    if _is(data, "control", "TimeResponseData"):
        return _of_response(data, time, dt)
    if _is(data, "control", "FrequencyResponseData"):
        raise InputError("data is a frequency response, not a record over time; give it to youla.identify as it is, or as a youla.Response")
    if _is(data, "youla", "Channels"):
        raise InputError("data is youla.Channels, whose channels have time stamps of their own; bring them to one clock by .synchronise(...).records")
    if _is(data, "pandas", "DataFrame"):
        return _of_pandas(data, chosen, time, dt)
    if _is(data, "polars", "LazyFrame"):
        raise InputError("data is a polars LazyFrame; give data.collect()")
    if _is(data, "polars", "DataFrame"):
        return _of_columns({name: data[name].to_numpy() for name in _needed(data.columns, chosen, time)}, time, dt)
    if isinstance(data, Mapping):
        return _of_columns({name: data[name] for name in _needed(list(data), chosen, time)}, time, dt)
    return _of_array(data, chosen, time, dt)


def _is(data: Any, module: str, name: str) -> bool:
    """Whether `data` is of a class of a module that may not be installed."""
    loaded = sys.modules.get(module)
    kind = getattr(loaded, name, None)
    return kind is not None and isinstance(data, kind)


def require_seconds(what: str, column: Any, otherwise: str = "") -> None:
    """Refuse a column of the time whose name states another unit than the second."""
    other = _native.unit_of_time(str(column))
    if other is not None:
        raise InputError(
            f"{what} is in {other[0]} by its name, but times are read in seconds; give a column of seconds (data[{column!r}] {other[1]}){otherwise}"
        )


def _clock(times: Any, dt: float | None, what: str, column: Any = "", turned: str = "data[::-1]") -> float:
    """The sample time; `turned` is how rows in falling order are put right."""
    if times is None and dt is None:
        raise InputError("dt is missing: give the sample time in seconds, or time= with the column that holds it")
    if times is None:
        assert dt is not None
        return dt
    require_seconds(what, column, ", or leave time out and give the sample time as dt=")
    seconds = as_floats(times, what)
    if not np.isfinite(seconds).all():
        raise InputError(f"{what} has a value that is not finite; cut these rows out")
    steps = np.diff(seconds.ravel())
    usual = float(np.median(steps)) if steps.size else 0.0
    if steps.size and usual <= 0:
        falls = f"falls, newest row first; give {turned}" if usual < 0 else "stands still; give the time of every row, or the sample time as dt="
        raise InputError(f"{what} {falls}")
    try:
        return _native.clock(what, np.ascontiguousarray(seconds), dt)
    except InputError:
        # As the readers of files have it: a step may differ from the others by 0.1 %, and by the rounding of the times.
        uneven = np.flatnonzero(np.abs(steps - usual) > 1e-3 * abs(usual))
        if not uneven.size:
            raise
        k = int(uneven[0])
        raise InputError(
            f"{what} is not uniform: sample {k + 1}, counted from 0, comes {steps[k]:.6g} s after the one before, the usual step is {usual:.6g} s "
            f"({uneven.size} such steps); "
            "cut at gaps and give identify a list of records, or bring it to one clock: youla.Channels(data, time=...).synchronise(dt=...)"
        ) from None


def _of_array(data: Any, chosen: dict[str, list[str | int]], time: str | int | None, dt: float | None) -> Source:
    refuse_masked(data, "data")
    array = as_floats(data, "data")
    if array.ndim == 0:
        raise InputError(f"data is {kind(data)}, but must be samples x channels, a mapping, a data frame or the path of a file")
    if array.ndim != 2:
        raise InputError(f"data has {array.ndim} dimensions, but must be samples x channels; use numpy.column_stack")
    if array.shape[0] == 0:
        raise InputError("data has no samples, but a record needs at least 2")
    if array.shape[0] < array.shape[1]:
        shape = f"{array.shape[0]} x {array.shape[1]}"
        raise InputError(f"data is {shape}, but must be samples x channels with more samples than channels; give data.T")
    if isinstance(time, str):
        raise InputError(f"time is {time!r}, but an array has no names; give the number of its column")
    times = None
    if time is not None:
        if not 0 <= time < array.shape[1]:
            raise InputError(f"time is column {time}, but data has columns 0 to {array.shape[1] - 1}")
        times = array[:, time]
    used = {place for places in chosen.values() for place in places if isinstance(place, (int, np.integer)) and 0 <= place < array.shape[1]}
    for place in sorted(used):
        refuse_wrapped(np.asarray(data)[:, place], f"column {place}")
    empty = [""] * array.shape[1]
    return Source(array, _clock(times, dt, "time"), empty, list(empty))


def _of_columns(columns: dict[str, Any], time: str | int | None, dt: float | None) -> Source:
    for name, values in columns.items():
        refuse_masked(values, f"channel {name!r}")
        if name != time:
            refuse_wrapped(values, f"channel {name!r}")
    arrays = {name: as_floats(_seconds(values) if name == time else values, f"channel {name!r}") for name, values in columns.items()}
    # A matrix of one column is a channel, as simulations return it.
    arrays = {name: array[:, 0] if array.ndim == 2 and array.shape[1] == 1 else array for name, array in arrays.items()}
    for name, array in arrays.items():
        if array.ndim != 1:
            raise InputError(f"channel {name!r} has {array.ndim} dimensions, but a column has 1; give one entry per channel")
    lengths = {name: len(array) for name, array in arrays.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"channels differ in length: {lengths}; cut them to the same samples")
    times = arrays.pop(str(time)) if time is not None else None
    if not arrays:
        raise InputError("inputs and outputs are missing: name the channels of data")
    names = list(arrays)
    return Source(np.column_stack(list(arrays.values())), _clock(times, dt, f"time {time!r}", time), names, [""] * len(names))


def _seconds(times: Any) -> Any:
    """Dates and durations as seconds from the first; numbers as they are."""
    dtype = getattr(times, "dtype", None)
    if getattr(dtype, "kind", "") not in ("m", "M") or len(times) == 0:
        return times
    return (times - times[0]) / np.timedelta64(1, "s")


def _needed(known: list[Any], chosen: dict[str, list[str | int]], time: str | int | None) -> list[str]:
    """The columns that are used; others may hold anything."""
    wanted = [(group, place) for group, places in chosen.items() for place in places]
    if time is not None:
        wanted.append(("time", time))
    for group, place in wanted:
        if not isinstance(place, str):
            raise InputError(f"{group} is {place!r}, but the columns of data are chosen by name: {', '.join(map(str, known))}")
        if place not in known:
            names = ", ".join(map(str, known))
            raise InputError(f"{group} names {place!r}, which is no channel; the channels are {names}")
    return list(dict.fromkeys(place for _, place in wanted if isinstance(place, str)))


def _of_pandas(data: Any, chosen: dict[str, list[str | int]], time: str | int | None, dt: float | None) -> Source:
    if data.columns.nlevels > 1:
        raise InputError("data has columns of several levels; name them by one: data.columns = data.columns.map('_'.join)")
    if not any(isinstance(name, str) for name in data.columns):
        raise InputError("data has columns without a text as name; give data.to_numpy() to choose by number, or name them")
    if data.columns.has_duplicates:
        raise InputError(f"data has two columns of one name: {list(data.columns[data.columns.duplicated()])}; rename one")
    times, unit = None, ""
    if time == "index" and "index" not in data.columns:
        times, time = _index_seconds(data.index), None
        unit = data.index.name if data.index.dtype.kind in "fiu" else ""
    elif time is None:
        _check_unused(data.index, dt)
    columns = {name: data[name].to_numpy() for name in _needed(list(data.columns), chosen, time)}
    if times is None:
        return _of_columns(columns, time, dt)
    return _of_columns(columns, None, _clock(times, dt, "the index of data", unit, "data.sort_index()"))


def _check_unused(index: Any, dt: float | None) -> None:
    """An index that nobody asked for may hold the time, and shows rows in another order than they were measured."""
    if index.nlevels > 1 or index.dtype.kind not in "fiuMm":
        return
    if dt is None and type(index).__name__ != "RangeIndex":
        raise InputError("dt is missing: give time='index', which takes the index of data in seconds, dates or durations, or the sample time in seconds")
    if not index.is_monotonic_increasing:
        how = "falls, newest row first" if index.is_monotonic_decreasing else "falls at some rows"
        raise InputError(f"the index of data {how}; give data.sort_index(), or data.reset_index(drop=True) where the rows are in the order of their time")


def _index_seconds(index: Any) -> Any:
    import pandas as pd

    if isinstance(index, pd.DatetimeIndex):
        return (index - index[0]).total_seconds().to_numpy()
    if isinstance(index, pd.TimedeltaIndex):
        return index.total_seconds().to_numpy()
    if index.nlevels > 1 or index.dtype.kind not in "fiu":
        raise InputError(f"the index of data is a {type(index).__name__}, but must hold seconds as numbers, dates or durations")
    return index.to_numpy()


def _of_response(data: Any, time: str | int | None, dt: float | None) -> Source:
    """Channels x time, with a trace between them where there are several experiments."""
    if time is not None:
        raise InputError("time is given, but a TimeResponseData holds its own; leave time out")
    if data.ntraces > 1:
        raise InputError(f"data has {data.ntraces} traces; make one Record of each, for example of an input_output_response")
    count = len(data.time)
    parts: list[Array] = []
    names: list[str] = []
    default: dict[str, list[str | int]] = {"inputs": [], "outputs": []}
    for group, values, labels in (("outputs", data.y, data.output_labels), ("inputs", data.u, data.input_labels)):
        if values is None:
            continue
        parts.append(as_floats(values, group).reshape(-1, count))
        names.extend(map(str, labels))
        default[group] = list(map(str, labels))
    table = np.ascontiguousarray(np.vstack(parts).T)
    return Source(table, _clock(data.time, dt, "the time of data"), names, [""] * len(names), default)


def _of_file(
    path: str | os.PathLike[str], chosen: dict[str, list[str | int]], time: str | int | None, dt: float | None
) -> Source:
    if _is_parquet(path):
        return _of_parquet(path, chosen, time, dt)
    places = list(dict.fromkeys(place for group in chosen.values() for place in group))
    channels = [(str(p), p, "") if isinstance(p, str) else (f"column {p}", f"#{p + 1}", "") for p in places]
    clock = time if time is None or isinstance(time, str) else f"#{time + 1}"
    if dt is None and clock is None:
        raise InputError("dt is missing: give the sample time in seconds, or time= with the column that holds it")
    if not channels:
        raise InputError("inputs and outputs are missing: name the channels of the file")
    if os.path.isdir(path):
        raise InputError(f"data is the folder {os.fspath(path)}, but a record is one file; give youla.identify_many its files")
    data, found, _ = _native.read_log(os.fspath(path), channels, clock, dt)
    for column, (name, _, _) in zip(data.T, channels, strict=True):
        # Text says nothing of types.
        if np.array_equal(column, np.rint(column)) and np.abs(column).max(initial=0.0) < 2**53:
            refuse_wrapped(column.astype(np.int64), f"channel {name!r}")
    source = _File(data, found, ["" if isinstance(p, int) else p for p in places], [""] * len(places))
    source.places.extend(places)
    return source


def _is_parquet(path: str | os.PathLike[str]) -> bool:
    try:
        with open(path, "rb") as file:
            return file.read(4) == b"PAR1"
    except OSError:
        return False  # the reader of the other files says why


def _of_parquet(
    path: str | os.PathLike[str], chosen: dict[str, list[str | int]], time: str | int | None, dt: float | None
) -> Source:
    parquet = need("pyarrow.parquet")
    names = _needed(parquet.read_schema(path).names, chosen, time)
    table = parquet.read_table(path, columns=names)
    columns = {name: table.column(name).to_numpy() for name in names}
    if time is None or columns[str(time)].dtype.kind != "M":
        return _of_columns(columns, time, dt)
    dates = columns.pop(str(time))
    return _of_columns(columns, None, _clock((dates - dates[:1]) / np.timedelta64(1, "s"), dt, f"time {time!r}"))


def refuse_log(path: Any, what: str) -> None:
    """Refuse the path of a log where that of a run.toml is taken: nothing says what its columns mean."""
    name = os.path.basename(path_of(path, what))
    if not name.lower().endswith(".toml"):
        columns = _columns_of(file_of(path, what))
        known = f"; its columns are {', '.join(columns)}" if columns else ""
        raise InputError(f"{what} is {name}, a log; give youla.Record({name!r}, inputs=, outputs=, time=) in its place{known}")


def _columns_of(path: str) -> list[str]:
    """Names of the columns of a text file, as far as its first line has them."""
    try:
        with open(path, encoding="utf-8-sig") as file:
            line = file.readline(2000).strip()
    except (OSError, UnicodeDecodeError):
        return []
    mark = max(",;\t", key=line.count)
    names = [name.strip(" \"'") for name in line.split(mark)]
    return names if len(names) > 1 and not any(_is_number(name) for name in names) else []


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@dataclass(frozen=True)
class _File(Source):
    """The columns of a file that were read, by the places under which they were asked for."""

    places: list[str | int] = field(default_factory=list)

    def column(self, place: str | int, group: str) -> int:
        return self.places.index(place)
