"""Signs of arguments as they are in every cell: SymEngine writes cosh(x - y) or cosh(y - x), as its hashes fall.

Differences that functions and even powers take become temporaries, of which the term that stands first in its list is
the one that is subtracted.
"""

from collections.abc import Sequence
from typing import Any

from qddot.codegen.cells import Signatures, argument_of
from qddot.codegen.kernel import Assignment, Slot
from qddot.codegen.nodes import operands
from qddot.codegen.rewrite import Names, opposite, rewrite

Write = tuple[Slot, Any]


def with_signs(
    temporaries: Sequence[Assignment], writes: Sequence[Write], signatures: Signatures, names: Names
) -> tuple[list[Assignment], list[Write]]:
    """A draft of the same value in which such signs do not depend on hashes."""
    found: list[Assignment] = []
    known: dict[Any, Any] = {}

    def change(node: Any) -> Any:
        argument = argument_of(node)
        if argument is None:
            return node
        sign = signatures.sign(argument)
        value = argument if sign == 1 else opposite(argument)
        if value not in known:
            known[value] = names.fresh("tmp_")
            found.append((known[value], value))
        others = operands(node)[1:]
        return node.func(sign * known[value], *others)

    memo: dict[Any, Any] = {}
    for symbol, expression in temporaries:
        changed = rewrite(expression, change, memo)
        found.append((symbol, changed))
    changed_writes = [(slot, rewrite(expression, change, memo)) for slot, expression in writes]
    return found, changed_writes
