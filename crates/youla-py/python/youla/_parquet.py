"""Rows of tasks as a Parquet data set."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Any

from ._checks import folder_of, path_of, truth
from ._errors import InputError
from ._optional import need

Row = dict[str, Any]

#: Columns with one type in every data set, whatever its rows hold; `list` and `matrix` are of numbers.
_TYPES = {
    "index": "int64",
    "record": "string",
    "trusted": "bool",
    "order": "int64",
    "dead_time": "counts",
    "least_fit": "float64",
    "hz": "list",
    "zeta": "list",
    "real_poles": "list",
    "ts": "float64",
    "a": "matrix",
    "b": "matrix",
    "c": "matrix",
    "d": "matrix",
    "error": "string",
}


def write(rows: Sequence[Row], folder: str | os.PathLike[str], replace: bool) -> str:
    """Write the rows into a folder and return its path."""
    pa, parquet = need("pyarrow"), need("pyarrow.parquet")
    path = os.path.abspath(path_of(folder, "folder"))
    file = os.path.join(path, "part-0.parquet")
    if os.path.exists(path) and not os.path.isdir(path):
        raise InputError(f"folder {path} is a file; give the folder of the data set")
    there = os.listdir(path) if os.path.isdir(path) else []
    if there and not (truth(replace, "replace") and there == ["part-0.parquet"]):
        remedy = "give another folder" if replace else "give another folder, or replace=True"
        raise InputError(f"folder {path} holds {sorted(there)[0]}; {remedy}")
    found = [_columns(row) for row in rows]
    names = list(dict.fromkeys([*(n for row in found for n in row if n != "error"), "error"]))
    table = pa.table({name: _array(pa, name, [row.get(name) for row in found]) for name in names})
    folder_of(path, "folder")
    # Readers of a data set pass over names that start with a dot.
    part = os.path.join(path, ".part-0")
    parquet.write_table(table, part)
    os.replace(part, file)
    return path


def _columns(row: Row) -> Row:
    """A row with modes and matrices as columns of one meaning for any number of modes."""
    found = {key: value for key, value in row.items() if key not in ("modes", "model")}
    if "modes" in row:
        found |= {"hz": [m[0] for m in row["modes"]], "zeta": [m[1] for m in row["modes"]]}
    return {**found, **row.get("model", {})}


def _array(pa: Any, name: str, values: list[Any]) -> Any:
    kinds = {"list": pa.list_(pa.float64()), "matrix": pa.list_(pa.list_(pa.float64())), "counts": pa.list_(pa.int64())}
    if name in _TYPES:
        kind = _TYPES[name]
        return pa.array(values, kinds.get(kind) or pa.type_for_alias(kind))
    try:
        return pa.array(values)
    except (pa.ArrowInvalid, pa.ArrowTypeError):
        # Values of several types under one option of a scan.
        return pa.array([None if v is None else json.dumps(v) for v in values])
