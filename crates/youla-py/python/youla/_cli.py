"""The program ``youla``."""

from __future__ import annotations

import signal
import sys

from . import _native


def main() -> int:
    """Run the program with the arguments of the command line.

    Returns
    -------
    int
        Exit code: 0; 1 where ``youla check`` found a defect; 2 for input that cannot be used; 3 for an impossible
        computation.
    """
    # Ctrl-C ends the program at once, as it ends the program without Python.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.program(["youla", *sys.argv[1:]])
