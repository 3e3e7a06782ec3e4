"""Arrays of users as arrays of float64, with errors that name the argument and the remedy."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import InputError

Array = npt.NDArray[np.float64]


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
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        raise InputError(f"{what} has masked values; fill or cut them out first, for example with .compressed()")
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise InputError(f"{what} is not an array: {error}; give rows of equal length") from None
    if array.dtype.kind not in "fiub":
        kinds = {"O": "Python objects", "U": "text", "S": "bytes", "c": "complex numbers", "M": "dates", "m": "durations"}
        found = kinds.get(array.dtype.kind, str(array.dtype))
        raise InputError(f"{what} holds {found}, but must hold real numbers; convert with .astype(float) first")
    floats: Array = np.asarray(array, dtype=np.float64)
    return floats


def as_matrix(values: Any, what: str) -> Array:
    """Return a number, a row or a matrix as a two-dimensional array; see `as_floats`."""
    array = as_floats(values, what)
    if array.ndim > 2:
        raise InputError(f"{what} has {array.ndim} dimensions, but must have at most 2")
    return np.atleast_2d(array)


def positive(value: Any, what: str) -> float:
    """Return a positive finite number."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{what} is {value!r}, but must be a positive number") from None
    if not (number > 0 and np.isfinite(number)):
        raise InputError(f"{what} is {number}, but must be a positive number")
    return number


def whole(value: Any, what: str, least: int) -> int:
    """Return a whole number of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InputError(f"{what} is {value!r}, but must be a whole number of at least {least}")
    return int(value)
