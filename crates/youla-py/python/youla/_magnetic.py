"""Rotors of ROSS on active magnetic bearings as plant and controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._arrays import Array, as_floats, positive
from ._checks import place, truth
from ._errors import InputError
from ._loop import reduce as reduce_model
from ._model import Complex, Model, frequencies
from ._optional import need
from ._systems import as_model

#: Positions of a lateral displacement (x, y) and of its slopes among the six degrees of freedom of a node of ROSS.
_LATERAL = (0, 1, 3, 4)


@dataclass(frozen=True)
class MagneticLoop:
    """A rotor of ROSS on magnetic bearings as plant and controller; made by `magnetic_loop`.

    Attributes
    ----------
    plant : Model
        From the controller outputs to the sensor signals; the negative stiffness of the bearings belongs to it.
    controller : Model
        ``u = K (r - y)``, discretised by Tustin's rule.
    speed : float
        Speed of the rotor, rad/s.
    """

    plant: Model
    controller: Model
    speed: float
    _modal: tuple[Array, Array, Array, Array]
    _shapes: Array

    def __repr__(self) -> str:
        return f"<youla.rotor.MagneticLoop at {self.speed:g} rad/s:\n  plant {self.plant!r},\n  controller {self.controller!r}>"

    def unbalance_response(self, hz: Any, *, node: int, magnitude: float, model: Any = None) -> Complex:
        """Compute the synchronous response of the sensors to an unbalance, with gyroscopic terms of the speed of the loop.

        Parameters
        ----------
        hz : array_like, (n,)
            Frequencies of rotation, Hz.
        node : int
            Node of the rotor that holds the unbalance.
        magnitude : float
            Unbalance, kg m.
        model : Model, optional
            Identified plant that takes the place of `plant` in the loop.

        Returns
        -------
        ndarray of complex, (n, p)
            Amplitude and phase at the sensors, in the unit of the outputs.

        Raises
        ------
        InputError
            For a node that the rotor does not have.
        """
        w = frequencies(2 * np.pi * as_floats(hz, "hz"))
        node = place(node, "node", len(self._shapes), "nodes of the rotor")
        g = self.plant if model is None else as_model(model, "model")
        force = positive(magnitude, "magnitude", "kg m") * (w**2)[:, None] * (self._shapes[node].T @ np.array([1.0, -1.0j]))
        stiffness, damping, _, sensors = self._modal
        dynamic = stiffness - (w**2)[:, None, None] * np.eye(len(stiffness)) + 1j * w[:, None, None] * damping
        free = np.linalg.solve(dynamic, force[..., None])
        loop = g.frequency_response(w).values @ self.controller.frequency_response(w).values
        # Negative feedback: the sensors of the closed loop show S = (I + G K)^-1 times the response of the free rotor.
        found: Complex = np.linalg.solve(np.eye(loop.shape[1]) + loop, sensors @ free)[..., 0].astype(np.complex128)
        return found


def magnetic_loop(rotor: Any, *, dt: float, speed: float = 0.0, order: int | None = None, plane: bool = False) -> MagneticLoop:
    """Make plant and controller of a ROSS rotor on magnetic bearings.

    The lateral modes of the free rotor up to the Nyquist frequency are kept, the bearings add their negative stiffness ``ks``
    and their force per current ``ki``, and the plant is discretised with a zero-order hold.

    Parameters
    ----------
    rotor : ross.Rotor
        Its bearings must all be ``MagneticBearingElement``.
    dt : float
        Sample time, seconds.
    speed : float
        Speed of rotation, rad/s.
    order : int, optional
        States of the plant after `youla.reduce`; all when absent.
    plane : bool
        Whether to keep the first axis of each bearing only. Without rotation the two planes of an isotropic rotor do not act
        on each other.

    Returns
    -------
    MagneticLoop
        Plant and controller of one loop.

    Raises
    ------
    InputError
        For a rotor with other bearings, or with nodes of other than six degrees of freedom.

    Notes
    -----
    The force of a bearing is ``ki k_amp u - ks x``, with ``ks`` below zero, as in the stiffness matrix of ROSS. The simulation of
    ROSS in the time domain (``compute_pid_amb`` of 2.3.0) adds ``+ ks x``, which is a spring that pulls back, and leaves out
    ``k_amp`` and ``k_sense``.

    Examples
    --------
    >>> import control, youla                                               # doctest: +SKIP
    >>> from ross.rotor_assembly import rotor_amb_example                   # doctest: +SKIP
    >>> s = control.TransferFunction.s                                      # doctest: +SKIP
    >>> loop = magnetic_loop(rotor_amb_example(3e3 + 6 * s / (1 + s / 6e3)), dt=1e-4, plane=True)  # doctest: +SKIP
    >>> bool(youla.certify(loop.plant, loop.controller, feedback="negative"))                    # doctest: +SKIP
    True
    """
    dt, plane = positive(dt, "dt"), truth(plane, "plane")
    bearings = list(getattr(rotor, "bearing_elements", []))
    if not bearings or not all(hasattr(b, "ki") and hasattr(b, "ks") for b in bearings):
        raise InputError("rotor must be a ross.Rotor all of whose bearings are MagneticBearingElement")
    if rotor.number_dof != 6:
        raise InputError(f"rotor has {rotor.number_dof} degrees of freedom per node, but must have 6, as ross.Rotor of version 2 has")
    if plane and speed != 0:
        raise InputError(f"plane is True at a speed of {speed:g} rad/s, which couples the two planes; give speed=0 or plane=False")
    basis = _lateral(rotor, float(bearings[0].sensors_axis_rotation) if plane else None)
    squares, shapes, damping = _free_modes(rotor, basis, float(speed), np.pi / dt)
    axes = [axis for b in bearings for axis in _axes(b)[: 1 if plane else 2]]
    rows = np.array([direction @ shapes[b.n] for b, direction, _ in axes])
    gains = np.array([(b.ki * amp, sense) for b, _, (amp, sense) in axes])
    every = [(b.ks, direction @ shapes[b.n]) for b in bearings for _, direction, _ in _axes(b)]
    stiffness: Array = np.diag(squares) + np.add.reduce([ks * np.outer(row, row) for ks, row in every])
    # ROSS later than 2.3 may place the sensor of a bearing at a node of its own.
    seen = np.array([direction @ shapes[getattr(b, "sensor_node", b.n)] for b, direction, _ in axes])
    forces, sensors = rows.T * gains[:, 0], gains[:, 1:] * seen
    names = [f"{b.tag or f'bearing {b.n}'} {'vw'[k % 2] if not plane else 'v'}" for k, (b, _, _) in enumerate(axes)]
    full = _discrete((stiffness, damping, forces, sensors), dt, names)
    controller = _controllers([b for b, _, _ in axes], dt, names)
    if order is not None:
        full = _reduced(full, order, names)
    return MagneticLoop(full, controller, float(speed), (stiffness, damping, forces, sensors), shapes)


def _axes(bearing: Any) -> list[tuple[Any, Array, tuple[float, float]]]:
    """The two controlled axes of a bearing: direction in x and y, gains of amplifier and sensor."""
    angle = float(bearing.sensors_axis_rotation)
    amp, sense = (np.broadcast_to(np.asarray(x, dtype=np.float64), (2,)) for x in (bearing.k_amp, bearing.k_sense))
    directions = (np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)]))
    return [(bearing, d, (float(amp[k]), float(sense[k]))) for k, d in enumerate(directions)]


def _lateral(rotor: Any, angle: float | None) -> Array:
    """The lateral degrees of freedom, or those of the plane at an angle from the x axis, as columns."""
    node = np.eye(6)[:, _LATERAL]
    if angle is not None:
        cos, sin = np.cos(angle), np.sin(angle)
        node = node @ np.array([[cos, 0.0], [sin, 0.0], [0.0, -sin], [0.0, cos]])
    found: Array = np.kron(np.eye(rotor.ndof // 6), node).astype(np.float64)
    return found


def _free_modes(rotor: Any, basis: Array, speed: float, highest: float) -> tuple[Array, Array, Array]:
    """Squared frequencies, shapes (node x 2 x mode) and damping of the lateral modes of the rotor without its bearings."""
    bare = type(rotor)(rotor.shaft_elements, rotor.disk_elements)
    mass, stiffness, damping, gyroscopic = (basis.T @ x @ basis for x in (bare.M(0), bare.K(0), bare.C(0), bare.G()))
    squares, vectors = need("scipy.linalg").eigh((stiffness + stiffness.T) / 2, (mass + mass.T) / 2)
    near = squares < highest**2
    squares, vectors = np.where(squares[near] > 1e-9 * highest**2, squares[near], 0.0), vectors[:, near]
    shapes = (basis @ vectors).reshape(-1, 6, vectors.shape[1])[:, :2]
    return squares, shapes, vectors.T @ (damping + speed * gyroscopic) @ vectors


def _discrete(modal: tuple[Array, Array, Array, Array], dt: float, names: list[str]) -> Model:
    """The modal model with a zero-order hold."""
    stiffness, damping, forces, sensors = modal
    n, m = forces.shape
    # Positions in units of 1 / rate keep the matrices balanced.
    rate = 1 / dt
    a = np.block([[np.zeros((n, n)), rate * np.eye(n)], [-stiffness / rate, -damping]])
    b = np.vstack([np.zeros((n, m)), forces / rate])
    held = need("scipy.linalg").expm(dt * np.block([[a, b], [np.zeros((m, 2 * n + m))]]))
    c = np.hstack([sensors, np.zeros_like(sensors)])
    d = np.zeros((len(sensors), m))
    return Model(held[: 2 * n, : 2 * n], held[: 2 * n, 2 * n :], c, d, dt=dt, inputs=names, outputs=names, name="rotor")


def _controllers(bearings: list[Any], dt: float, names: list[str]) -> Model:
    control = need("control")
    each = [control.ss(control.sample_system(b.get_analog_controller(), dt, method="tustin")) for b in bearings]
    k = control.append(*each)
    return Model(k.A, k.B, k.C, k.D, dt=dt, inputs=names, outputs=names, name="controller")


def _reduced(full: Model, order: int, names: list[str]) -> Model:
    """Fewer states by normalised coprime factors, which take unstable models; channels in units of the static gain."""
    size = float(np.max(np.abs(full.frequency_response([0.01 / full.dt]).values)))
    scaled = Model(full.a, full.b, full.c / size, full.d / size, dt=full.dt)
    found = reduce_model(scaled, method="normalised-coprime", order=order).model
    return Model(found.a, found.b, found.c * size, found.d * size, dt=full.dt, inputs=names, outputs=names, name="rotor, reduced")
