"""A run: its models, regions, conversions, files and figures."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import loop

import youla


def test_the_plant_is_found(run: youla.Run) -> None:
    """Pole 0.95 within 0.01; the interval of its frequency holds the truth."""
    assert run.recommended.order == 1
    assert abs(run.recommended.poles[0] - 0.95) < 0.01
    (pole,) = run.real_poles()
    truth = -np.log(0.95) / 0.01 / (2 * np.pi)
    assert pole.hz_interval is not None
    assert pole.hz_interval[0] < truth < pole.hz_interval[1]
    assert (run.modes(), run.recommended.modes()) == ((), ())
    assert abs(run.recommended.real_poles()[0].hz - pole.hz) < 1e-9
    assert run.verdict.evidence
    assert run.fits["likelihood"]["fresh"][0] > 80


def test_regions_hold_the_truth(run: youla.Run) -> None:
    truth = youla.Model([[0.95]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    w = np.geomspace(1.0, 200.0, 30)
    exact = truth.frequency_response(w).magnitude
    found = run.frequency_response(w, model="likelihood")
    assert found.low is not None
    assert found.high is not None
    held = (found.low <= exact) & (exact <= found.high)
    assert held.mean() > 0.6
    assert found.covariance is not None
    assert found.covariance.shape == (30, 1, 1, 3)
    assert run.frequency_response(w, model="hansen").low is None
    assert run.frequency_response(w, model="nominal").low is None
    assert run.measured_response is not None


def test_round_trips_are_exact(run: youla.Run) -> None:
    scipy_signal = pytest.importorskip("scipy.signal")
    pytest.importorskip("control")
    model = run.recommended
    for other in (run.to_control(), run.to_scipy()):
        for name in "abcd":
            assert np.array_equal(getattr(model, name), getattr(other, name.upper()))
        assert other.dt == model.dt
    assert isinstance(run.to_scipy(), scipy_signal.StateSpace)
    assert run.to_control().input_labels == list(model.inputs)
    w = np.array([1.0, 10.0])
    theirs = run.frequency_response(w).to_control()
    ours = run.frequency_response(w).values[:, 0, 0]
    assert np.array_equal(np.ravel(theirs.frdata), ours)
    assert np.allclose(run.to_control()(np.exp(1j * w * 0.01)), ours, rtol=1e-12)


def test_systems_of_every_kind_are_the_same_loop(record: youla.Record) -> None:
    """Nominal and controller as model, python-control and SciPy systems: the same bits."""
    control, scipy_signal = pytest.importorskip("control"), pytest.importorskip("scipy.signal")
    model = youla.Model([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=0.01)
    kinds = [model, control.ss(0.9, 0.1, 1, 0, 0.01), scipy_signal.dlti(0.9, 0.1, 1, 0, dt=0.01), {"state_space": {
        "domain": "discrete", "a": [[0.9]], "b": [[0.1]], "c": [[1.0]], "d": [[0.0]],
    }}]  # fmt: skip
    gains = [2.0, np.array([[2.0]]), control.ss([], [], [], 2.0, 0.01), {"pid": {"kp": 2.0, "discretisation": "tustin"}}]
    hansen = {"order": 1, "horizon": 5}
    found = [
        youla.identify(record, nominal=g, controller=k, feedback="negative", hansen=hansen).model("hansen") for g, k in zip(kinds, gains, strict=True)
    ]
    assert len({(m.a.tobytes(), m.b.tobytes(), m.c.tobytes()) for m in found}) == 1
    positive = youla.identify(record, nominal=model, controller=-2.0, feedback="positive", hansen=hansen).model("hansen")
    assert positive.a.tobytes() == found[0].a.tobytes()
    tf = control.tf([0.1], [1, -0.9], 0.01)
    theirs = scipy_signal.TransferFunction([0.1], [1, -0.9], dt=0.01)
    both = [youla.identify(record, nominal=g, controller=2.0, feedback="negative", hansen=hansen).model("nominal") for g in (tf, theirs)]
    assert both[0].a.tobytes() == both[1].a.tobytes()


def test_files(run: youla.Run, tmp_path: Path) -> None:
    folder = run.save(tmp_path / "run")
    written = json.loads((Path(folder) / "4-identify/recommended.json").read_text())
    assert written["a"] == run.recommended.a.tolist()
    summary = json.loads((Path(folder) / "summary.json").read_text())
    assert summary["recommended"] == run.summary["recommended"]
    with pytest.raises(youla.InputError, match="give replace=True"):
        run.save(tmp_path / "run")
    run.save(tmp_path / "run", replace=True)
    run.report(tmp_path / "report.html")
    assert "<svg" in (tmp_path / "report.html").read_text() or "uPlot" in (tmp_path / "report.html").read_text()
    run.recommended.save(tmp_path / "model.json")
    log = youla.Record(loop(7, 500), inputs=0, outputs=1, excitation=2, dt=0.01)
    again = youla.identify(log, nominal=tmp_path / "model.json", controller=2.0, feedback="negative", hansen={"order": 1, "horizon": 5})
    assert again.model("nominal").a.tolist() == run.recommended.a.tolist()
    assert 'name = "log"' in run.settings


def test_frames_and_pages(run: youla.Run) -> None:
    pytest.importorskip("pandas")
    frame = run.to_frame()
    assert set(frame["model"]) >= {"likelihood", "hansen"}
    assert len(run.frequency_response([1.0, 2.0]).to_frame()) == 2
    page = run._repr_html_()
    assert page.count("<polyline") == 2
    assert "NaN" not in page
    assert "log" in repr(run)


def test_figures(run: youla.Run) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = run.plot.bode()
    assert len(axes) == 2
    assert len(axes[0].collections) == 1  # the band of the recommended model
    assert run.plot.nyquist().patches
    run.plot.poles()
    run.plot.fit()
    recommended, _, measured = (line.get_ydata() for line in axes[1].lines)
    assert np.ptp(measured) < 360 + np.ptp(recommended), "the measured phase stays beside that of the model"
    assert run.plot.bode("hansen", axes)[0] is axes[0]
    with pytest.raises(youla.InputError, match="output is 3"):
        run.plot.bode(output=3)


def test_stages(run: youla.Run, record: youla.Record, nominal: youla.Model, tmp_path: Path) -> None:
    found = youla.check(record, nominal=nominal, controller=2.0, feedback="negative")
    assert found and found.ok
    other = youla.check(record, nominal=nominal, controller=3.0, feedback="negative")
    assert other.findings != found.findings
    assert not other and not other.ok
    model = youla.subspace(record, order=1, horizon=5)
    assert model.frequency_response([1.0]).values.shape == (1, 1, 1)
    new = youla.redesign(run)
    assert new.controller.inputs == ("y",)
    assert youla.certify(run.recommended, new.controller, feedback="positive")
    on_the_circle = youla.Model([[-0.4]], [[1.0]], [[1.0]], [[0.0]], dt=0.01)
    assert not any(youla.certify(on_the_circle, 0.6 - k * 1e-16, feedback="negative") for k in range(5))
    excitation = youla.excite(nominal, 2.0, feedback="negative", amplitude=0.5, band=[0.5, 20], seconds=10)
    assert excitation.signal.shape == (1000, 1)
    assert np.abs(excitation.signal).max() <= 0.5 * (1 + 1e-12)
    compared = youla.compare([run, run], page=tmp_path / "page.html")
    assert len(compared.distances) == 1
    assert (tmp_path / "page.html").is_file()
    plant = youla.Model(np.diag([0.9, 0.1]), [[1.0], [1e-3]], [[1.0, 1.0]], [[0.0]], dt=0.1)
    small = youla.reduce(plant, method="balanced-truncation", order=1)
    assert small.model.order == 1
    assert small.error_bound is not None
    w = np.geomspace(0.1, 30, 50)
    error = np.abs(small.model.frequency_response(w).values - plant.frequency_response(w).values).max()
    assert error <= small.error_bound * (1 + 1e-9)


def test_missing_models_say_why(run: youla.Run) -> None:
    with pytest.raises(youla.InputError, match="it has likelihood"):
        run.model("grey_box")


def test_ctrl_c_stops_a_run(tmp_path: Path) -> None:
    """SIGINT in a run that takes many seconds: KeyboardInterrupt within a second."""
    script = tmp_path / "long.py"
    script.write_text(
        "import numpy as np, youla\n"
        "t = np.random.default_rng(1).standard_normal((60000, 6))\n"
        "log = youla.Record(t, inputs=[0, 1, 2], outputs=[3, 4, 5], dt=0.01)\n"
        "print('go', flush=True)\n"
        "try:\n"
        "    youla.identify(log, nominal=0 * np.eye(3), controller=0)\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted', flush=True)\n"
        "    import os; os._exit(0)\n"
    )
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "go\n"
        time.sleep(0.3)
        start = time.monotonic()
        child.send_signal(signal.SIGINT)
        assert child.stdout.readline() == "interrupted\n"
        assert time.monotonic() - start < 1.0


def test_a_run_toml_is_the_same_run(tmp_path: Path) -> None:
    table = loop(9, 600)
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header="u,y,d", comments="", fmt="%.17g")
    log = youla.Record(table, inputs=0, outputs=1, excitation=2, dt=0.01, name="log")
    nominal = {"state_space": {"domain": "discrete", "a": [[0.9]], "b": [[0.1]], "c": [[1.0]]}}
    run = youla.identify(log, nominal=nominal, controller={"pid": {"kp": 2.0, "discretisation": "tustin", "feedback": "negative"}})
    text = run.settings.replace('file = "log"', 'file = "log.csv"')
    (tmp_path / "run.toml").write_text(text)
    again = youla.identify(tmp_path / "run.toml")
    for name in run.models:
        assert again.model(name).a.tobytes() == run.model(name).a.tobytes(), name


def test_the_program_is_in_the_wheel(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "youla"]
    version = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    assert version.stdout.startswith("youla ")
    missing = subprocess.run([*command, "identify", "no.toml"], capture_output=True, text=True, check=False)
    assert (missing.returncode, "no such file" in missing.stderr) == (2, True)
    misspelt = subprocess.run([*command, "identfy"], capture_output=True, text=True, check=False)
    assert misspelt.returncode == 2
