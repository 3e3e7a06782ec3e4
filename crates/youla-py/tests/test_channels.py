"""Logs whose channels have time stamps of their own, as machines write them."""

from __future__ import annotations

import importlib.util

import loggers
import numpy as np
import pytest

import youla

DT = 0.0025
CONTROLLER = 1.2


def needs(module: str):
    return pytest.mark.skipif(importlib.util.find_spec(module) is None, reason=f"{module} is not installed")


def machine() -> youla.Model:
    """A mode at 31 Hz with 4 % damping behind a slow pole, stabilised by a proportional controller."""
    w, z = 2 * np.pi * 31 * DT, 0.04
    r = np.exp(-z * w)
    a = np.array([[r * np.cos(w), r * np.sin(w), 0.0], [-r * np.sin(w), r * np.cos(w), 0.0], [0.0, 0.0, 0.97]])
    return youla.Model(a, [[0.05], [0.05], [0.03]], [[1.0, 1.0, 1.0]], [[0.0]], dt=DT)


def loop(seed: int, n: int = 16_000) -> dict[str, np.ndarray]:
    """Input, output and an excitation that is held for five cycles, a row for each cycle."""
    rng = np.random.default_rng(seed)
    d = np.repeat(rng.standard_normal(n // 5), 5)
    u, y = youla.simulate_loop(machine(), CONTROLLER, feedback="negative", excitation=d[:, None], noise=0.05 * rng.standard_normal((n, 1)))
    return {"u": u[:, 0], "y": y[:, 0], "d": d}


def stamped(signals: dict[str, np.ndarray], seed: int, drop: float = 0.01) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Each channel with scatter of a third of a cycle, a delay, dropped samples, on a logger whose clock is 60 ppm fast; d is written when it changes."""
    rng, found = np.random.default_rng(seed), {}
    for name, late in (("u", 0.55), ("y", 0.0), ("d", 0.3)):
        values = signals[name]
        cycles = np.arange(len(values))
        times = 12.0 + DT * (1 - 6e-5) * (cycles + late + rng.uniform(-1 / 6, 1 / 6, len(values)))
        kept = np.r_[True, np.diff(values) != 0] if name == "d" else rng.random(len(values)) >= drop
        kept[:2] = True
        found[name] = (times[kept], values[kept])
    return found


def error(record: youla.Record | tuple[youla.Record, ...]) -> tuple[float, youla.Run]:
    """Root mean square of the error of the identified response relative to the machine, and the run."""
    run = youla.identify(record, controller=CONTROLLER, feedback="negative")
    omega = 2 * np.pi * np.geomspace(0.5, 150, 200)
    true = machine().frequency_response(omega).values[:, 0, 0]
    found = run.recommended.frequency_response(omega).values[:, 0, 0]
    return float(np.sqrt(np.mean(np.abs(found / true - 1) ** 2))), run


def read(kind: str, path, seed: int, signals) -> youla.Synchronised:
    """The log of a kind, with its names, brought to the clock of the controller."""
    log = stamped(signals, seed)
    if kind == "mf4":
        loggers.mf4(path, log)
    elif kind == "ulg":
        loggers.ulog(path, log)
    else:
        loggers.ardupilot(path, log)
    channels = youla.Channels.read(path)
    suffix = {"ulg": ".value", "bin": ".V"}.get(kind, "")
    u, y, d = (f"{name}{suffix}" for name in "uyd")
    return channels.synchronise(inputs=u, outputs=y, excitation=d, dt=DT, changes_only=d)


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param("ulg", marks=needs("pyulog")),
        pytest.param("bin", marks=needs("pymavlink")),
        pytest.param("mf4", marks=needs("asammdf")),
    ],
)
def test_a_log_with_scatter_drops_and_changes_gives_the_model_of_one_clock(tmp_path, kind):
    signals = loop(3)
    found = read(kind, tmp_path / f"log.{kind}", 4, signals)
    one_clock = youla.Record(signals, inputs="u", outputs="y", excitation="d", dt=DT)
    exact, several = error(one_clock)[0], error(found.records)
    assert several[1].verdict.trusted
    assert several[0] <= 1.2 * exact, f"{several[0]} beside {exact}\n{found}"
    u, y, d = found.timing
    assert (u.placement, y.placement, d.placement) == ("sampled", "sampled", "held")
    assert abs(u.delay - 0.55 * DT) < 0.02 * DT and abs(found.drift + 6e-5) < 5e-6
    assert 100 < u.filled < 220 and u.error < 0.2
    # What was not dropped is the sample of its cycle.
    rows = np.asarray(found.records[0].y)[:, 0]
    same = np.isclose(rows, signals["y"][: len(rows)], rtol=1e-6, atol=1e-6)
    assert same.mean() > 0.985


@needs("wpiutil")
def test_a_wpilog_is_held_between_changes(tmp_path):
    signals = loop(4, 8000)
    loggers.wpilog(tmp_path / "log.wpilog", stamped(signals, 1, drop=0.0))
    found = youla.Channels.read(tmp_path / "log.wpilog").synchronise(inputs="u", outputs="y", excitation="d", dt=DT)
    assert [t.placement for t in found.timing] == ["held"] * 3
    for name, rows in (("u", found.records[0].u), ("y", found.records[0].y), ("d", found.records[0].excitation)):
        assert len(rows) > 7990 and (np.asarray(rows)[:, 0] == signals[name][: len(rows)]).all()


@needs("orangebox")
def test_a_betaflight_blackbox_is_read_with_the_flight_that_is_asked_for(tmp_path):
    signals = loop(5, 8000)
    whole = {"motor[0]": np.round(1000 * signals["u"]), "gyroADC[0]": np.round(1000 * signals["y"]), "debug[0]": np.round(1000 * signals["d"])}
    times = DT * np.arange(8000) + np.random.default_rng(1).uniform(0, DT / 8, 8000)
    loggers.betaflight(tmp_path / "log.bbl", times, whole, flights=2)
    channels = youla.Channels.read(tmp_path / "log.bbl", flight=2)
    found = channels.synchronise(inputs="motor[0]", outputs="gyroADC[0]", excitation="debug[0]", dt=DT)
    assert (np.asarray(found.records[0].u)[:, 0] == whole["motor[0]"]).all()
    # A slow field is known from its first frame on.
    assert channels["flightModeFlags"][0][0] == pytest.approx(times[20], abs=1e-6) and channels["flightModeFlags"][1][0] == 3
    assert error(found.records)[1].verdict.trusted
    with pytest.raises(youla.InputError, match="flight is 3, but .* has flights 1 to 2"):
        youla.Channels.read(tmp_path / "log.bbl", flight=3)


def test_an_output_with_a_clock_of_its_own_has_its_error_in_the_region(tmp_path):
    """The machine between the cycles: states at the beginning of a cycle, then exp(A tau) x + A^-1 (exp(A tau) - I) B u."""
    linalg = pytest.importorskip("scipy.linalg")
    w = 2 * np.pi * 30
    a = linalg.block_diag([[0, 1], [-w * w, -0.1 * w]], [[-15.0]])
    b, c = np.array([[0], [0.3 * w * w], [15.0]]), np.array([[1.0, 0, 1]])
    poles, v = np.linalg.eig(a)
    into, out = np.linalg.solve(v, np.eye(3)), c @ v
    ad = linalg.expm(DT * a)
    plant = youla.Model(ad, np.linalg.solve(a, (ad - np.eye(3)) @ b), c, [[0.0]], dt=DT)
    omega = 2 * np.pi * np.geomspace(0.5, 180, 150)
    true, squares = plant.frequency_response(omega).values[:, 0, 0], []
    for seed, rate in enumerate((1.37, 0.93, 3.1)):
        rng, n = np.random.default_rng(seed), 12_000
        d = np.repeat(rng.standard_normal(n // 4), 4)
        x, u, states = np.zeros(3), np.zeros(n), np.zeros((n, 3))
        noise = 0.01 * rng.standard_normal(n)
        for k in range(n):
            states[k] = x
            u[k] = d[k] - 0.4 * (c @ x + noise[k])[0]
            x = plant.a @ x + plant.b[:, 0] * u[k]
        stamps = np.arange(0.3 * DT, (n - 1) * DT, DT / rate)
        k = (stamps / DT).astype(int)
        decay = np.exp((stamps - k * DT)[:, None] * poles)
        y = np.real((decay * (states[k] @ into.T) + (decay - 1) / poles * (into @ b).T * u[k, None]) @ out.T)[:, 0]
        t = DT * np.arange(n)
        log = youla.Channels({"u": (t, u), "y": (stamps, y + 0.01 * rng.standard_normal(len(y))), "d": (t, d)})
        found = log.synchronise(inputs="u", outputs="y", excitation="d", dt=DT)
        assert found.timing[1].placement == "interpolated" and found.timing[1].delay is None
        run = youla.identify(found.records, controller=0.4, feedback="negative")
        stated = run.summary["recommended"]["response_deviation"]
        deviation = np.interp(omega / 2 / np.pi, stated["hz"], [entry[0][0] for entry in stated["absolute"]])
        miss = np.abs(run.recommended.frequency_response(omega).values[:, 0, 0] - true)
        squares.append(np.mean((miss / deviation) ** 2))
        (_, high), *_ = run.verdict.bands
        below = omega < 2 * np.pi * high
        assert 40 < high < 130 and (miss[below] < 0.2 * np.abs(true[below])).all()
    assert np.mean(squares) < 2.25
    run.save(tmp_path / "run")
    assert youla.load(tmp_path / "run") == run
    with pytest.raises(youla.InputError, match="'u', which is no output"):
        youla.Record({"u": u, "y": u}, inputs="u", outputs="y", dt=DT, sampled_every={"u": 0.1})


@needs("nptdms")
def test_a_tdms_file_keeps_its_units(tmp_path):
    signals = loop(6, 2000)
    loggers.tdms(tmp_path / "log.tdms", signals, DT)
    found = youla.Channels.read(tmp_path / "log.tdms").synchronise(inputs="rig/u", outputs="rig/y", dt=DT)
    # The channel y starts two steps later, by the time in the file.
    rows = found.records[0]
    assert (np.asarray(rows.y)[:, 0] == signals["y"][:-2]).all() and (np.asarray(rows.u)[:, 0] == signals["u"][2:]).all()
    assert "rig/u" in repr(found)


def test_columns_with_empty_cells_and_pairs_are_the_same():
    pd = pytest.importorskip("pandas")
    log = stamped(loop(7, 2000), 8)
    frame = pd.DataFrame()
    for name, (times, values) in log.items():
        frame = frame.join(pd.DataFrame({name: values}, index=times), how="outer")
    frame = frame.rename_axis("t").reset_index()
    chosen = {"inputs": "u", "outputs": "y", "excitation": "d", "dt": DT}
    a = youla.Channels(log, changes_only="d").synchronise(**chosen)
    b = youla.Channels(frame, time="t").synchronise(**chosen, changes_only="d")
    assert np.array_equal(a.records[0].u, b.records[0].u) and repr(a) == repr(b)
    assert list(a.to_frame().index) == ["u", "y", "d"]


def test_a_pause_gives_several_records():
    signals = loop(9, 4000)
    log = {n: (np.delete(t, slice(900, 1400)), np.delete(v, slice(900, 1400))) for n, (t, v) in stamped(signals, 1, drop=0.0).items() if n != "d"}
    found = youla.Channels(log).synchronise(inputs="u", outputs="y", dt=DT)
    assert [len(r) for r in found.records] == [900, 2600] and found.left_out == 500
    assert [r.name for r in found.records] == ["log, part 1", "log, part 2"]


@pytest.mark.parametrize(
    "call, says",
    [
        (lambda log: youla.Channels({"u": [1.0, 2.0, 3.0]}), "is no pair .times, values"),
        (lambda log: youla.Channels(np.zeros((9, 2))), "must be a mapping"),
        (lambda log: youla.Channels(log, changes_only="r"), "changes_only names 'r', which is no channel; the channels are u, y, d"),
        (lambda log: youla.Channels({"t_ms": [0.0, 1.0], "u": [0.0, 1.0]}, time="t_ms"), "in milliseconds by its name"),
        (lambda log: youla.Channels({"t": [0.0, 1.0], "u": [0.0, 1.0]}, time="time"), "time names 'time', which is no column"),
        (lambda log: youla.Channels({"t": [0.0, 1.0], "u": [0.0, 1.0, 2.0]}, time="t"), "'u' has 3 cells, the time 2"),
        (lambda log: youla.Channels(log).synchronise(dt=DT, outputs="y"), "inputs is missing"),
        (lambda log: youla.Channels(log).synchronise(dt=DT, inputs="u", outputs="u"), "'u' is chosen twice"),
        (lambda log: youla.Channels(log).synchronise(dt=DT, inputs="u", outputs="gyro"), "outputs names 'gyro', which is no channel"),
        (lambda log: youla.Channels(log).synchronise(dt=0.0, inputs="u", outputs="y"), "dt is 0"),
        (lambda log: youla.Channels(log).synchronise(dt=2.5, inputs="u", outputs="y"), '"u" has more samples than the sample time of 2.5 s has cycles.*median step is 0.0025'),
        (lambda log: youla.Channels(log).synchronise(dt=DT, inputs="u", outputs="y", changes_only="d"), "changes_only names 'd', which is not chosen"),
        (lambda log: youla.Channels(log).synchronise(dt=DT, inputs="d", outputs="y"), '"d" .*written only when it changes'),
        (lambda log: youla.Channels({**log, "y": (log["y"][0][::-1], log["y"][1])}).synchronise(dt=DT, inputs="u", outputs="y"), '"y", sample 2.*decreases'),
        (lambda log: youla.Channels({**log, "y": (log["y"][0][::8], log["y"][1][::8])}).synchronise(dt=DT, inputs="u", outputs="y"), '"y" is logged every 0.020.* faster than 24'),
        (lambda log: youla.Channels.read("no-such-log.ulg"), "no such file"),
        (lambda log: youla.Channels("flight.ulg"), r"youla.Channels.read\(path\)"),
        (lambda log: youla.Record(youla.Channels(log), inputs="u", outputs="y", dt=DT), r"synchronise\(\.\.\.\)\.records"),
        (lambda log: youla.identify(youla.Channels(log), controller=1.0, feedback="negative"), r"synchronise\(\.\.\.\)\.records"),
        (lambda log: youla.check(youla.Channels(log).synchronise(inputs="u", outputs="y", dt=DT)), "give its .records"),
    ],
)
def test_a_mistake_is_told_with_its_remedy(call, says):
    with pytest.raises(youla.InputError, match=says):
        call(stamped(loop(2, 4000), 3))


def test_a_file_of_another_kind_and_a_damaged_one_are_refused(tmp_path):
    other = tmp_path / "log.dat"
    other.write_bytes(b"t,u,y\n0,1,2\n")
    with pytest.raises(youla.InputError, match="not a log that is known by its first bytes"):
        youla.Channels.read(other)
    if importlib.util.find_spec("pyulog"):
        damaged = tmp_path / "log.ulg"
        loggers.ulog(damaged, stamped(loop(2, 400), 3))
        damaged.write_bytes(damaged.read_bytes()[:30])
        with pytest.raises(youla.InputError, match="no numeric channel|damaged"):
            youla.Channels.read(damaged)
