"""Logs of machines, each read by the package of its vendor or field."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ._arrays import Array
from ._errors import InputError
from ._optional import need


@dataclass(frozen=True)
class Logged:
    """A channel of a log: name, unit, times in seconds, values, whether it is written only when it changes."""

    name: str
    unit: str
    times: Array
    values: Array
    changes_only: bool = False


def read(path: str, flight: int) -> list[Logged]:
    """Read every numeric channel of a log, recognised by its first bytes."""
    with open(path, "rb") as file:
        head = file.read(64)
    found = next((reader for first, reader in _READERS if head.startswith(first)), None)
    if found is None:
        raise InputError(
            f"{path}: not a log that is known by its first bytes (ULog, Betaflight, ArduPilot .bin, wpilog, MDF, TDMS); "
            "give youla.Channels a mapping of (times, values), or a data frame with time="
        )
    try:
        channels = [c for c in map(_without_gaps, found(path, flight)) if len(c.values)]
    except InputError:
        raise
    except Exception as error:  # the packages raise what they meet in a damaged file
        raise InputError(f"{path}: the file is damaged or cut off ({type(error).__name__}: {error})") from None
    if not channels:
        raise InputError(f"{path}: the log holds no numeric channel with time stamps")
    return channels


def _without_gaps(channel: Logged) -> Logged:
    """The samples that are numbers: NaN is how loggers write that there is none."""
    there = ~np.isnan(channel.values)
    return channel if there.all() else replace(channel, times=channel.times[there], values=channel.values[there])


def _floats(values: Any) -> Array:
    return np.ascontiguousarray(values, dtype=np.float64)


def _ulog(path: str, _: int) -> Iterator[Logged]:
    log = need("pyulog").ULog(path)
    topics = [d.name for d in log.data_list]
    for data in log.data_list:
        times = data.data["timestamp"] / 1e6
        topic = f"{data.name}[{data.multi_id}]" if topics.count(data.name) > 1 else data.name
        for field, values in data.data.items():
            if field != "timestamp":
                yield Logged(f"{topic}.{field}", "", times, _floats(values))


def _betaflight(path: str, flight: int) -> Iterator[Logged]:
    parser = need("orangebox").Parser.load(path)
    count = parser.reader.log_count
    if not 1 <= flight <= count:
        raise InputError(f"flight is {flight}, but {path} has flights 1 to {count}")
    parser.set_log_index(flight)
    names = list(parser.field_names)
    rows = [frame.data for frame in parser.frames()]
    times = _floats([row[names.index("time")] for row in rows]) / 1e6
    own = len(parser.reader.field_defs[need("orangebox.types").FrameType.INTRA])
    for k, name in enumerate(names):
        # Slow and GPS fields are repeated in each row, and texts before their first frame.
        values = _floats([row[k] if isinstance(row[k], (int, float)) else np.nan for row in rows])
        if name != "time":
            yield Logged(name, "", times, values, k >= own)


def _ardupilot(path: str, _: int) -> Iterator[Logged]:
    log = need("pymavlink.DFReader").DFReader_binary(path)
    columns: dict[str, tuple[list[float], list[float]]] = {}
    while (message := log.recv_msg()) is not None:
        fields = message.to_dict()
        kind, stamp = fields.pop("mavpackettype"), fields.pop("TimeUS", None)
        if stamp is None:
            continue
        instance = fields.get(getattr(message.fmt, "instance_field", None) or "")
        topic = kind if instance is None else f"{kind}[{instance}]"
        for field, value in fields.items():
            if isinstance(value, (int, float)):
                times, values = columns.setdefault(f"{topic}.{field}", ([], []))
                times.append(stamp / 1e6)
                values.append(value)
    for name, (stamps, values) in columns.items():
        yield Logged(name, "", _floats(stamps), _floats(values))


def _wpilog(path: str, _: int) -> Iterator[Logged]:
    getters = {
        "double": "getDouble",
        "float": "getFloat",
        "int64": "getInteger",
        "boolean": "getBoolean",
        "double[]": "getDoubleArray",
        "float[]": "getFloatArray",
        "int64[]": "getIntegerArray",
    }
    entries: dict[int, tuple[str, str]] = {}
    columns: dict[str, tuple[list[float], list[float]]] = {}
    for record in need("wpiutil.log").DataLogReader(path):
        if record.isStart():
            start = record.getStartData()
            if start.type in getters:
                entries[start.entry] = (start.name, start.type)
        elif not record.isControl() and record.getEntry() in entries:
            name, kind = entries[record.getEntry()]
            value = getattr(record, getters[kind])()
            several = [(f"{name}[{k}]", v) for k, v in enumerate(value)] if kind.endswith("[]") else [(name, value)]
            for channel, number in several:
                times, values = columns.setdefault(channel, ([], []))
                times.append(record.getTimestamp() / 1e6)
                values.append(float(number))
    for name, (times, values) in columns.items():
        # Threads of a robot append to the file in turn.
        order = np.argsort(times, kind="stable")
        yield Logged(name, "", _floats(times)[order], _floats(values)[order], True)


def _mdf(path: str, _: int) -> Iterator[Logged]:
    with need("asammdf").MDF(path) as log:
        seen: dict[str, int] = {}
        for signal in log.iter_channels(skip_master=True):
            if signal.samples.dtype.kind not in "fiub" or signal.samples.ndim != 1:
                continue
            seen[signal.name] = count = seen.get(signal.name, 0) + 1
            name = signal.name if count == 1 else f"{signal.name} ({count})"
            valid = slice(None) if signal.invalidation_bits is None else ~np.asarray(signal.invalidation_bits, dtype=bool)
            yield Logged(name, signal.unit or "", _floats(signal.timestamps)[valid], _floats(signal.samples)[valid])


def _tdms(path: str, _: int) -> Iterator[Logged]:
    every = [(g.name, c) for g in need("nptdms").TdmsFile.read(path).groups() for c in g.channels()]
    timed = [(g, c) for g, c in every if c.dtype.kind in "fiub" and "wf_increment" in c.properties]
    starts = [c.properties.get("wf_start_time") for _, c in timed]
    if any(start is None for start in starts) and len(set(starts)) > 1:
        raise InputError(f"{path}: some channels state the time at which they start, others do not, so that they have no common clock")
    first = min(starts) if starts and starts[0] is not None else None
    for (group, channel), start in zip(timed, starts, strict=True):
        late = 0.0 if first is None else float((start - first) / np.timedelta64(1, "s"))
        unit = str(channel.properties.get("unit_string", ""))
        yield Logged(f"{group}/{channel.name}", unit, late + _floats(channel.time_track()), _floats(channel[:]))


_READERS: list[tuple[bytes, Callable[[str, int], Iterator[Logged]]]] = [
    (b"ULog\x01\x125", _ulog),
    (b"H Product:Blackbox", _betaflight),
    (b"\xa3\x95", _ardupilot),
    (b"WPILOG", _wpilog),
    (b"MDF     ", _mdf),
    (b"TDSm", _tdms),
]
