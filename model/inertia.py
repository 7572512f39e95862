"""Motions without kinetic energy: pivots of the mass matrix that vanish, found at birth and by numbers.

The mass matrix d^2 T/d(qdot)^2 is taken by second differences in the velocities, which are exact where T is quadratic,
at points around the default parameters: in floating point where that is certain, in 100 digits where it is not.
"""

import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
from sympy import Add, Expr, Symbol, lambdify

from qddot.model.kinks import cases
from qddot.model.table import Value

#: A pivot this small against 1 is not certain in floating point.
_DOUBTFUL = 1e-6
#: Digits of the slow arithmetic, its step against the size of velocities, what is zero beside 1 and beside T / step^2.
_DIGITS, _STEP, _ZERO, _NOISE = 100, 1e-20, 1e-14, 1e-90
#: Sizes of coordinates, velocities, inputs and time that are tried, around zero.
_SIZES = (0.1, 1.0, 0.01, 10.0, 1e-3, 100.0)
#: Points at which a pivot must vanish, with none where it does not, to vanish by structure.
_WITNESSES = 3
#: Terms of T that stand in one row: Python reads no more than some 3000.
_LONGEST_SUM = 1000

Quantities = Mapping[Symbol, Expr]
Matrix = list[list[Any]]
Energy = Callable[..., Any]


@dataclass(frozen=True)
class Inertia:
    """What was found of a mass matrix.

    massless: indices of the velocities in a motion without kinetic energy; empty where none was found.
    singular: whether that motion meets no inertia at all; else T is merely not positive.
    is_known: whether T has a value at any of the points that were tried.
    """

    massless: tuple[int, ...] = ()
    singular: bool = False
    is_known: bool = True


def inertia(
    kinetic_energy: Expr, velocities: Sequence[Symbol], quantities: Quantities, defaults: Mapping[Symbol, float]
) -> Inertia:
    """Whether M = L D L^T has pivots other than zero only.

    quantities: what named symbols stand for, in order. defaults: of the parameters.
    """
    kinetic_energy = cases(kinetic_energy)
    quantities = {symbol: cases(expression) for symbol, expression in quantities.items()}
    used = set(kinetic_energy.free_symbols).union(*(expression.free_symbols for expression in quantities.values()))
    others = sorted(used - set(velocities) - quantities.keys(), key=str)
    arguments, pairs = [*velocities, *others], _coupled(kinetic_energy, velocities, quantities)
    fast = _energy_function(kinetic_energy, arguments, quantities, "math")
    slow: Energy | None = None
    found: list[Inertia] = []
    for point in _points(len(velocities), others, defaults):
        quick = _difference(fast, point, len(velocities), pairs) if _is_quadratic(fast, point) else None
        verdict = _certain(quick)
        if verdict is None:
            slow = slow or _energy_function(kinetic_energy, arguments, quantities, "mpmath")
            with mpmath.workdps(_DIGITS):
                verdict = _exact(_difference(slow, _precise(point), len(velocities), pairs))
        if verdict is not None and not verdict.massless:
            return verdict
        found += [verdict] if verdict is not None else []
        if len(found) == _WITNESSES:
            return found[0]
    return Inertia(is_known=bool(found))


@dataclass(frozen=True)
class _Point:
    velocities: tuple[Any, ...]
    others: tuple[Any, ...]
    step: Any


def _points(n: int, others: Sequence[Symbol], defaults: Mapping[Symbol, float]) -> Iterator[_Point]:
    """Points around the defaults, then with any positive parameters: seeded, so that a model is judged the same."""
    chance = random.Random(20)
    for near in (True, True, False, False):
        for size in _SIZES:
            values = tuple(
                chance.uniform(-size, size)
                if symbol not in defaults
                else defaults[symbol] * chance.uniform(0.9, 1.1)
                if near and defaults[symbol]
                else chance.uniform(0.5, 1.5)
                for symbol in others
            )
            yield _Point(tuple(chance.uniform(-0.5 * size, 0.5 * size) for _ in range(n)), values, size)


def _precise(point: _Point) -> _Point:
    """The same point with a step that leaves no error of differences that matters."""
    convert = mpmath.mpf
    return _Point(tuple(map(convert, point.velocities)), tuple(map(convert, point.others)), convert(point.step) * _STEP)


def _difference(energy: Energy, point: _Point, n: int, pairs: set[tuple[int, int]]) -> tuple[Matrix, Any] | None:
    """M, and the greatest value of T that went into it; None where T has no value."""
    greatest: Any = 0.0

    def at(*moved: int) -> Any:
        nonlocal greatest
        v = list(point.velocities)
        for k in moved:
            v[k] += point.step
        value = energy(*v, *point.others)
        greatest = max(greatest, abs(value))
        return value

    try:
        base, single = at(), [at(k) for k in range(n)]
        matrix = [[point.step * 0] * n for _ in range(n)]
        for k, j in pairs:
            matrix[k][j] = matrix[j][k] = (at(k, j) - single[k] - single[j] + base) / point.step**2
    except (ArithmeticError, ValueError, TypeError):
        return None
    entries = [base, greatest, *(value for row in matrix for value in row)]
    if not all(map(_is_real, entries)):
        return None
    return matrix, greatest / point.step**2


def _is_real(value: Any) -> bool:
    return (
        math.isfinite(value)
        if isinstance(value, float | int)
        else isinstance(value, mpmath.mpf) and mpmath.isfinite(value)
    )


def _is_quadratic(energy: Energy, point: _Point) -> bool:
    """Whether third differences vanish along a line through the velocities, so that second ones are the derivatives."""
    try:
        lines = [[(i + 2) * v + point.step * i for v in point.velocities] for i in range(4)]
        a, b, c, d = (energy(*line, *point.others) for line in lines)
    except (ArithmeticError, ValueError, TypeError):
        return False
    return bool(abs(d - 3 * c + 3 * b - a) <= 1e-12 * max(map(abs, (a, b, c, d))))


def _certain(found: tuple[Matrix, float] | None) -> Inertia | None:
    """Regular by floating point, or None where only more digits, or another point, can tell."""
    if found is None:
        return None
    matrix, size = found
    least = min((matrix[k][k] for k in range(len(matrix))), default=0.0)
    if least <= 0.0 or 1e-13 * size > _DOUBTFUL * least:
        return None
    return None if _massless(matrix, _DOUBTFUL) else Inertia()


def _exact(found: tuple[Matrix, Any] | None) -> Inertia | None:
    if found is None:
        return None
    matrix = [[value if abs(value) > _NOISE * found[1] else 0 * value for value in row] for row in found[0]]
    motion = _massless(matrix, _ZERO)
    if not motion:
        return Inertia()
    largest = max(map(abs, motion))
    indices = tuple(k for k, share in enumerate(motion) if abs(share) > _ZERO * largest)
    resisting = max(abs(sum(row[j] * motion[j] for j in indices)) for row in matrix)
    greatest = max(abs(value) for row in matrix for value in row)
    return Inertia(indices, singular=resisting <= _ZERO * greatest * largest)


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


def _energy_function(
    kinetic_energy: Expr, arguments: Sequence[Symbol], quantities: Quantities, modules: str
) -> Callable[..., Any]:
    """T as a Python function; the quantities it uses go in as assignments, in order, instead of being substituted."""
    assignments = list(quantities.items())
    held = (value.func for each in (kinetic_energy, *quantities.values()) for value in each.atoms(Value))
    tables = {function.__name__: function.at for function in held}
    terms = Add.make_args(kinetic_energy)
    parts = [Add(*terms[k : k + _LONGEST_SUM]) for k in range(0, len(terms), _LONGEST_SUM)]
    values = lambdify(arguments, parts, modules=[tables, modules], cse=lambda terms: (assignments, terms))
    return lambda *point: sum(values(*point))


def _massless(matrix: Matrix, zero: float) -> list[Any]:
    """A motion x with x M x = 0, by the first pivot of L D L^T that vanishes; empty where none does."""
    n = len(matrix)
    scales = [(abs(row[k]) or max(map(abs, row)) or 1.0) ** 0.5 for k, row in enumerate(matrix)]
    rows = [[matrix[k][j] / (scales[k] * scales[j]) for j in range(n)] for k in range(n)]
    for k in range(n):
        if abs(rows[k][k]) <= zero:
            x = _back_substitute(rows, k)
            return [share / scale for share, scale in zip(x, scales, strict=True)]
        for i in range(k + 1, n):
            if factor := rows[i][k] / rows[k][k]:
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    return []


def _back_substitute(rows: Matrix, free: int) -> list[Any]:
    x: list[Any] = [0.0] * len(rows)
    x[free] = 1.0
    for k in reversed(range(free)):
        x[k] = -sum(rows[k][j] * x[j] for j in range(k + 1, free + 1)) / rows[k][k]
    return x
