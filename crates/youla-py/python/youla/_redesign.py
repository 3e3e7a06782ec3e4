"""A new controller on the result of one run or of several operating points."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _native
from ._checks import kind, listed
from ._errors import InputError
from ._kept import Kept, again, files_of
from ._model import Model
from ._options import check_redesign, plain
from ._result import Run
from ._types import Matrices


@dataclass(frozen=True)
class Redesign:
    """A new controller ``u = K y`` (positive feedback), and what it promises as ``[redesign]`` reports it."""

    controller: Model
    promised: dict[str, Any]

    def __repr__(self) -> str:
        if "proof" in self.promised:
            named = "; ".join(", ".join(f"{key} {gains[key]:.4g}" for key in ("kp", "ki", "kd")) for gains in self.promised["controllers"])
            return f"<youla.Redesign: {named}; {'proved' if self.promised['proof']['holds'] else 'NOT proved'} on {self.promised['proof']['models']} models>"
        loops = [f"{key} {of['least_damping']:.4g}" for key, of in self.promised.items() if isinstance(of, dict) and of.get("least_damping") is not None]
        return f"<youla.Redesign: controller of order {self.controller.order}; least damping {', '.join(loops) or 'unknown'}>"


def redesign(run: Run | Sequence[Run], **options: Any) -> Redesign:
    """Design a new controller on the result of a run, or one PID on those of several operating points.

    Parameters
    ----------
    run : Run, or sequence of Run
        A finished run. Several runs, one for each operating point, need ``structure="pid"``: the same controller ran at all of them, and the
        limits of the new one hold over the regions of all.
    **options
        Either ``method``, ``input_weights`` and ``peak_sensitivity``, or ``structure="pid"`` with its parts and limits as the mapping ``pid``,
        for example ``pid={"peak_sensitivity": 1.7, "phase_margin": 40}``.

    Returns
    -------
    Redesign
        The new controller, m x p, with positive feedback, and the figures of both loops; of a PID the gains and their proof, of several points
        that of the worst one.

    Raises
    ------
    InputError
        For an option that the structure does not use, where the run has no coprime factors, where runs of several points had other controllers or sample times; of a PID, where
        the machine is not square or its controller leads an output to the input of another loop.
    NumericalError
        Where no tried weight, or no PID, keeps the limits.

    Examples
    --------
    >>> import youla
    >>> new = youla.redesign(youla.demo("bearing"))
    >>> new.controller.inputs, new.promised["predicted"]["least_damping"] > new.promised["present"]["least_damping"]
    (('y_h', 'y_v'), True)
    """
    runs = _runs(run)
    check_redesign(options, "redesign")
    first = runs[0]
    if len(runs) > 1 and options.get("structure") != "pid":
        raise InputError("of several runs one PID is designed; give structure='pid', or redesign each run by itself")
    if options.get("structure") is None:
        promised, (a, b, c, d, dt) = first._native.redesign(plain(options))
    else:
        promised, (a, b, c, d, dt) = _pid(runs, options)
    u, y = ([name for name, _ in channels] for channels in first._native.ports())
    return Redesign(Model(a, b, c, d, dt=dt, inputs=y, outputs=u, name="new controller"), json.loads(promised))


def _runs(given: Any) -> list[Run]:
    """One run or several; a model alone has no region, on which a controller is designed."""
    runs: list[Any] = [given] if isinstance(given, (Run, Model)) else listed(given, "run", "youla.Run")
    for one in runs:
        if not isinstance(one, Run):
            remedy = "; give the youla.Run that holds this model" if isinstance(one, Model) else ""
            raise InputError(f"run is {kind(one)}, but must be a youla.Run, as youla.identify returns it, or a list of them{remedy}")
    if not runs:
        raise InputError("run is empty, but must be a youla.Run or a list of them, one for each operating point")
    return runs


def _pid(runs: Sequence[Run], options: Mapping[str, Any]) -> tuple[str, Matrices]:
    kept = [Kept(files_of(run._native)) for run in runs]
    ran = [k.model("controller") for k in kept]
    for k, other in enumerate(ran[1:], 1):
        if ran[0] is None or other is None or not _equal(ran[0], other):
            raise InputError(f"run[{k}] had another controller or sample time than run[0]; one controller is redesigned for points at which it ran")
    settings, logs, _ = again(kept[0])
    doubts = list(dict.fromkeys(doubt for k in kept for doubt in json.loads(k.summary()).get("doubts", [])))
    return _native.redesign_pid(settings, logs, [k.point() for k in kept], doubts, plain(options))


def _equal(a: Matrices, b: Matrices) -> bool:
    matrices = zip(a[:4], b[:4], strict=True)
    return bool(np.isclose(a[4], b[4], rtol=1e-9)) and all(x.shape == y.shape and np.allclose(x, y, rtol=1e-9) for x, y in matrices)
