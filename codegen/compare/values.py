"""What the author's expressions are worth in the model's symbols."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import symengine as se
from sympy import Abs, sign
from sympy import Symbol as SympySymbol

from qddot.codegen.canonical import exact
from qddot.codegen.compare.tree import Addend, Call, Lookup, Node, Number, Power, Product, Sum, Symbol
from qddot.codegen.convert import convert, primed
from qddot.codegen.symbols import named

_FUNCTIONS = {name: getattr(se, name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")}
_FUNCTIONS |= {"exp": se.exp, "log": se.log, "sqrt": se.sqrt, "atan2": se.atan2}
_KINKED = {"abs": Abs, "sign": sign}


@dataclass(frozen=True)
class Reading:
    """How an expression is to be read: meanings of names, and what is changed at which place.

    meanings: name -> expression; a name without one is a symbol. renamed: place of a symbol -> the name to read there
    (None: the number 1). scaled: the node of an addend, which knows its place -> what to multiply it by.
    """

    meanings: Mapping[str, Any]
    renamed: Mapping[int, str | None] = field(default_factory=dict)
    scaled: Mapping[Node, Any] = field(default_factory=dict)

    def with_names(self, renamed: Mapping[int, str | None]) -> "Reading":
        """The same with some symbols read otherwise."""
        return Reading(self.meanings, {**self.renamed, **renamed}, self.scaled)

    def with_scale(self, node: Node, factor: Any) -> "Reading":
        """The same with an addend multiplied once more."""
        return Reading(self.meanings, self.renamed, {**self.scaled, node: self.scaled.get(node, 1) * factor})

    def symbol(self, name: str) -> Any:
        """The meaning of a name."""
        return self.meanings[name] if name in self.meanings else named(name)

    def addend(self, addend: Addend) -> Any:
        """The value of an addend, its sign and scale included."""
        value = self.value(addend.node)
        signed = -value if addend.negative else value
        return self.scaled[addend.node] * signed if addend.node in self.scaled else signed

    def value(self, node: Node) -> Any:  # noqa: PLR0911 - one for each kind of node
        """The value of an expression."""
        match node:
            case Number(value, _):
                return exact(value)
            case Symbol(name, at):
                name_here = self.renamed.get(at, name)
                return se.Integer(1) if name_here is None else self.symbol(name_here)
            case Sum(addends, _):
                return se.Add(*(self.addend(addend) for addend in addends))
            case Product(above, below, _):
                inverse = (self.value(part) ** -1 for part in below)
                return se.Mul(*(self.value(part) for part in above), *inverse)
            case Power(base, exponent, _):
                return self.value(base) ** self.value(exponent)
            case Lookup(table, orders, arguments, _):
                return se.Function(primed(table, orders))(*map(self.value, arguments))
            case Call(function, arguments, _):
                return self._call(function, [self.value(argument) for argument in arguments])

    def _call(self, function: str, arguments: list[Any]) -> Any:
        if function in _KINKED:
            return convert(_KINKED[function](*map(_real, arguments)))
        return _FUNCTIONS[function](*arguments)


def _real(expression: Any) -> Any:
    """In SymPy's form with real symbols: the modulus of exp(x) is exp(x), and has no real part of x in it."""
    found = expression._sympy_()
    return found.xreplace({symbol: SympySymbol(symbol.name, real=True) for symbol in found.free_symbols})
