"""Kinetic energy by groups of velocities that it couples with each other: each group has a block of the mass matrix."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate, chain, pairwise
from typing import Any

from sympy import Add, Expr, Mul, Symbol, lambdify
from sympy.printing.pycode import MpmathPrinter, PythonCodePrinter

from qddot.model.table import Value

#: Terms of T that stand in one row: Python reads no more than some 3000.
_LONGEST_SUM = 1000

#: What writes functions for these modules, terms and factors as they come: to put them in order takes most of the time.
_PRINTERS = {"math": PythonCodePrinter, "mpmath": MpmathPrinter}
_AS_LAMBDIFY = {
    **{"fully_qualified_modules": False, "inline": True, "allow_unknown_functions": True},
    "order": "none",
}

Quantities = Mapping[Symbol, Expr]
#: The part of T that each group of velocities has, of velocities and others.
Energies = Callable[..., list[Any]]


@dataclass(frozen=True)
class Group:
    """Velocities that T couples, rising, with its terms; pairs: places of two of them that meet in a term."""

    velocities: tuple[int, ...]
    terms: tuple[Expr, ...]
    pairs: tuple[tuple[int, int], ...]


def groups(kinetic_energy: Expr, velocities: Sequence[Symbol], quantities: Quantities) -> list[Group]:
    """The velocities in groups that no term of T couples with another; all other entries of M are zero."""
    reach: dict[Symbol, set[int]] = {velocity: {k} for k, velocity in enumerate(velocities)}
    for symbol, expression in quantities.items():
        reach[symbol] = _reached(expression, reach)
    terms = [(term, _reached(term, reach) or {0}) for term in Add.make_args(kinetic_energy)]
    leader = list(range(len(velocities)))  # a velocity of the same group with a lower index, itself if it is the first

    def first(k: int) -> int:
        while leader[k] != k:
            leader[k] = k = leader[leader[k]]
        return k

    for _, together in terms:
        heads = {first(k) for k in together}
        for k in heads:
            leader[k] = min(heads)
    members: dict[int, list[int]] = {}
    for k in range(len(velocities)):
        members.setdefault(first(k), []).append(k)
    place = {k: i for found in members.values() for i, k in enumerate(found)}
    held: dict[int, list[Expr]] = {head: [] for head in members}
    pairs: dict[int, set[tuple[int, int]]] = {head: set() for head in members}
    for term, together in terms:
        head = first(min(together))
        held[head].append(term)
        pairs[head].update((place[k], place[j]) for k in together for j in together if j <= k)
    return [Group(tuple(found), tuple(held[k]), tuple(sorted(pairs[k]))) for k, found in members.items()]


def _reached(expression: Expr, reach: Mapping[Symbol, set[int]]) -> set[int]:
    """The velocities that an expression depends on."""
    return set().union(*(reach.get(part, ()) for part in expression.free_symbols))


def energies(found: Sequence[Group], arguments: Sequence[Symbol], quantities: Quantities, modules: str) -> Energies:
    """T of every group as a Python function; what quantities stand for is assigned in it, in order, not substituted.

    modules: `math` or `mpmath`.
    """
    assignments = list(quantities.items())
    parts, powers = _distinct([_squared(group, arguments) for group in found])
    terms = [term for part in parts for term in part]
    tables = {
        value.func.__name__: value.func.at for each in (*terms, *quantities.values()) for value in each.atoms(Value)
    }
    rows_of = [[Add(*row) for row in _rows(part)] for part in parts]
    ends = list(accumulate(map(len, rows_of), initial=0))
    values = lambdify(
        arguments,
        list(chain.from_iterable(rows_of)),
        modules=[tables, modules],
        printer=_PRINTERS[modules]({**_AS_LAMBDIFY, "user_functions": dict(zip(tables, tables, strict=True))}),
        cse=lambda terms: (assignments, terms),
    )

    def parts_of(*point: Any) -> list[Any]:
        rows = values(*point)
        sums = [sum(rows[start:end]) for start, end in pairwise(ends)]
        return [sums[k] if place is None else sums[k] * point[place] ** 2 for k, place in powers]

    return parts_of


#: Terms, and the place of the velocity by whose square all of them are multiplied.
_Part = tuple[tuple[Expr, ...], int | None]


def _squared(group: Group, arguments: Sequence[Symbol]) -> _Part:
    """T of a group; of one velocity what its square is multiplied by, which other groups may have in common."""
    if len(group.velocities) != 1:
        return group.terms, None
    place = group.velocities[0]
    velocity, square = arguments[place], arguments[place] ** 2
    found = []
    for term in group.terms:
        factors = Mul.make_args(term)
        others = tuple(part for part in factors if part != square)
        if len(others) == len(factors) or any(velocity in part.free_symbols for part in others):
            return group.terms, None
        found.append(others)
    return tuple(_product(others) for others in found), place


@lru_cache(1000)
def _product(factors: tuple[Expr, ...]) -> Expr:
    return Mul(*factors)


def _distinct(parts: Sequence[_Part]) -> tuple[list[tuple[Expr, ...]], list[tuple[int, int | None]]]:
    """Each sum of terms once; and of every part which of them it is, with its velocity."""
    places: dict[tuple[Expr, ...], int] = {}
    found = [(places.setdefault(terms, len(places)), place) for terms, place in parts]
    return list(places), found


def _rows(terms: Sequence[Expr]) -> Iterator[Sequence[Expr]]:
    """Terms in rows that Python reads."""
    return (terms[k : k + _LONGEST_SUM] for k in range(0, len(terms), _LONGEST_SUM))
