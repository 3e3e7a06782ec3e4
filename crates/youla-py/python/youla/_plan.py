"""Experiment planning: what an excitation would tell, from Monte Carlo runs on a simulated loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _native
from ._arrays import Array, as_floats, seeded, whole
from ._checks import known, listed, place, table
from ._errors import Error, InputError, NumericalError
from ._loop import EXCITE, certify, excite, simulate_loop
from ._model import Model
from ._optional import need
from ._plot import _axes, grid
from ._record import Record
from ._result import Run
from ._study import Folder, _prepared
from ._systems import as_model, sign_of
from ._tasks import MOST_TASKS, Progress, Row, Rows, key_of, run_tasks
from ._types import Feedback

#: Quantile of the normal distribution for 95 %.
_Z95 = 1.959963984540054
#: Frequencies of the band at which the responses are compared.
_FREQUENCIES = 30
#: Farthest that an identified mode may lie from a true one, as a part of its frequency; farther ones are not that mode.
_FARTHEST = 0.2

System = tuple[Array, Array, Array, Array, float]


@dataclass(frozen=True, repr=False)
class Study(Rows):
    """Monte Carlo runs of several experiments; see `study`.

    Attributes
    ----------
    rows : tuple of dict
        One for each run, ordered by condition and then by replicate.
    computed : int
        Runs that were computed in this call; the others were in the folder.
    conditions : tuple of dict
        The experiments.
    modes : tuple of tuple of float
        Frequency in Hz and damping ratio of the oscillating modes of the simulated plant, by frequency.
    peak_sensitivity : float
        That of the simulated loop.
    """

    conditions: tuple[dict[str, Any], ...]
    modes: tuple[tuple[float, float], ...]
    peak_sensitivity: float

    def table(self) -> list[dict[str, Any]]:
        """Summarise the runs of each condition.

        Returns
        -------
        list of dict
            The condition, and of its runs: ``runs``, ``failed``, ``trusted`` (share), ``response_error`` (root mean square of the
            relative error of G over the band, median of the runs), ``peak_deviation`` and ``peak_bias`` of the peak of the
            sensitivity, and of each mode k the ``found_k`` (share), ``hz_deviation_k``, ``zeta_deviation_k`` and ``zeta_bias_k``
            over the runs, ``zeta_stated_k`` (the median of the deviations that the runs state) and ``zeta_coverage_k`` (the share
            of their 95 % intervals that hold the true damping).
        """
        return [{**c, **self._summary(k)} for k, c in enumerate(self.conditions)]

    def _summary(self, condition: int) -> dict[str, Any]:
        rows = [r for r in self.rows if r["condition"] == condition]
        good = [r for r in rows if "error" not in r]
        found: dict[str, Any] = {"runs": len(rows), "failed": len(rows) - len(good)}
        found["trusted"] = float(np.mean([r["trusted"] for r in good])) if good else 0.0
        found["response_error"] = _median([r["response_error"] for r in good])
        peaks = [r["peak"] for r in good if r["peak"] is not None]
        found["peak_deviation"], found["peak_bias"] = _scatter(peaks, self.peak_sensitivity)
        for k, (hz, zeta) in enumerate(self.modes):
            of = [r["matched"][k] for r in good if r["matched"][k] is not None]
            found[f"found_{k + 1}"] = len(of) / len(rows) if rows else 0.0
            found[f"hz_deviation_{k + 1}"] = _scatter([m["hz"] for m in of], hz)[0]
            found[f"zeta_deviation_{k + 1}"], found[f"zeta_bias_{k + 1}"] = _scatter([m["zeta"] for m in of], zeta)
            stated = [m for m in of if m["zeta_stated"] is not None]
            found[f"zeta_stated_{k + 1}"] = _median([m["zeta_stated"] for m in stated])
            held = [abs(m["zeta"] - zeta) <= _Z95 * m["zeta_stated"] for m in stated]
            found[f"zeta_coverage_{k + 1}"] = float(np.mean(held)) if held else float("nan")
        return found

    def to_frame(self) -> Any:
        """Return the table as a pandas data frame, a row for each condition."""
        return need("pandas").DataFrame(self.table())

    def cheapest(self, zeta: float, *, mode: int | None = None) -> dict[str, Any] | None:
        """Find the shortest experiment, and of these the one with the least amplitude, that gives the damping accurately enough.

        Parameters
        ----------
        zeta : float
            Wanted standard deviation of the damping ratio, as a part of it, at most 1: 0.05 is 5 %.
        mode : int, optional
            Which mode, from 0 in the order of `modes`; every mode when absent.

        Returns
        -------
        dict or None
            The row of `table`, whose deviations are absolute; None where no condition suffices. A condition suffices where every
            run found the mode.

        Raises
        ------
        InputError
            For a plant without oscillating modes, a mode that it does not have, or a part that is none.
        """
        wanted = _part(zeta, "zeta")
        self._zeta(0 if mode is None else mode)
        limits = {k + 1: wanted * self._zeta(k) for k in (range(len(self.modes)) if mode is None else [mode])}

        def suffices(row: Mapping[str, Any]) -> bool:
            return all(row[f"zeta_deviation_{k}"] <= limit and row[f"found_{k}"] == 1 for k, limit in limits.items())

        enough = [row for row in self.table() if suffices(row)]
        return min(enough, key=lambda row: (_length(row), float(np.max(row["amplitude"]))), default=None)

    def plot(self, ax: Any = None, *, mode: int | None = None, wanted: float | None = None) -> Any:
        """Draw the standard deviation of the damping over the length of the experiment.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Where to draw, one for each mode that is drawn; new axes when absent.
        mode : int, optional
            Which mode, from 0 in the order of `modes`; all of them when absent.
        wanted : float, optional
            Wanted deviation as a part of the damping, drawn as a line.

        Returns
        -------
        matplotlib axes
            An array of them for several modes.

        Raises
        ------
        InputError
            For a plant without oscillating modes, or a mode that it does not have.
        """
        self._zeta(0 if mode is None else mode)
        if mode is not None or len(self.modes) == 1:
            return self._draw(_axes(ax), mode or 0, wanted)
        axes = grid(ax, len(self.modes), 1, (6.4, 2.6)).ravel()
        for k, one in enumerate(axes):
            self._draw(one, k, wanted)
        return axes

    def _draw(self, ax: Any, mode: int, wanted: float | None) -> Any:
        true = self._zeta(mode)
        curves: dict[str, list[tuple[float, float]]] = {}
        for row in self.table():
            label = f"{row.get('shape', 'multisine')}, amplitude {np.max(row['amplitude']):g}"
            curves.setdefault(label, []).append((_length(row), 100 * row[f"zeta_deviation_{mode + 1}"] / true))
        for label, points in curves.items():
            ax.plot(*zip(*sorted(points), strict=True), marker="o", label=label)
        if wanted is not None:
            ax.axhline(100 * _part(wanted, "wanted"), color="0.4", linestyle="--", label="wanted")
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.set_xlabel("length of the record, s" if all("seconds" in c for c in self.conditions) else "length of the record")
        ax.set_ylabel("deviation of the damping, %")
        ax.set_title(f"mode at {self.modes[mode][0]:.3g} Hz", fontsize="medium")
        ax.legend()
        return ax

    def _zeta(self, mode: int) -> float:
        if not self.modes:
            raise InputError("the simulated plant has no oscillating mode, so that there is no damping; read .table() instead")
        return self.modes[place(mode, "mode", len(self.modes), f"the plant has {len(self.modes)} oscillating modes")][1]


def _part(value: Any, what: str) -> float:
    """Return a standard deviation as a part of the damping ratio."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not 0 < float(value) <= 1:
        raise InputError(f"{what} is {value!r}, but is the wanted standard deviation as a part of the damping ratio, above 0 and at most 1; 5 % is 0.05")
    return float(value)


def study(
    plant: Any,
    controller: Any,
    conditions: Sequence[Mapping[str, Any]],
    *,
    n: int = 20,
    seed: int | None = None,
    noise: Any = None,
    feedback: Feedback | None = None,
    executor: Executor | None = None,
    folder: Folder = None,
    progress: Progress | None = None,
) -> Study:
    """Find out by simulation which experiment tells enough, before going to the machine.

    For each condition the loop is simulated n times with fresh noise and identified without a key.

    Parameters
    ----------
    plant : Run, Model, or discrete-time system of python-control or SciPy
        The simulated machine. Of a run, the recommended model with its noise.
    controller : Model or discrete-time system of python-control or SciPy
        The controller as for `certify`, or a gain, m x p; ``"own"`` is that of the run.
    conditions : sequence of mapping
        Arguments of `excite` for each experiment: ``amplitude``, ``band``, ``seconds`` or ``samples``, ``shape`` and so on.
    n : int
        Runs of each condition.
    seed : int
        Seed of the noise and of the excitation; the same seed gives the same rows on every executor.
    noise : float or sequence of float, optional
        Standard deviation of white noise at the outputs, one for all or one each, in the unit of the outputs. Needed for a
        model; a run knows its noise.
    feedback : {"negative", "positive"}
        Sign with which the controller is written.
    executor, folder, progress
        As for `bootstrap`.

    Returns
    -------
    Study
        A row for each run, and a table with the deviations of each condition.

    Raises
    ------
    InputError
        For a loop that is not stable, for conditions that `excite` refuses, and for a model without `noise`.

    Examples
    --------
    >>> import numpy as np, youla
    >>> r, w = 0.98, 0.2
    >>> a = r * np.array([[np.cos(w), np.sin(w)], [-np.sin(w), np.cos(w)]])
    >>> plant = youla.Model(a, [[0.0], [0.2]], [[1.0, 0.0]], [[0.0]], dt=0.01)
    >>> short = {"amplitude": 1.0, "band": [0.5, 10.0], "seconds": 10}
    >>> found = youla.study(plant, 0.1, [short, {**short, "seconds": 40}], feedback="negative", n=4, noise=0.05, seed=1)
    >>> [row["failed"] for row in found.table()]
    [0, 0]
    >>> found.cheapest(0.5)["seconds"]
    10
    """
    n, seed = whole(n, "n", 1, MOST_TASKS), seeded(seed)
    twin, spread = _twin(plant, noise)
    of_plant = Model(*twin[0][:4], dt=twin[0][4])
    if isinstance(plant, Run) and isinstance(controller, str) and controller == "own":
        controller, feedback = plant.model("controller"), "positive"
    feedback = sign_of(controller, feedback)
    k = as_model(controller, "controller", of_plant.dt)
    certificate = certify(of_plant, k, feedback=feedback)
    if certificate.peak_sensitivity is None:
        raise InputError("the controller does not stabilise the plant, so that the loop cannot be simulated; check feedback=")
    given = listed(conditions, "conditions", "mappings of arguments of excite")
    chosen = [_condition(condition, i, of_plant, k, feedback, seed) for i, condition in enumerate(given)]
    if not chosen:
        raise InputError("conditions is empty; give at least one mapping of arguments of excite")
    modes = _oscillating(of_plant)
    payload = {
        "twin": twin,
        "spread": spread,
        "controller": (k.a, k.b, k.c, k.d, k.dt),
        "feedback": feedback,
        "conditions": chosen,
        "modes": modes,
        "seed": seed,
    }
    if len(chosen) * n > MOST_TASKS:
        raise InputError(f"n is {n}, but {len(chosen)} conditions may have at most {MOST_TASKS // len(chosen)} runs each; give a smaller n")
    items = [(c, r) for c in range(len(chosen)) for r in range(n)]
    rows = run_tasks(_trial, payload, items, key=key_of(payload), executor=executor, folder=folder, progress=progress)
    return Study(rows.rows, rows.computed, tuple(chosen), tuple(modes), certificate.peak_sensitivity)


def _twin(plant: Any, noise: Any) -> tuple[tuple[System, System], Array]:
    """Plant, the same with its innovations as further inputs, and the root of their covariance."""
    if isinstance(plant, Run):
        if noise is not None:
            raise InputError("noise is given for a run, which knows its noise; leave it out, or give run.recommended as the plant")
        predictor = plant._native.predictor()
        if predictor is None:
            raise NumericalError("the run has no recommended model with a predictor; its noise cannot be simulated")
        g = plant.recommended
        a, b, c, d, gain, covariance = (np.asarray(x, dtype=np.float64) for x in predictor)
        wide: System = (a, np.hstack([b, gain]), c, np.hstack([d, np.eye(len(c))]), g.dt)
        return ((g.a, g.b, g.c, g.d, g.dt), wide), np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    g = as_model(plant, "plant")
    p = g.d.shape[0]
    if noise is None:
        raise InputError("noise is not given; state the standard deviation of the noise at the outputs")
    sizes = np.ravel(as_floats(noise, "noise"))
    if sizes.size not in (1, p) or np.any(sizes < 0):
        raise InputError(f"noise must be one standard deviation, or {p} of them, not below zero")
    wide = (g.a, np.hstack([g.b, np.zeros((g.a.shape[0], p))]), g.c, np.hstack([g.d, np.eye(p)]), g.dt)
    return ((g.a, g.b, g.c, g.d, g.dt), wide), np.diag(np.broadcast_to(sizes, (p,)).astype(np.float64))


def _condition(given: Any, index: int, plant: Model, k: Model, feedback: Feedback, seed: int) -> dict[str, Any]:
    """A condition that `excite` takes."""
    what = f"conditions[{index}]"
    found = table(given, what, "{'amplitude': 1.0, 'band': [1, 100], 'seconds': 10}")
    for key in ("amplitude", "band"):
        if key not in found:
            raise InputError(f"{what} lacks {key!r}; each condition holds the arguments of excite")
    known(found, ["amplitude", "band", "seconds", "samples", *EXCITE], what)
    found = {"seed": seed, **found}
    try:
        excite(plant, k, feedback=feedback, **found)
    except InputError as error:
        raise InputError(f"{what}: {error}") from None
    return found


def _oscillating(plant: Model) -> list[tuple[float, float]]:
    return sorted((m.hz, m.zeta) for m in plant.modes())


def _trial(payload: Mapping[str, Any], item: tuple[int, int], index: int) -> Row:
    condition, replicate = item
    labels = {"condition": condition, "replicate": replicate}
    try:
        return {**labels, **_identified(payload, condition, replicate)}
    except Error as error:
        return {**labels, "error": str(error)}


def _identified(payload: Mapping[str, Any], condition: int, replicate: int) -> Row:
    (plant, wide), chosen = (Model(*x[:4], dt=x[4]) for x in payload["twin"]), payload["conditions"][condition]
    k = Model(*payload["controller"][:4], dt=payload["controller"][4])
    p, m = plant.d.shape
    d = excite(plant, k, feedback=payload["feedback"], **chosen).signal
    draws = np.random.default_rng([payload["seed"], condition, replicate])
    e = draws.standard_normal((len(d), p)) @ payload["spread"].T
    of_all = Model(k.a, k.b, np.vstack([k.c, np.zeros((p, k.a.shape[0]))]), np.vstack([k.d, np.zeros((p, p))]), dt=k.dt)
    u, y = simulate_loop(wide, of_all, excitation=np.hstack([d, e]), feedback=payload["feedback"])
    columns = np.arange(m + p + m)
    inputs, outputs, excited = (columns[i].tolist() for i in (slice(m), slice(m, m + p), slice(m + p, None)))
    log = Record(np.hstack([u[:, :m], y, d]), inputs=inputs, outputs=outputs, excitation=excited, dt=plant.dt)
    run = Run(_native.identify(*_prepared(log, None, {"nominal": plant, "controller": k, "feedback": payload["feedback"]}), True))
    found = run.summary["recommended"]
    if found is None:
        raise NumericalError(str(run.summary["refused"].get("recommended", "no model is recommended")))
    return {
        "trusted": found["trusted"],
        "order": found["order"],
        "modes": [[mode["hz"], mode["zeta"]] for mode in found["modes"]],
        "real_poles": [p["z"] for p in found["real_poles"]],
        "matched": [_nearest(found["modes"], hz) for hz, _ in payload["modes"]],
        "response_error": _response_error(run.recommended, plant, chosen["band"]),
        "peak": certify(run.recommended, k, feedback=payload["feedback"]).peak_sensitivity,
    }


def _nearest(modes: Sequence[Mapping[str, Any]], hz: float) -> dict[str, Any] | None:
    """The oscillating mode nearest to a frequency, if one is near."""
    near = [m for m in modes if m["zeta"] is not None and abs(m["hz"] / hz - 1) <= _FARTHEST]
    best = min(near, key=lambda m: abs(m["hz"] - hz), default=None)
    return None if best is None else {"hz": best["hz"], "zeta": best["zeta"], "zeta_stated": best["zeta_deviation"]}


def _response_error(model: Model, plant: Model, band: Sequence[float]) -> float:
    low, high = (float(f) for f in band)
    omega = 2 * np.pi * np.geomspace(max(low, high / 1e4), high, _FREQUENCIES)
    found, true = model.frequency_response(omega).values, plant.frequency_response(omega).values
    return float(np.sqrt(np.mean(np.abs(found - true) ** 2) / np.mean(np.abs(true) ** 2)))


def _scatter(values: Sequence[float], true: float) -> tuple[float, float]:
    """Standard deviation and bias; not a number for fewer than two values."""
    if len(values) < 2:
        return float("nan"), float("nan")
    return float(np.std(values, ddof=1)), float(np.mean(values) - true)


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else float("nan")


def _length(row: Mapping[str, Any]) -> float:
    return float(row["seconds"] if "seconds" in row else row["samples"])
