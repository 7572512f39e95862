"""What a model's named symbols stand for: quantities, their rates by the chain rule, and the rates of states."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from sympy import Add, Expr, Symbol, SympifyError, sympify

from qddot.model.contents import accelerations
from qddot.model.kinks import cases
from qddot.model.naming import t

if TYPE_CHECKING:
    from qddot.model.system import System


class LoopError(ValueError):
    """Definitions that need each other; `loop` holds their symbols, the first one again at the end."""

    def __init__(self, loop: tuple[Symbol, ...]) -> None:
        super().__init__(" needs ".join(map(str, loop)))
        self.loop = loop

    def __reduce__(self) -> tuple[type["LoopError"], tuple[tuple[Symbol, ...]]]:
        """Made of its symbols again, not of what it says."""
        return LoopError, (self.loop,)


def definitions(system: "System") -> dict[Symbol, Expr]:
    """Symbol -> expression of every quantity as declared, each one's rate behind it, then the rates of states."""
    known: dict[Symbol, Expr] = {}
    rates: dict[Symbol, Expr] = {each.symbol: each.rate for each in system.coordinates}
    rates |= {each.symbol: each.rate for each in system.states}
    rates |= {each.symbol: each.rate for each in system.inputs}
    rates |= {each.rate: symbol for each in system.inputs for symbol in accelerations(each)}
    for quantity in system.quantities:
        expression = as_expression(quantity.expression)
        known[quantity.symbol] = expression
        derivative = time_derivative(expression, rates)
        rates[quantity.symbol] = quantity.rate or derivative
        if quantity.rate is not None:
            known[quantity.rate] = derivative
    return known | {state.rate: as_expression(state.derivative) for state in system.states}


def in_order(known: Mapping[Symbol, Expr]) -> dict[Symbol, Expr]:
    """The definitions in an order in which each uses earlier ones only, as near to the given one as can be.

    Raises LoopError where there is none.
    """
    ordered: dict[Symbol, Expr] = {}

    def place(symbol: Symbol, waiting: tuple[Symbol, ...]) -> None:
        if symbol in ordered:
            return
        if symbol in waiting:
            raise LoopError((*waiting[waiting.index(symbol) :], symbol))
        for needed in sorted(known[symbol].free_symbols & known.keys() - ordered.keys(), key=str):
            place(needed, (*waiting, symbol))
        ordered[symbol] = known[symbol]

    for symbol in known:
        place(symbol, ())
    return ordered


def time_derivative(expression: Expr, rates: Mapping[Symbol, Expr]) -> Expr:
    """d/dt of an expression in t and in what has `rates`, by the chain rule."""
    terms = Add.make_args(cases(expression))
    held = [term.free_symbols for term in terms]

    def derivative(symbol: Symbol) -> Expr:
        return Add(*(term.diff(symbol) for term, symbols in zip(terms, held, strict=True) if symbol in symbols))

    total = derivative(t)
    for symbol in sorted(set().union(*held) & rates.keys(), key=str):
        total += derivative(symbol) * rates[symbol]
    return total


def as_expression(value: object) -> Any:
    """Numbers become SymPy numbers; strings are never parsed, and stay for the check to refuse as all others do."""
    try:
        return value if isinstance(value, str | bool) else sympify(value)
    except SympifyError:
        return value


def as_sum(value: object) -> Any:
    """As `as_expression`; of a sequence of terms their sum, at a cost of their number, or the first that is no term."""
    if not isinstance(value, list | tuple | Iterator):
        return as_expression(value)
    terms = [as_expression(each) for each in value]
    for each in terms:
        if not isinstance(each, Expr):
            return each
    return Add(*terms)
