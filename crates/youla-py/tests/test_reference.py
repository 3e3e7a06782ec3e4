"""The API reference: complete docstrings in numpydoc form, and a site that builds without a warning."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import youla
from conftest import ROOT

SECTION = re.compile(r"^(\w[\w ]+)\n-{3,}$", re.MULTILINE)


def functions() -> Iterator[tuple[str, Any]]:
    """Public functions, and public methods of public classes."""
    for name in youla.__all__:
        found = getattr(youla, name)
        if inspect.isfunction(found):
            yield name, found
        elif inspect.isclass(found):
            for key, member in vars(found).items():
                if inspect.isfunction(member) and not key.startswith("_"):
                    yield f"{name}.{key}", member


def sections(text: str) -> dict[str, str]:
    parts = SECTION.split(text)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def named(section: str) -> set[str]:
    """Names of a section, without the stars; `a, b : float` names two."""
    heads = [line.partition(" : ")[0] for line in section.splitlines() if line and not line.startswith(" ")]
    return {name.strip().lstrip("*") for head in heads for name in head.split(",")}


ALL = dict(functions())


@pytest.mark.parametrize("name", ALL)
def test_a_function_says_what_it_takes_returns_and_raises(name: str) -> None:
    found = ALL[name]
    text = inspect.getdoc(found) or ""
    parts = sections(text)
    parameters = [p for p in inspect.signature(found).parameters if p != "self"]
    missing = set(parameters) - named(parts.get("Parameters", ""))
    assert not missing, f"no parameter {missing}"
    returns = inspect.signature(found).return_annotation != "None"
    assert not returns or "Returns" in parts or (text.startswith("Return ") and not parameters)
    if "." not in name:
        assert "Raises" in parts
        assert ">>>" in parts.get("Examples", "")


@pytest.mark.parametrize("kind", [youla.Record, youla.Model, youla.Run, youla.Bootstrap])
def test_main_classes_have_an_example(kind: type) -> None:
    assert ">>>" in (inspect.getdoc(kind) or "")


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    """Every public name is on its page; numpydoc sections are headings, not text."""
    pytest.importorskip("pdoc")
    command = [sys.executable, str(ROOT / "crates/youla-py/reference.py"), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    page = (tmp_path / "youla.html").read_text(encoding="utf-8")
    for name in youla.__all__:
        assert f'id="{name}"' in page, name
    assert "Parameters</h6>" in page
    assert not re.search(r"<p>Parameters\s*-{3,}", page)
