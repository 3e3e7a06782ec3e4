"""Identify a machine without opening its control loop.

>>> import youla
>>> run = youla.demo()                              # simulates a levitated mass and identifies it
>>> run.verdict.trusted, run.recommended.order
(True, 2)
"""

from typing import TYPE_CHECKING

from . import _native
from ._channels import Channels, ChannelTiming, Synchronised
from ._compare import Comparison, compare
from ._errors import Error, InputError, NumericalError
from ._figures import Plots
from ._identify import demo, identify
from ._loop import Certificate, Excitation, Reduction, certify, excite, reduce, simulate_loop
from ._model import FrequencyResponse, Mode, Model, RealPole
from ._plan import Study, study
from ._record import Record
from ._redesign import Redesign, redesign
from ._response import Response
from ._result import Run, load
from ._stages import Check, SubspaceEstimate, check, greybox, subspace
from ._study import Bootstrap, bootstrap, identify_many, scan
from ._tasks import Rows
from ._verdict import Evidence, Prediction, Verdict, VerdictTest
from ._workbench import workbench

__version__ = _native.version()

if not TYPE_CHECKING:  # a type checker knows the names that there are
    from ._elsewhere import absent as __getattr__

__all__ = [
    "Bootstrap",
    "Certificate",
    "ChannelTiming",
    "Channels",
    "Check",
    "Comparison",
    "Error",
    "Evidence",
    "Excitation",
    "FrequencyResponse",
    "InputError",
    "Mode",
    "Model",
    "NumericalError",
    "Plots",
    "Prediction",
    "RealPole",
    "Record",
    "Redesign",
    "Reduction",
    "Response",
    "Rows",
    "Run",
    "Study",
    "SubspaceEstimate",
    "Synchronised",
    "Verdict",
    "VerdictTest",
    "bootstrap",
    "certify",
    "check",
    "compare",
    "demo",
    "excite",
    "greybox",
    "identify",
    "identify_many",
    "load",
    "redesign",
    "reduce",
    "scan",
    "simulate_loop",
    "study",
    "subspace",
    "workbench",
]
