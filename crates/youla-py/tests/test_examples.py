"""Models from Python equal those of the program bit by bit, on both examples with measured data."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

import youla

tomllib = pytest.importorskip("tomllib")  # Python 3.11 and later

FILES = {
    "likelihood": "4-identify/recommended.json",
    "hansen": "5-recombine/hansen.json",
    "hansen_reduced": "6-reduce/hansen_reduced.json",
    "direct": "4-identify/direct.json",
    "nominal": "2-factor/nominal.json",
    "controller": "2-factor/controller.json",
}


def of_program(example: str, data: Path, folder: Path) -> Path:
    """The run folder of the program, which is the program of this package."""
    text = (ROOT / "examples" / example / "run.toml").read_text()
    toml = folder.with_suffix(".toml")
    toml.write_text(text.replace("../../../shared/data", str(data)))
    command = [sys.executable, "-m", "youla", "identify", str(toml), "--out", str(folder), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


def records(files: list[dict], settings: dict, data: Path) -> list[youla.Record]:
    """The records of run.toml, read and cut from Python."""
    made = []
    for file in files:
        path = data / file["file"].split("shared/data/")[1]
        groups = {"inputs": "inputs", "outputs": "outputs", "input_excitation": "excitation", "reference": "reference"}
        channels = {py: [c.get("from", c["name"]) for c in settings["data"][key]] for key, py in groups.items()}
        clock = {"dt": settings["data"].get("sample_time"), "time": settings["data"].get("time_column")}
        made.append(youla.Record(path, **channels, **clock, name=path.name.split(".")[0])[file.get("skip", 0) :])
    return made


@pytest.mark.parametrize("example", ["flexible-drive", "qube"])
def test_models_equal_those_of_the_program(example: str, data: Path, tmp_path: Path) -> None:
    settings = tomllib.loads((ROOT / "examples" / example / "run.toml").read_text())
    if example == "flexible-drive":
        nominal = pytest.importorskip("control").tf([2500.0], [1.0, 20.0, 0.0])
    else:
        control = pytest.importorskip("control")
        given = settings["nominal"]["state_space"]
        nominal = control.ss(given["a"], given["b"], given["c"], 0)
    tables = ("factors", "hansen", "direct", "reduction", "verification", "frequency_response")
    run = youla.identify(
        records(settings["data"]["estimation"], settings, data),
        verify=records(settings["data"]["verification"], settings, data),
        nominal=nominal,
        controller=settings["controller"],
        name=settings["name"],
        **{key: settings[key] for key in tables if key in settings},
    )
    folder = of_program(example, data, tmp_path / "run")
    refused = json.loads((folder / "summary.json").read_text())["refused"]
    assert run.summary["refused"] == refused
    for key, file in FILES.items():
        if key in refused:
            continue
        written = json.loads((folder / file).read_text())
        model = run.model(key)
        for name in "abcd":
            matrix = getattr(model, name)
            assert matrix.tolist() == np.array(written[name], dtype=float).reshape(matrix.shape).tolist(), (key, name)
        assert model.dt == written["ts"]
    summary = json.loads((folder / "summary.json").read_text())
    found = run.summary
    for of in (summary, found):
        of.pop("seconds")
        for checked in of["data"]["records"]:
            checked.pop("file")
            checked.pop("rows")
        for finding in of["data"]["findings"]:
            finding.pop("rows", None)
    # A record of Python names its channels by their columns, run.toml by its own names.
    channels = [*settings["data"].get("input_excitation", []), *settings["data"].get("reference", [])]
    names = {c["name"]: c.get("from", c["name"]) for c in channels}
    for method in summary["methods"].values():
        for residuals in method.get("residuals", {}).values():
            residuals["excitations"] = [names[name] for name in residuals["excitations"]]
    assert json.dumps(found["methods"]) == json.dumps(summary["methods"])
    assert found["recommended"] == summary["recommended"]
