"""A sine that the compiler can put in line and into vector registers: a road of five axles needs five at every stage.

Reduction by pi/2 in three parts (Cody and Waite, Software Manual for the Elementary Functions, 1980) and the
polynomials of fdlibm (k_sin.c, k_cos.c), without a branch: within two units in the last place.
"""

import numpy as np

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN

#: The largest angle in rad: beyond it the products of the reduction are no longer exact.
FAR = 2.0**20

_TWO_OVER_PI = 0.6366197723675814
#: pi/2 as a sum; the first two have 33 bits, so that their products with a quadrant number below 2^20 are exact.
_PART_1, _PART_2, _PART_3 = 1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21
_S1, _S2, _S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S4, _S5, _S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C4, _C5, _C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


@compiled(**LEAN)
def sine(x):
    """Sine of x in rad, |x| <= FAR."""
    q = np.rint(x * _TWO_OVER_PI)
    r = ((x - q * _PART_1) - q * _PART_2) - q * _PART_3
    z = r * r
    sine = r + r * z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))))
    cosine = 1.0 - 0.5 * z + z * z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6)))))
    half = np.floor(0.5 * q)
    value = sine if q == 2.0 * half else cosine
    return value if half == 2.0 * np.floor(0.5 * half) else -value
