"""The matrix exponential less the identity, Y = exp(M) - 1, for M = [[A, 0], [V, J]] in row form.

Scaling and squaring of the Taylor polynomial of degree 16 in Paterson and Stockmeyer's form, six products; the scaling
bounds the backward error by the unit roundoff (Al-Mohy, Higham, SIAM J. Sci. Comput. 33 (2011) 488-511, section 3).
Kept without the identity, 2 Y + Y Y squares a small Y without losing the digits that 1 + Y would round away, so a block
that needs more scaling than its neighbour does not spoil it (N. J. Higham, Functions of Matrices, section 10.5).
The rows below n are functions of time that drive the states (Van Loan, IEEE Trans. Autom. Control 23 (1978) 395-404).
A matrix is its n columns of all n + q rows in panels, then J (q, q) in panels; the block above J vanishes.
"""

import math

import numpy as np

from runner.compiled import compiled
from runner.memory import BLOCK, LEAN, floats, weighted_sum

#: Largest 1-norm at which the Taylor polynomial of degree 16 has a backward error of 2^-53.
THETA_16 = 0.78
ROW = 8 * BLOCK
#: The polynomial in blocks of four powers: the last is M^13/13! to M^16/16! and the constant 1/12!.
LAST_BLOCK = 13
FACTORIALS = np.array([float(math.factorial(k)) for k in range(17)])


@compiled(**LEAN)
def matrix_size(n, q):
    """Numbers in a matrix of n + q rows."""
    return BLOCK * (-(-n // BLOCK) * (n + q) + -(-q // BLOCK) * q)


@compiled(**LEAN)
def driving_block(base, n, q):
    """Address of J in the matrix at `base`."""
    return base + ROW * -(-n // BLOCK) * (n + q)


@compiled(**LEAN)
def multiply_add(n, q, left, right, result):
    """Result += left right, matrices of n + q rows."""
    rows, panels, q_panels = n + q, -(-n // BLOCK), -(-q // BLOCK)
    left_j, right_j, result_j = driving_block(left, n, q), driving_block(right, n, q), driving_block(result, n, q)
    for b in range(panels):
        source = right + ROW * rows * b
        for k in range(rows):
            target = result + ROW * (rows * b + k)
            for p in range(panels):
                weights = left + ROW * (rows * p + k)
                weighted_sum(target, 1.0, weights, min(BLOCK, n - BLOCK * p), source + ROW * BLOCK * p, target)
            if k >= n:
                for p in range(q_panels):
                    weights, first = left_j + ROW * (q * p + k - n), source + ROW * (n + BLOCK * p)
                    weighted_sum(target, 1.0, weights, min(BLOCK, q - BLOCK * p), first, target)
    for b in range(q_panels):
        for k in range(q):
            target = result_j + ROW * (q * b + k)
            for p in range(q_panels):
                weights, first = left_j + ROW * (q * p + k), right_j + ROW * (q * b + BLOCK * p)
                weighted_sum(target, 1.0, weights, min(BLOCK, q - BLOCK * p), first, target)


@compiled(**LEAN)
def norm(n, q, base):
    """The largest sum of magnitudes of a row."""
    size, rows = matrix_size(n, q), n + q
    M = floats(base, size)
    J = BLOCK * -(-n // BLOCK) * rows
    largest = 0.0
    for k in range(rows):
        total = 0.0
        for b in range(-(-n // BLOCK)):
            for i in range(BLOCK):
                total += abs(M[BLOCK * (rows * b + k) + i])
        if k >= n:
            for b in range(-(-q // BLOCK)):
                for i in range(BLOCK):
                    total += abs(M[J + BLOCK * (q * b + k - n) + i])
        largest = max(largest, total)
    return largest


@compiled(**LEAN)
def add_to_diagonal(n, q, base, value):
    """Matrix += value * identity."""
    size, rows = matrix_size(n, q), n + q
    M = floats(base, size)
    J = BLOCK * -(-n // BLOCK) * rows
    for k in range(n):
        M[BLOCK * (rows * (k // BLOCK) + k) + k % BLOCK] += value
    for k in range(q):
        M[J + BLOCK * (q * (k // BLOCK) + k) + k % BLOCK] += value


@compiled(**LEAN)
def clear(base, count):
    """Write `count` zeros."""
    target = floats(base, count)
    for i in range(count):
        target[i] = 0.0


@compiled(**LEAN)
def squarings_for(size):
    """How often exp(M / 2^s) is squared where M has this norm."""
    return max(0, math.frexp(size / THETA_16)[1]) if size > THETA_16 else 0


@compiled(**LEAN)
def combine_powers(count, result, first, M, M_2, M_3, M_4):
    """Result = M/first! + M^2/(first+1)! + M^3/(first+2)!, and M^4/16! where that ends the polynomial."""
    T, P, P_2, P_3 = floats(result, count), floats(M, count), floats(M_2, count), floats(M_3, count)
    P_4 = floats(M_4, count)
    a, b, c = 1.0 / FACTORIALS[first], 1.0 / FACTORIALS[first + 1], 1.0 / FACTORIALS[first + 2]
    d = 1.0 / FACTORIALS[16] if first == LAST_BLOCK else 0.0
    for i in range(count):
        T[i] = a * P[i] + b * P_2[i] + c * P_3[i] + d * P_4[i]


@compiled(**LEAN)
def polynomial_block(n, q, result, first, M, M_2, M_3, M_4):
    """Result = the coefficients of M^0 to M^3 in the block of the polynomial that begins with 1/(first - 1)!."""
    combine_powers(matrix_size(n, q), result, first, M, M_2, M_3, M_4)
    if first > 1:
        add_to_diagonal(n, q, result, 1.0 / FACTORIALS[first - 1])


@compiled(**LEAN)
def exponential(n, q, M, M_2, M_3, M_4, Y, room):
    """Write exp(M) - 1 and return the address where it is: Y or room. M is scaled; all are addresses of matrices.

    One product a turn: three powers, three steps of Horner's rule, the squarings. That there is one call of
    `multiply_add` only keeps compilation short.
    """
    count = matrix_size(n, q)
    squarings = squarings_for(norm(n, q, M))
    P, factor = floats(M, count), math.ldexp(1.0, -squarings)
    for i in range(count):
        P[i] *= factor
    for turn in range(6 + squarings):
        left, right, target = Y, Y, room
        if turn < 3:
            left = M if turn == 0 else M_2
            right = M if turn < 2 else M_2
            target = (M_2, M_3, M_4)[turn]
            clear(target, count)
        elif turn < 6:
            left = M_4
            if turn == 3:
                polynomial_block(n, q, Y, LAST_BLOCK, M, M_2, M_3, M_4)
            polynomial_block(n, q, room, LAST_BLOCK - 4 * (turn - 2), M, M_2, M_3, M_4)
        else:
            source, double = floats(Y, count), floats(room, count)
            for i in range(count):
                double[i] = 2.0 * source[i]
        multiply_add(n, q, left, right, target)
        if turn >= 3:
            Y, room = room, Y
    return Y
