"""Conditions in time and parameters alone: what changes sign at each, and a channel that says on which side a run is.

A pulse between t_1 and t_2 is written as a Piecewise; the instants at which its conditions change are known before a
run begins, so that every method lands on them, and within a step every condition stays what it is.
"""

from collections.abc import Iterator
from typing import Any

import symengine as se

from qddot.codegen.calculus import Definitions
from qddot.codegen.nodes import holds_choice, operands, symbols_of
from qddot.codegen.rewrite import Names, inequalities, replaced

_HALF = se.Rational(1, 2)
#: What a switching function says of itself, see `Switches.rows`.
STRAIGHT, CURVED = se.Integer(0), se.Integer(-1)


class Switches:
    """Takes conditions in time out of expressions: t_1 < t becomes 1/2 < side_1.

    definitions: as they were declared. functions: side -> its switching function: the side is 1 where that is positive,
    else 0. conditions: side -> the condition that it stands for.
    """

    def __init__(self, definitions: Definitions, time: Any, fixed: frozenset[Any], names: Names) -> None:
        self.definitions = definitions
        self.functions: dict[Any, Any] = {}
        self.conditions: dict[Any, Any] = {}
        self._time, self._fixed, self._names = time, fixed, names
        self._sides: dict[Any, Any] = {}

    def __call__(self, expression: Any) -> Any:
        """The same expression with its conditions in time by their sides."""
        if not holds_choice(expression):
            return expression
        found = {node: self._by_side(node) for node in inequalities(expression) if self._is_timed(node)}
        return replaced(expression, found) if found else expression

    def rows(self) -> Iterator[tuple[Any, Any, Any]]:
        """Of each switching function: itself, its slope in time, and how it bends.

        That is 0 where it is a straight line, else the sum of the squares of the angular frequencies in it, or -1 where
        it has none.
        """
        for function in self.functions.values():
            slope = self._slope(function)
            if self._time not in self.definitions.base_symbols(slope):
                yield function, slope, STRAIGHT
                continue
            found = (wave for each in self._within(function) for wave in each.atoms(se.sin, se.cos, se.tan))
            waves = {operands(wave)[0] for wave in found}
            frequencies = [self._slope(angle) for angle in sorted(waves, key=str)]
            turns = se.Add(*(each**2 for each in frequencies))
            yield function, slope, turns if turns != 0 else CURVED

    def _slope(self, expression: Any) -> Any:
        return self.definitions.gradient(expression, (self._time,)).get(self._time, se.Integer(0))

    def _within(self, expression: Any) -> Iterator[Any]:
        """An expression and what defines the quantities in it."""
        yield expression
        for symbol in sorted(symbols_of(expression) & self.definitions.expressions.keys(), key=str):
            yield from self._within(self.definitions.expressions[symbol])

    def _is_timed(self, node: Any) -> bool:
        below, above = operands(node)
        found = self.definitions.base_symbols(above - below)
        return self._time in found and found <= self._fixed | {self._time}

    def _by_side(self, node: Any) -> Any:
        """The condition below < above by the side on which above - below is; where it vanishes is an instant."""
        below, above = operands(node)
        function, contrary = se.expand(above - below), se.expand(below - above)
        if contrary in self._sides:
            return se.Lt(self._sides[contrary], _HALF)
        if function not in self._sides:
            side = self._sides[function] = self._names.fresh("side_")
            self.functions[side], self.conditions[side] = function, node
        return se.Lt(_HALF, self._sides[function])
