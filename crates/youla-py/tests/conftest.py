"""A small loop with a known plant, and where the measured data are."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import youla

ROOT = Path(__file__).resolve().parents[3]


def loop(seed: int, samples: int = 4000, noise: float = 0.02) -> np.ndarray:
    """Columns u, y, d of the plant 0.1 / (z - 0.95) under u = -2 y + d."""
    rng = np.random.default_rng(seed)
    plant = youla.Model([[0.95]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    d = rng.standard_normal((samples, 1))
    u, y = youla.simulate_loop(plant, 2.0, feedback="negative", excitation=d, noise=noise * rng.standard_normal((samples, 1)))
    return np.hstack([u, y, d])


@pytest.fixture(scope="session")
def table() -> np.ndarray:
    return loop(102)


@pytest.fixture(scope="session")
def record(table: np.ndarray) -> youla.Record:
    return youla.Record(table, inputs=0, outputs=1, excitation=2, dt=0.01, name="log")


@pytest.fixture(scope="session")
def fresh() -> youla.Record:
    return youla.Record(loop(2), inputs=0, outputs=1, excitation=2, dt=0.01, name="fresh")


@pytest.fixture(scope="session")
def nominal() -> youla.Model:
    return youla.Model([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)


@pytest.fixture(scope="session")
def run(record: youla.Record, fresh: youla.Record, nominal: youla.Model) -> youla.Run:
    hansen = {"order": 2, "horizon": 10}
    response = {"window": 512}
    return youla.identify(
        record, nominal=nominal, controller=2.0, feedback="negative", verify=fresh, hansen=hansen, frequency_response=response
    )


@pytest.fixture(scope="session")
def data() -> Path:
    found = Path(os.environ.get("YOULA_DATA", ROOT / "../shared/data")).resolve()
    if not found.is_dir():
        pytest.skip("the measured data are absent (YOULA_DATA or ../shared/data)")
    return found
