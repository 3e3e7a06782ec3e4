"""Runs the program on mutated inputs under limits of memory and time, and reports every exit code but those documented.

    python3 fuzz/programs.py target/debug/youla [runs] [first seed]      needs numpy, scipy and h5py

Each run takes a small log in one of its formats, a run.toml, a run folder or a model, changes it, and starts a verb on it with 1 GB
of memory (`ulimit -v`) and 20 s. Allowed are the exit codes 0, 2 and 3, and 1 of `check`."""
import gzip, json, os, pathlib, random, resource, shutil, subprocess, sys, tempfile, time
import h5py
import numpy as np
from scipy.io import savemat

MEMORY, SECONDS, ROWS = 1_000_000 << 10, 20, 700
FORMATS = {'csv': '', 'csv.gz': '', 'npz': '', 'mat': '', 'h5': ''}
NUMBERS = ['0', '-1', '1', '2', '1e300', '-1e300', '1e-300', '5e-324', '1e308', 'nan', 'inf', '-inf', '100000', '1000000000', '18446744073709551615', '-0.0', '0.5',
           'true', '""', '[]', '{}', '"\\u001b[2J"', '[[]]', '[1e300]', '[nan]', '[0.0]']
VALUES = [np.nan, np.inf, -np.inf, 1e300, -1e300, 1e308, 5e-324, 1e-300, 0.0, 1e30, -1e17]
VERBS = [['check', 'run.toml'], ['identify', 'run.toml', '--out', 'out', '--force'], ['excite', 'run.toml', '--amplitude', '0.5', '--band', '5,100', '--duration', '1', '--out', 'out'],
         ['signals', 'run.toml', '--out', 'out'], ['check', 'LOG', '--input', 'u', '--output', 'y', '--sample-time', '1e-3'], ['init', 'LOG', '--out', 'new.toml']]
OF_RUN = [['report', 'run'], ['compare', 'run', 'other'], ['plot', 'run', 'all'], ['export', 'run', '--to', 'c-controller', '--out', 'c.h']] + [
    ['export', 'run', '--to', to, '--out', f'model.{to}'] for to in ('npz', 'mat', 'python', 'matlab', 'c')]
OF_MODEL = [['export', 'model.json', '--to', to, '--out', 'x'] for to in ('npz', 'mat', 'python', 'matlab', 'c')]


def log(seed):
    """u and y of a lightly damped mode under proportional feedback with white d."""
    rng = np.random.default_rng(seed)
    d, y, rows = rng.standard_normal(ROWS), [0.0, 0.0], []
    for k in range(ROWS):
        now = 1.9 * y[-1] - 0.95 * y[-2] + 0.05 * (rows[-1][1] if rows else 0) + 1e-3 * rng.standard_normal()
        rows.append([1e-3 * k, d[k] - 0.5 * now, now, d[k]])
        y = [y[-1], now]
    return np.array(rows)


def strange(data, rng):
    """The same log with values, channels or rows that no machine makes."""
    data = data.copy()
    kind = rng.randrange(12)
    column, row = rng.randrange(1, 4), rng.randrange(len(data))
    if kind == 0: data[row, column] = rng.choice(VALUES)
    elif kind == 1: data[:, column] = rng.choice(VALUES)
    elif kind == 2: data[:, 1:] = rng.choice(VALUES)
    elif kind == 3: data = data[:rng.choice([0, 1, 2, 3, 5, 15, 17, 40, 100])]
    elif kind == 4: data[:, column] *= rng.choice([1e300, 1e-300, 1e150, 1e-160, 5e-324])
    elif kind == 5: data[:, 1:] *= rng.choice([1e300, 1e-300, 1e150, 1e-160, 1e200])
    elif kind == 6: data[:, 0] *= rng.choice([1e-300, 1e300, 0.0, -1.0, 1e12])
    elif kind == 7: data[row:, column] = data[row, column]
    elif kind == 8: data[rng.randrange(len(data)):, column] += rng.choice([1e3, 1e12, -1e300])
    elif kind == 9: data[:, column] = np.round(data[:, column])
    elif kind == 10: data[:, column] = data[:, rng.randrange(4)]
    return data


def write(path, data, form):
    names = ['t', 'u', 'y', 'd']
    text = lambda: (','.join(names) + '\n' + '\n'.join(','.join(repr(float(v)) for v in r) for r in data) + '\n').encode()
    if form == 'csv': path.write_bytes(text())
    elif form == 'csv.gz': path.write_bytes(gzip.compress(text(), 1))
    elif form == 'npz': np.savez_compressed(path, **{n: data[:, j] for j, n in enumerate(names)})
    elif form == 'mat': savemat(path, {n: data[:, j] for j, n in enumerate(names)}, do_compression=True)
    else:
        with h5py.File(path, 'w') as file:
            for j, n in enumerate(names):
                file.create_dataset(n, data=data[:, j], chunks=(101,), maxshape=(None,), compression='gzip') if len(data) else file.create_dataset(n, data=data[:, j])


def settings(form):
    return f'''name = "f"
[data]
sample_time = 1e-3
time_column = "t"
inputs = [{{ name = "u", unit = "V" }}]
outputs = [{{ name = "y", unit = "um" }}]
input_excitation = [{{ name = "d" }}]
estimation = [{{ file = "log.{form}", take = 400 }}]
verification = [{{ file = "log.{form}", skip = 400, name = "v" }}]
[nominal.state_space]
domain = "discrete"
a = [[1.9, -0.95], [1.0, 0.0]]
b = [[0.05], [0.0]]
c = [[1.0, 0.0]]
d = [[0.0]]
[controller.difference_equation]
feedback = "negative"
numerator = [0.5]
denominator = [1.0]
[hansen]
horizon = 10
order = 4
[direct]
horizon = 10
order = 4
[frequency_response]
window = 64
'''


def bytes_changed(data, rng):
    data = bytearray(data)
    for _ in range(rng.randint(1, 6)):
        at = rng.randrange(len(data) + 1)
        kind = rng.randrange(7)
        if kind < 2 and at < len(data): data[at] = rng.randrange(256)
        elif kind == 2: del data[at:at + rng.randint(1, 64)]
        elif kind == 3: data[at:at] = data[at:at + 64]
        elif kind == 4 and rng.random() < 0.3: del data[at:]
        elif kind == 5: data[at:at + 4] = rng.choice([b'\xff\xff\xff\xff', b'\xff\xff\xff\x7f', b'\0\0\0\x80', b'\0\0\0\0'])
        else: data[at:at] = rng.choice([b'[' * 5000, b'{"a":' * 5000, b'1e999', b'nan', b'"', b'\n', b'\x1b[2J', b',' * 3000, b'(' * 3000])
    return bytes(data)


def numbers_changed(text, rng):
    """A number or a text of TOML or JSON replaced by one that means something else."""
    import re
    for _ in range(rng.randint(1, 2)):
        found = [one for one in re.finditer(r'-?\d+(\.\d*)?(e[-+]?\d+)?|"[^"\n]*"|\[\[?[^\[\]]*\]', text)
                 if text[text.rfind('\n', 0, one.start()) + 1:one.start()].strip() or one.group()[0] not in '["']
        if not found: return text
        one = rng.choice(found)
        new = rng.choice(NUMBERS) if rng.random() < 0.8 else '[' * 300 + ']' * 300
        text = text[:one.start()] + new + text[one.end():]
    return text


KEYS = ['[data]\nextra = 1', '[recommended]\nmax_order = 100000', '[recommended]\nmax_order = 0', '[check]\nlags = 100000', '[check]\nlags = 0', '[check]\nexcitation_order = 100000',
        '[redesign]\n', '[uncertainty]\nmethod = "bootstrap"\n', '[reduction]\norder = 100000', '[certificate]\n', '[hansen.uncertainty]\nmethod="delta"', '[reduction]\norder = 2']


def case(rng, base, folder):
    """Writes one mutated case and gives the arguments."""
    form = rng.choice(list(FORMATS))
    file = folder / f'log.{form}'
    kind = rng.randrange(10)
    write(file, strange(base, rng) if kind < 3 else base, form)
    text = settings(form)
    if kind == 3: file.write_bytes(bytes_changed(file.read_bytes(), rng))
    elif kind == 4:
        raw = gzip.compress(bytes_changed(gzip.decompress(file.read_bytes()), rng)) if form == 'csv.gz' else bytes_changed(file.read_bytes(), rng)
        file.write_bytes(raw)
    elif kind in (5, 6): text = numbers_changed(text, rng)
    elif kind == 7: text = text + rng.choice(KEYS) + '\n' if rng.random() < 0.6 else bytes_changed(text.encode(), rng).decode('latin-1')
    elif kind >= 8:
        source = rng.choice([p for p in (folder.parent / 'whole').rglob('*') if p.is_file()])
        verb = rng.choice(OF_RUN + OF_MODEL)
        for name in ('run', 'other'):
            shutil.copytree(folder.parent / 'whole', folder / name)
        shutil.copy(folder.parent / 'whole/4-identify/recommended.json', folder / 'model.json')
        victim = folder / 'model.json' if verb in OF_MODEL else folder / 'run' / source.relative_to(folder.parent / 'whole')
        if victim.suffix in ('.json', '.toml') and rng.random() < 0.7: victim.write_text(numbers_changed(victim.read_text(), rng))
        else: victim.write_bytes(bytes_changed(victim.read_bytes(), rng))
        return verb
    (folder / 'run.toml').write_text(text)
    return [str(file.name) if a == 'LOG' else a for a in rng.choice(VERBS if kind < 5 else VERBS[:4])]


def limited():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def run(program, arguments, folder):
    start = time.time()
    try:
        done = subprocess.run([program, '--quiet', *arguments], cwd=folder, capture_output=True, timeout=SECONDS, preexec_fn=limited, stdin=subprocess.DEVNULL,
                              env=dict(os.environ, RAYON_NUM_THREADS='1'))
        return done.returncode, done.stderr.decode('utf-8', 'replace'), time.time() - start
    except subprocess.TimeoutExpired:
        return 'time', '', time.time() - start


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    runs, first = (int(a) for a in (sys.argv[2:] + ['200', '0'][len(sys.argv) - 2:])[:2])
    top = pathlib.Path(tempfile.mkdtemp())
    base, codes, slowest, bad = log(1), {}, (0, ''), 0
    write(top / 'log.csv', base, 'csv')
    (top / 'run.toml').write_text(settings('csv'))
    code, said, _ = run(program, ['identify', 'run.toml', '--out', 'whole'], top)
    if code != 0: sys.exit(f'the whole log is refused: {said}')
    for seed in range(first, first + runs):
        folder = top / 'case'
        folder.mkdir()
        arguments = case(random.Random(seed), base, folder)
        code, said, seconds = run(program, arguments, folder)
        codes[code] = codes.get(code, 0) + 1
        slowest = max(slowest, (seconds, f'{seed} {arguments}'))
        control = any(ord(c) < 32 and c not in '\n\t' for c in said)
        if code not in (0, 2, 3) and not (code == 1 and arguments[0] == 'check') or control or (code in (2, 3) and not said.strip()):
            bad += 1
            kept = pathlib.Path(tempfile.gettempdir()) / f'youla-programs-{seed}'
            shutil.rmtree(kept, ignore_errors=True)
            shutil.copytree(folder, kept, symlinks=True)
            print(f'seed {seed}: exit {code}, {seconds:.1f} s, {arguments}, kept in {kept}\n    {said[:400]!r}', flush=True)
        shutil.rmtree(folder)
    shutil.rmtree(top)
    print(f'{runs} runs from seed {first}: {bad} bad; exit codes {codes}; slowest {slowest[0]:.1f} s: {slowest[1]}')
    sys.exit(bad > 0)


if __name__ == '__main__':
    main()
