"""Names of the models of a run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ._checks import text
from ._errors import InputError, NumericalError

#: Name of the recommended model among the models of a run; "recommended" is taken as well.
RECOMMENDED = "likelihood"

#: Models from other signals than u to others than y.
NO_PLANTS = ("controller", "new_controller", "deviation")

#: What computes a model that is not there.
_COMPUTED_BY = {
    "nominal": "give identify nominal=",
    "hansen": "give identify nominal= and hansen={}",
    "hansen_reduced": "give identify nominal=, hansen={} and reduction={}",
    "direct": "give identify direct={}",
    "grey_box": "youla.greybox(record, structure=...) estimates it",
    "true_plant": "simulations have it, such as youla.demo()",
    "new_controller": "give identify redesign={}, or use youla.redesign(run)",
}


def label_of(key: str) -> str:
    """The name of a model in figures and messages."""
    return "recommended" if key == RECOMMENDED else key


def key_of(name: Any, what: str, there: Sequence[str], refused: dict[str, str]) -> str:
    """Return the key of a model that is there; `refused` has reasons of those that were asked for and are impossible."""
    key = RECOMMENDED if text(name, what) == "recommended" else str(name)
    if key in there:
        return key
    # S is that of the coprime factors.
    reason = refused.get("factors" if key == "deviation" else label_of(key))
    if reason is not None:
        raise NumericalError(f"there is no model {name!r}: {reason}")
    remedy = f"; {_COMPUTED_BY[key]}" if key in _COMPUTED_BY else ""
    raise InputError(f"this run has no model {name!r}; it has {', '.join(there)}{remedy}")
