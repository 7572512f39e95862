"""Motions without kinetic energy: pivots of the mass matrix that vanish, found at birth and by numbers.

The mass matrix d^2 T/d(qdot)^2 is taken by second differences in the velocities, which are exact where T is quadratic,
at points around the default parameters: in floating point where that is certain, in 100 digits where it is not. It is a
block for each group of velocities that T couples, and a velocity of every group is moved at once: what that costs does
not depend on how many groups there are.
"""

import math
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
from sympy import Expr, Symbol

from qddot.model.kinks import cases
from qddot.model.velocity_groups import Energies, Group, Quantities, energies, groups

#: A pivot this small against 1 is not certain in floating point.
_DOUBTFUL = 1e-6
#: Digits of the slow arithmetic, its step against the size of velocities, what is zero beside 1 and beside T / step^2.
_DIGITS, _STEP, _ZERO, _NOISE = 100, 1e-20, 1e-14, 1e-90
#: Sizes of coordinates, velocities, inputs and time that are tried, around zero.
_SIZES = (0.1, 1.0, 0.01, 10.0, 1e-3, 100.0)
#: Points at which a pivot must vanish, with none where it does not, to vanish by structure.
_WITNESSES = 3

Matrix = list[list[Any]]


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
    arguments, parts = [*velocities, *others], groups(kinetic_energy, velocities, quantities)
    fast = energies(parts, arguments, quantities, "math")
    slow: Energies | None = None
    found: list[Inertia] = []
    for point in _points(len(velocities), others, defaults):
        verdict = _certain(_blocks(fast, point, parts) if _is_quadratic(fast, point) else None)
        if verdict is None:
            slow = slow or energies(parts, arguments, quantities, "mpmath")
            with mpmath.workdps(_DIGITS):
                verdict = _exact(_blocks(slow, _precise(point), parts))
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


@dataclass(frozen=True)
class _Block:
    """M of a group, and the greatest value of T that went into it against the square of the step."""

    velocities: tuple[int, ...]
    matrix: Matrix
    size: Any


def _blocks(energy: Energies, point: _Point, parts: Sequence[Group]) -> list[_Block] | None:
    """M of every group, by differences; None where T has no value."""
    greatest: list[Any] = [0.0] * len(parts)

    def at(moved: Sequence[tuple[int, ...]]) -> list[Any]:
        """T of every group, with the velocities at these places of it moved, each by a step."""
        v = list(point.velocities)
        for group, places in zip(parts, moved, strict=True):
            for place in places:
                v[group.velocities[place]] += point.step
        values = energy(*v, *point.others)
        greatest[:] = map(max, greatest, map(abs, values))
        return values

    try:
        base = at([()] * len(parts))
        largest = range(max((len(group.velocities) for group in parts), default=0))
        single = [at([(k,) if k < len(group.velocities) else () for group in parts]) for k in largest]
        rounds = range(max((len(group.pairs) for group in parts), default=0))
        double = [at([group.pairs[r] if r < len(group.pairs) else () for group in parts]) for r in rounds]
        matrices = [[[point.step * 0] * len(group.velocities) for _ in group.velocities] for group in parts]
        for i, (group, matrix) in enumerate(zip(parts, matrices, strict=True)):
            for (k, j), values in zip(group.pairs, double, strict=False):
                entry = (values[i] - single[k][i] - single[j][i] + base[i]) / point.step**2
                matrix[k][j] = matrix[j][k] = entry
    except (ArithmeticError, ValueError, TypeError):
        return None
    entries = [*base, *greatest, *(value for matrix in matrices for row in matrix for value in row)]
    if not all(map(_is_real, entries)):
        return None
    found = zip(parts, matrices, greatest, strict=True)
    return [_Block(group.velocities, matrix, value / point.step**2) for group, matrix, value in found]


def _is_real(value: Any) -> bool:
    return (
        math.isfinite(value)
        if isinstance(value, float | int)
        else isinstance(value, mpmath.mpf) and mpmath.isfinite(value)
    )


def _is_quadratic(energy: Energies, point: _Point) -> bool:
    """Whether third differences vanish along a line through the velocities, so that second ones are the derivatives."""
    try:
        lines = [[(i + 2) * v + point.step * i for v in point.velocities] for i in range(4)]
        a, b, c, d = (sum(energy(*line, *point.others)) for line in lines)
    except (ArithmeticError, ValueError, TypeError):
        return False
    return bool(abs(d - 3 * c + 3 * b - a) <= 1e-12 * max(map(abs, (a, b, c, d))))


def _certain(blocks: Sequence[_Block] | None) -> Inertia | None:
    """Regular by floating point, or None where only more digits, or another point, can tell."""
    return Inertia() if blocks is not None and all(map(_is_regular, blocks)) else None


def _is_regular(block: _Block) -> bool:
    least = min((row[k] for k, row in enumerate(block.matrix)), default=1.0)
    return least > 0.0 and 1e-13 * block.size <= _DOUBTFUL * least and not _massless(block.matrix, _DOUBTFUL)


def _exact(blocks: Sequence[_Block] | None) -> Inertia | None:
    """The first motion without kinetic energy, if there is one; None where T has no value."""
    if blocks is None:
        return None
    for block in blocks:
        matrix = [[value if abs(value) > _NOISE * block.size else 0 * value for value in row] for row in block.matrix]
        if motion := _massless(matrix, _ZERO):
            largest = max(map(abs, motion))
            moving = [k for k, share in enumerate(motion) if abs(share) > _ZERO * largest]
            resisting = max(abs(sum(row[j] * motion[j] for j in moving)) for row in matrix)
            greatest = max(abs(value) for row in matrix for value in row)
            indices = tuple(block.velocities[k] for k in moving)
            return Inertia(indices, singular=resisting <= _ZERO * greatest * largest)
    return Inertia()


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
