"""The verdict on a model, with its evidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ._arrays import Array
from ._options import in_python


@dataclass(frozen=True)
class Evidence:
    """A question to the records: its figure, the largest figure that is accepted, and whether it is kept."""

    question: str
    figure: float | None
    limit: float
    holds: bool


@dataclass(frozen=True)
class VerdictTest:
    """A test of the verdict.

    Attributes
    ----------
    question : str
        What was asked.
    outcome : str
        ``passed``, ``failed`` or ``not-tested``.
    required : bool
        Whether the model is trusted only where the test is passed; other tests name an imperfection with its size.
    figure, limit : float
        What was found, ``None`` where nothing was tested, and the largest figure that is accepted.
    deviations : float or None
        By how many standard deviations the records show it beyond chance.
    hz : tuple of float or None
        Where it was found, Hz.
    note : str
        What lies behind the figure, or why nothing was tested.
    """

    question: str
    outcome: str
    required: bool
    figure: float | None
    limit: float
    deviations: float | None
    hz: tuple[float, float] | None
    note: str


@dataclass(frozen=True)
class Verdict:
    """Whether the recommended model can be trusted.

    Attributes
    ----------
    trusted : bool
        Whether every required test is passed.
    reasons : tuple of str
        Why the model is not trusted; empty where it is.
    evidence : tuple of Evidence
        Questions to the records.
    lines : tuple of str
        The verdict of the report, in sentences.
    tests : tuple of VerdictTest
        The tests, each with its outcome.
    bands : tuple of (float, float)
        Bands in Hz in which the standard deviation of every entry is at most a tenth of it.
    loop_ratio, loop_ratio_hz : float or None
        The part of the margin of the loop that the 95 % region takes, and where; ``None`` for an open loop.
    description : bool or None
        Whether the description of the loop agrees with the log, whatever the model is worth; ``None`` where nothing could be asked.
    defects : tuple of str
        What is wrong with the records or the stated controller, as `check` says it, with the remedy.
    """

    trusted: bool
    reasons: tuple[str, ...]
    evidence: tuple[Evidence, ...]
    lines: tuple[str, ...]
    tests: tuple[VerdictTest, ...] = ()
    bands: tuple[tuple[float, float], ...] = ()
    loop_ratio: float | None = None
    loop_ratio_hz: float | None = None
    description: bool | None = None
    defects: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return self.trusted

    def __str__(self) -> str:
        return "\n".join([*self.lines, *self.defects])

    def __repr__(self) -> str:
        counts = [f"{sum(t.outcome == o for t in self.tests)} {o.replace('-', ' ')}" for o in ("passed", "failed", "not-tested")]
        causes = [*self.defects[:2], *self.reasons[:5]]
        shown = [f"  {cause}" for cause in causes] + (["  ..."] if len(causes) < len(self.defects) + len(self.reasons) else [])
        return "\n".join([f"<youla.Verdict: {'trusted' if self.trusted else 'not trusted'}; tests: {', '.join(counts)}>", *shown])


@dataclass(frozen=True)
class Prediction:
    """A verification record: measured outputs, and those predicted by each model, samples x p."""

    record: str
    measured: Array
    predicted: dict[str, Array]

    def __repr__(self) -> str:
        n, p = self.measured.shape
        return f"<youla.Prediction {self.record!r}: {n} samples of {p} outputs, by {', '.join(self.predicted)}>"


def defect(finding: dict[str, Any]) -> str:
    """A defect of the report in a sentence with its remedy."""
    where = " ".join(str(finding[key]) for key in ("record", "channel") if finding.get(key))
    advice = in_python(finding["advice"]).rstrip(".")
    return f"Defect of {where or 'the records'}: {finding['what']}.{f' {advice}.' if advice else ''}"
