"""Checks of arguments: each error names the argument, what it is, and what it must be."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np

from ._errors import InputError


def text(value: Any, what: str) -> str:
    """Return a text that is not empty."""
    if not isinstance(value, str) or not value:
        raise InputError(f"{what} is {value!r}, but must be a text that is not empty")
    return value


def table(value: Any, what: str, example: str) -> dict[str, Any]:
    """Return a mapping with texts as keys, as a dictionary."""
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise InputError(f"{what} is {kind(value)}, but must be a mapping such as {example}")
    return dict(value)


def known(names: Iterable[str], among: Iterable[str], function: str) -> None:
    """Refuse keywords that a function does not have, with the nearest that it has."""
    there = list(among)
    for name in names:
        if name not in there:
            near = get_close_matches(name, there, 1, 0.6)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise InputError(f"{function} has no argument {name!r}; {hint}options are {', '.join(there)}")


def path_of(value: Any, what: str) -> str:
    """Return the path of a file or folder as text."""
    if not isinstance(value, (str, os.PathLike)) or not os.fspath(value):
        raise InputError(f"{what} is {value!r}, but must be a path")
    return str(os.fspath(value))


def file_of(value: Any, what: str) -> str:
    """Return the path of a file that is there."""
    path = path_of(value, what)
    if os.path.isdir(path):
        raise InputError(f"{what} is the folder {path}, but must be a file; name one of its files")
    if not os.path.exists(path):
        raise InputError(f"{path}: no such file; {what} is read from the folder {os.getcwd()} unless its path is absolute")
    return path


def write_file(path: Any, what: str, content: str) -> None:
    """Write a text, or say why the place cannot be written."""
    place = path_of(path, what)
    try:
        with open(place, "w", encoding="utf-8") as file:
            file.write(content)
    except OSError as error:
        raise InputError(f"{what} is {place}, which cannot be written ({error.strerror}); give another place") from None


def folder_of(value: Any, what: str) -> str:
    """Return the absolute path of a folder, made where it is not there."""
    path = os.path.abspath(path_of(value, what))
    try:
        os.makedirs(path, exist_ok=True)
    except OSError as error:
        raise InputError(f"{what} {path} is no folder and cannot be made ({error.strerror}); give another folder") from None
    return path


def callback(value: Callable[..., Any] | None, what: str) -> None:
    """Refuse what cannot be called."""
    if value is not None and not callable(value):
        raise InputError(f"{what} is {value!r}, but must be True, or a function of the number of finished tasks, or None")


def share(value: Any, what: str) -> float:
    """Return a number between 0 and 1, both excluded."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not 0 < float(value) < 1:
        raise InputError(f"{what} is {value!r}, but must be between 0 and 1")
    return float(value)


def choice(value: Any, what: str, choices: Sequence[str]) -> str:
    """Return one of the texts; `choices` may explain them in parentheses."""
    if not isinstance(value, str) or value not in [c.partition(" ")[0] for c in choices]:
        explained = [f"{c.partition(' ')[0]!r}{c[len(c.partition(' ')[0]) :]}" for c in choices]
        raise InputError(f"{what} is {value!r}, but must be {' or '.join(explained)}")
    return value


def truth(value: Any, what: str) -> bool:
    """Return True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{what} is {kind(value)}, but must be True or False")
    return bool(value)


def place(value: Any, what: str, count: int, of: str) -> int:
    """Return the number of one of `count` things, counted from 0."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not 0 <= value < count:
        raise InputError(f"{what} is {value!r}, but {of}, counted from 0")
    return int(value)


def listed(value: Any, what: str, of: str) -> list[Any]:
    """Return the entries of a list, tuple, array or generator."""
    try:
        return [value] if isinstance(value, (str, bytes, Mapping)) else list(value)
    except TypeError:
        raise InputError(f"{what} is {value!r}, but must be a list of {of}") from None


def kind(value: Any) -> str:
    """The type of a value with its article, for messages."""
    name = type(value).__name__
    return "None" if value is None else f"{'an' if name[0].lower() in 'aeiou' else 'a'} {name}"
