"""What a release is made of: licence texts, and archives whose names agree."""

from __future__ import annotations

import importlib.metadata
import json
import runpy
import shutil
import subprocess
import sys
import types

import pytest
from conftest import ROOT

CRATE = ROOT / "crates/youla-py"


def test_every_crate_that_is_used_is_named_with_a_licence() -> None:
    """faer, PyO3 and the embedded uPlot are there; crates that serve tests only are not."""
    if shutil.which("cargo") is None:
        pytest.skip("cargo is absent")
    subprocess.run([sys.executable, str(CRATE / "licences.py")], check=True, capture_output=True)
    text = (CRATE / "licenses/THIRD-PARTY.txt").read_text(encoding="utf-8")
    for name in ("\nfaer 0.", "\npyo3 0.", "\nserde_json 1.", "embedded in reports: uplot", "embedded in reports: font"):
        assert name in text, name
    assert "SIL Open Font License" in text or "SIL OPEN FONT LICENSE" in text
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--manifest-path", str(ROOT / "Cargo.toml")]
    packages = json.loads(subprocess.run(command, check=True, capture_output=True, encoding="utf-8").stdout)["packages"]
    named = [p for p in packages if f"\n{p['name']} {p['version']} (" in text]
    assert 100 < len(named) < len(packages)
    assert len(text.encode()) < 1_000_000, "a wheel has at most 15 MB"


def test_the_build_backend_writes_the_licences_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """`pip install` of the source: each hook that makes metadata or a wheel finds the texts."""
    hooks = ["build_wheel", "build_sdist", "build_editable", "prepare_metadata_for_build_wheel", "prepare_metadata_for_build_editable"]
    calls: list[str] = []
    maturin = types.ModuleType("maturin")
    for name in hooks:
        setattr(maturin, name, lambda *_, name=name: calls.append(name))
    for kind in ("editable", "sdist", "wheel"):
        setattr(maturin, f"get_requires_for_build_{kind}", list)
    monkeypatch.setitem(sys.modules, "maturin", maturin)
    licences = types.ModuleType("licences")
    licences.main = lambda: calls.append("licences")  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "licences", licences)
    backend = runpy.run_path(str(CRATE / "backend.py"))
    for name in hooks:
        backend[name]("folder")
    assert calls == [call for name in hooks for call in ("licences", name)]
    settings = (CRATE / "pyproject.toml").read_text()
    assert 'build-backend = "backend"' in settings and 'path = "backend.py", format = "sdist"' in settings


def test_binstall_takes_what_cargo_dist_makes() -> None:
    tomllib = pytest.importorskip("tomllib")  # Python 3.11 and later
    dist = tomllib.loads((ROOT / "dist-workspace.toml").read_text())["dist"]
    package = tomllib.loads((ROOT / "crates/youla-cli/Cargo.toml").read_text())["package"]
    binstall = package["metadata"]["binstall"]
    formats = {".tar.gz": "tgz", ".zip": "zip"}
    assert binstall["pkg-fmt"] == formats[dist["unix-archive"]]
    windows = [target for target in dist["targets"] if "windows" in target]
    assert set(binstall["overrides"]) == set(windows)
    # Archives of cargo-dist have a folder, zip files have none.
    assert binstall["bin-dir"].startswith("{ name }-{ target }/")
    for target in windows:
        override = binstall["overrides"][target]
        assert (override["pkg-fmt"], override["bin-dir"]) == (formats[dist["windows-archive"]], "{ bin }{ binary-ext }")
    assert "{ repo }/" in binstall["pkg-url"]


def test_the_wheel_states_the_address_of_the_workspace() -> None:
    tomllib = pytest.importorskip("tomllib")  # Python 3.11 and later
    package = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]
    assert package["homepage"] == package["repository"]
    assert importlib.metadata.metadata("youla")["Home-page"] == package["homepage"]
