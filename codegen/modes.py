"""Conditions in the state: what changes sign at each, and a mode by which a method holds the condition on a side.

x > d is written x - d + mode_1 > 0. Where the mode is 0 the condition is what it was; where it is infinite, the branch
stays what it is however x moves, so that a step sees a smooth function and can be ended where x - d vanishes.
"""

from typing import Any

import symengine as se

from qddot.codegen.calculus import Definitions
from qddot.codegen.rewrite import Names, inequalities, replaced

_STRICT = "StrictLessThan"


class Modes:
    """Gives the conditions in expressions their modes.

    fixed: what no condition switches by: parameters, t, and the sides of conditions in time. functions: mode -> its
    switching function, positive where the condition, or its opposite, holds. bounds: mode -> how far
    off the middle of its branches, these being 1 off, what slides is held, where that is not 1. written: what stands
    for a condition now -> the condition.
    """

    def __init__(self, definitions: Definitions, fixed: frozenset[Any], names: Names) -> None:
        self.functions: dict[Any, Any] = {}
        self.bounds: dict[Any, Any] = {}
        self.written: dict[Any, Any] = {}
        self._definitions, self._fixed, self._names = definitions, fixed, names
        self._known: dict[Any, Any] = {}

    def __call__(self, expression: Any) -> Any:
        """The same expression, its conditions in the state with their modes."""
        if not expression.atoms(se.Piecewise):
            return expression
        found = {node: self._with_mode(node) for node in inequalities(expression) if self._moves(node)}
        return replaced(expression, found) if found else expression

    def _moves(self, node: Any) -> bool:
        below, above = node.args
        return not self._definitions.base_symbols(above - below) <= self._fixed

    def _with_mode(self, node: Any) -> Any:
        """The condition below < above as above - below + mode > 0; its contrary has the same mode."""
        below, above = map(self, node.args)
        function, contrary = se.expand(above - below), se.expand(below - above)
        compare = se.Lt if type(node).__name__ == _STRICT else se.Le
        if contrary in self._known:
            held = compare(below - above + self._known[contrary], 0)
        else:
            if function not in self._known:
                mode = self._known[function] = self._names.fresh("mode_")
                self.functions[mode] = above - below
            held = compare(0, above - below + self._known[function])
        self.written[held] = node
        return held

    def bound(self, function: Any, value: Any) -> None:
        """Let what slides where a function is zero be held up to this bound."""
        mode = self._known.get(se.expand(function), self._known.get(se.expand(-function)))
        if mode is not None and value != 1:
            self.bounds[mode] = value
