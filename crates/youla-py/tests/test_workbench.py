"""The workbench as a widget: what the page begins with, and that it is the program's."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

import youla

pytest.importorskip("anywidget")


def test_a_record_is_a_file_with_settings(record: youla.Record) -> None:
    bench = youla.workbench(record)
    assert bench.page.startswith("<!doctype html>") and len(bench.page) < 6_000_000
    with np.load(io.BytesIO(bench.files["record.npz"])) as arrays:
        assert np.array_equal(arrays["u1"], record.u[:, 0]) and np.array_equal(arrays["y1"], record.y[:, 0])
    assert f"sample_time = {record.dt!r}" in bench.settings and 'from = "u1"' in bench.settings
    assert bench.summary == {}


def test_a_file_is_as_if_it_were_dropped(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("t,u,y\n0,1,2\n1,2,3\n")
    bench = youla.workbench(log)
    assert bench.files == {"log.csv": log.read_bytes()} and bench.settings == ""


def test_what_is_no_record_is_refused() -> None:
    with pytest.raises(youla.InputError, match="no such file"):
        youla.workbench("nowhere.csv")
    with pytest.raises(youla.InputError, match="must be a youla.Record or the path"):
        youla.workbench(np.ones(3))  # type: ignore[arg-type]
