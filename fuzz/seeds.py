"""Writes the seeds of the fuzz targets to crates/youla-io/tests/seeds: synthetic, a few hundred bytes each.
Needs numpy, scipy and h5py; the folders run_toml, paper_toml, rig_toml and structure also take what ships with the project."""
import gzip, hashlib, io, json, math, pathlib, struct
import h5py
import numpy as np
from scipy.io import savemat

root = pathlib.Path(__file__).resolve().parent.parent
seeds = root / 'crates/youla-io/tests/seeds'


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


def matlab73(fill):
    """An HDF5 file behind the 512 bytes of MATLAB."""
    out = io.BytesIO()
    with h5py.File(out, 'w', userblock_size=512) as file:
        fill(file)
    data = bytearray(out.getvalue())
    data[:128] = b'MATLAB 7.3 MAT-file, synthetic'.ljust(116) + bytes(8) + b'\x00\x02IM'
    return bytes(data)


def classed(group, name, data, matlab_class, **options):
    dataset = group.create_dataset(name, data=data, track_times=False, **options)
    dataset.attrs['MATLAB_class'] = np.bytes_(matlab_class)
    return dataset



def array(data):
    out = io.BytesIO()
    np.save(out, data)
    return out.getvalue()


table = 't,u,y\n0,1,-0.5\n0.001,2,1e-3\n0.002,3,4\n'
put('csv', 'comma.csv', table)
put('csv', 'packed.csv.gz', gzip.compress(table.encode(), mtime=0))
put('csv', 'semicolon.csv', '# a comment\n' + table.replace(',', ';').replace('\n', '\r\n'))
put('csv', 'decimal-comma.csv', 't;u;y\n0;1;-0,5\n0,001;2;1e-3\n0,002;3;4,25\n')
put('csv', 'tabs.txt', '\ufeff' + table.replace(',', '\t'))
put('csv', 'blanks.txt', '0 1 2\n1 3 4\n\n2 5 6\n')
put('csv', 'gap.csv', '0,1\n1,1\n2,1\n5,1\n6,1\n')
structure = {'Data': {'u': np.arange(3.0), 'name': 'rig', 'runs': [{'y': np.eye(2)}, {'y': np.ones(3)}]}}
cells = np.empty((1, 2), dtype=object)
cells[0, 0], cells[0, 1] = np.arange(2, dtype=np.int16), 'text'
variables = {**structure, 'c': cells, 'z': np.array([1 + 2j]), 'flag': np.array([True]), 'i': np.arange(3, dtype=np.uint8)}
put('mat', 'plain.mat', matlab(variables, False))
put('mat', 'packed.mat', matlab(variables, True))


def structs(file):
    classed(file, 'ts', np.array([[5e-4]]), 'double')
    classed(file, 'x', np.arange(6.0).reshape(2, 3), 'double')
    classed(file, 'name', np.array([[ord(c)] for c in 'rig'], dtype=np.uint16), 'char').attrs['MATLAB_int_decode'] = np.int32(2)
    classed(file, 'none', np.array([0, 0], dtype=np.uint64), 'double').attrs['MATLAB_empty'] = np.uint8(1)
    data = file.create_group('Data')
    data.attrs['MATLAB_class'] = np.bytes_('struct')
    classed(data, 'u', np.arange(4.0).reshape(1, 4), 'double')
    classed(data, 'y', np.arange(4, dtype=np.int16).reshape(1, 4), 'int16')


def cycle(file):
    file.create_group('Data')['again'] = file


put('mat73', 'structs.mat', matlab73(structs))
put('mat73', 'cycle.mat', matlab73(cycle))
put('mat73', 'chunks.mat', matlab73(lambda file: classed(file, 'x', np.arange(1011.0), 'double', chunks=(503,), compression='gzip')))
empty = np.array([2**63, 0], dtype=np.uint64)
put('mat73', 'empty.mat', matlab73(lambda file: classed(file, 'none', empty, 'double').attrs.create('MATLAB_empty', np.uint8(1))))
put('mat73', 'rows.h5', matlab73(lambda file: file.create_dataset('x', data=np.arange(6.0).reshape(3, 2), track_times=False))[512:])
put('model', 'model.npz', saved(a=np.eye(2) / 2, b=np.ones((2, 1)), c=np.ones((1, 2)), d=np.zeros((1, 1)), ts=1e-3))
model = {'a': np.eye(2) / 2, 'b': np.ones((2, 1)), 'c': np.ones((1, 2)), 'd': np.zeros((1, 1)), 'ts': 1e-3}
put('model', 'model.mat', matlab({**model, 'inputs': np.array([['u']], dtype=object)}, False))
put('npz', 'two.npz', saved(u=np.arange(4.0), y=np.arange(4, dtype=np.float32).reshape(2, 2)))
put('npz', 'text.npz', saved(names=np.array(['u', 'y']), n=np.int16(3)))
put('run_toml', 'drive.toml', (root / 'examples/flexible-drive/run.toml').read_bytes())
put('subspace_toml', 'options.toml', 'horizon = 20\nmethod = "cva"\norder = "auto"\n')
put('subspace_toml', 'fixed.toml', 'horizon = 10\npast = 20\norder = 4\nstability = "allow"\n')
for template in sorted((root / 'crates/youla-greybox/src/declared/templates').glob('*.toml')):
    put('structure', template.name, template.read_bytes())
put('structure', 'small.toml', 'sample_time = 0.1\na = [["sqrt(k) ^ -2 * pi", "exp(-m)"], [0, "atan(k / m)"]]\nb = [["1 / m"], [1]]\n'
    'c = [["(k - 2) * ratio", 0]]\n[parameters]\nk = { initial = 2.0, min = 0.0, unit = "N/m" }\nm = { initial = 1.0, fixed = true }\n'
    '[derived]\nratio = "k / m"\n')
row = '3,0.5,0.1,100,1.5,1.6,hansen,ok,97.1,96.2,12,note'
put('row', 'row.csv', f'{row},{hashlib.sha256(row.encode()).hexdigest()[:8]}')
put('paper_toml', 'paper.toml', (root / 'studies/paper/assets/paper.toml').read_bytes())
put('rig_toml', 'bearing.toml', (root / 'studies/paper/assets/bearing.toml').read_bytes())
put('check_toml', 'check.toml', 'clipped_samples = 3\nlags = 20\nexcitation_order = 40\ncrest = 4.5\nsignificance = 1e-3\n[limits]\ny = [-1.0, 2.5]\n')
channel = {'name': 'y', 'unit': 'um'}
system = {'a': [[0.5, 0.1], [0, 0.25]], 'b': [[1.0], [0]], 'c': [[1, -1e-3]], 'd': [[0]]}
put('controller_json', 'youla.json', json.dumps({'method': 'youla', 'ts': 1e-3, 'measured': [channel], 'commanded': [channel],
                                                 'controller': system, 'q': system}))
put('controller_json', 'lqg.json', json.dumps({'method': 'lqg', 'ts': 1e-3, 'measured': [channel], 'commanded': [channel],
                                               'controller': system, 'observer': {**system, 'f': [[1, 2]], 'l': [[1], [2]]}}))
put('model_json', 'model.json', json.dumps({'name': 'hansen', 'inputs': [channel], 'outputs': [channel], 'ts': 1e-3, **system,
    'poles': [[0.5, 0], [0.25, 0]], 'details': {'order': 2}, 'provenance': {'schema': 1, 'program': 'youla 0.1.0', 'seed': None,
    'sources': [{'path': 'y.csv', 'purpose': 'estimation', 'sha256': ''}], 'options': {'horizon': 20}}}))
put('model', 'model.json', json.dumps({'name': 'hansen', 'inputs': [channel], 'outputs': [channel], 'ts': 1e-3, **system}))
clock = {'sample_time': 1e-3, 'samples': 3, 'detail': {'start': 0, 'end': 0}, 'bucket': 1}
trace = {'steps': [0, 1, 1], 'values': [1.0, None, -2.5]}
axis = {'label': 'time', 'unit': 's', 'range': [0, 2.5], 'log': False}
empty = {'title': 'rig', 'summary': '', 'program': 'youla', 'run': 'a', 'settings': '[data]', 'sources': [], 'inputs': [channel],
         'outputs': [channel], 'sample_time': 1e-3, 'methods': [{'key': 'hansen', 'label': 'Hansen', 'role': 'hansen'}], 'verdict': [],
         'notes': [], 'fits': [], 'experiments': [], 'orders': [], 'verification': [], 'frequency': None, 'poles': [], 'modes': [],
         'reduction': None, 'certificates': [], 'bezout_residual': 1e-12, 'stages': []}


def report(name, **parts):
    put('report_json', name, json.dumps({**empty, **parts}, separators=(',', ':')))


report('tables.json', verdict=[{'status': 'good', 'text': 'fits', 'evidence': 'fits'}], notes=[{'status': 'caution', 'text': 'few'}],
       fits=[{'record': 'r', 'output': 0, 'method': 'hansen', 'fit': 91.5}], modes=[{'method': 'hansen', 'hz': 10.5, 'zeta': 0.02}],
       poles=[{'method': 'hansen', 'poles': [[0.5, 0.1]]}], stages=[{'name': 'read', 'seconds': 0.1}],
       orders=[{'method': 'hansen', 'label': 'S', 'values': [3, 1, None], 'chosen': 2}])
report('curves.json', frequency={'hz': [1, 2], 'models': [{'method': 'hansen', 'output': 0, 'input': 0, 'magnitude_db': [1, 2],
       'phase_deg': [0, -190]}], 'indirect': [{'output': 0, 'input': 0, 'hz': [1, 2], 'magnitude_db': [1, 2], 'phase_deg': [9, 8],
       'coherence': [1, 0.5]}]}, experiments=[{'name': 'r', 'clock': clock, 'signals': [{'kind': 'alpha', 'channel': channel, 'trace': trace}]}],
       verification=[{'record': 'r', 'prediction': 'simulated', 'clock': clock, 'outputs': [{'output': 0, 'measured': trace,
       'predictions': [{'method': 'hansen', 'predicted': trace, 'residual': trace}]}]}])
for name, content, log in [
    ('curves', {'curves': [{'method': 'hansen', 'note': '', 'drawn': 'line', 'x': [1, 2, 4], 'y': [1, None, 3]},
                           {'method': 'b', 'note': 'n', 'drawn': 'points', 'x': [1, 2], 'y': [1e-3, 1e3]}]}, True),
    ('boxes', {'boxes': [{'method': 'hansen', 'note': 'n', 'values': [1, 2, 3, 9, None]}]}, False),
    ('cells', {'cells': {'columns': ['a'], 'rows': ['b'], 'cells': [{'method': 'hansen', 'strength': 0.5, 'text': 't', 'detail': ''}]}}, False)]:
    figure = {'key': 'loop', 'title': 'Loop', 'caption': '', 'layout': 'beside',
              'panels': [{'title': 'p', 'x': {**axis, 'log': log}, 'y': {**axis, 'range': None}, 'content': content}]}
    report(f'figure-{name}.json', redesign={'loops': empty['methods'], 'figure': figure, 'tables': []})

q = {'a': [[0.5]], 'b': [[0.1, 0]], 'c': [[0], [0.2]], 'd': [[0, 0], [0, 0]]}
put('q_table_json', 'two.json', json.dumps({'ts': 5e-5, 'points': [{'name': 'a', 'rpm': 0, 'q': q}, {'name': 'b', 'rpm': 1000, 'q': q}],
    'between': [{'gain': 0.1, 'room': 1, 'change': 0.1, 'region': 0.1, 'q_room': 0.5, 'q_error': 0}]}))
put('campaign_toml', 'example.toml', (root / "examples/commission/campaign.toml").read_text())
# Bodies of frames of youla-link, one a line: describe, alive, arm, start, stop, begin, write, commit, switch, release, read; a body of rows.
single = lambda *values: struct.pack(f'<{len(values)}f', *values)
put('link', 'requests.bin', b'\n'.join([b'\0', b'\1', b'\2', b'\3\1\x12\4\0' + single(0.5), b'\4', b'\5',
    b'\6\0\0' + single(0.25, 0.25, 0.25), b'\7\1\2\3\4', b'\x08', b'\x09', b'\x0b\0\0']))
put('link', 'rows.bin', struct.pack('<Q', 40) + 2 * (single(1, -2, 0.5, 0.25, 0.5, -0.5, 0.02, math.nan) + struct.pack('<I', 3)))
