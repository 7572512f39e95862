"""Which velocities carry no kinetic energy: the null space of the mass matrix, found at birth and by numbers."""

import random
from collections.abc import Callable, Mapping, Sequence

from sympy import Add, Expr, Symbol, lambdify

#: A pivot this small against the largest one is zero; the points are random, so a chance hit is no concern.
_TOLERANCE = 1e-9

Quantities = Mapping[Symbol, Expr]


def massless(kinetic_energy: Expr, velocities: Sequence[Symbol], quantities: Quantities) -> list[int]:
    """Indices of the velocities in a motion without kinetic energy; empty where the mass matrix is regular.

    quantities: what named symbols stand for, in order. The mass matrix d^2 T/d(qdot)^2 is taken by second differences
    in the velocities (exact where T is quadratic) at two seeded random points with positive parameters: singular at
    both means singular by structure.
    """
    chance = random.Random(20)
    vectors = [_null_vector(_mass_matrix(kinetic_energy, velocities, quantities, chance)) for _ in range(2)]
    if not all(vectors):
        return []
    return [k for k, share in enumerate(vectors[0]) if abs(share) > _TOLERANCE]


def _mass_matrix(
    kinetic_energy: Expr, velocities: Sequence[Symbol], quantities: Quantities, chance: random.Random
) -> list[list[float]]:
    used = set(kinetic_energy.free_symbols).union(*(expression.free_symbols for expression in quantities.values()))
    others = sorted(used - set(velocities) - quantities.keys(), key=str)
    energy = _energy_function(kinetic_energy, [*velocities, *others], quantities)
    point = [chance.uniform(0.5, 1.5) for _ in others]
    start = [chance.uniform(-0.5, 0.5) for _ in velocities]

    def at(*moved: int) -> float:
        v = list(start)
        for k in moved:
            v[k] += 1.0
        return energy(*v, *point)

    base, single = at(), [at(k) for k in range(len(velocities))]
    matrix = [[0.0] * len(velocities) for _ in velocities]
    for k, j in _coupled(kinetic_energy, velocities, quantities):
        matrix[k][j] = matrix[j][k] = at(k, j) - single[k] - single[j] + base
    return matrix


def _coupled(kinetic_energy: Expr, velocities: Sequence[Symbol], quantities: Quantities) -> set[tuple[int, int]]:
    """Pairs of velocities that meet in one term of T; all other entries of the mass matrix are zero."""
    reach: dict[Symbol, set[int]] = {velocity: {k} for k, velocity in enumerate(velocities)}
    for symbol, expression in quantities.items():
        reach[symbol] = set().union(*(reach.get(part, ()) for part in expression.free_symbols))
    pairs: set[tuple[int, int]] = set()
    for term in Add.make_args(kinetic_energy):
        together = set().union(*(reach.get(part, ()) for part in term.free_symbols))
        pairs.update((k, j) for k in together for j in together if j <= k)
    return pairs


def _energy_function(kinetic_energy: Expr, arguments: Sequence[Symbol], quantities: Quantities) -> Callable[..., float]:
    """T as a Python function; the quantities it uses go in as assignments, in order, instead of being substituted."""
    assignments = list(quantities.items())
    values = lambdify(arguments, [kinetic_energy], modules="math", cse=lambda terms: (assignments, terms))
    return lambda *point: values(*point)[0]


def _null_vector(matrix: list[list[float]]) -> list[float]:
    """A vector x with M x = 0, by elimination with full symmetric pivoting; empty where M is regular."""
    n = len(matrix)
    rows = [list(row) for row in matrix]
    scale = max(abs(value) for row in rows for value in row) or 1.0
    left = set(range(n))
    done: list[int] = []
    while left:
        k = max(sorted(left), key=lambda i: abs(rows[i][i]))
        if abs(rows[k][k]) <= _TOLERANCE * scale:
            return _back_substitute(rows, done, k)
        left.remove(k)
        done.append(k)
        for i in left:
            if factor := rows[i][k] / rows[k][k]:
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    return []


def _back_substitute(rows: list[list[float]], done: list[int], free: int) -> list[float]:
    x = [0.0] * len(rows)
    x[free] = 1.0
    for k in reversed(done):
        x[k] = -sum(rows[k][j] * x[j] for j in range(len(x)) if j != k) / rows[k][k]
    return x
