"""Options: tables of run.toml as keywords, and what they may hold."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ._checks import choice, known, table
from ._errors import InputError

#: Tables of run.toml that are keywords.
OPTIONS = (
    "recommended", "factors", "hansen", "direct", "reduction", "grey_box", "redesign",
    "verification", "check", "frequency_response", "data",
)  # fmt: skip


#: Other arguments of the functions that take these keywords, for hints.
_ARGUMENTS = {
    "identify": ("nominal", "controller", "feedback", "hold", "verify", "name"),
    "check": ("nominal", "controller", "feedback", "hold"),
    "identify_many": ("nominal", "controller", "feedback", "hold", "name", "read", "executor", "folder", "progress"),
}

#: Tables of models with an order that is identified.
_IDENTIFIED = ("recommended", "hansen", "direct")

#: Keys of [redesign] that a structure does not use.
_WITHOUT_STRUCTURE = ("method", "input_weights", "peak_sensitivity")

#: Keys of [redesign.pid].
_PID = ("terms", "notches", "discretisation", "peak_sensitivity", "gain_margin", "phase_margin", "delay_margin", "command_effort")

#: Least phase margin that can be asked for, degrees: 1.5 rad are below it, and no controller is that close to instability on purpose.
_LEAST_PHASE = 5.0


def check_options(options: Mapping[str, Any], function: str) -> None:
    """Refuse keywords that are no tables of run.toml."""
    known(options, [*OPTIONS, *_ARGUMENTS[function]], function)
    for key, given in options.items():
        if not isinstance(given, Mapping):
            raise InputError(f"{key} is {type(given).__name__}, but must be a mapping as the table [{key}] of run.toml")
        if key in _IDENTIFIED:
            check_order(given.get("order"), f"{key}['order']")
    if "redesign" in options:
        check_redesign(options["redesign"], "redesign")


def check_order(order: Any, what: str) -> None:
    """Refuse an order below 1; other values are told by the key that they are of."""
    if isinstance(order, (int, np.integer)) and not isinstance(order, bool) and order < 1:
        raise InputError(f"{what} is {order}, but must be a whole number of at least 1, or 'auto'")


def check_redesign(options: Mapping[str, Any], function: str) -> None:
    """Refuse what the chosen structure does not use, with the place where it belongs."""
    for key in options:
        if key in _PID and key != "peak_sensitivity":
            raise InputError(f"{key} is a key of pid; give structure='pid' and pid={{{key!r}: {options[key]!r}}}")
    known(options, [*_WITHOUT_STRUCTURE, "structure", "pid"], function)
    if options.get("structure") is None:
        if options.get("pid") is not None:
            raise InputError("pid is not used without structure='pid'; give structure='pid' too, or leave pid out")
        return
    choice(options["structure"], "structure", ("pid",))
    for key in _WITHOUT_STRUCTURE:
        value = options.get(key)
        if value is not None:
            remedy = f"give pid={{{key!r}: {value!r}}}" if key in _PID else "leave it out"
            raise InputError(f"{key} is not used with structure='pid'; {remedy}")
    if options.get("pid") is not None:
        _check_pid(table(options["pid"], "pid", "{'peak_sensitivity': 1.7}"))


def _check_pid(limits: dict[str, Any]) -> None:
    known(limits, _PID, "pid")
    phase = limits.get("phase_margin")
    if isinstance(phase, (int, float, np.number)) and 0 < phase < _LEAST_PHASE:
        raise InputError(f"pid['phase_margin'] is {phase:g}, but is in degrees: give at least {_LEAST_PHASE:g}, such as 40, or 0 for no limit")


#: Words of run.toml and of the command line, and those of this package for them, in this order.
_TABLES = "|".join([*(name for name in OPTIONS if name != "data"), "controller", "nominal"])
_IN_PYTHON = (
    (r"`?--[\w-]+`?, or |, --[\w-]+(?=\))| to run\.toml", ""),
    *(
        # Not where a column of the user's has the name.
        (rf"(?<=\[data\] ){key}\b|(?<=`){key}(?=`)|(?<=check ){key}\b|(?<=excitation: ){key}\b|\b{key}(?= in \[data\])|(?<=\(){key}(?=\))", ours)
        for key, ours in (("input_excitation", "excitation"), ("sample_time", "dt"), ("time_column", "time"))
    ),
    (r"`?(detrend|disturbance)`? in \[data\]|\[data\] (detrend|disturbance)\b", r"data={'\1\2': ...}"),
    (r" in \[data\]", " of the record"), (r"\[data\] (has|lists|names|states)\b", r"the record \1"), (r"\[data\] (\w+)", r"\1 of the record"), (r"\[data\]", "the record"),
    (r"`?(feedback|hold)`? in \[controller\]|\[controller\] (feedback|hold)\b|`(\w+)` in \[excite\]", r"\1\2\3="),
    (rf"`(\w+)` in \[({_TABLES})\]", r"\2={'\1': ...}"), (rf"\[({_TABLES})\] (\w+_\w+|\w+(?= = ))", r"\1={'\2': ...}"),
    (rf"\[({_TABLES})\.(\w+)\]", r"\1={'\2': ...}"), (rf"\[({_TABLES})\](?=:)", r"\1"), (rf"\[({_TABLES})\]", r"\1="),
)  # fmt: skip


def in_python(told: str) -> str:
    """What is said in words of run.toml and of the command line, with the arguments of this package."""
    for words, ours in _IN_PYTHON:
        told = re.sub(words, ours, told)
    return told


def plain(value: Any, where: str = "an option") -> Any:
    """Settings as numbers, text, lists and mappings; what is None is absent. `where` is the place of the value, for messages."""
    if isinstance(value, Mapping):
        inside = "" if where == "an option" else f"{where}."
        return {str(key): plain(v, f"{inside}{key}") for key, v in value.items() if v is not None}
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(v, where) for v in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{where} is {value}, but must be finite; leave it out where it is not known")
    if isinstance(value, (str, bool, int, float)):
        return value
    raise InputError(f"{where} is {value!r}, but options are numbers, text, lists and mappings")
