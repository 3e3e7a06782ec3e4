"""Records from every source are the same record, without a copy where none is needed, and inputs are never changed."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from conftest import loop

import youla

NAMES = {"inputs": "u", "outputs": "y", "excitation": "d"}


def columns(table: np.ndarray) -> dict[str, np.ndarray]:
    return dict(zip("uyd", table.T.copy(), strict=True))


def same(record: youla.Record, table: np.ndarray) -> None:
    assert record.u.tolist() == table[:, [0]].tolist()
    assert record.y.tolist() == table[:, [1]].tolist()
    assert record.excitation is not None
    assert record.excitation.tolist() == table[:, [2]].tolist()
    assert (record.inputs, record.outputs, record.dt) == (("u",), ("y",), 0.01)


def test_every_source_gives_the_same_record(table: np.ndarray, tmp_path: Path) -> None:
    pd, pl = pytest.importorskip("pandas"), pytest.importorskip("polars")
    frame = pd.DataFrame(columns(table))
    frame["t"] = np.arange(len(frame)) * 0.01
    same(youla.Record(table, inputs=0, outputs=1, excitation=2, dt=0.01), table)
    same(youla.Record(columns(table), **NAMES, dt=0.01), table)
    same(youla.Record(frame, **NAMES, dt=0.01), table)
    same(youla.Record(pl.DataFrame(columns(table)), **NAMES, dt=0.01), table)
    frame.to_csv(tmp_path / "log.csv", index=False)
    same(youla.Record(tmp_path / "log.csv", **NAMES, dt=0.01), table)
    by_number = youla.Record(tmp_path / "log.csv", inputs=0, outputs=1, excitation=2, dt=0.01)
    assert by_number.y.tolist() == table[:, [1]].tolist()
    np.savez(tmp_path / "log.npz", **columns(table))
    same(youla.Record(tmp_path / "log.npz", **NAMES, dt=0.01), table)


def test_time_is_read_from_column_index_and_dates(table: np.ndarray) -> None:
    pd = pytest.importorskip("pandas")
    frame = pd.DataFrame(columns(table[:100]))
    seconds = np.arange(100) * 0.01
    for index in (seconds, pd.to_timedelta(seconds, unit="s"), pd.Timestamp("2026-01-01") + pd.to_timedelta(seconds, unit="s")):
        found = youla.Record(frame.set_index(pd.Index(index)), **NAMES, time="index")
        assert found.dt == pytest.approx(0.01, rel=1e-9)
    frame["t"] = seconds
    assert youla.Record(frame, **NAMES, time="t").dt == pytest.approx(0.01, rel=1e-12)


def test_a_file_with_a_clock_in_milliseconds_is_refused_in_words_of_python(tmp_path: Path) -> None:
    pd, _ = pytest.importorskip("pandas"), pytest.importorskip("pyarrow")
    frame = pd.DataFrame({"t_ms": np.arange(9.0), "u": np.arange(9.0), "y": np.arange(9.0) ** 2})
    frame.to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "units.csv").write_text("t;u;y\nms;V;m\n0;1,5;2\n1;2,5;3\n")
    frame.to_parquet(tmp_path / "log.parquet")
    for data, time, says in (
        (tmp_path / "log.csv", "t_ms", "log.csv: the time column .* is in milliseconds by its name.*dt="),
        (tmp_path / "log.parquet", "t_ms", "in milliseconds by its name.*dt="),
        (frame.set_index("t_ms"), "index", "the index of data is in milliseconds"),
        (tmp_path / "units.csv", "t", "units.csv, line 2, column .*pandas.read_csv .sep=, decimal=, skiprows=."),
    ):
        with pytest.raises(youla.InputError, match=says) as told:
            youla.Record(data, inputs="u", outputs="y", time=time)
        assert "[data]" not in str(told.value)
    stamps = 1764352842 + np.round(np.arange(3000) / 150, 3)  # steps of 6 and 7 ms
    assert youla.Record({"t": stamps, "u": stamps, "y": -stamps}, inputs="u", outputs="y", time="t").dt == pytest.approx(1 / 150, rel=2e-5)
    dates = frame.assign(timestamp_ms=pd.to_datetime(frame["t_ms"], unit="ms"))
    dates.to_parquet(tmp_path / "dates.parquet")
    assert youla.Record(tmp_path / "dates.parquet", inputs="u", outputs="y", time="timestamp_ms").dt == pytest.approx(1e-3)


def test_responses_of_python_control_are_channels_by_time() -> None:
    """Two outputs and two samples more than channels: by its type, never by its shape."""
    control = pytest.importorskip("control")
    system = control.ss(np.diag([0.5, 0.6]), np.eye(2), np.eye(2), 0, 0.1, inputs=["a", "b"], outputs=["v", "w"])
    u = np.arange(8.0).reshape(2, 4)
    response = control.forced_response(system, np.arange(4) * 0.1, u)
    found = youla.Record(response)
    assert (found.inputs, found.outputs, found.samples) == (("a", "b"), ("v", "w"), 4)
    assert found.u.tolist() == u.T.tolist()
    assert found.y.tolist() == response.y.T.tolist()
    chosen = youla.Record(response, inputs="b", outputs="w")
    assert chosen.u[:, 0].tolist() == u[1].tolist()


def test_a_frame_goes_round(record: youla.Record) -> None:
    pytest.importorskip("pandas")
    again = youla.Record(record.to_frame(), **NAMES, time="index")
    assert again.u.tolist() == record.u.tolist()
    assert again.dt == pytest.approx(record.dt, rel=1e-12)


def test_float64_is_not_copied_and_never_changed() -> None:
    """10^6 x 4: a copy would take 32 MB; a view takes none. The array stays as it was through an identification."""
    table = np.zeros((1_000_000, 4))
    tracemalloc.start()
    record = youla.Record(table, inputs=[0, 1], outputs=[2, 3], dt=1e-3)
    part = record[1000:]
    views = (record.u, record.y, part.u)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1_000_000
    assert all(np.shares_memory(view, table) for view in views)
    with pytest.raises(ValueError, match="read-only"):
        record.u[0, 0] = 1.0


def test_identification_leaves_its_input_as_it_was(nominal: youla.Model) -> None:
    table = loop(5, 500)
    before = table.copy()
    log = youla.Record(table, inputs=0, outputs=1, excitation=2, dt=0.01)
    youla.identify(log, nominal=nominal, controller=2.0, feedback="negative", hansen={"order": 1, "horizon": 5})
    assert np.array_equal(table, before)
    assert table.flags.writeable


def test_an_array_that_was_changed_is_refused() -> None:
    table = loop(5, 10_000)
    log = youla.Record(table, inputs=0, outputs=1, dt=0.01, name="log")
    part = log[5000:]
    table[:, 2] = 0.0  # no channel of the record
    youla.check(log)
    for change in (lambda: table[:, 1].__imul__(1e3), lambda: table.__setitem__((-1, 0), np.nan)):
        kept = table.copy()
        change()
        for use in (lambda: youla.check(log), lambda: youla.identify(part, controller=2.0, feedback="negative"), lambda: log[:100], log.split):
            with pytest.raises(youla.InputError, match=r"the array of log was changed after youla.Record\(...\); give Record data.copy\(\)"):
                use()
        table[:] = kept
    youla.check(part)


def test_a_counter_that_wrapped_is_refused(tmp_path: Path) -> None:
    """An encoder of 16 bits in a move over its range; a binary excitation of the whole range and a full-scale ramp that stays are none."""
    rng = np.random.default_rng(1)
    angle = np.cumsum(300 * rng.standard_normal(4000) + 40)
    wrapped, prbs = angle.astype(np.int64).astype(np.int16), (rng.integers(0, 2, 4000) * 255 - 128).astype(np.int8)
    assert np.abs(np.diff(wrapped.astype(int))).max() > 60000
    told = r"jumps by about 65536 at row \d+, counted from 0, where its counter wrapped; give numpy.unwrap\(column.astype\(float\), period=65536\)"
    for data in ({"u": prbs, "y": wrapped}, {"u": prbs, "y": wrapped.astype(np.int64)}, {"u": prbs, "y": wrapped.astype(np.uint16)}):
        with pytest.raises(youla.InputError, match=f"channel 'y' {told}"):
            youla.Record(data, inputs="u", outputs="y", dt=0.01)
    with pytest.raises(youla.InputError, match=f"column 0 {told}"):
        youla.Record(np.column_stack([wrapped, wrapped]), inputs=1, outputs=0, dt=0.01)
    np.savetxt(tmp_path / "log.csv", np.column_stack([prbs, wrapped]), delimiter=",", header="u,y", comments="", fmt="%d")
    with pytest.raises(youla.InputError, match=f"channel 'y' {told}"):
        youla.Record(tmp_path / "log.csv", inputs="u", outputs="y", dt=0.01)
    mended = np.unwrap(wrapped.astype(float), period=65536)
    assert np.ptp(np.diff(mended)) < 5000
    for good in (mended, np.arange(4000, dtype=np.int16), np.linspace(-32768, 32767, 4000).astype(np.int16), (2e4 * rng.standard_normal(4000)).clip(-32768, 32767).astype(np.int16)):
        youla.Record({"u": prbs, "y": good}, inputs="u", outputs="y", dt=0.01)


def test_cuts_are_records(record: youla.Record) -> None:
    first, second = record.split(0.25)
    assert (first.samples, second.samples) == (1000, 3000)
    assert (first.name, second.name) == ("log-estimation", "log-verification")
    assert second.y.tolist() == record[1000:].y.tolist()
    assert record.named("other").name == "other"


def test_a_column_of_dates_and_a_matrix_of_one_column_are_channels(table: np.ndarray) -> None:
    pd = pytest.importorskip("pandas")
    seconds = 1e-3 * np.arange(len(table))
    dates = np.datetime64("2026-01-01") + (seconds * 1e9).astype("timedelta64[ns]")
    data = {"t": dates, "u": table[:, [0]], "y": table[:, 1]}
    for frame in (data, pd.DataFrame({name: np.ravel(values) for name, values in data.items()})):
        record = youla.Record(frame, inputs="u", outputs="y", time="t")
        assert record.dt == pytest.approx(1e-3) and np.array_equal(record.u, table[:, [0]])
    assert youla.Record({"t": list(seconds), "u": table[:, 0], "y": table[:, 1]}, inputs="u", outputs="y", time="t").dt == pytest.approx(1e-3)


def test_models_are_equal_by_their_matrices() -> None:
    one, same, other = (youla.Model([[a]], [[1.0]], [[1.0]], [[0.0]], dt=1e-3) for a in (0.5, 0.5, 0.6))
    assert one == same and hash(one) == hash(same) and one != other and one != 1
