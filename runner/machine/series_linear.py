"""Nodes that are sums of factors times other nodes: side by side in slots, or one in all lanes."""

from collections.abc import Sequence
from typing import Any, Protocol

from qddot.runner.machine.packing import Packing
from qddot.runner.machine.recurrences import ONE, Factor, Node
from qddot.runner.machine.vector_code import VectorCode


class _Row:
    """A term or none of each node in a vector; taken: the places of those that have one, as bits; vectors: of terms."""

    def __init__(self, length: int) -> None:
        self.terms: list[tuple[Factor, str] | None] = [None] * length
        self.taken, self.vectors = 0, set[int]()

    def put(self, place: int, term: tuple[Factor, str], vector: int) -> None:
        """Put a term of this vector at a place."""
        self.terms[place] = term
        self.taken |= 1 << place
        self.vectors.add(vector)

    def take_up(self, other: "_Row") -> None:
        """Put all terms of a row that fits between."""
        self.terms = [one or another for one, another in zip(self.terms, other.terms, strict=True)]
        self.taken |= other.taken
        self.vectors |= other.vectors


class Emitter(Protocol):
    """What is asked of the emitter of a series; see `series.Emitter`."""

    code: VectorCode
    packing: Packing

    def gather(self, names: Sequence[str | None]) -> Any:
        """The nodes' coefficients side by side."""

    def row(self, factors: Sequence[Factor | None]) -> Any:
        """A vector of factors."""

    def scaled(self, values: Any, factors: Sequence[Factor | None], total: Any = None) -> Any:
        """Factors times values, plus a total."""


def linear(emitter: Emitter, nodes: Sequence[Node], first: bool) -> Any:
    """The coefficients of these nodes of an order; constants belong to the first."""
    if emitter.code.width == 1:
        return _linear_alone(emitter, nodes[0], first)
    constant = [_constants(node) for node in nodes]
    total = _sum_of_rows(emitter, _transposed(constant) if first else [])
    for row in _rows(emitter.packing, nodes):
        values = emitter.gather([term and term[1] for term in row.terms])
        total = emitter.scaled(values, [term and term[0] for term in row.terms], total)
    return emitter.code.zero if total is None else total


def _rows(packing: Packing, nodes: Sequence[Node]) -> list[_Row]:
    """The terms of nodes in rows, one of each node at most: few rows, and of few vectors each.

    Terms as far in memory from their nodes, as neighbours in a chain are, come out of two vectors at most; rows that
    are not full take up others that fit between, those of the same vectors first. What is known last is added last.
    """
    found: dict[tuple[int, int], _Row] = {}
    for place, node in enumerate(nodes):
        met: dict[int, int] = {}
        for term in _terms(node):
            vector, item = packing.home[term[1]]
            far = vector * packing.width + item - place
            met[far] = met.get(far, 0) + 1
            found.setdefault((far, met[far]), _Row(len(nodes))).put(place, term, vector)
    rows: list[_Row] = []
    for row in sorted(found.values(), key=lambda row: row.terms.count(None)):
        fitting = [each for each in rows if not each.taken & row.taken]
        if fitting:
            max(fitting, key=lambda each: len(each.vectors & row.vectors)).take_up(row)
        else:
            rows.append(row)
    return sorted(rows, key=lambda row: max(packing.depths[term[1]] for term in row.terms if term))


def _linear_alone(emitter: Emitter, node: Node, first: bool) -> Any:
    """The sum of one node: what has one factor is added before it is multiplied, single terms from the last on.

    Rows of masses that hang on each other have their first terms alike, or their last: LLVM shares such sums.
    """
    code, total = emitter.code, _sum_of_rows(emitter, [[each] for each in _constants(node)] if first else [])
    for (factor, name), *others in sorted(_by_size(node)[::-1], key=len):
        value = emitter.gather([name])
        for other, another in others:
            combine = code.add if other == factor else code.subtract
            value = combine(value, emitter.gather([another]))
        total = emitter.scaled(value, [factor], total)
    return code.zero if total is None else total


def _by_size(node: Node) -> list[list[tuple[Factor, str]]]:
    """A node's terms by the size of their factors."""
    found: dict[Any, list[tuple[Factor, str]]] = {}
    for factor, name in _terms(node):
        found.setdefault((abs(factor.number), factor.constants), []).append((factor, name))
    return list(found.values())


def _terms(node: Node) -> list[tuple[Factor, str]]:
    return [(factor, name) for factor, name in zip(node.factors, node.arguments, strict=True) if name != ONE]


def _constants(node: Node) -> list[Factor]:
    return [factor for factor, name in zip(node.factors, node.arguments, strict=True) if name == ONE]


def _sum_of_rows(emitter: Emitter, rows: Sequence[Sequence[Factor | None]]) -> Any:
    total = None
    for row in rows:
        total = emitter.row(row) if total is None else emitter.code.add(total, emitter.row(row))
    return total


def _transposed(rows: list[list[Any]]) -> list[list[Any]]:
    """First items of rows of different lengths, second ones, ...; None where there is none."""
    return [[row[i] if i < len(row) else None for row in rows] for i in range(max(map(len, rows), default=0))]
