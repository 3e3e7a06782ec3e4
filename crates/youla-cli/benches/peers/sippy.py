"""SIPPY's N4SID: python sippy.py FOLDER HORIZON ORDER. Prints what slicot.py prints."""
import contextlib
import io
import sys
from sippy_unipi import system_identification
from common import load, measure

folder, s, n = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])


def identify(u, y):
    with contextlib.redirect_stdout(io.StringIO()):
        found = system_identification(y.T.copy(), u.T.copy(), 'N4SID', SS_fixed_order=n, SS_f=s, SS_p=s, tsample=1.)
    return found.A, found.B, found.C, found.D


measure(identify, *load(folder))
