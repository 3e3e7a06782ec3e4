"""Channels with their own time stamps, as loggers of machines write them, and their way to the clock of the controller."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _native
from ._arrays import Array, as_floats, positive
from ._checks import file_of, listed, table, text
from ._errors import InputError
from ._loggers import Logged, read
from ._optional import need
from ._record import Record
from ._sources import require_seconds

Names = str | Iterable[str] | None

#: Groups of channels, and what they may be absent for.
_GROUPS = ("inputs", "outputs", "excitation", "reference", "alpha")


@dataclass(frozen=True)
class ChannelTiming:
    """The clock of a channel, and what its place in the rows cost.

    Attributes
    ----------
    name : str
        Name of the channel.
    samples : int
        Samples in the log.
    step, longest_step : float
        Median and longest step of its stamps, seconds.
    jitter : float
        Root mean square of the scatter of its stamps about the clock, seconds; of another clock, about its own steps.
    delay : float or None
        Delay of its stamps after those of the first output, seconds; None for another clock.
    placement : str
        ``"sampled"``, one sample for each cycle; ``"held"``, the last value; ``"interpolated"``, between samples of another clock.
    filled : int
        Values of the rows that the log does not have.
    error : float
        Root mean square of the error of what was filled or interpolated, measured on samples that the log has, as a share of the size of the
        channel.
    """

    name: str
    samples: int
    step: float
    longest_step: float
    jitter: float
    delay: float | None
    placement: str
    filled: int
    error: float


@dataclass(frozen=True)
class Synchronised:
    """Records on the clock of the controller.

    Attributes
    ----------
    records : tuple of Record
        One for each part without a gap of more than eight cycles.
    timing : tuple of ChannelTiming
        The clock of each channel.
    drift : float
        Sample time of the controller by the clock of the logger over the stated one, less one.
    left_out : int
        Rows in gaps, and in parts of less than 50 rows, which no record holds.
    """

    records: tuple[Record, ...]
    timing: tuple[ChannelTiming, ...]
    drift: float
    left_out: int

    def to_frame(self) -> Any:
        """Return the timing as a pandas data frame, a row for each channel."""
        pd = need("pandas")
        return pd.DataFrame([vars(t) for t in self.timing]).set_index("name")

    def __repr__(self) -> str:
        width = max(len("channel"), *(len(t.name) for t in self.timing))
        head = f"{'channel':<{width}}  samples      step     jitter      delay  placement     filled  error"

        def line(t: ChannelTiming) -> str:
            delay = "-" if t.delay is None else f"{1e3 * t.delay:.3f} ms"
            return (
                f"{t.name:<{width}} {t.samples:>8} {1e3 * t.step:>6.3f} ms {1e3 * t.jitter:>7.3f} ms {delay:>10}"
                f"  {t.placement:<12} {t.filled:>7} {100 * t.error:>5.1f} %"
            )

        rows = ", ".join(str(len(r)) for r in self.records[:10])
        parts = f"{len(self.records)} record{'s' if len(self.records) > 1 else ''} of {rows} rows of {self.records[0].dt:g} s"
        rest = f"; {self.left_out} rows left out" if self.left_out else ""
        return "\n".join([head, *map(line, self.timing), f"{parts}{rest}; clock {1e6 * self.drift:+.1f} ppm"])


class Channels:
    """Channels with their own time stamps.

    Parameters
    ----------
    data : mapping, DataFrame
        Mapping from names to pairs ``(times, values)``, times in seconds; or a mapping of columns or data frame with one column of the time,
        named by `time`, in which a cell that is not a number means that the channel has no sample there.
    time : str, optional
        Column of the time in seconds, for columns.
    changes_only : str or list of str
        Channels of which a value was written only when it changed.
    units : mapping, optional
        Unit labels by channel name.
    name : str
        Name in reports.

    Raises
    ------
    InputError
        For what cannot be channels, with the argument and the remedy.

    See Also
    --------
    Channels.read : the log of a flight controller or a data logger.

    Examples
    --------
    >>> import numpy as np, youla
    >>> t = 0.01 * np.arange(500)
    >>> value = np.sin(0.3 * np.arange(500) ** 1.1)
    >>> log = youla.Channels({"u": (t + 0.003, value), "y": (t, np.roll(value, 1))})
    >>> found = log.synchronise(inputs="u", outputs="y", dt=0.01)
    >>> len(found.records[0]), found.timing[0].placement, round(found.timing[0].delay, 4)
    (500, 'sampled', 0.003)
    """

    def __init__(
        self,
        data: Any,
        *,
        time: str | None = None,
        changes_only: Names = None,
        units: Mapping[str, str] | None = None,
        name: str = "log",
    ) -> None:
        if isinstance(data, (str, os.PathLike)):
            raise InputError(f"data is {os.fspath(data)!r}; read a log by youla.Channels.read(path), a text file by pandas.read_csv and time=")
        labels = {} if units is None else table(units, "units", "{'u': 'V'}")
        written = [] if changes_only is None else listed(changes_only, "changes_only", "names")
        found = _of_columns(data, time) if time is not None else _of_pairs(data)
        for where, names in (("units", labels), ("changes_only", written)):
            unknown = [n for n in names if n not in found]
            if unknown:
                raise InputError(f"{where} names {unknown[0]!r}, which is no channel; the channels are {_some(found)}")
        self._name = text(name, "name")
        self._channels = {n: Logged(n, str(labels.get(n, "")), t, v, n in written) for n, (t, v) in found.items()}

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, flight: int = 1) -> Channels:
        """Read the log of a machine.

        Parameters
        ----------
        path : str or path
            ULog of PX4 (with pyulog), Betaflight blackbox (orangebox), ArduPilot .bin (pymavlink), WPILib .wpilog (robotpy-wpiutil), ASAM MDF
            .mf4 (asammdf) or TDMS of LabVIEW (npTDMS); recognised by its first bytes. ``pip install 'youla[logs]'`` installs them all.
        flight : int
            Which flight of a Betaflight file, counted from 1.

        Returns
        -------
        Channels
            Every numeric channel of the file, names as the file has them; ``names`` lists them. Those of a .wpilog are written when they change.

        Raises
        ------
        InputError
            For a file of another kind, a damaged one, or where the package that reads it is not installed.
        """
        place = file_of(path, "path")
        made = object.__new__(cls)
        made._name = os.path.basename(place)
        made._channels = {c.name: c for c in read(place, flight)}
        return made

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(self._channels)

    def __getitem__(self, name: str) -> tuple[Array, Array]:
        """Return times, seconds, and values of a channel."""
        channel = self._of(name, "channels")
        return channel.times, channel.values

    def _of(self, name: Any, group: str) -> Logged:
        if name not in self._channels:
            raise InputError(f"{group} names {name!r}, which is no channel; the channels are {_some(self._channels, name)}")
        return self._channels[name]

    def synchronise(
        self,
        *,
        dt: float,
        inputs: Names = None,
        outputs: Names = None,
        excitation: Names = None,
        reference: Names = None,
        alpha: Names = None,
        changes_only: Names = None,
    ) -> Synchronised:
        """Bring channels to the clock of the controller.

        Parameters
        ----------
        dt : float
            Sample time of the controller, seconds.
        inputs, outputs, excitation, reference, alpha : str or list of str
            Channels, as for `Record`.
        changes_only : str or list of str, optional
            Chosen channels of which a value was written only when it changed, beside those that are known for it.

        Returns
        -------
        Synchronised
            Records for `identify` and `check`, and the timing of each channel: rate, scatter, delay, what was filled, and how wrong that is.

        Raises
        ------
        InputError
            Where the channels do not follow `dt`, do not overlap, or where what is missing would decide the result.

        Notes
        -----
        Stamps only count the cycles: their scatter, a constant delay of a channel and a drift between the clocks of machine and logger cost
        nothing. A cycle begins with its outputs. Single missing samples are filled by their conditional mean, given the rows around them; a
        gap of more than eight cycles cuts the record.
        """
        groups = dict(zip(_GROUPS, (inputs, outputs, excitation, reference, alpha), strict=True))
        chosen = {g: [] if n is None else listed(n, g, "names") for g, n in groups.items()}
        for group in ("inputs", "outputs"):
            if not chosen[group]:
                raise InputError(f"{group} is missing: name at least one of {_some(self._channels)}")
        every = [name for names in chosen.values() for name in names]
        twice = next((n for n in every if every.count(n) > 1), None)
        if twice is not None:
            raise InputError(f"{twice!r} is chosen twice; choose each channel once")
        also = [] if changes_only is None else listed(changes_only, "changes_only", "names")
        for name in also:
            if name not in every:
                raise InputError(f"changes_only names {name!r}, which is not chosen; chosen are {_some(every)}")
        parts, units = [], {}
        for group, names in chosen.items():
            for name in names:
                c = self._of(name, group)
                units[name] = c.unit
                parts.append((name, c.unit, group, c.changes_only or name in also, c.times, c.values))
        step = positive(dt, "dt")
        records, timing, drift, left_out = _native.synchronise(self._name, parts, step)
        several = len(records) > 1
        kinds = [ChannelTiming(**t) for t in json.loads(timing)]
        steps = {t.name: t.step for t in kinds if t.placement == "interpolated"}

        def record(k: int, data: Array) -> Record:
            name = f"{self._name}, part {k + 1}" if several else self._name
            columns = dict(zip(every, data.T, strict=True))
            groups: dict[str, Any] = dict(chosen)
            return Record(columns, dt=step, name=name, units=units, sampled_every=steps, **groups)

        made = tuple(record(k, data) for k, (data, _) in enumerate(records))
        return Synchronised(made, tuple(kinds), drift, left_out)

    def __repr__(self) -> str:
        def line(c: Logged) -> str:
            steps = np.diff(c.times)
            if not steps.size:
                return f"  {c.name}: {len(c.values)} samples"
            how = "changes only" if c.changes_only else f"step {1e3 * float(np.median(steps)):.4g} ms, at most {1e3 * float(steps.max()):.4g} ms"
            return f"  {c.name}: {len(c.values)} samples, {how}"

        shown = list(self._channels.values())[:8]
        rest = len(self._channels) - len(shown)
        more = [f"  and {rest} more; .names lists all"] if rest else []
        return "\n".join([f"<youla.Channels {self._name!r}: {len(self._channels)} channels", *map(line, shown), *more]) + ">"


def _some(names: Iterable[str], like: Any = "") -> str:
    """At most ten names, those that share a word with `like` first."""
    every = list(names)
    words = [w for w in str(like).lower().replace("[", ".").split(".") if len(w) > 1]
    every.sort(key=lambda n: -sum(w in n.lower() for w in words))
    return ", ".join(every[:10]) + (f" and {len(every) - 10} more" if len(every) > 10 else "")


def _of_pairs(data: Any) -> dict[str, tuple[Array, Array]]:
    example = "{'u': (times, values), 'y': (times, values)}, or columns with time= naming the one of the time"
    found = {}
    for name, pair in table(data, "data", example).items():
        if not isinstance(pair, (tuple, list)) or len(pair) != 2:
            raise InputError(f"data[{name!r}] is no pair (times, values); give {example}")
        times, values = (as_floats(part, f"data[{name!r}][{k}]").ravel() for k, part in enumerate(pair))
        found[name] = (times, values)
    return found


def _of_columns(data: Any, time: str) -> dict[str, tuple[Array, Array]]:
    try:
        names = [str(n) for n in (data.columns if hasattr(data, "columns") else data)]
        columns = {n: data[n] for n in names}
    except (TypeError, KeyError):
        raise InputError("data is no data frame and no mapping of columns, but time= names a column; give one of them") from None
    if time not in columns:
        raise InputError(f"time names {time!r}, which is no column; the columns are {_some(names)}")
    require_seconds(f"time {time!r}", time)
    times = as_floats(columns.pop(time), f"time {time!r}").ravel()
    found = {}
    for name, column in columns.items():
        values = as_floats(column, f"channel {name!r}").ravel()
        if len(values) != len(times):
            raise InputError(f"channel {name!r} has {len(values)} cells, the time {len(times)}; give columns of equal length")
        there = ~np.isnan(values)
        if there.any():
            found[name] = (times[there], values[there])
    return found
