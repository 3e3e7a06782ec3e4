"""Comparison of runs of one machine."""

from __future__ import annotations

import json
import os
import tempfile
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from . import _native
from ._checks import listed, path_of, text
from ._errors import InputError
from ._names import label_of
from ._pages import place_of_page
from ._result import Run


@dataclass(frozen=True)
class Comparison:
    """Names of runs, and the distance of each pair.

    Attributes
    ----------
    runs : tuple of str
        Names of the runs.
    distances : tuple of dict
        ``from`` and ``to``, names of two runs; ``nu_gap``, 0 to 1, or None, and then ``refusal`` says why.
    """

    runs: tuple[str, ...]
    distances: tuple[dict[str, Any], ...]

    def __repr__(self) -> str:
        return f"<youla.Comparison: {len(self.runs)} runs, {len(self.distances)} distances; {', '.join(self.runs[:6])}>"


def compare(
    runs: Sequence[Run | str | os.PathLike[str]], *, model: str = "likelihood", page: Any = None, replace: bool = False
) -> Comparison:
    """Compare one model of several runs of one machine.

    Parameters
    ----------
    runs : sequence of Run or of paths of run folders
        At least two.
    model : str
        Name of the model.
    page : path, optional
        HTML file of the comparison, with its data in a JSON file beside it. A comparison of that name is replaced.
    replace : bool
        Whether to replace any other file of these names as well.

    Returns
    -------
    Comparison
        Names of the runs and the nu-gap, 0 to 1, of each pair.

    Raises
    ------
    InputError
        For fewer than two runs, runs with other numbers of channels, a folder without the model, and a page in the place of a file that youla
        did not write. Channels of other names are a warning.

    Examples
    --------
    >>> import youla
    >>> found = youla.compare([youla.demo(seed=1), youla.demo(seed=2)])
    >>> len(found.runs), len(found.distances)
    (2, 1)
    """
    if isinstance(runs, str):
        raise InputError(f"runs is {runs!r}, but must be a list of at least two youla.Run or run folders")
    runs = listed(runs, "runs", "at least two youla.Run or run folders")
    model = text(model, "model")
    place = None if page is None else place_of_page(page, "page", replace, data_beside=True)
    with tempfile.TemporaryDirectory() as folder:
        paths = [
            run.save(os.path.join(folder, f"run-{k + 1}")) if isinstance(run, Run) else path_of(run, f"runs[{k}]")
            for k, run in enumerate(runs)
        ]
        _same_channels([_channels(place) for place in paths])
        # Run folders name the recommended model by its file.
        found = json.loads(_native.compare(paths, label_of(model), place))
    return Comparison(tuple(found["runs"]), tuple(found["distances"]))


def _channels(folder: str) -> dict[str, list[str]] | None:
    """Names of inputs and outputs of a run folder; `None` for what is none, which the comparison refuses."""
    try:
        with open(os.path.join(folder, "1-record/records.json"), encoding="utf-8") as file:
            found = json.load(file)
        return {group: [channel["name"] for channel in found[group]] for group in ("inputs", "outputs")}
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _same_channels(runs: list[dict[str, list[str]] | None]) -> None:
    """Refuse runs with other numbers of channels, and warn of other names: they may be another machine."""
    first = runs[0] if runs else None
    for k, other in enumerate(runs):
        if first is None or other is None or first == other:
            continue
        told = f"runs[{k}] has {_in_words(other)}, but runs[0] has {_in_words(first)}; compare runs of one machine"
        if any(len(first[group]) != len(other[group]) for group in first):
            raise InputError(told)
        warnings.warn(f"{told}, or give the channels one name in all records", stacklevel=3)


def _in_words(channels: dict[str, list[str]]) -> str:
    return " and ".join(f"the {group} {', '.join(names)}" for group, names in channels.items())
