"""Runs `youla identify` on random closed loops under limits of memory and time, and gathers exit codes and refusals.

    python3 fuzz/loops.py target/debug/youla [loops] [first seed] [minutes]      needs numpy and scipy

Each loop is a random plant of order 1 to 12 with 1 to 3 inputs and outputs in random units, with a nominal model that is wrong in its
parameters or its order, under a static, PI or observer-based controller that stabilises both, with a random excitation, noise and
length. Allowed are the exit codes 0, 2 and 3; every refusal is printed once with its count and a seed."""
import os, pathlib, re, resource, shutil, subprocess, sys, tempfile, time
import numpy as np
import scipy.linalg as sl

MEMORY, SECONDS = 1_000_000 << 10, 60
rows = lambda m: '[' + ', '.join('[' + ', '.join(repr(float(v)) for v in r) + ']' for r in np.atleast_2d(m)) + ']'
radius = lambda a: max(abs(np.linalg.eigvals(a))) if len(a) else 0.0


def plant(rng, n, m, p, largest):
    """Modes and lags with poles up to `largest`."""
    a, k = np.zeros((n, n)), 0
    while k < n:
        size = largest * rng.uniform(0.3, 1) ** rng.choice([0.05, 0.3, 1.0])
        if n - k > 1 and rng.random() < 0.7:
            angle = np.pi * np.exp(rng.uniform(np.log(0.005), np.log(0.95)))
            a[k:k + 2, k:k + 2] = size * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            k += 2
        else:
            a[k, k] = size * rng.choice([1, 1, -1])
            k += 1
    t = rng.standard_normal((n, n)) + 2 * np.eye(n)
    a = np.linalg.solve(t, a @ t)
    d = rng.standard_normal((p, m)) * 0.1 if rng.random() < 0.15 else np.zeros((p, m))
    return a, rng.standard_normal((n, m)), rng.standard_normal((p, n)), d


def closed(g, k):
    """Poles of u = K y about y = G u; none where the loop is not well posed."""
    (a, b, c, d), (ak, bk, ck, dk) = g, k
    e = np.eye(len(c)) - d @ dk
    if np.linalg.cond(e) > 1e3: return np.inf
    f = np.linalg.inv(e)
    top = np.hstack([a + b @ dk @ f @ c, b @ (ck + dk @ f @ d @ ck)])
    return radius(np.vstack([top, np.hstack([bk @ f @ c, ak + bk @ f @ d @ ck])]))


def controller(rng, g):
    a, b, c, d = g
    n, m, p = len(a), b.shape[1], len(c)
    kind = rng.integers(3)
    if kind == 2:
        x = sl.solve_discrete_are(a, b, c.T @ c + 1e-6 * np.eye(n), 10 ** rng.uniform(-1, 3) * np.eye(m))
        f = -np.linalg.solve(b.T @ x @ b + np.eye(m), b.T @ x @ a)
        x = sl.solve_discrete_are(a.T, c.T, b @ b.T + 1e-6 * np.eye(n), 10 ** rng.uniform(-1, 3) * np.eye(p))
        l = -np.linalg.solve(c @ x @ c.T + np.eye(p), c @ x @ a.T).T
        return (a + b @ f + l @ c + l @ d @ f, -l, f, np.zeros((m, p)))
    gain = -rng.standard_normal((m, p)) * 10 ** rng.uniform(-3, 0) / max(1e-9, np.abs(c @ np.linalg.pinv(np.eye(n) - 0.98 * a) @ b).max())
    if kind == 0: return np.zeros((1, 1)), np.zeros((1, p)), np.zeros((m, 1)), gain     # a state that does nothing
    return np.eye(p), np.eye(p), gain * rng.uniform(0.001, 0.1), gain


def loop(seed):
    rng = np.random.default_rng(seed)
    while True:
        n, m, p = int(rng.integers(1, 13)), int(rng.integers(1, 4)), int(rng.integers(1, 4))
        g = plant(rng, n, m, p, rng.choice([0.9, 0.99, 0.999, 1.0, 1.02]))
        wrong = lambda x: x * (1 + rng.choice([0, 1e-9, 0.02, 0.2]) * rng.standard_normal(x.shape))
        nominal = (g[0] * rng.choice([1.0, 0.98, 1.005]), wrong(g[1]), wrong(g[2]), g[3])
        try:
            k = controller(rng, nominal)
            if max(closed(g, k), closed(nominal, k)) < 0.9995: break
        except (np.linalg.LinAlgError, ValueError):
            pass
    count = int(rng.choice([120, 300, 800, 2000]))
    level = rng.choice(['white', 'prbs', 'multisine', 'steps'])
    times = np.arange(count)[:, None]
    d = {'white': lambda: rng.standard_normal((count, m)), 'prbs': lambda: np.repeat(rng.choice([-1.0, 1.0], (count, m)), rng.integers(1, 6), 0)[:count],
         'multisine': lambda: sum(np.cos(2 * np.pi * f * times / 120 + rng.uniform(0, 6.3, m)) for f in range(1, 30)), 'steps': lambda: np.repeat(rng.standard_normal((count, m)), 40, 0)[:count]}[level]()
    noise = rng.choice([0.0, 1e-4, 0.01, 0.1, 1.0])
    (a, b, c, dd), (ak, bk, ck, dk) = g, k
    x, xk, u, y = np.zeros(n), np.zeros(len(ak)), [], []
    invert, drawn = np.linalg.inv(np.eye(p) - dd @ dk), rng.standard_normal((count, p))
    for t in range(count):
        now = invert @ (c @ x + dd @ (ck @ xk + d[t]) + noise * drawn[t])
        command = ck @ xk + dk @ now + d[t]
        x, xk = a @ x + b @ command, ak @ xk + bk @ now
        u.append(command); y.append(now)
    # Units: outputs and inputs in any.
    su, sy = 10 ** rng.uniform(-4, 4, m), 10 ** rng.uniform(-4, 4, p)
    nominal = (nominal[0], nominal[1] / su, nominal[2] * sy[:, None], nominal[3] / su * sy[:, None])
    k = (k[0], k[1] / sy, k[2] * su[:, None], k[3] / sy * su[:, None])
    known = rng.random() < 0.85
    return dict(ts=10 ** rng.uniform(-5, 2), u=np.array(u) * su, y=np.array(y) * sy, d=d * su if known else None, nominal=nominal, k=k, count=count)


def write(l, folder):
    (m, p), n = (l['u'].shape[1], l['y'].shape[1]), l['count']
    parts = [('u', l['u']), ('y', l['y'])] + ([('d', l['d'])] if l['d'] is not None else [])
    names = [f'{s}{j}' for s, v in parts for j in range(v.shape[1])]
    np.savetxt(folder / 'log.csv', np.hstack([v for _, v in parts]), delimiter=',', header=','.join(names), comments='', fmt='%.9g')
    channels = lambda s, k: '[' + ', '.join(f'{{ name = "{s}{i}" }}' for i in range(k)) + ']'
    known = f'input_excitation = {channels("d", m)}\n' if l['d'] is not None else ''
    tables = ''
    for name, g in [('nominal', l['nominal']), ('controller', l['k'])]:
        feedback = 'feedback = "positive"\n' if name == 'controller' else ''
        a, b, c, d = g
        tables += f'[{name}.state_space]\n{feedback}domain = "discrete"\na = {rows(a)}\nb = {rows(b)}\nc = {rows(c)}\nd = {rows(d)}\n'
    take = 2 * n // 3
    (folder / 'run.toml').write_text(f'name = "loop"\n[data]\nsample_time = {l["ts"]!r}\ninputs = {channels("u", m)}\noutputs = {channels("y", p)}\n{known}'
        f'estimation = [{{ file = "log.csv", take = {take} }}]\nverification = [{{ file = "log.csv", skip = {take} }}]\n{tables}')


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    count, first, minutes = (float(a) for a in (sys.argv[2:] + ['200', '0', '1e9'][len(sys.argv) - 2:])[:3])
    end, top = time.time() + 60 * minutes, pathlib.Path(tempfile.mkdtemp())
    codes, said, slowest, bad, done = {}, {}, (0, 0), 0, 0
    limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for seed in range(int(first), int(first + count)):
        if time.time() > end: break
        folder = top / 'loop'
        folder.mkdir()
        write(loop(seed), folder)
        start = time.time()
        try:
            found = subprocess.run([program, '-q', 'identify', 'run.toml', '--out', 'run'], cwd=folder, capture_output=True, text=True, timeout=SECONDS,
                                   preexec_fn=limit, stdin=subprocess.DEVNULL, env=dict(os.environ, RAYON_NUM_THREADS='1'))
            code, text = found.returncode, found.stderr
        except subprocess.TimeoutExpired:
            code, text = 'time', ''
        slowest = max(slowest, (time.time() - start, seed))
        codes[code] = codes.get(code, 0) + 1
        if code:
            kind = re.sub(r'-?\d[\d.e+-]*', '#', text.strip().splitlines()[0] if text.strip() else '')
            said.setdefault((code, kind), []).append(seed)
        if code not in (0, 2, 3):
            bad += 1
            print(f'seed {seed}: exit {code}: {text[:500]!r}', flush=True)
        done += 1
        shutil.rmtree(folder)
    shutil.rmtree(top)
    for (code, kind), seeds in sorted(said.items(), key=lambda x: -len(x[1])):
        print(f'{len(seeds):5} exit {code}, such as seed {seeds[0]}: {kind[:300]}')
    print(f'{done} loops from seed {int(first)}: {bad} bad; exit codes {codes}; slowest {slowest[0]:.1f} s: seed {slowest[1]}')
    sys.exit(bad > 0)


if __name__ == '__main__':
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    main()
