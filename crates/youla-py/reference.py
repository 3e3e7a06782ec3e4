"""The API reference of the package as a static site: ``python crates/youla-py/reference.py target/api``.

Functions come before classes. A warning is an error: a name that cannot be resolved would be missing on the page.
"""

from __future__ import annotations

import inspect
import sys
import warnings
from pathlib import Path

import pdoc

import youla

if __name__ == "__main__":
    warnings.simplefilter("error")
    youla.__all__.sort(key=lambda name: inspect.isclass(getattr(youla, name)))
    pdoc.render.configure(docformat="numpy", show_source=False, search=True, footer_text=f"youla {youla.__version__}")
    pdoc.pdoc("youla", output_directory=Path(sys.argv[1]))
