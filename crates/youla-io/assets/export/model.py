"""@heading@

    x[k+1] = a x[k] + b u[k]
    y[k]   = c x[k] + d u[k]

Needs numpy and python-control. `from this_file import G`, or run it.
"""
import control
import numpy as np

ts = @ts@  # seconds
@matrices@
G = control.ss(a, b, c, d, ts, name="@name@", inputs=[@inputs@], outputs=[@outputs@])
@predictor@@predict@
if __name__ == "__main__":
    print(G)
    control.damp(G)
