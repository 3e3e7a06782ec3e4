"""Licence texts for the wheel: the build backend (backend.py) writes them; before ``maturin build``, which calls no backend, run this file.

Writes the licences of this project and THIRD-PARTY.txt, with those of every crate that the extension module uses and of what
is embedded in it, into ``crates/youla-py/licenses``, from which maturin takes them (`license-files` in pyproject.toml).
The texts are those that the crates ship.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

HERE = Path(__file__).resolve().parent
PROJECT = HERE.parents[1]
NAMES = ("license", "licence", "copying", "copyright", "notice", "unlicense")
RULE = "=" * 80


def used(metadata: dict) -> list[dict]:
    """Crates of others that `youla-py` uses on any system, by name; those for builds and tests alone are left out."""
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    packages = {package["id"]: package for package in metadata["packages"]}
    found = [next(p["id"] for p in metadata["packages"] if p["name"] == "youla-py")]
    for key in found:  # grows
        for dependency in nodes[key]["deps"]:
            normal = any(kind["kind"] is None for kind in dependency["dep_kinds"])
            if normal and dependency["pkg"] not in found:
                found.append(dependency["pkg"])
    foreign = [packages[key] for key in found if packages[key]["source"] is not None]
    return sorted(foreign, key=lambda p: (p["name"], p["version"]))


def texts_in(folder: Path) -> list[str]:
    """The licence files of a folder, and those of a folder for them in it."""
    files = [file for file in folder.iterdir() if file.name.lower().startswith(NAMES)]
    files += [inner for file in files if file.is_dir() for inner in file.iterdir()]
    return sorted(f.read_text(encoding="utf-8", errors="replace").strip() for f in files if f.is_file())


def third_party(sources: dict[str, list[str]]) -> str:
    """One text of all sources; a licence that several ship is there once, below their names."""
    by_text: dict[str, list[str]] = {}
    for name, texts in sources.items():
        for text in texts:
            by_text.setdefault(text, []).append(name)
    lines = [f"What this wheel is made of: {len(sources)} crates and assets of others. Their licences:"]
    for text, names in sorted(by_text.items(), key=lambda entry: entry[1]):
        lines += ["", RULE, *names, "-" * 80, text]
    lines += ["", RULE, "Crates that ship no licence file; the terms of their licence are those of the texts above:"]
    lines += [name for name, texts in sources.items() if not texts]
    return "\n".join(lines) + "\n"


def main() -> None:
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--manifest-path", str(PROJECT / "Cargo.toml")]
    metadata = json.loads(subprocess.run(command, check=True, capture_output=True, encoding="utf-8").stdout)
    sources = {}
    for package in used(metadata):
        authors = ", ".join(author.partition(" <")[0] for author in package["authors"])
        name = f"{package['name']} {package['version']} ({package['license']}{'; ' if authors else ''}{authors})"
        sources[name] = texts_in(Path(package["manifest_path"]).parent)
    for asset in sorted((PROJECT / "crates/youla-report/assets").iterdir()):
        if asset.is_dir() and texts_in(asset):
            sources[f"embedded in reports: {asset.name}"] = texts_in(asset)
    folder = HERE / "licenses"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name in ("LICENSE-MIT", "LICENSE-APACHE"):
        shutil.copy(PROJECT / name, folder / name)
    (folder / "THIRD-PARTY.txt").write_text(third_party(sources), encoding="utf-8")
    print(f"{len(sources)} crates and assets in {folder / 'THIRD-PARTY.txt'}")


if __name__ == "__main__":
    main()
