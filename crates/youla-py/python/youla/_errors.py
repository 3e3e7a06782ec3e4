"""The exceptions of the package."""

from __future__ import annotations


class Error(Exception):
    """Base of all exceptions of this package; the message states what, where and the remedy."""


class InputError(Error, ValueError):
    """An argument cannot be used as it is given; the program exits with code 2 for the same reason."""


class NumericalError(Error, ArithmeticError):
    """The arguments are well formed, but the computation is impossible on them; exit code 3 of the program."""
