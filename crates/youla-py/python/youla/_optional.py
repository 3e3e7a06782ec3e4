"""Packages that are used where they are installed."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ._errors import InputError

#: The extra of this package that installs each of them.
_EXTRAS = {
    "anywidget": "notebook",
    "asammdf": "logs",
    "control": "control",
    "matplotlib.pyplot": "plot",
    "nptdms": "logs",
    "orangebox": "logs",
    "orangebox.types": "logs",
    "pandas": "frames",
    "pyarrow": "parquet",
    "pyarrow.parquet": "parquet",
    "pymavlink.DFReader": "logs",
    "pyulog": "logs",
    "scipy.linalg": "rotor",
    "scipy.signal": "control",
    "traitlets": "notebook",
    "wpiutil.log": "logs",
}


def need(module: str) -> Any:
    """Return a module, or say which extra installs it."""
    try:
        return import_module(module)
    except ImportError:
        name = module.partition(".")[0]
        raise InputError(f"{name} is not installed, but this needs it: pip install 'youla[{_EXTRAS[module]}]'") from None
