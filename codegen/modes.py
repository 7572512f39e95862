"""Conditions in the state: what changes sign at each, and a mode by which a method holds the condition on a side.

x > d is written x - d + mode_1 > 0, and area(x) of a table area_held(x, mode_2). Where the mode is 0 the condition is
what it was; where it is infinite, the branch stays what it is however x moves, so that a step sees a smooth function
and can be ended where x - d vanishes. Of a table what is held is that x is in a piece of even or of odd number.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import symengine as se

from qddot.codegen.calculus import Definitions
from qddot.codegen.convert import held, is_held, looked_up
from qddot.codegen.nodes import holds_choice, holds_table, operands
from qddot.codegen.rewrite import Names, inequalities, replaced, rewrite
from qddot.model.table import knots_of

_FREE = se.Integer(0)
_STRICT = "StrictLessThan"


class Modes:
    """Gives the conditions in expressions their modes.

    fixed: what no condition switches by: parameters, t, and the sides of conditions in time. functions: mode -> its
    switching function, positive where the condition, or its opposite, holds. bounds: mode -> how far
    off the middle of its branches, these being 1 off, what slides is held, where that is not 1. written: what stands
    for a condition now -> the condition. knots: of tables by name, which arguments have kinks that are located.
    """

    def __init__(
        self, definitions: Definitions, fixed: frozenset[Any], names: Names, knots: Mapping[str, Sequence[bool]]
    ) -> None:
        self.functions: dict[Any, Any] = {}
        self.bounds: dict[Any, Any] = {}
        self.written: dict[Any, Any] = {}
        self._definitions, self._fixed, self._names = definitions, fixed, names
        self._known: dict[Any, Any] = {}
        self._knots = knots

    def __call__(self, expression: Any) -> Any:
        """The same expression, its conditions in the state and its tables of the state with their modes."""
        if holds_choice(expression):
            nodes = (node for node in inequalities(expression) if self._moves(operands(node)[1] - operands(node)[0]))
            found = {node: self._with_mode(node) for node in nodes}
            expression = replaced(expression, found) if found else expression
        return rewrite(expression, self._held, {}) if holds_table(expression) else expression

    def _moves(self, expression: Any) -> bool:
        return not self._definitions.base_symbols(expression) <= self._fixed

    def _held(self, node: Any) -> Any:
        """The value of a table held in its pieces; anything else as it is."""
        if not isinstance(node, se.FunctionSymbol) or is_held(node):
            return node
        table, _ = looked_up(node)
        located = [
            jumps and self._moves(x) for jumps, x in zip(self._knots.get(table, ()), operands(node), strict=False)
        ]
        if not any(located):
            return node
        pairs = enumerate(zip(located, operands(node), strict=True))
        return held(node, [self._of_knots(table, k, len(located), x) if jumps else _FREE for k, (jumps, x) in pairs])

    def _of_knots(self, table: str, argument: int, count: int, at: Any) -> Any:
        function = se.Function(knots_of(table, argument, count))(at)
        if function not in self._known:
            self._known[function] = self._names.fresh("mode_")
            self.functions[self._known[function]] = function
        return self._known[function]

    def _with_mode(self, node: Any) -> Any:
        """The condition below < above as above - below + mode > 0; its contrary has the same mode."""
        below, above = map(self, operands(node))
        function, contrary = se.expand(above - below), se.expand(below - above)
        compare = se.Lt if type(node).__name__ == _STRICT else se.Le
        if contrary in self._known:
            found = compare(below - above + self._known[contrary], 0)
        else:
            if function not in self._known:
                mode = self._known[function] = self._names.fresh("mode_")
                self.functions[mode] = above - below
            found = compare(0, above - below + self._known[function])
        self.written[found] = node
        return found

    def bound(self, function: Any, value: Any) -> None:
        """Let what slides where a function is zero be held up to this bound."""
        mode = self._known.get(se.expand(function), self._known.get(se.expand(-function)))
        if mode is not None and value != 1:
            self.bounds[mode] = value
