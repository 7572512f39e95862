"""Nodes that are sums of factors times other nodes: side by side in slots, or one in all lanes."""

from collections.abc import Sequence
from typing import Any, Protocol

from qddot.runner.machine.packing import Packing
from qddot.runner.machine.recurrences import ONE, Factor, Node
from qddot.runner.machine.vector_code import VectorCode


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
    slots: dict[int, list[list[tuple[Factor, str]]]] = {}
    constant: list[list[Factor]] = []
    for node in nodes:
        own: dict[int, list[tuple[Factor, str]]] = {}
        constant.append(_constants(node))
        for factor, name in _terms(node):
            own.setdefault(emitter.packing.home[name][0], []).append((factor, name))
        for source in own.keys() | slots.keys():
            slots.setdefault(source, [[] for _ in constant[:-1]]).append(own.get(source, []))
    total = _sum_of_rows(emitter, _transposed(constant) if first else [])
    for source in sorted(slots):
        for terms in _transposed(slots[source]):
            values = emitter.gather([term[1] if term else None for term in terms])
            total = emitter.scaled(values, [term[0] if term else None for term in terms], total)
    return emitter.code.zero if total is None else total


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
