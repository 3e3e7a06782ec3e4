"""What a user writes today: SciPy's least squares around a simulation of the bearing with 16 parameters.
python grey_box.py FOLDER FACTOR slicot|control    prints seconds, fit on the verification record in percent, half the sum of squares."""
import sys
import time
import numpy as np
from scipy.linalg import expm
from scipy.optimize import least_squares
from common import fit, load

TS = 2e-4
DAMPING = [-224.9, 3.97, 9.12, -267.7]
STIFFNESS = [-1.869e6, -8577.0, -9510.0, -1.737e6]
GAIN = [-6.126e6, 3.154e5, -1.571e5, -4.516e6]
POLE = [989.0, 0.0, 0.0, 942.5]


def continuous(theta):
    d, k, b, p = np.asarray(theta).reshape(4, 2, 2)
    zero, eye = np.zeros((2, 2)), np.eye(2)
    a = np.block([[zero, eye, zero], [k, d, b], [zero, zero, -p]])
    return a, np.vstack([zero, zero, p]), np.hstack([eye, zero, zero]), zero


def sampled(theta):
    a, b, c, d = continuous(theta)
    joint = np.zeros((8, 8))
    joint[:6, :6], joint[:6, 6:] = TS * a, TS * b
    step = expm(joint)
    return step[:6, :6], step[:6, 6:], c, d


def by_slicot(theta, u):
    import ctrlsys
    a, b, c, d = map(np.asfortranarray, sampled(theta))
    return ctrlsys.tf01md(a, b, c, d, np.asfortranarray(u.T), np.zeros(6))[0].T


def by_control(theta, u):
    import control
    return control.forced_response(control.ss(*continuous(theta)).sample(TS), inputs=u.T).outputs.T


folder, factor, program = sys.argv[1], float(sys.argv[2]), sys.argv[3]
simulate = {'slicot': by_slicot, 'control': by_control}[program]
u, y, uv, yv = load(folder)
start = factor * np.array(DAMPING + STIFFNESS + GAIN + POLE)
scale = np.where(start != 0, abs(start), 1000 * factor)


def residual(scaled):
    e = (simulate(scaled * scale, u) - y).ravel()
    return np.clip(np.nan_to_num(e, nan=1e6, posinf=1e6, neginf=-1e6), -1e6, 1e6)


simulate(start, u[:100])
begun = time.perf_counter()
found = least_squares(residual, start / scale, method='trf', max_nfev=300)
seconds = time.perf_counter() - begun
print(seconds, fit(sampled(found.x * scale), uv, yv), found.cost)
