"""Where a page may be written: a file that youla did not write is not replaced unless that is asked for."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any

from ._checks import path_of, truth
from ._errors import InputError

#: What every page of youla holds among its first bytes.
_GENERATOR = b'<meta name="generator" content="youla '


def place_of_page(path: Any, what: str, replace: Any, *, data_beside: bool = False) -> str:
    """Return the path of a page; with `data_beside` its data go into a JSON file of the same name."""
    place = path_of(path, what)
    stem, suffix = os.path.splitext(place)
    if suffix.lower() != ".html":
        raise InputError(f"{what} is {place}, but the page is an HTML file; give {stem}.html")
    if not truth(replace, "replace"):
        _refuse_foreign(place, f"{what} is {place}", _is_page)
        if data_beside:
            _refuse_foreign(f"{stem}.json", f"{what} is {place}, whose data go into {stem}.json", _is_comparison)
    return place


def _refuse_foreign(place: str, told: str, ours: Callable[[str], bool]) -> None:
    # An empty file, as tempfile makes, holds nothing to lose.
    if os.path.isfile(place) and os.path.getsize(place) and not ours(place):
        raise InputError(f"{told}, a file that is there and that youla did not write; give another name, or replace=True to replace it")


def _is_page(place: str) -> bool:
    with open(place, "rb") as file:
        return _GENERATOR in file.read(2000)


def _is_comparison(place: str) -> bool:
    try:
        with open(place, encoding="utf-8") as file:
            found = json.load(file)
    except ValueError:
        return False
    return isinstance(found, dict) and {"runs", "distances", "report"} <= found.keys()
