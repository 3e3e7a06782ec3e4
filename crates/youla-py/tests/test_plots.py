"""Figures as a control engineer draws them."""

from __future__ import annotations

import numpy as np
import pytest

import youla

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")
plt = pytest.importorskip("matplotlib.pyplot")


@pytest.fixture(scope="module")
def bearing() -> youla.Run:
    return youla.demo("bearing")


@pytest.fixture(autouse=True)
def closed() -> object:
    yield
    plt.close("all")


def drawn(ax: object, label: str) -> object:
    """The line of a legend's entry."""
    return next(line for line in ax.lines if label in str(line.get_label()))


def test_bode_draws_every_entry_with_its_name(bearing: youla.Run) -> None:
    axes = bearing.plot.bode()
    assert axes.shape == (4, 2)
    assert [ax.get_title() for ax in axes[::2].ravel()] == ["u_h, V → y_h, um", "u_v, V → y_h, um", "u_h, V → y_v, um", "u_v, V → y_v, um"]
    assert axes[0, 0].get_ylabel() == "magnitude, dB"
    points = drawn(axes[0, 0], "measured")
    assert points.get_linestyle() == "None"
    assert len(points.get_xdata()) <= 200
    one = bearing.plot.bode(output=1, input=0)
    assert one.shape == (2,)
    expected = 20 * np.log10(bearing.frequency_response().magnitude[:, 1, 0])
    assert np.allclose(drawn(one[0], "recommended").get_ydata(), expected)
    with pytest.raises(youla.InputError, match="ax must be 4 x 2 axes"):
        bearing.plot.bode(ax=one)


def test_incoherent_points_have_no_phase() -> None:
    """Above 50 Hz the demonstration's output is noise."""
    axes = youla.demo().plot.bode()
    (measured,) = [line for line in axes[1].lines if line.get_marker() == "."]
    assert max(measured.get_xdata()) < 100
    assert max(x for line in axes[0].lines for x in line.get_xdata()) > 400


def test_nyquist_draws_the_loop_gain_with_its_margins(run: youla.Run) -> None:
    ax = run.plot.nyquist()
    assert ax.get_aspect() == 1
    assert drawn(ax, "-1").get_xdata()[0] == -1
    gain = 2.0 * run.frequency_response().values[:, 0, 0]
    line = drawn(ax, "loop gain")
    assert np.allclose(line.get_xdata() + 1j * line.get_ydata(), gain)
    assert ax.patches
    # The circle is crossed where |G| = 1/2.
    margin = drawn(ax, "phase margin")
    assert abs(np.hypot(margin.get_xdata()[0], margin.get_ydata()[0]) - 1) < 1e-3
    stated = run.summary["methods"]["likelihood"]["robustness"]["phase_margin_deg"]
    assert abs(float(str(margin.get_label()).split()[2].rstrip("°")) - stated) < 0.02 * stated


def test_the_loop_shows_peaks(bearing: youla.Run) -> None:
    axes = bearing.plot.loop()
    peak = bearing.summary["methods"]["likelihood"]["robustness"]["peak_sensitivity"]
    found = max(drawn(axes[2], "S, peak").get_ydata())
    assert abs(10 ** (found / 20) / peak - 1) < 0.05
    assert len([1 for line in axes[0].lines if "opened at" in str(line.get_label())]) == 2
    assert len(bearing.plot.nyquist(output=0).get_legend().get_texts()) >= 3


def test_parts_sum_to_the_deviation(bearing: youla.Run) -> None:
    axes = bearing.plot.parts()
    assert axes.shape == (2, 2)
    squares = sum(10 ** (np.nan_to_num(drawn(axes[1, 0], part).get_ydata(), nan=-300) / 10) for part in ("noise", "choice", "variation", "distortion"))
    assert np.allclose(squares, 10 ** (drawn(axes[1, 0], "deviation").get_ydata() / 10), rtol=1e-6)


def test_runs_are_compared(run: youla.Run, bearing: youla.Run) -> None:
    axes = run.plot.compare([run])
    assert [text.get_text() for text in axes[0].get_legend().get_texts()] == ["log (1)", "log (2)"]
    with pytest.raises(youla.InputError, match="compare runs of one machine"):
        run.plot.compare(bearing)
    with pytest.raises(youla.InputError, match="runs has an int"):
        run.plot.compare([1])


def test_legends_hide_nothing_and_a_fit_is_readable(run: youla.Run) -> None:
    for ax in (run.plot.poles(), run.plot.fit(), run.plot.nyquist()):
        ax.figure.canvas.draw()
        legend = ax.get_legend().get_window_extent()
        assert legend.x0 >= ax.get_window_extent().x1
        assert legend.x1 <= ax.figure.bbox.x1
    ax = run.plot.fit()
    assert len(drawn(ax, "measured").get_xdata()) == 800
    assert "fit" in ax.get_title()
    low, high = run.plot.fit(seconds=(1, 2)).get_xlim()
    assert (low, high) == pytest.approx((1, 1.99))
    with pytest.raises(youla.InputError, match="the record lasts"):
        run.plot.fit(seconds=(1000, 1001))


def test_an_open_loop_has_no_loop_gain(record: youla.Record, nominal: youla.Model) -> None:
    found = youla.identify(youla.Record(np.asarray(record.to_frame()), inputs=0, outputs=1, dt=0.01), nominal=nominal, controller=0)
    with pytest.raises(youla.InputError, match="the controller of this run is 0"):
        found.plot.nyquist()


@pytest.mark.parametrize("model", ["controller", "deviation"])
def test_only_a_plant_has_a_loop_gain(run: youla.Run, model: str) -> None:
    assert model in run.models
    for draw in (run.plot.nyquist, run.plot.loop):
        with pytest.raises(youla.InputError, match=f"model '{model}' is no plant of the loop; choose of likelihood, nominal, hansen"):
            draw(model)


@pytest.mark.parametrize("projection", ["polar", "3d"])
def test_figures_need_rectangular_axes(run: youla.Run, projection: str) -> None:
    axes = plt.subplots(2, subplot_kw={"projection": projection})[1]
    for draw in (lambda: run.plot.nyquist(ax=axes[0]), lambda: run.plot.bode(ax=axes)):
        with pytest.raises(youla.InputError, match=f"ax has the projection '{projection}', but the figure needs rectangular axes"):
            draw()


def test_channels_and_the_recommended_model_have_names(bearing: youla.Run) -> None:
    by_name, by_number = bearing.plot.bode("recommended", output="y_v", input="u_h"), bearing.plot.bode("likelihood", output=1, input=0)
    assert by_name[0].get_title() == by_number[0].get_title() == "u_h, V → y_v, um"
    assert np.array_equal(drawn(by_name[0], "recommended").get_ydata(), drawn(by_number[0], "recommended").get_ydata())
    for draw in (bearing.plot.nyquist, bearing.plot.loop, bearing.plot.parts, lambda **k: bearing.plot.compare([bearing], **k), bearing.plot.fit):
        draw(output="y_h")
        with pytest.raises(youla.InputError, match="output is 'y', but the outputs are y_h, y_v"):
            draw(output="y")
    with pytest.raises(youla.InputError, match="input is 'y_h', but the inputs are u_h, u_v"):
        bearing.plot.bode(input="y_h")
    assert np.array_equal(bearing.model("recommended").a, bearing.recommended.a)
    assert bearing.modes("recommended") == bearing.modes()


def test_a_missing_model_names_the_argument_that_computes_it(record: youla.Record, run: youla.Run) -> None:
    bare = youla.identify(record, controller=2.0, feedback="negative")
    for key, says in (("hansen", "give identify nominal= and hansen="), ("nominal", "give identify nominal="), ("new_controller", r"youla.redesign\(run\)")):
        for call in (bare.plot.bode, bare.model, bare.modes, bare.plot.poles):
            with pytest.raises(youla.InputError, match=f"this run has no model '{key}'; it has likelihood, controller.*; .*{says}"):
                call(key)
    with pytest.raises(youla.InputError, match="this run has no model 'bode'; it has [a-z, _]*$"):
        run.plot.bode("bode")


def test_a_study_draws_every_mode() -> None:
    c, s = np.cos([0.2, 0.6]), np.sin([0.2, 0.6])
    a = np.zeros((4, 4))
    for k in range(2):
        a[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = 0.98 * np.array([[c[k], s[k]], [-s[k], c[k]]])
    plant = youla.Model(a, [[0.0], [0.2], [0.0], [0.2]], [[1.0, 0.0, 1.0, 0.0]], [[0.0]], dt=0.01)
    short = {"amplitude": 1.0, "band": [0.5, 20.0], "seconds": 10}
    axes = youla.study(plant, 0.1, [short], feedback="negative", n=2, noise=0.05, seed=1).plot()
    assert len(axes) == 2
    assert axes[0].get_title() != axes[1].get_title()
