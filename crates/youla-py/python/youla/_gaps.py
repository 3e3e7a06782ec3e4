"""Samples without a value, in words: where they are, and the parts between them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._arrays import masked
from ._errors import InputError

#: Most parts that a message lists.
_LISTED = 4


def _runs(bad: Any) -> list[tuple[int, int]]:
    """First rows of the runs of true values, and the rows after them."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], bad, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _where(bad: Any) -> str:
    """The first run of true values in words, with the number of all."""
    (first, last), *others = _runs(bad)
    rows = f"sample {first}" if last == first + 1 else f"samples {first} to {last - 1}"
    more = f", and at {len(others)} more place{'s' if len(others) > 1 else ''}" if others else ""
    return f"{rows}, counted from 0{more}"


def _parts(bad: Any, name: str) -> str:
    """The parts between the runs of true values that can be records, as Python."""
    edges = [0, *(k for run in _runs(bad) for k in run), len(bad)]
    kept = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 2]
    shown = [f"{name}[{a or ''}:{'' if b == len(bad) else b}]" for a, b in kept[:_LISTED]]
    return ", ".join([*shown, *(["..."] if len(kept) > _LISTED else [])])


def _many(bad: Any) -> str:
    """What else helps against scattered single samples."""
    return "; youla.Channels(data, time=).synchronise(dt=) fills single samples and cuts at gaps" if len(_runs(bad)) >= _LISTED else ""


def refuse_masked(values: Any, what: str) -> None:
    """Refuse masked values of a record with the parts that have none."""
    if masked(values) and values.ndim:
        bad = np.ma.getmaskarray(values).reshape(len(values), -1).any(axis=1)
        raise InputError(
            f"{what} has masked values at {_where(bad)}; make a Record of each part without them, "
            f"{_parts(bad, 'data')}, and give identify their list{_many(bad)}"
        )


def refuse_not_finite(bad_of: dict[str, Any], record: str) -> None:
    """Refuse channels with values that are not finite, given by name where each has them, with the parts that have none."""
    name, first = next((n, bad) for n, bad in bad_of.items() if bad.any())
    every = np.logical_or.reduce(list(bad_of.values()))
    left = _parts(every, "record")
    remedy = f"identify from the parts without such samples, [{left}]{_many(every)}" if left else "check its column"
    raise InputError(f"{record}: channel {name!r} is not finite at {_where(first)}; {remedy}")
