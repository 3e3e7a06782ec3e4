"""Stages that need no whole run: the check of records, subspace identification, a physical structure."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _native
from ._arrays import Array
from ._checks import table
from ._errors import InputError
from ._identify import Records, identify, prepare, records_of
from ._model import FrequencyResponse, Mode, Model
from ._optional import need
from ._options import check_options, check_order, in_python, plain
from ._record import Record
from ._result import Run
from ._types import Feedback, Hold


@dataclass(frozen=True)
class Check:
    """Findings of a check of records; true where there is no defect.

    Attributes
    ----------
    findings : tuple of dict
        The most serious first: ``severity``, ``test``, ``record``, ``channel``, ``rows``, ``what``, ``numbers``, ``advice``.
    defects, cautions, notes : int
        Numbers of findings.
    """

    findings: tuple[dict[str, Any], ...]
    defects: int
    cautions: int
    notes: int

    @property
    def ok(self) -> bool:
        """Whether there is no defect."""
        return self.defects == 0

    def __bool__(self) -> bool:
        return self.ok

    def to_frame(self) -> Any:
        """Return the findings as a pandas data frame."""
        pd = need("pandas")
        return pd.DataFrame(self.findings)

    def __repr__(self) -> str:
        lines = [f"  {f['severity']}: {' '.join(str(f[k]) for k in ('record', 'channel') if f.get(k))}: {f['what']}"[:160] for f in self.findings]
        more = [f"  ... and {len(lines) - 8} more; print() shows all"] if len(lines) > 8 else []
        return "\n".join([f"<youla.Check: {self.defects} defects, {self.cautions} cautions, {self.notes} notes>", *lines[:8], *more])

    def __str__(self) -> str:
        lines = [f"{self.defects} defects, {self.cautions} cautions, {self.notes} notes"]
        for f in self.findings:
            where = " ".join(str(f[key]) for key in ("record", "channel") if f.get(key))
            lines.append(f"{f['severity']}: {where}: {f['what']}. {f['advice']}".rstrip())
        return "\n".join(lines)


def check(
    record: Records, *, nominal: Any = None, controller: Any = None, feedback: Feedback | None = None, hold: Hold | None = None,
    **options: Mapping[str, Any],
) -> Check:  # fmt: skip
    """Check records before identifying from them.

    Parameters
    ----------
    record : Record or sequence of Record
        Records.
    nominal : Model, python-control or SciPy system, number, matrix, mapping or path, optional
        A rough model of the plant, p x m; see `identify`.
    controller : as `nominal`, optional
        The controller that ran, m x p. Without it the tests of the controller are left out.
    feedback : {"negative", "positive"}
        Sign with which the controller is written.
    hold : {"tustin", "zoh"}, optional
        How a controller in continuous time was discretised.
    **options : mapping
        Tables of run.toml, above all ``check`` and ``data``.

    Returns
    -------
    Check
        Findings, the most serious first.

    Raises
    ------
    InputError
        For arguments that cannot be used. Defects of the records are findings, not exceptions.

    Examples
    --------
    >>> import numpy as np, youla
    >>> rng = np.random.default_rng(1)
    >>> log = youla.Record(rng.standard_normal((2000, 2)), inputs=0, outputs=1, dt=1e-3)
    >>> youla.check(log).defects
    0
    """
    first = _first(record)
    check_options(options, "check")
    known = controller is not None
    settings, logs = prepare(record, None, nominal, controller if known else 0, feedback, hold, None, options)
    found = json.loads(_native.check(settings, logs, known))
    findings = tuple({**f, "advice": in_python(f["advice"])} for f in found["findings"])
    return Check(findings, found["defects"], found["cautions"], found["notes"])


def _first(record: Records) -> Record:
    listed = records_of(record, "record")
    if not listed:
        raise InputError("record is an empty list, but must hold at least one youla.Record")
    return listed[0]


class SubspaceEstimate:
    """A model by subspace identification.

    Attributes
    ----------
    model : Model
        The model.
    singular_values : ndarray
        Values from which the order is chosen, descending.
    horizon, past : int
        Block rows of the future and of the past.
    """

    def __init__(self, found: _native.Subspace, record: Record) -> None:
        a, b, c, d, dt = found.model()
        self.model = Model(a, b, c, d, dt=dt, inputs=record.inputs, outputs=record.outputs, name="subspace")
        self.singular_values: Array = np.array(found.singular_values())
        self.horizon, self.past = found.horizons()

    def modes(self) -> tuple[Mode, ...]:
        """Return the modes of the model."""
        return self.model.modes()

    def frequency_response(self, omega: Any) -> FrequencyResponse:
        """Return the frequency response.

        Parameters
        ----------
        omega : array_like, (n,)
            Angular frequencies, rad/s.

        Returns
        -------
        FrequencyResponse
            Values of the shape (n, p, m).
        """
        return self.model.frequency_response(omega)

    def __repr__(self) -> str:
        return f"<youla.SubspaceEstimate: order {self.model.order}, horizon {self.horizon}, past {self.past}>"


def subspace(record: Records, **options: Any) -> SubspaceEstimate:
    """Identify from u and y by a subspace method, without regard to nominal model and controller.

    Parameters
    ----------
    record : Record or sequence of Record
        Records.
    **options
        Keys of ``[direct]`` of run.toml: ``method`` (``"n4sid"``, ``"moesp"``, ``"cva"``; for closed loops ``"ssarx"``,
        ``"pbsid-opt"``), ``order`` (states), ``horizon`` and ``past`` (samples), ``feedthrough``, ``delays``,
        ``stability``.

    Returns
    -------
    SubspaceEstimate
        The model with its singular values and horizons.

    Raises
    ------
    InputError
        For options that do not exist or cannot be used.
    NumericalError
        For a record without excitation, or an unstable model unless ``stability="allow"``.

    Examples
    --------
    >>> import numpy as np, youla
    >>> u = np.random.default_rng(1).standard_normal((500, 1))
    >>> y = youla.Model([[0.8]], [[1.0]], [[1.0]], [[0.0]], dt=1.0).simulate(u)
    >>> log = youla.Record(np.hstack([u, y]), inputs=0, outputs=1, dt=1.0)
    >>> round(float(youla.subspace(log, order=1, horizon=5).model.a[0, 0]), 3)
    0.8
    """
    check_order(options.get("order"), "order")
    settings, logs = prepare(record, None, None, 0, None, None, None, {})
    return SubspaceEstimate(_native.subspace(settings, logs, plain(options)), _first(record))


def greybox(record: Records, *, structure: Mapping[str, Any], grey_box: Mapping[str, Any] | None = None, **arguments: Any) -> Run:
    """Estimate a physical structure, started from the result of the Hansen scheme.

    Parameters
    ----------
    record : Record or sequence of Record
        Records.
    structure : mapping
        The table ``[grey_box.structure]`` of run.toml: parameters and matrices.
    grey_box : mapping, optional
        Other keys of ``[grey_box]``.
    **arguments
        As for `identify`: ``nominal``, ``controller`` and further ones.

    Returns
    -------
    Run
        Its model ``grey_box`` is the structure, and ``summary["methods"]["grey_box"]`` holds the parameters with their
        intervals, in the units of the structure.

    Raises
    ------
    InputError
        For a structure that cannot be used: an unknown name, an expression that cannot be read, matrices that do not fit.

    Examples
    --------
    A first-order lag with unknown gain and pole, in continuous time:

    >>> import numpy as np, youla
    >>> plant = youla.Model([[0.95]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    >>> d = np.random.default_rng(1).standard_normal((3000, 1))
    >>> n = 0.01 * np.random.default_rng(2).standard_normal((3000, 1))
    >>> u, y = youla.simulate_loop(plant, 2.0, feedback="negative", excitation=d, noise=n)
    >>> log = youla.Record(np.hstack([u, y, d]), inputs=0, outputs=1, excitation=2, dt=0.01)
    >>> structure = {
    ...     "parameters": {"pole": {"initial": 4.0, "min": 0.1, "max": 50.0}, "gain": {"initial": 8.0}},
    ...     "a": [["-pole"]], "b": [["gain"]], "c": [[1.0]],
    ... }
    >>> run = youla.greybox(log, structure=structure, nominal=plant, controller=2.0, feedback="negative", hansen={"order": 1, "horizon": 5})
    >>> round(float(run.model("grey_box").a[0, 0]), 2)
    0.95
    """
    declared = table(structure, "structure", "{'template': 'mass-spring-damper'}")
    others = {} if grey_box is None else table(grey_box, "grey_box", "{'noise': 'innovation'}")
    return identify(record, grey_box={**others, "structure": declared}, **arguments)
