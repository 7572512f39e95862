"""Exponentials of all lengths from one: a ladder of Y_l = exp(2^l M) - 1, M = [[delta A, 0], [V, J]] in row form.

Y_0 is the Taylor polynomial of degree 16 in Paterson and Stockmeyer's form, six products; delta A is small enough for a
backward error below the unit roundoff (Al-Mohy, Higham, SIAM J. Sci. Comput. 33 (2011) 488-511, section 3). Each rung
is a squaring; without the identity, 2 Y + Y Y squares a small Y without losing the digits that 1 + Y would round away
(N. J. Higham, Functions of Matrices, section 10.5). A way of k delta goes over the rungs of the binary digits of k.

The rows below n are functions of time that drive the states (Van Loan, IEEE Trans. Autom. Control 23 (1978) 395-404).
The block above J vanishes, so these rows can be exchanged when an input changes its piece: the n rows of A, by far the
most, are computed once for a run. All matrices have room for n + q_max rows, so that A stays where it is.
"""

import math

import numpy as np

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BLOCK, LEAN, floats
from qddot.runner.machine.sums import weighted_sum

#: Largest 1-norm at which the Taylor polynomial of degree 16 has a backward error of 2^-53.
THETA_16 = 0.78
ROW = 8 * BLOCK
#: The polynomial in blocks of four powers: the last is M^13/13! to M^16/16! and the constant 1/12!.
LAST_BLOCK = np.int64(13)
INVERSE_FACTORIALS = np.array([1.0 / math.factorial(k) for k in range(17)])
#: Matrices in the order in which they lie: the powers 1 to 4 of M, three partial sums of the polynomial, the rungs. As
#: np.int64, because numba compiles a function again for every literal int that it is called with.
M, M_2, M_3, M_4, U_3, U_2, U_1, Y = np.arange(8)
FIRST_ROW = np.int64(0)
#: Rungs there is room for. A way of more than 2^LEVELS delta takes the last one several times.
LEVELS = 40
#: Turns before there is Y_0.
TURNS = 6


@compiled(**LEAN)
def place(s, which):
    """Address of a matrix."""
    return s.matrices + s.matrix_bytes * which


@compiled(**LEAN)
def driving_block(s, base):
    """Address of J in the matrix at `base`."""
    return base + ROW * s.panels * (s.n + s.q_max)


@compiled(**LEAN)
def multiply_add(s, left, right, result, first, end):
    """Rows first to end - 1 of result += left right."""
    n, q, rows = s.n, s.q, s.n + s.q_max
    left_j, right_j, result_j = driving_block(s, left), driving_block(s, right), driving_block(s, result)
    for b in range(s.panels):
        source = right + ROW * rows * b
        for k in range(first, end):
            target = result + ROW * (rows * b + k)
            for p in range(s.panels):
                weights = left + ROW * (rows * p + k)
                weighted_sum(target, 1.0, weights, min(BLOCK, n - BLOCK * p), source + ROW * BLOCK * p, target)
            if k >= n:
                for p in range(-(-q // BLOCK)):
                    weights, start = left_j + ROW * (s.q_max * p + k - n), source + ROW * (n + BLOCK * p)
                    weighted_sum(target, 1.0, weights, min(BLOCK, q - BLOCK * p), start, target)
    for b in range(-(-q // BLOCK)):
        for k in range(max(first, n) - n, end - n):
            target = result_j + ROW * (s.q_max * b + k)
            for p in range(-(-q // BLOCK)):
                weights, start = left_j + ROW * (s.q_max * p + k), right_j + ROW * (s.q_max * b + BLOCK * p)
                weighted_sum(target, 1.0, weights, min(BLOCK, q - BLOCK * p), start, target)


@compiled(**LEAN)
def combine_rows(s, result, first, end, a, b, c, d, source):
    """Rows of result = a S + b M_2 + c M_3 + d M_4, S the matrix at `source`; in both of its parts."""
    size = s.n + s.q_max
    for part in range(s.panels + -(-s.q // BLOCK)):
        start, stop, shift = first, end, ROW * size * part
        if part >= s.panels:
            start, stop = max(first, s.n) - s.n, end - s.n
            shift = ROW * (size * s.panels + s.q_max * (part - s.panels))
        count = max(0, stop - start) * BLOCK
        where = shift + ROW * start
        T, S, P_2 = floats(result + where, count), floats(source + where, count), floats(place(s, M_2) + where, count)
        P_3, P_4 = floats(place(s, M_3) + where, count), floats(place(s, M_4) + where, count)
        if b == 0.0:
            for i in range(count):
                T[i] = a * S[i]
        else:
            for i in range(count):
                T[i] = a * S[i] + b * P_2[i] + c * P_3[i] + d * P_4[i]


@compiled(**LEAN)
def add_to_diagonal(s, base, first, end, value):
    """Rows of the matrix += value * identity."""
    J = driving_block(s, base)
    for k in range(first, end):
        if k < s.n:
            floats(base + ROW * ((s.n + s.q_max) * (k // BLOCK) + k), BLOCK)[k % BLOCK] += value
        else:
            j = k - s.n
            floats(J + ROW * (s.q_max * (j // BLOCK) + j), BLOCK)[j % BLOCK] += value


@compiled(**LEAN)
def polynomial_block(s, base, first_power, first, end):
    """Rows = the coefficients of M^0 to M^3 (to M^4 in the last block) that begin with 1/(first_power - 1)!."""
    inverse = INVERSE_FACTORIALS
    d = inverse[16] if first_power == LAST_BLOCK else 0.0
    a, b, c = inverse[first_power], inverse[first_power + 1], inverse[first_power + 2]
    combine_rows(s, base, first, end, a, b, c, d, place(s, M))
    if first_power > 1:
        add_to_diagonal(s, base, first, end, inverse[first_power - 1])


@compiled(**LEAN)
def climb(s, first, end, turn, turns):
    """Compute rows first to end - 1 of what the turns from `turn` to turns - 1 give; a turn is one product.

    M^2, M^3, M^4, three steps of Horner's rule, then a rung each. The rows of A must be there before those of J.
    """
    while turn < turns:
        left = right = place(s, Y + turn - TURNS)
        target = left + s.matrix_bytes
        if turn < 3:
            left, right = place(s, min(turn, M_2)), place(s, max(0, turn - 1))
            target = place(s, turn + 1)
            combine_rows(s, target, first, end, 0.0, 0.0, 0.0, 0.0, place(s, M))
        elif turn < TURNS:
            left, right, target = place(s, M_4), place(s, turn + 1), place(s, turn + 2)
            if turn == 3:
                polynomial_block(s, right, LAST_BLOCK, first, end)
            polynomial_block(s, target, LAST_BLOCK - 4 * (turn - 2), first, end)
        else:
            combine_rows(s, target, first, end, 2.0, 0.0, 0.0, 0.0, left)
        multiply_add(s, left, right, target, first, end)
        turn += 1


@compiled(**LEAN)
def reach(s, level):
    """Make sure that the rung `level` is there, with the drivers of the present segment."""
    turns = TURNS + level
    if s.turns < turns:
        climb(s, FIRST_ROW, s.n, s.turns, turns)
        s.exponentials += s.turns == 0
        s.turns = turns
    if s.driver_turns < turns:
        climb(s, s.n, s.n + s.q, s.driver_turns, turns)
        s.driver_turns = turns


@compiled(**LEAN)
def apply(s, level):
    """Move x and the drivers p by 2^level delta."""
    n, q, rows, base = s.n, s.q, s.n + s.q_max, place(s, Y + level)
    for b in range(s.panels):
        first = base + ROW * rows * b
        weighted_sum(s.x + ROW * b, 1.0, s.x, n, first, s.y + ROW * b)
        weighted_sum(s.y + ROW * b, 1.0, s.p, q, first + ROW * n, s.y + ROW * b)
    J = driving_block(s, base)
    for b in range(-(-q // BLOCK)):
        weighted_sum(s.p + ROW * b, 1.0, s.p, q, J + ROW * s.q_max * b, s.p_next + ROW * b)
    s.x, s.y = s.y, s.x
    s.p, s.p_next = s.p_next, s.p
    s.products += 1


@compiled(**LEAN)
def level_for(count):
    """The highest rung of a way of `count` delta."""
    return min(LEVELS - 1, math.frexp(count)[1] - 1) if count >= 1.0 else 0


@compiled(**LEAN)
def go_up(s, count):
    """Move by count * delta, a whole number."""
    level = level_for(count)
    reach(s, level)
    left = np.int64(count)
    while left > 0:
        for _ in range(left >> level):
            apply(s, level)
        left &= (np.int64(1) << level) - 1
        level -= 1
