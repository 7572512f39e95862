"""Parameter-only arithmetic out of the hot kernel, into constants computed once a run."""

from typing import Any

import symengine as se

from codegen.kernel import Assignment, Kernel
from codegen.rewrite import Names, factors, is_condition, rebuild, split_number


def hoist(kernel: Kernel, parameters: frozenset[Any], names: Names) -> tuple[tuple[Assignment, ...], Kernel]:
    """Split a kernel into constants, (symbol, expression) in parameters and earlier constants, and what is left.

    Whole parameter-only subexpressions and the parameter-only parts of products and sums become constants, divisions by
    parameters with them. The kernel that is left reads the constants.
    """
    hoisting = _Hoisting(set(parameters), names)
    kept: list[Assignment] = []
    for symbol, expression in kernel.temporaries:
        if expression.free_symbols <= hoisting.constant | hoisting.renamed.keys():
            hoisting.move(symbol, expression)
        else:
            kept.append((symbol, hoisting.stripped(expression)))
    writes = [(slot, hoisting.stripped(expression)) for slot, expression in kernel.writes]
    reads = kernel.reads | {symbol for symbol, _ in hoisting.assignments}
    return tuple(hoisting.assignments), Kernel(reads, tuple(kept), tuple(writes))


class _Hoisting:
    def __init__(self, constant: set[Any], names: Names) -> None:
        self.constant = constant
        self.names = names
        self.assignments: list[Assignment] = []
        self.known: dict[Any, Any] = {}
        self.renamed: dict[Any, Any] = {}

    def move(self, symbol: Any, expression: Any) -> None:
        """Make a temporary a constant; a name that only this kernel knows is exchanged for one known to all."""
        value = expression.subs(self.renamed)
        if symbol in self.names:
            self.assign(symbol, value)
        else:
            self.renamed[symbol] = self.named(value)

    def assign(self, symbol: Any, expression: Any) -> None:
        self.assignments.append((symbol, expression))
        self.constant.add(symbol)
        self.known.setdefault(expression, symbol)

    def named(self, expression: Any) -> Any:
        """The constant with this value; a sign stays outside."""
        number, rest = split_number(expression)
        if number == -1:
            return -self.named(rest)
        if not expression.args:
            return expression
        if expression not in self.known:
            self.assign(self.names.fresh(_wish(expression)), expression)
        return self.known[expression]

    def stripped(self, expression: Any) -> Any:
        """The expression with its parameter-only parts named."""
        if found := expression.free_symbols & self.renamed.keys():
            expression = expression.subs({symbol: self.renamed[symbol] for symbol in found})
        if not expression.args or not expression.free_symbols:
            return expression
        if expression.free_symbols <= self.constant and not is_condition(expression):
            return self.named(expression)
        if isinstance(expression, se.Mul | se.Add):
            parts = expression.args
            fixed = [part for part in parts if part.free_symbols <= self.constant]
            moving = [self.stripped(part) for part in parts if not part.free_symbols <= self.constant]
            build = se.Mul if isinstance(expression, se.Mul) else se.Add
            if any(part.free_symbols for part in fixed):
                return build(self.named(build(*fixed)), *moving)
            return build(*fixed, *moving)
        return rebuild(expression, [self.stripped(part) for part in expression.args])


def _wish(expression: Any) -> str:
    """A telling name: inverse_m_1, k_1_over_m_1, m_1_times_g; numbered where that would be long."""
    above = [part for part in factors(expression) if part.is_Symbol]
    powers = [part.args for part in factors(expression) if isinstance(part, se.Pow)]
    below = [base for base, exponent in powers if exponent == -1 and base.is_Symbol]
    simple = split_number(expression)[0] == 1 and len(above) + len(below) == len(factors(expression)) <= 3
    if isinstance(expression, se.Add) and len(expression.args) == 2:
        parts = sorted((str(part), number) for number, part in map(split_number, expression.args) if part.is_Symbol)
        if len(parts) == 2 and {abs(number) for _, number in parts} == {1} and max(n for _, n in parts) == 1:
            (first, _), (second, number) = sorted(parts, key=lambda part: part[1] == -1)
            return f"{first}_{'plus' if number == 1 else 'minus'}_{second}"
    if not simple or isinstance(expression, se.Add):
        return "constant_"
    top, bottom = "_times_".join(sorted(map(str, above))), "_and_".join(sorted(map(str, below)))
    if not top:
        return f"inverse_{bottom}"
    return f"{top}_over_{bottom}" if bottom else top
