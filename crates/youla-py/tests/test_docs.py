"""The programs of docs/python.md and of both READMEs run, in the order of their page."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import ROOT

PAGES = ["docs/python.md", "docs/channels.md", "README.md", "crates/youla-py/README.md"]


def blocks(text: str) -> list[str]:
    parts = text.split("```")[1::2]
    kinds = ("python,package\n", "python\nimport youla\n")
    return [part.split("\n", 1)[1] for part in parts if part.startswith(kinds)]


@pytest.mark.parametrize("page", PAGES)
def test_programs_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("pandas", "control"):
        pytest.importorskip(module)
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(tmp_path)
    found = blocks((ROOT / page).read_text())
    assert found
    names: dict[str, object] = {}
    for block in found:
        exec(compile(block, page, "exec"), names)
