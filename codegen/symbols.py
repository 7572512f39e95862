"""SymEngine's symbols, made so that those of long rows of names are told apart quickly.

SymEngine hashes a name so weakly that q_100 - q_101 has the hash of q_102 - q_103 and of hundreds more, each of which a
look-up compares: two thirds of the time of a chain of 1000 masses. Names that count to hundreds have some characters
behind them there, which nobody sees: a symbol's text is its name.
"""

import re
from functools import cache
from typing import Any

import symengine as se

#: What spreads hashes; three characters leave some alike.
_BEHIND = "____"
_COUNTS = re.compile(r"[0-9]{3}")


class _Kept(se.Symbol):  # type: ignore[misc]
    """A symbol of which SymEngine keeps the object itself, and never lets go of it.

    Of others it makes a new object each time that it says what a node is made of, to be compared with those there are:
    to look at a product takes more than twice as long.
    """


class _Spread(_Kept):
    """A symbol that SymEngine knows by a longer name."""

    def __init__(self, name: str) -> None:
        super().__init__(name + _BEHIND)

    def __str__(self) -> str:
        return str(super().__str__()).removesuffix(_BEHIND)

    __repr__ = __str__


@cache
def named(name: str) -> Any:
    """The symbol of a name: all symbols come from here, as one that SymEngine makes of the name may be another."""
    return _Spread(name) if _COUNTS.search(name) else _Kept(name)


def with_symbols(expression: Any) -> Any:
    """An expression that SymEngine made by itself, with the symbols of here."""
    found = {each: named(each.name) for each in expression.free_symbols if _COUNTS.search(each.name)}
    return expression.xreplace(found) if found else expression
