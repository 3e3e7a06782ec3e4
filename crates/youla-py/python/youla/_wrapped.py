"""Counters that wrapped: a column of integers that jumps by about the range of its type, and moves little else."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._errors import InputError

#: Largest share of the steps that can be wraps, and of the range that the other steps can take: a binary excitation jumps more often, and
#: noise over the whole range farther.
_WRAPS, _MOVES = 0.02, 1 / 16


def refuse_wrapped(values: Any, what: str) -> None:
    """Refuse a column of an integer type with wraps."""
    dtype = getattr(values, "dtype", None)
    if not isinstance(dtype, np.dtype) or dtype.kind not in "iu" or np.ndim(values) != 1 or len(values) < 3:
        return
    steps = np.diff(np.asarray(values, dtype=np.float64))
    # Frames hold counters of fewer bits in wider columns.
    for bits in {1: (8,), 2: (16,), 4: (16, 32), 8: (16, 32)}[dtype.itemsize]:
        row = _first_wrap(steps, 2.0**bits)
        if row is not None:
            raise InputError(
                f"{what} jumps by about {2**bits} at row {row}, counted from 0, where its counter wrapped; "
                f"give numpy.unwrap(column.astype(float), period={2**bits}) in its place"
            )


def _first_wrap(steps: Any, period: float) -> int | None:
    far = np.abs(steps) > 0.75 * period
    if not 0 < far.mean() < _WRAPS:
        return None
    largest = np.abs(steps[~far]).max(initial=0.0)
    back = np.abs(np.abs(steps[far]) - period).max()
    return int(np.argmax(far)) + 1 if largest < _MOVES * period and back <= 1.5 * largest else None
