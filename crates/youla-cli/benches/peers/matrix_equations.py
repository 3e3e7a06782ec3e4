"""SciPy and SLICOT on the problems of matrix_equations.rs.  argv: folder, residuals | speed"""
import sys, time, warnings
import numpy as np, scipy.linalg as sl
import ctrlsys, slycot
warnings.filterwarnings('ignore')
KINDS = ['care', 'dare', 'lyapunov', 'stein', 'sylvester', 'reorder']
norm = np.linalg.norm


def matrices(data, at, count):
    found = []
    for _ in range(count):
        rows, columns = int(data[at]), int(data[at + 1])
        found.append(data[at + 2:at + 2 + rows * columns].reshape(columns, rows).T.copy())
        at += 2 + rows * columns
    return found, at


def problems(path):
    data, at, found = np.fromfile(path), 0, []
    while at < len(data):
        kind, hard, count = KINDS[int(data[at])], bool(data[at + 1]), int(data[at + 2])
        given, at = matrices(data, at + 3, count)
        found.append((kind, hard, given))
    return found


def ours(path):
    data, at, found = np.fromfile(path), 0, []
    while at < len(data):
        solution, at = matrices(data, at + 1, int(data[at]))
        found.append(solution)
    return found


def solvers(kind):
    f = lambda x: np.array(x, order='F', copy=True)
    def od(time, a, b, q, r):
        return [slycot.sb02od(len(a), b.shape[1], f(a), f(b), f(q), f(r), time)[0]]
    def md(time, a, b, q, r):
        return [slycot.sb02md(len(a), f(a), f(b @ np.linalg.solve(r, b.T)), f(q), time, hinv='D' if time == 'C' else 'I')[0]]
    def lyapunov(time):
        def run(a, q):
            u = np.zeros_like(a, order='F')
            x = slycot.sb03md57(f(a), f(u), f(-q), time, 'X', 'N', 'T')[2:4]
            return [x[0] / x[1]]
        return run
    return {
        'care': {'scipy': lambda a, b, q, r: [sl.solve_continuous_are(a, b, q, r)],
                 'sb02od': lambda *p: od('C', *p), 'sb02md': lambda *p: md('C', *p)},
        'dare': {'scipy': lambda a, b, q, r: [sl.solve_discrete_are(a, b, q, r)],
                 'sb02od': lambda *p: od('D', *p), 'sb02md': lambda *p: md('D', *p)},
        'lyapunov': {'scipy': lambda a, q: [sl.solve_continuous_lyapunov(a, -q)], 'sb03md': lyapunov('C')},
        'stein': {'scipy': lambda a, q: [sl.solve_discrete_lyapunov(a, q)], 'sb03md': lyapunov('D')},
        'sylvester': {'scipy': lambda a, b, c: [sl.solve_sylvester(a, b, c)],
                      'sb04md': lambda a, b, c: [ctrlsys.sb04md(f(a), f(b), f(c))[0]]},
        'reorder': {'scipy': lambda a: list(sl.schur(a, sort=lambda re, im=0.0: re < 0)[1::-1])},
    }[kind]


def residual(kind, given, solution):
    x = np.asarray(solution[0])
    if kind in ('care', 'dare'):
        a, b, q, r = given
        if kind == 'care':
            k = np.linalg.solve(r, b.T @ x); g = x @ b @ k
            size = 2 * norm(a.T @ x) + norm(g) + norm(q)
            left = a.T @ x + x @ a - g + q
            stable = np.linalg.eigvals(a - b @ k).real.max() < 0
        else:
            k = np.linalg.solve(r + b.T @ x @ b, b.T @ x @ a); g = a.T @ x @ b @ k
            left = a.T @ x @ a - x - g + q
            size = norm(a.T @ x @ a) + norm(x) + norm(g) + norm(q)
            stable = abs(np.linalg.eigvals(a - b @ k)).max() < 1
        return norm(left) / size if stable else np.inf
    if kind == 'lyapunov':
        a, q = given
        return norm(a @ x + x @ a.T + q) / (2 * norm(a) * norm(x) + norm(q))
    if kind == 'stein':
        a, q = given
        return norm(a @ x @ a.T - x + q) / ((norm(a) ** 2 + 1) * norm(x) + norm(q))
    if kind == 'sylvester':
        a, b, c = given
        return norm(a @ x + x @ b - c) / ((norm(a) + norm(b)) * norm(x) + norm(c))
    q, t = x, np.asarray(solution[1])
    signs = np.diag(t) < 0
    ordered = not np.any(~signs[:-1] & signs[1:])
    a = given[0]
    error = norm(a - q @ t @ q.T) / norm(a) + norm(q.T @ q - np.eye(len(a))) / np.sqrt(len(a))
    return error if ordered else np.inf


def judged(kind, given, solve):
    try:
        with np.errstate(all='ignore'):
            value = residual(kind, given, solve(*given))
        return value if np.isfinite(value) else np.inf
    except Exception:
        return np.inf


def compare(folder):
    found = problems(f'{folder}/problems.bin')
    mine = ours(f'{folder}/ours.bin')
    print('| problems | | median | 90 % | largest | failed | ours worse than the best peer by 2, 10 | than the worst by 2, 10 |')
    print('|---|---|---|---|---|---|---|---|')
    for hard in (False, True):
        for kind in KINDS:
            these = [(given, x) for (k, h, given), x in zip(found, mine) if k == kind and h == hard]
            table = {'ours': [judged(kind, given, lambda *_: x) for given, x in these]}
            for name, solve in solvers(kind).items():
                table[name] = [judged(kind, given, solve) for given, _ in these]
            peers = np.maximum(np.array([v for name, v in table.items() if name != 'ours']), 1e-16)
            own = np.maximum(np.array(table['ours']), 1e-16)
            def worse(reference, factor):
                return int(np.sum((own > factor * reference) & (own > 1e-14) & ~(np.isinf(own) & np.isinf(reference))))
            counts = [worse(r, f) for r in (peers.min(0), peers.max(0)) for f in (2, 10)]
            for name, values in table.items():
                values = np.array(values); good = values[np.isfinite(values)]
                share = f'{counts[0]}, {counts[1]} | {counts[2]}, {counts[3]}' if name == 'ours' else ' | '
                print(f'| {"hard " if hard else ""}{kind}, {len(these)} | {name} | {np.median(good):.1e} | '
                      f'{np.quantile(good, 0.9):.1e} | {good.max():.1e} | {np.sum(~np.isfinite(values))} | {share} |')
            for i in np.argsort(-own / peers.min(0))[:3]:
                if own[i] > max(1e-14, 2 * peers[:, i].min()):
                    sizes = len(these[i][0][0])
                    print(f'worst: {kind} n = {sizes}: ours {own[i]:.1e}, peers {[f"{v:.1e}" for v in peers[:, i]]}', file=sys.stderr)


def speed(folder):
    kind, _, given = problems(f'{folder}/one.bin')[0]
    for name, solve in solvers(kind).items():
        try:
            solve(*given)
        except Exception:
            continue
        times = []
        while not times or sum(times) < 0.5 and len(times) < 101:
            start = time.perf_counter(); solve(*given); times.append(time.perf_counter() - start)
        print(name, sorted(times)[len(times) // 2])


{'residuals': compare, 'speed': speed}[sys.argv[2]](sys.argv[1])
