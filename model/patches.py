"""Piecewise polynomials of two arguments through the points of a grid: what `interpolation` makes of one argument, made
in both, one after the other."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from qddot.model.interpolation import DEGREES, interpolated, polynomial

#: The kinds that have a meaning in two arguments: what a monotone one is to be between the lines of a grid is open.
KINDS = ("linear", "cubic")


@dataclass(frozen=True)
class Patches:
    """Polynomials in the distances from origins in x and in y, as `Pieces` in each.

    x, y: the origins of pieces, the first before all points. patches[i][k]: by the powers of both distances, those of
    y running faster, the coefficients from the i-th origin in x and the k-th in y.
    """

    x: tuple[float, ...]
    y: tuple[float, ...]
    patches: tuple[tuple[tuple[float, ...], ...], ...]
    degree: int

    def at(self, x: Any, y: Any, by_x: int = 0, by_y: int = 0) -> Any:
        """The value at a point, or the derivative of these orders."""
        i, k = (bisect_right(line, at, lo=1) - 1 for line, at in ((self.x, x), (self.y, y)))
        coefficients, width = self.patches[i][k], self.degree + 1
        rows = (coefficients[start : start + width] for start in range(0, len(coefficients), width))
        return polynomial([polynomial(row, y - self.y[k], by_y) for row in rows], x - self.x[i], by_x)


def patched(x: Sequence[float], y: Sequence[float], z: Sequence[Sequence[float]], kind: str, outside: str) -> Patches:
    """The patches through the points of a grid, z[i][k] at x[i] and y[k]: the tensor product of both interpolations.

    Pieces depend on the values linearly, so the coefficients along y, at all x, are interpolated along x in their turn
    (de Boor, A Practical Guide to Splines, chapter XVII). Which argument comes first does not matter.
    """
    width = DEGREES[kind] + 1
    along_y = [interpolated(y, row, kind, outside).pieces for row in z]
    columns = [
        [interpolated(x, [row[k][1 + power] for row in along_y], kind, outside).pieces for power in range(width)]
        for k in range(len(along_y[0]))
    ]
    lines = [piece[0] for piece in columns[0][0]], [piece[0] for piece in along_y[0]]
    patches = tuple(
        tuple(tuple(column[by_y][i][1 + by_x] for by_x in range(width) for by_y in range(width)) for column in columns)
        for i in range(len(lines[0]))
    )
    return Patches(tuple(lines[0]), tuple(lines[1]), patches, width - 1)
