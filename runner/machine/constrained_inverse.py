"""What the series of motion under constraints takes of M_0 a + G_0' l = f, G_0 a = gamma: the inverse, by columns.

A constraint that depends on others has no row and no column in it: its multiplier is 0 at every order.
"""

from functools import cache

import numpy as np
from numba import types

from qddot.runner.machine.constrained_factors import factorize, solve_four
from qddot.runner.machine.constrained_work import compiled_work_size, side_row, work_size
from qddot.runner.machine.fours import FOUR
from qddot.runner.machine.memory import floats, matrix
from qddot.runner.machine.pointers import make_known

#: How code of a series calls `inverse`.
INVERSE = "qddot.runner.machine.constrained_inverse.inverse"
SIGNATURE = types.void(*6 * [types.int64])


@cache
def let_series_invert() -> None:
    """Make `inverse` known, before code that calls it is loaded."""
    make_known(INVERSE, inverse, SIGNATURE)


def room_for(n: int, m: int) -> int:
    """Doubles that `inverse` works in, for n coordinates and m constraints."""
    return n * n + m * n + m + work_size(n, m)


def inverse(columns, length, n, m, coordinates, room):
    """Overwrite the columns at an address, `length` doubles each, with those of the inverse (n + m, n + m).

    They hold, for each coordinate, its column of M and below it that of G, then the residuals (m,) of positions;
    coordinates: the address of q (n,). Without a number where a motion that the constraints allow has no inertia.
    """
    M, G = matrix(room, n, n), matrix(room + 8 * n * n, m, n)
    for i in range(n):
        column = floats(columns + 8 * length * i, n + m)
        for k in range(n):
            M[k, i] = column[k]
        for j in range(m):
            G[j, i] = column[n + j]
    residuals, given = floats(room + 8 * n * (n + m), m), floats(columns + 8 * length * n, m)
    for j in range(m):
        residuals[j] = given[j]
    work = floats(room + 8 * (n * (n + m) + m), compiled_work_size(n, m))
    has_inertia = factorize(M, G, m, residuals, floats(coordinates, n), work)
    one = 1.0 if has_inertia else np.nan
    for first in range(0, n + m, FOUR):
        count = min(FOUR, n + m - first)
        for i in range(n + m):
            right = floats(side_row(work, n, m, i), FOUR)
            for k in range(FOUR):
                right[k] = one if i == first + k else 0.0
        solve_four(n, m, work)
        for k in range(count):
            column = floats(columns + 8 * length * (first + k), length)
            for i in range(length):
                column[i] = floats(side_row(work, n, m, i), FOUR)[k] if i < n + m else 0.0
