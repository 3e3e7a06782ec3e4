"""Arrays of users as arrays of float64, with errors that name the argument and the remedy."""

from __future__ import annotations

import sys
from collections.abc import Sized
from decimal import Decimal
from numbers import Real
from typing import Any

import numpy as np
import numpy.typing as npt

from ._checks import kind
from ._errors import InputError

Array = npt.NDArray[np.float64]

#: Most numbers of one array: 1 GB as float64, as of the files of logs. `numpy.broadcast_to` shows more than any memory holds.
MOST_NUMBERS = 125_000_000

#: Kinds of arrays that hold no real numbers, and what to do.
_KINDS = {
    "O": ("Python objects", "convert with .astype(float) first"),
    "U": ("text", "convert with .astype(float) first"),
    "S": ("bytes", "convert with .astype(float) first"),
    "c": ("complex numbers", "a frequency response goes into youla.Response; of complex samples give real and imaginary part as two channels"),
    "M": ("dates", "name the column with the time by time="),
    "m": ("durations", "name the column with the time by time="),
    "V": ("records with fields", "give a mapping: {name: array[name] for name in array.dtype.names}"),
}


def as_floats(values: Any, what: str) -> Array:
    """Return `values` as float64 in native byte order, without a copy where they already are.

    Parameters
    ----------
    values : array_like
        Real numbers.
    what : str
        Name of the argument in errors.

    Returns
    -------
    ndarray
        The numbers; a view of `values` where no conversion is needed.

    Raises
    ------
    InputError
        For text, objects, complex numbers, masked values and dates.
    """
    if masked(values):
        raise InputError(f"{what} has masked values; fill them or cut them out first")
    limited(values, what)
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise InputError(f"{what} is not an array: {error}; give rows of equal length") from None
    except Exception as error:  # what `__array__` of another package raises
        raise InputError(f"{what} is {kind(values)} that is no NumPy array: {error}") from None
    if array.ndim == 0 and array.dtype.kind in "OSU":
        raise InputError(f"{what} is {kind(values)}, but must be an array or a list of real numbers")
    if array.dtype.kind not in "fiub":
        found, remedy = _KINDS.get(array.dtype.kind, (str(array.dtype), "convert with .astype(float) first"))
        raise InputError(f"{what} holds {found}, but must hold real numbers; {remedy}")
    floats: Array = np.asarray(array, dtype=np.float64)
    return floats


def masked(values: Any) -> bool:
    """Whether an array has masked values; where numpy.ma is not loaded, which takes 1 MB, there is none."""
    ma = sys.modules.get("numpy.ma")
    return ma is not None and isinstance(values, ma.MaskedArray) and bool(ma.is_masked(values))


def limited(values: Any, what: str) -> None:
    """Refuse more numbers than are read, before any of them is copied."""
    size = getattr(values, "size", None)
    try:
        count = size if isinstance(size, int) else len(values) if isinstance(values, Sized) else 0
    except OverflowError:  # range(10**30)
        count = sys.maxsize
    if count > MOST_NUMBERS:
        raise InputError(f"{what} has {count} numbers, but may have at most {MOST_NUMBERS} (1 GB); give fewer rows or columns, or resample")


def as_matrix(values: Any, what: str) -> Array:
    """Return a number, a row or a matrix as a two-dimensional array; see `as_floats`."""
    array = as_floats(values, what)
    if array.ndim > 2:
        raise InputError(f"{what} has {array.ndim} dimensions, but must have at most 2")
    return np.atleast_2d(array)


def positive(value: Any, what: str, unit: str = "seconds") -> float:
    """Return a positive finite number of a unit."""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.item()
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (Real, Decimal)):
        raise InputError(f"{what} is {value!r}, but must be a positive number of {unit}")
    number = float(value)
    if not (number > 0 and np.isfinite(number)):
        raise InputError(f"{what} is {number}, but must be a positive number of {unit}")
    return number


def seeded(value: Any) -> int:
    """Return a seed, which must be stated."""
    if value is None:
        raise InputError("seed is missing; give a whole number, such as seed=1: the same seed gives the same rows again")
    return whole(value, "seed", 0)


def whole(value: Any, what: str, least: int, most: int = 2**64 - 1) -> int:
    """Return a whole number from `least` to `most`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InputError(f"{what} is {value!r}, but must be a whole number of at least {least}")
    if value > most:
        raise InputError(f"{what} is {value}, but must be {'below 2^64' if most >= 2**64 - 1 else f'at most {most}'}")
    return int(value)
