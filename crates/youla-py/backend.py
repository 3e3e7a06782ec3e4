"""Build backend of the wheel: maturin, after the licence texts have been written, so that `pip install` of the source has them too."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import maturin
from maturin import get_requires_for_build_editable, get_requires_for_build_sdist, get_requires_for_build_wheel  # noqa: F401

HERE = Path(__file__).resolve().parent


def _with_licences(hook: Any) -> Any:
    def build(*args: Any, **options: Any) -> Any:
        # A source distribution holds the texts, and not the workspace from which they are gathered.
        if (HERE / "licences.py").exists():
            sys.path.insert(0, str(HERE))
            import licences

            licences.main()
        return hook(*args, **options)

    return build


build_wheel = _with_licences(maturin.build_wheel)
build_sdist = _with_licences(maturin.build_sdist)
build_editable = _with_licences(maturin.build_editable)
prepare_metadata_for_build_wheel = _with_licences(maturin.prepare_metadata_for_build_wheel)
prepare_metadata_for_build_editable = _with_licences(maturin.prepare_metadata_for_build_editable)
