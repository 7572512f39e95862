"""Functions that several rows call with the same arguments, as neighbouring cells do: computed once, and kept.

The exponential in the force of a spring acts on both of its ends. Where cells are loops, its values are kept in an
array of the kernel's own, which a loop fills before the rows are computed.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from qddot.codegen.cells import Place, Signatures, in_order, runs
from qddot.codegen.kernel import Assignment, Slot
from qddot.codegen.nodes import operands
from qddot.codegen.rewrite import Names, is_call, replaced

Write = tuple[Slot, Any]


@dataclass
class Kept:
    """items: symbol -> its item of an array. nodes: call -> the symbol of its value."""

    items: dict[Any, Slot] = field(default_factory=dict)
    nodes: dict[Any, Any] = field(default_factory=dict)

    @property
    def places(self) -> dict[Any, Place]:
        """Where the symbols stand."""
        return {symbol: (slot.argument, slot.index[0]) for symbol, slot in self.items.items()}

    def written(
        self, temporaries: Sequence[Assignment], writes: Sequence[Write]
    ) -> tuple[list[Assignment], list[Write]]:
        """A draft with the values computed first, and read where they are used."""
        memo: dict[Any, Any] = {}
        found = [(self.items[symbol], node) for node, symbol in self.nodes.items()]
        return (
            [(symbol, replaced(expression, self.nodes, memo)) for symbol, expression in temporaries],
            [*found, *((slot, replaced(expression, self.nodes, memo)) for slot, expression in writes)],
        )


def kept(temporaries: Sequence[Assignment], writes: Sequence[Write], signatures: Signatures, names: Names) -> Kept:
    """What is worth being kept of a draft: calls that are alike from cell to cell, most of them in several rows."""
    definitions = dict(temporaries)
    known: dict[Any, frozenset[Any]] = {}

    def calls(node: Any) -> frozenset[Any]:
        if node not in known:
            parts = (definitions[node],) if node in definitions else operands(node)
            inside = frozenset[Any]().union(*map(calls, parts))
            known[node] = inside | {node} if is_call(node) else inside
        return known[node]

    rows = Counter(call for _, expression in writes for call in calls(expression))
    found = Kept()
    alike = in_order(rows, signatures)
    for run in runs(list(map(signatures, alike)), 1):
        nodes = alike[run.first : run.behind]
        if any(run.steps[0]) and 2 * sum(rows[node] > 1 for node in nodes) >= len(nodes):
            array = _array(names, len(nodes))
            for k, node in enumerate(nodes):
                found.nodes[node] = symbol = names.fresh(f"{array}_{k + 1}")
                found.items[symbol] = Slot(array, (k,))
    return found


def _array(names: Names, count: int) -> str:
    """A name for an array that is free with each number behind it."""
    while True:
        array = str(names.fresh("shared"))
        if not any(f"{array}_{k + 1}" in names for k in range(count)):
            return array
