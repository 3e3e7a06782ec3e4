"""Records: samples x channels with the meaning of the channels and the sample time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from zlib import crc32

import numpy as np

from ._arrays import Array, positive
from ._checks import listed, table, text
from ._checks import share as between
from ._errors import InputError
from ._optional import need
from ._sources import Source, source_of
from ._types import Log

Names = str | int | Sequence[str | int] | None

#: Groups of channels with their keys in run.toml and the names of unnamed channels.
_GROUPS = (
    ("inputs", "inputs", "u"),
    ("outputs", "outputs", "y"),
    ("excitation", "input_excitation", "d"),
    ("reference", "reference", "r"),
    ("alpha", "alpha", "alpha"),
)

#: Rows that tell whether an array was changed.
_COMPARED = 4096

_LETTERS = {group: letter for group, _, letter in _GROUPS}

#: An array of more numbers holds a channel, not column numbers.
_MOST_CHANNELS = 100


class Record:
    """A log of a machine under feedback.

    Parameters
    ----------
    data : array_like, mapping, DataFrame, TimeResponseData, str or path
        - NumPy array, samples x columns: channels are chosen by column number, counted from 0;
        - mapping from names to columns, pandas or polars data frame: by name;
        - `control.TimeResponseData` (which holds channels x time and is recognised by its type, never by its shape): by
          label; its inputs and outputs are taken where `inputs` and `outputs` are absent;
        - path of a text, MATLAB or NumPy file: by name or column number; of a Parquet file, which pyarrow reads: by name.
    inputs, outputs : str, int or list of them
        Plant inputs u as applied, after saturation, and measured outputs y.
    excitation : str, int or list of them, optional
        Known excitation d added at the plant inputs, one channel per input.
    reference : str, int or list of them, optional
        Known reference r, one channel per output.
    alpha : str, int or list of them, optional
        Known excitation at the port alpha of an observer-based controller, one per input; not with `excitation`.
    dt : float, optional
        Sample time, seconds. Needed unless `time` or a `TimeResponseData` states it; it is never guessed.
    time : str, int or ``"index"``, optional
        Column with the time in seconds; ``"index"`` takes the index of a pandas data frame (numbers in seconds, dates or
        durations). The steps must be equal.
    name : str, optional
        Name in reports.
    units : mapping, optional
        Unit labels by channel name, for example ``{"u": "V"}``.
    sampled_every : mapping, optional
        Of outputs that were interpolated between samples of a clock of their own, the step of these samples in seconds, by channel name; the
        error of the interpolation is in the region of the model. `Channels.synchronise` states it.

    Raises
    ------
    InputError
        For what cannot be a record, with the argument and the remedy.

    Notes
    -----
    An array of float64 is not copied, and never changed. Where you change it afterwards, the record is refused; a few thousand rows are
    compared.

    Examples
    --------
    >>> import numpy as np, youla
    >>> log = youla.Record(np.zeros((1000, 2)), inputs=0, outputs=1, dt=1e-3)
    >>> log.samples, log.dt, log.inputs, log.y.shape
    (1000, 0.001, ('u',), (1000, 1))
    """

    def __init__(
        self,
        data: Any,
        *,
        inputs: Names = None,
        outputs: Names = None,
        excitation: Names = None,
        reference: Names = None,
        alpha: Names = None,
        dt: float | None = None,
        time: str | int | None = None,
        name: str = "record",
        units: Mapping[str, str] | None = None,
        sampled_every: Mapping[str, float] | None = None,
    ) -> None:
        if isinstance(data, Record):
            raise InputError("data is already a youla.Record; use it as it is, or cut it by record[first:last]")
        if isinstance(time, (bool, np.bool_)) or not isinstance(time, (str, int, np.integer, type(None))):
            raise InputError(f"time is {time!r}, but must be the name or number of a column, or 'index'")
        labels = {} if units is None else table(units, "units", "{'u': 'V'}")
        for channel, unit in labels.items():
            if not isinstance(unit, str):
                raise InputError(f"units[{channel!r}] is {unit!r}, but must be a text such as 'V'")
        dt = None if dt is None else positive(dt, "dt")
        asked = dict(zip([g[0] for g in _GROUPS], (inputs, outputs, excitation, reference, alpha), strict=True))
        chosen = {group: _listed(names, group) for group, names in asked.items()}
        source = source_of(data, chosen, time, dt)
        self._set(source, chosen, text(name, "name"), labels)
        steps = {} if sampled_every is None else table(sampled_every, "sampled_every", "{'y': 0.01}")
        for channel, step in steps.items():
            positive(step, f"sampled_every[{channel!r}]")
            if channel not in self.outputs:
                raise InputError(f"sampled_every names {channel!r}, which is no output; outputs are {list(self.outputs)}")
        self._steps = {channel: float(step) for channel, step in steps.items()}

    def _set(self, source: Source, chosen: dict[str, list[str | int]], name: str, units: dict[str, str]) -> None:
        self._name, self._data, self._dt = name, source.data, source.dt
        self._groups: dict[str, tuple[tuple[str, str, int], ...]] = {}
        for group, _, letter in _GROUPS:
            names = source.default.get(group, []) if not chosen[group] else chosen[group]
            columns = [source.column(place, group) for place in names]
            unnamed = [letter] if len(names) == 1 else [f"{letter}{k + 1}" for k in range(len(names))]
            labels = [source.names[c] or unnamed[k] for k, c in enumerate(columns)]
            entries = zip(labels, columns, strict=True)
            self._groups[group] = tuple((n, units.pop(n, source.units[c]), c) for n, c in entries)
        for group in ("inputs", "outputs"):
            if not self._groups[group]:
                raise InputError(f"{group} is missing: name at least one channel, for example {group}=[0] or {group}=['u']")
        plant = [c for group in ("inputs", "outputs") for _, _, c in self._groups[group]]
        twice = next((c for c in plant if plant.count(c) > 1), None)
        if twice is not None:
            where = source.names[twice] or f"column {twice}"
            raise InputError(f"{where} is chosen twice as input or output; choose each channel once")
        # Of several inputs one may be its own excitation: no controller drives it.
        inputs = [c for _, _, c in self._groups["inputs"]]
        own = inputs if len(inputs) > 1 else []
        for group in ("excitation", "reference", "alpha"):
            for k, (name, _, column) in enumerate(self._groups[group]):
                if column in plant and not (group == "excitation" and own[k : k + 1] == [column]):
                    raise InputError(f"{group} names {name!r}, which is an input or output already; choose the column of what is added from outside, or leave {group} out")
        if units:
            raise InputError(f"units names {sorted(units)}, which are no channels; channels are {sorted(self._labels())}")
        if len(self) < 2:
            raise InputError(f"data has {len(self)} samples, but a record needs at least 2")
        self._mark = self._checksum()

    def _labels(self) -> list[str]:
        return [name for group in self._groups.values() for name, _, _ in group]

    def _columns(self, group: str) -> Array | None:
        columns = [column for _, _, column in self._groups[group]]
        if not columns:
            return None
        if columns == list(range(columns[0], columns[0] + len(columns))):
            found = self._data[:, columns[0] : columns[0] + len(columns)]
        else:
            found = self._data[:, columns]
        found = found.view()
        found.flags.writeable = False
        return found

    @property
    def name(self) -> str:
        """Name in reports."""
        return self._name

    @property
    def dt(self) -> float:
        """Sample time, seconds."""
        return self._dt

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the plant inputs."""
        return tuple(name for name, _, _ in self._groups["inputs"])

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the plant outputs."""
        return tuple(name for name, _, _ in self._groups["outputs"])

    @property
    def u(self) -> Array:
        """Plant inputs, samples x m; read-only."""
        found = self._columns("inputs")
        assert found is not None
        return found

    @property
    def y(self) -> Array:
        """Measured outputs, samples x p; read-only."""
        found = self._columns("outputs")
        assert found is not None
        return found

    @property
    def excitation(self) -> Array | None:
        """Known excitation at the plant inputs, samples x m; read-only."""
        return self._columns("excitation")

    @property
    def reference(self) -> Array | None:
        """Known reference, samples x p; read-only."""
        return self._columns("reference")

    @property
    def alpha(self) -> Array | None:
        """Known excitation at the port alpha, samples x m; read-only."""
        return self._columns("alpha")

    def __len__(self) -> int:
        return int(self._data.shape[0])

    def __getitem__(self, rows: slice) -> Record:
        """Return consecutive rows as a record of the same name, without a copy."""
        if not isinstance(rows, slice) or rows.step not in (None, 1):
            raise InputError("a record is cut by record[first:last] with step 1; resample the data before")
        if not all(x is None or isinstance(x, (int, np.integer)) for x in (rows.start, rows.stop)):
            raise InputError(f"a record is cut by numbers of samples, not by {rows.start!r}:{rows.stop!r}; divide seconds by dt")
        return self._with(self._data[rows], self._name)

    def _checksum(self) -> int:
        """Of the values in rows that are spread over the record, the first and the last among them."""
        rows = np.linspace(0, len(self) - 1, min(len(self), _COMPARED)).astype(np.intp)
        found = 0
        for column in sorted({column for group in self._groups.values() for _, _, column in group}):
            found = crc32(self._data[rows, column].tobytes(), found)
        return found

    def _unchanged(self) -> None:
        """Refuse an array that was changed in place: the record would be of other data than was seen."""
        if self._checksum() != self._mark:
            raise InputError(f"the array of {self._name} was changed after youla.Record(...); give Record data.copy(), or make the Record after the change")

    def _with(self, data: Array, name: str) -> Record:
        self._unchanged()
        part = object.__new__(Record)
        part._name, part._data, part._dt, part._groups, part._steps = name, data, self._dt, self._groups, self._steps
        if len(part) < 2:
            raise InputError(f"the rows that are left are {len(part)}, but a record needs at least 2")
        part._mark = part._checksum()
        return part

    def named(self, name: str) -> Record:
        """Give another name.

        Parameters
        ----------
        name : str
            Name in reports.

        Returns
        -------
        Record
            The same channels and samples, without a copy.
        """
        return self._with(self._data, text(name, "name"))

    def split(self, share: float = 0.7) -> tuple[Record, Record]:
        """Cut into a part to identify from and a part to verify on.

        Parameters
        ----------
        share : float
            Share of the samples in the first part, between 0 and 1.

        Returns
        -------
        tuple of Record
            Named ``<name>-estimation`` and ``<name>-verification``.
        """
        at = round(between(share, "share") * len(self))
        first, second = self._data[:at], self._data[at:]
        return self._with(first, f"{self._name}-estimation"), self._with(second, f"{self._name}-verification")

    def to_frame(self) -> Any:
        """Return the channels as a pandas data frame with the time in seconds as its index."""
        pd = need("pandas")
        columns = {name: self._data[:, column] for group in self._groups.values() for name, _, column in group}
        return pd.DataFrame(columns, index=pd.Index(np.arange(len(self)) * self._dt, name="t"))

    def __repr__(self) -> str:
        groups = ", ".join(f"{g}={[n for n, _, _ in c]}" for g, c in self._groups.items() if c)
        return f"<youla.Record {self._name!r}: {len(self)} samples of {self._dt:g} s, {groups}>"

    def _log(self) -> Log:
        self._unchanged()
        channels = [channel for group in self._groups.values() for channel in group]
        return (self._name, self._dt, channels, self._data)

    def _tables(self) -> dict[str, list[dict[str, Any]]]:
        """The channels as [data] of run.toml lists them."""
        groups = ((key, self._groups[group]) for group, key, _ in _GROUPS)

        def channel(key: str, name: str, unit: str) -> dict[str, Any]:
            step = self._steps.get(name) if key == "outputs" else None
            return {"name": name, "unit": unit} | ({} if step is None else {"sampled_every": step})

        return {key: [channel(key, n, unit) for n, unit, _ in of] for key, of in groups if of}


def _listed(names: Names, group: str) -> list[str | int]:
    if names is None:
        return []
    if isinstance(names, Mapping):
        raise InputError(f"{group} is {names!r}; channels are chosen by name or column number, or a list of them")
    places = [names] if isinstance(names, (int, np.integer)) else listed(names, group, "names or column numbers")
    values = np.asarray(names) if hasattr(names, "__array__") and not hasattr(names, "columns") else np.empty(0)
    if values.ndim and values.size and (values.dtype.kind in "fc" or values.size > _MOST_CHANNELS):
        raise InputError(
            f"{group} is an array of {values.size} values, but channels are chosen by name or column number; put it into data as a column, "
            f"by numpy.column_stack or data[{_LETTERS[group]!r}] = ..., and name that column"
        )
    for place in places:
        if isinstance(place, bool) or not isinstance(place, (str, int, np.integer)):
            raise InputError(f"{group} has {place!r}; channels are chosen by name or column number")
    return places
