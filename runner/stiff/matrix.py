"""The Jacobian of a stiff method, and a M - b df/dx of it: whole, as a band, or as the entries that elimination fills.

The pattern that the derivation found decides, by what a factorization costs; a mass matrix of one's own is dense.
"""

from typing import Any

import numpy as np

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.linear_algebra import LARGEST_OWN, factorize, solve
from qddot.runner.machine.memory import LEAN, VIEW, floats, integers, matrix
from qddot.runner.matrices import PlacedKernel
from qddot.runner.problem import Problem
from qddot.runner.stiff.band import (
    Band,
    band_of,
    factorize_shifted_band,
    multiply_band,
    place_in_band,
    solve_in_band,
)
from qddot.runner.stiff.sparse import (
    Sparse,
    factorize_shifted_sparse,
    fewest_multiplications,
    multiply_sparse,
    place_in_sparse,
    solve_sparse,
    sparse_of,
)

#: What `structure` says of a matrix.
DENSE, BAND, SPARSE = np.arange(3)
#: How many times as long as one of LAPACK's, in a whole matrix or a band, a multiplication of sparse rows takes.
SLOWER = 8


def structure_of(problem: Problem) -> Band | Sparse | None:
    """What is stored of a problem's Jacobian; None for all of it: it is small, or full, or beside a mass matrix."""
    n = len(problem.initial_state)
    if n <= LARGEST_OWN or problem.mass_matrix is not None or not isinstance(problem.jacobian, PlacedKernel):
        return None
    rows, columns = problem.jacobian.pattern.rows, problem.jacobian.pattern.columns
    band = band_of(n, rows, columns)
    cost = n**3 // 3 if band is None else band.multiplications
    if SLOWER * fewest_multiplications(n, rows, columns) >= cost:
        return band
    sparse = sparse_of(n, rows, columns)
    return sparse if sparse is not None and SLOWER * sparse.multiplications < cost else band


def fields_of(structure: Band | Sparse | None) -> dict[str, Any]:
    """What a space says of it, beside its arrays."""
    if isinstance(structure, Band):
        return {"structure": BAND, "lower": structure.lower, "upper": structure.upper}
    return {"structure": DENSE if structure is None else SPARSE, "lower": 0, "upper": 0}


@compiled(**VIEW)
def square(space, where):
    """The (n, n) matrix at an address."""
    return matrix(where, space.n, space.n)


@compiled(**LEAN)
def place(space, i, j):
    """Where the entry (i, j) of the Jacobian stands; -1 where it is none."""
    if space.structure == BAND:
        return place_in_band(space, i, j)
    return place_in_sparse(space, i, j) if space.structure == SPARSE else i * space.n + j


@compiled(**LEAN)
def entry(space, i, j):
    """The entry (i, j) of the Jacobian, 0 where it is none."""
    where = place(space, i, j)
    return floats(space.jacobian, space.cells)[where] if where >= 0 else 0.0


@compiled(**LEAN)
def set_entry(space, i, j, value):
    """Set it; where it is none nothing happens."""
    where = place(space, i, j)
    if where >= 0:
        floats(space.jacobian, space.cells)[where] = value


@compiled(**LEAN)
def factorize_combination(space, a, b):
    """Factorize a M - b df/dx; whether that failed."""
    if space.structure == BAND:
        return factorize_shifted_band(space, a, b)
    if space.structure == SPARSE:
        return factorize_shifted_sparse(space, a, b)
    n = space.n
    mass, jacobian, factors = square(space, space.mass), square(space, space.jacobian), square(space, space.factors)
    for j in range(n):
        for i in range(n):
            factors[j, i] = a * mass[i, j] - b * jacobian[i, j]  # by columns
    return factorize(space, factors, integers(space.pivots, n)) >= 0


@compiled(**LEAN)
def solve_combination(space, x):
    """Overwrite x (n,) with the solution of the system last factorized."""
    if space.structure == BAND:
        solve_in_band(space, x)
    elif space.structure == SPARSE:
        solve_sparse(space, x)
    else:
        solve(space, square(space, space.factors), integers(space.pivots, space.n), x)


@compiled(**LEAN)
def multiply(space, x, product):
    """Product (n,) = df/dx times x (n,)."""
    if space.structure == BAND:
        multiply_band(space, x, product)
    elif space.structure == SPARSE:
        multiply_sparse(space, x, product)
    else:
        multiply_whole(space, space.jacobian, x, product)


@compiled(**LEAN)
def multiply_whole(space, where, x, product):
    """Product (n,) = the (n, n) matrix at an address times x (n,)."""
    whole = square(space, where)
    for i in range(space.n):
        total = 0.0
        for j in range(space.n):
            total += whole[i, j] * x[j]
        product[i] = total
