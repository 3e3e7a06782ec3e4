"""Writes the seeds of the fuzz targets to crates/youla/tests/readers/seeds: synthetic, a few hundred bytes each.
Needs numpy and scipy; the folders run_toml, paper_toml, rig_toml and structure also take what ships with the project."""
import gzip, hashlib, io, pathlib
import numpy as np
from scipy.io import savemat

root = pathlib.Path(__file__).resolve().parent.parent
seeds = root / 'crates/youla/tests/readers/seeds'


def put(reader, name, data):
    folder = seeds / reader
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())


def saved(**variables):
    out = io.BytesIO()
    np.savez_compressed(out, **variables)
    return out.getvalue()


def matlab(variables, packed):
    out = io.BytesIO()
    savemat(out, variables, do_compression=packed)
    return b'MATLAB 5.0 MAT-file, synthetic'.ljust(116) + out.getvalue()[116:]


def array(data):
    out = io.BytesIO()
    np.save(out, data)
    return out.getvalue()


table = 't,u,y\n0,1,-0.5\n0.001,2,1e-3\n0.002,3,4\n'
put('csv', 'comma.csv', table)
put('csv', 'packed.csv.gz', gzip.compress(table.encode(), mtime=0))
put('csv', 'semicolon.csv', '# a comment\n' + table.replace(',', ';').replace('\n', '\r\n'))
put('csv', 'tabs.txt', '\ufeff' + table.replace(',', '\t'))
put('csv', 'blanks.txt', '0 1 2\n1 3 4\n\n2 5 6\n')
put('csv', 'gap.csv', '0,1\n1,1\n2,1\n5,1\n6,1\n')
structure = {'Data': {'u': np.arange(3.0), 'name': 'rig', 'runs': [{'y': np.eye(2)}, {'y': np.ones(3)}]}}
cells = np.empty((1, 2), dtype=object)
cells[0, 0], cells[0, 1] = np.arange(2, dtype=np.int16), 'text'
variables = {**structure, 'c': cells, 'z': np.array([1 + 2j]), 'flag': np.array([True]), 'i': np.arange(3, dtype=np.uint8)}
put('mat', 'plain.mat', matlab(variables, False))
put('mat', 'packed.mat', matlab(variables, True))
put('npz', 'two.npz', saved(u=np.arange(4.0), y=np.arange(4, dtype=np.float32).reshape(2, 2)))
put('npz', 'text.npz', saved(names=np.array(['u', 'y']), n=np.int16(3)))
put('npy', 'rows.npy', array(np.arange(6.0).reshape(3, 2)))
put('npy', 'columns.npy', array(np.asfortranarray(np.arange(6, dtype='>f4').reshape(3, 2))))
put('run_toml', 'drive.toml', (root / 'examples/flexible-drive/run.toml').read_bytes())
put('subspace_toml', 'options.toml', 'horizon = 20\nweight = "cva"\norder = { auto = { max = 6 } }\n[uncertainty]\nmethod = "delta"\n')
put('subspace_toml', 'fixed.toml', 'horizon = 10\npast = 20\norder = { fixed = 4 }\nstability = "allow"\n')
for template in sorted((root / 'crates/youla/src/identify/greybox/declared/templates').glob('*.toml')):
    put('structure', template.name, template.read_bytes())
put('structure', 'small.toml', 'sample_time = 0.1\na = [["sqrt(k) ^ -2 * pi", "exp(-m)"], [0, "atan(k / m)"]]\nb = [["1 / m"], [1]]\n'
    'c = [["(k - 2) * ratio", 0]]\n[parameters]\nk = { initial = 2.0, min = 0.0, unit = "N/m" }\nm = { initial = 1.0, fixed = true }\n'
    '[derived]\nratio = "k / m"\n')
row = '3,0.5,0.1,100,1.5,1.6,hansen,ok,97.1,96.2,12,note'
put('row', 'row.csv', f'{row},{hashlib.sha256(row.encode()).hexdigest()[:8]}')
put('paper_toml', 'paper.toml', (root / 'crates/youla/assets/paper.toml').read_bytes())
put('rig_toml', 'bearing.toml', (root / 'crates/youla/assets/bearing.toml').read_bytes())
