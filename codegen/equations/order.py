"""The order in which terms and factors are read; SymEngine's own goes by hash.

Parameters come first, in the order of their declaration, then inputs, quantities, coordinates, velocities, brackets,
functions and accelerations, so that a term reads k_6 a_1 d_1; terms are in the order of their parameters, then of their
velocities and coordinates.
"""

from collections.abc import Sequence
from typing import Any

import symengine as se

from qddot.codegen.lagrange import Equations
from qddot.codegen.rewrite import is_number, split_number

Rank = tuple[int, int]

_FIXED, _GIVEN, _FIXED_BRACKET, _TIME, _QUANTITY, _COORDINATE, _VELOCITY, _BRACKET, _FUNCTION, _ACCELERATION = range(10)


class Order:
    """Places of the symbols of one model, to be sorted by; `others` are symbols beside those of the model."""

    def __init__(self, equations: Equations, others: Sequence[Any] = ()) -> None:
        defined = equations.definitions.expressions
        constant = {symbol for symbol, expression in defined.items() if equations.parameter_only(expression)}
        constant -= set(equations.state_rates)
        held = equations.constraints
        groups = (
            (_FIXED, (*others, *equations.parameters, *(symbol for symbol in defined if symbol in constant))),
            (_GIVEN, equations.channels),
            (_TIME, (equations.time,)),
            (_QUANTITY, tuple(symbol for symbol in defined if symbol not in constant)),
            (_COORDINATE, (*equations.coordinates, *equations.states)),
            (_VELOCITY, (*equations.velocities, *equations.state_rates)),
            (_ACCELERATION, (*equations.accelerations, *held.multipliers, *held.reactions.values())),
        )
        self._rank: dict[Any, Rank] = {symbol: (group, k) for group, found in groups for k, symbol in enumerate(found)}
        self.fixed = {symbol for symbol, (group, _) in self._rank.items() if group == _FIXED}

    @property
    def symbols(self) -> tuple[Any, ...]:
        """All symbols that have a place."""
        return tuple(self._rank)

    def stand_in(self, symbol: Any, other: Any) -> None:
        """Let a symbol have the place of another, for which it stands."""
        self._rank[symbol] = self._rank[other]
        if other in self.fixed:
            self.fixed.add(symbol)

    def symbol(self, symbol: Any) -> Rank:
        """The place of a symbol in a product."""
        return self._rank[symbol]

    def term(self, term: Any) -> Any:
        """The place of a term in a sum."""
        found = sorted(self._rank[symbol] for symbol in term.free_symbols)
        fixed = [rank for rank in found if rank[0] == _FIXED]
        velocities = [rank for rank in found if rank[0] == _VELOCITY]
        places = [rank for rank in found if rank[0] in (_QUANTITY, _COORDINATE)]
        return fixed, not (velocities or places), velocities, places, str(term)

    def factor(self, factor: Any) -> Rank:
        """The place of a factor in a product."""
        base = factor.args[0] if isinstance(factor, se.Pow) and is_number(factor.args[1]) else factor
        if base in self._rank:
            return self._rank[base]
        if not base.free_symbols:
            return (_FIXED, -1)
        return self._bracket(base) if isinstance(base, se.Add) else (_FUNCTION, 0)

    def _bracket(self, total: Any) -> Rank:
        """m_1 + m_2 stands for a parameter; a difference, such as a lever arm, comes behind what it multiplies."""
        if not total.free_symbols <= self.fixed:
            return (_BRACKET, 0)
        signs = {split_number(term)[0].is_positive for term in total.args}
        return min(self._rank[symbol] for symbol in total.free_symbols) if len(signs) == 1 else (_FIXED_BRACKET, 0)
