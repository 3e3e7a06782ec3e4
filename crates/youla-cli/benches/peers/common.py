"""What the peers share: the records as raw numbers, and how a call is measured."""
import time
import numpy as np


def load(folder):
    channels = int(open(f'{folder}/channels').read())
    return [np.fromfile(f'{folder}/{name}').reshape(channels, -1).T for name in ('u', 'y', 'uv', 'yv')]


def memory(key):
    for line in open('/proc/self/status'):
        if line.startswith(key):
            return int(line.split()[1]) / 1024


def fit(model, u, y):
    a, b, c, d = (np.asarray(x) for x in model)
    x, simulated = np.zeros(len(a)), np.zeros_like(y)
    for k in range(len(u)):
        simulated[k] = c @ x + d @ u[k]
        x = a @ x + b @ u[k]
    return 100 * min(1 - np.linalg.norm(y - simulated, axis=0) / np.linalg.norm(y - y.mean(axis=0), axis=0))


def measure(identify, u, y, uv, yv):
    identify(u[:2000], y[:2000])
    before, times = memory('VmRSS'), []
    while not times or sum(times) < 1 and len(times) < 15:
        start = time.perf_counter()
        model = identify(u, y)
        times.append(time.perf_counter() - start)
    print(sorted(times)[len(times) // 2], fit(model, uv, yv), max(0, memory('VmHWM') - before))
