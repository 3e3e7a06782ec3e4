"""SLICOT's and SIPPY's N4SID with the true order on the records of the example accuracy_of_peers: python accuracy.py FOLDER.
Writes FOLDER/peers.csv: loop, seed, method, relative error of the bound and of the model over the frequencies that the record tells."""
import contextlib
import io
import sys
from pathlib import Path
import ctrlsys as slicot
import numpy as np
from sippy_unipi import system_identification

HORIZON, TOLD = 30, 0.3


def by_slicot(u, y, n):
    m, p = u.shape[1], y.shape[1]
    u, y = np.asfortranarray(u), np.asfortranarray(y)
    _, r, _, _, info = slicot.ib01ad('N', 'F', 'N', 'O', 'N', 'N', HORIZON, m, p, u, y, 0., 0.)
    assert info == 0, info
    a, c, b, d, *_, info = slicot.ib01bd('N', 'A', 'K', HORIZON, n, m, p, len(u), r, 0.)
    assert info == 0, info
    return a, b, c, d


def by_sippy(u, y, n):
    with contextlib.redirect_stdout(io.StringIO()):
        found = system_identification(y.T.copy(), u.T.copy(), 'N4SID', SS_fixed_order=n, SS_f=HORIZON, SS_p=HORIZON, tsample=1.)
    return found.A, found.B, found.C, found.D


def error(model, truth, bound):
    a, b, c, d = (np.asarray(x) for x in model)
    shares = 0.002 * (0.45 / 0.002) ** (np.arange(len(bound)) / (len(bound) - 1))
    found = np.array([c @ np.linalg.solve(np.exp(2j * np.pi * s) * np.eye(len(a)) - a, b) + d for s in shares])
    size = np.sqrt((abs(truth) ** 2).sum((1, 2)))
    relative = np.sqrt((abs(found - truth) ** 2).sum((1, 2))) / size
    return np.sqrt(np.mean(relative[bound < TOLD] ** 2))


folder = Path(sys.argv[1])
rows = []
for own in sorted(p for p in folder.iterdir() if p.is_dir()):
    m, p, n = map(int, (own / 'shape').read_text().split())
    u, y = (np.fromfile(own / name).reshape(k, -1).T for name, k in (('u', m), ('y', p)))
    bound = np.fromfile(own / 'bound')
    truth = np.fromfile(own / 'truth').reshape(len(bound), p, m, 2) @ [1, 1j]
    least = np.sqrt(np.mean(bound[bound < TOLD] ** 2))
    loop, seed = own.name.split('-')
    for name, identify in (('slicot', by_slicot), ('sippy', by_sippy)):
        try:
            found = error(identify(u, y, n), truth, bound)
        except (AssertionError, np.linalg.LinAlgError) as e:
            print(own.name, name, 'failed', e)
            continue
        rows.append(f'{loop},{seed},{name},{least},{found}')
(folder / 'peers.csv').write_text('\n'.join(rows) + '\n')
