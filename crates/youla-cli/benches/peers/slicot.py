"""SLICOT's fast path by the direct calls of ctrlsys: python slicot.py FOLDER HORIZON ORDER ALGORITHM (C, F or Q).
Prints seconds per call, smallest fit on the verification record in percent, and peak memory beside the data in MB."""
import sys
import numpy as np
import ctrlsys as slicot
from common import load, measure

folder, s, n, algorithm = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]


def identify(u, y):
    m, p = u.shape[1], y.shape[1]
    order, r, _, _, info = slicot.ib01ad('N', algorithm, 'N', 'O', 'N', 'N', s, m, p, u, y, 0., 0.)
    assert info == 0, info
    a, c, b, d, *_, info = slicot.ib01bd('N', 'A', 'K', s, n, m, p, len(u), r, 0.)
    assert info == 0, info
    a, b, c, d = map(np.asfortranarray, (a, b, c, d))
    slicot.ib01cd('X', 'U', 'D', n, m, p, a, b, c, d, u, y, 0.)
    return a, b, c, d


measure(identify, *[np.asfortranarray(x) for x in load(folder)])
