"""Arguments that can be meant, but mean something else: refused with what is meant, never taken silently."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import youla

Call = Callable[[youla.Run], Any]

#: Calls on a run, with what they are told.
CASES: dict[str, tuple[Call, str]] = {
    # redesign
    "limit of another structure": (
        lambda run: youla.redesign(run, structure="pid", peak_sensitivity=1.1),
        r"^peak_sensitivity is not used with structure='pid'; give pid=\{'peak_sensitivity': 1.1\}$",
    ),
    "method of another structure": (lambda run: youla.redesign(run, structure="pid", method="lqg"), "^method is not used with structure='pid'; leave it out$"),
    "weights of another structure": (lambda run: youla.redesign(run, structure="pid", input_weights=[1.0]), "^input_weights is not used"),
    "limits without structure": (lambda run: youla.redesign(run, pid={"peak_sensitivity": 1.5}), "^pid is not used without structure='pid'; give structure='pid' too"),
    "limit beside pid": (lambda run: youla.redesign(run, structure="pid", phase_margin=40), r"phase_margin is a key of pid; .*pid=\{'phase_margin': 40\}"),
    "phase margin in radians": (lambda run: youla.redesign(run, structure="pid", pid={"phase_margin": 0.7}), r"pid\['phase_margin'\] is 0.7, but is in degrees: give at least 5"),
    "misspelt limit": (lambda run: youla.redesign(run, structure="pid", pid={"gain_margn": 3}), "pid has no argument 'gain_margn'; did you mean 'gain_margin'"),
    "structure": (lambda run: youla.redesign(run, structure="lead-lag"), "structure is 'lead-lag', but must be 'pid'"),
    "model in place of a run": (lambda run: youla.redesign(run.recommended), "run is a Model, but must be a youla.Run.*give the youla.Run that holds this model"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_misuse_is_refused(case: str, run: youla.Run) -> None:
    call, says = CASES[case]
    with pytest.raises(youla.InputError, match=says) as told:
        call(run)
    assert "run.toml" not in str(told.value)


def test_a_redesign_asked_for_before_is_checked_alike(record: youla.Record) -> None:
    with pytest.raises(youla.InputError, match="peak_sensitivity is not used with structure='pid'"):
        youla.identify(record, controller=2.0, feedback="negative", redesign={"structure": "pid", "peak_sensitivity": 1.1})


def test_a_page_replaces_only_a_page(run: youla.Run, tmp_path: Path) -> None:
    log, page = tmp_path / "log.csv", tmp_path / "page.html"
    log.write_text("t,u,y\n")
    page.write_text("<html>mine</html>")
    (tmp_path / "data.json").write_text('{"runs": 3}')
    data = tmp_path / "data.html"
    for call, says in (
        (lambda: run.report(log), r"log.csv, but the page is an HTML file; give .*log.html"),
        (lambda: run.report(page), r"page.html, a file that is there and that youla did not write; give another name, or replace=True"),
        (lambda: youla.compare([run, run], page=page), "page is .*page.html, a file that is there"),
        (lambda: youla.compare([run, run], page=data), "whose data go into .*data.json, a file that is there"),
    ):
        with pytest.raises(youla.InputError, match=says):
            call()
    assert (log.read_text(), page.read_text(), data.exists()) == ("t,u,y\n", "<html>mine</html>", False)
    run.report(page, replace=True)
    run.report(page)
    youla.compare([run, run], page=data, replace=True)
    youla.compare([run, run], page=data)
    assert '"distances"' in (tmp_path / "data.json").read_text()
