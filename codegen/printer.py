"""SymEngine expressions as the Python that numba compiles, in one canonical order of terms and factors."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import symengine as se

from qddot.codegen.convert import MATH_NAMES, function_name
from qddot.codegen.nodes import operands, symbols_of
from qddot.codegen.rewrite import ONE, is_number, leading_number, split_number
from qddot.model.system import ModelError

_SUM, _PRODUCT, _ATOM = 1, 2, 3
_CONSTANTS = {"Pi": "math.pi", "Exp1": "math.e", "BooleanTrue": "True", "BooleanFalse": "False"}
_JUNCTIONS = {"And": "and", "Or": "or"}
_RELATIONS = {
    **{"StrictLessThan": "<", "LessThan": "<=", "Equality": "==", "Unequality": "!="},
    **{"StrictGreaterThan": ">", "GreaterThan": ">="},
}
#: Relations that are read the other way round where a number stands on the left.
_MIRRORED = {"StrictLessThan": "StrictGreaterThan", "LessThan": "GreaterThan"}

#: Terms of a sum that stand in one row: Python reads no more than some 3000.
_LONGEST_SUM = 1000
#: Integer powers up to this one are written as products.
_LARGEST_PRODUCT = 4
#: Integer powers up to this one compile.
_LARGEST_POWER = 2**31 - 1


class Printer:
    """Prints expressions; rank orders symbols (state first, parameters last) and so the terms that hold them."""

    def __init__(self, rank: Mapping[Any, int]) -> None:
        self._rank = rank
        self._printed: dict[Any, tuple[str, int]] = {}
        self._keys: dict[Any, tuple[bool, int, str]] = {}

    def __call__(self, expression: Any) -> str:
        """The text of an expression."""
        return self._print(expression)[0]

    def _within(self, expression: Any, precedence: int) -> str:
        text, own = self._print(expression)
        return text if own >= precedence else f"({text})"

    def _print(self, expression: Any) -> tuple[str, int]:
        found = self._printed.get(expression)
        if found is None:
            found = self._printed[expression] = self._text(expression)
        return found

    def _text(self, expression: Any) -> tuple[str, int]:
        if is_number(expression):
            return self._number(expression)
        if expression.is_Symbol:
            return str(expression), _ATOM
        if isinstance(expression, se.Add):
            return self._sum(expression), _SUM
        if isinstance(expression, se.Mul):
            return self._product(expression)
        if isinstance(expression, se.Pow):
            return self._power(*operands(expression))
        return self._function(expression)

    def _number(self, number: Any) -> tuple[str, int]:
        text = repr(double(number))
        return text, _SUM if text.startswith("-") else _ATOM

    def _sum(self, expression: Any) -> str:
        signed = [(leading_number(term).is_negative, self._key(term), term) for term in operands(expression)]
        signed.sort(key=lambda item: item[:2])
        if len(signed) <= _LONGEST_SUM:
            return self._signed(signed)
        parts = (signed[k : k + _LONGEST_SUM] for k in range(0, len(signed), _LONGEST_SUM))
        return " + ".join(f"({self._signed(part)})" for part in parts)

    def _signed(self, signed: Sequence[tuple[bool, Any, Any]]) -> str:
        """Terms with their signs, in the order given."""
        text = ""
        for negative, _, term in signed:
            body = self._within(-term if negative else term, _PRODUCT)
            text += (" - " if negative else " + " if text else "") + body if text or not negative else f"-{body}"
        return text

    def _product(self, expression: Any) -> tuple[str, int]:
        number, rest = split_number(expression)
        if number.is_negative:
            return f"-{self._within(-expression, _PRODUCT)}", _SUM
        parts = operands(rest) if isinstance(rest, se.Mul) else (rest,)
        below = [part for part in parts if _is_division(part)]
        above = sorted((part for part in parts if not _is_division(part)), key=self._factor_key)
        texts = [self._within(part, _PRODUCT) for part in above]
        if number != ONE or not texts:
            texts.insert(0, self._print(number)[0])
        text = " * ".join(texts)
        for part in sorted(below, key=self._factor_key):
            text += f" / {self._within(operands(part)[0] ** -operands(part)[1], _ATOM)}"
        return text, _PRODUCT

    def _power(self, base: Any, exponent: Any) -> tuple[str, int]:
        if base == se.E:
            return f"math.exp({self._print(exponent)[0]})", _ATOM
        if is_number(exponent) and exponent.is_negative:
            return f"1.0 / {self._within(base**-exponent, _ATOM)}", _PRODUCT
        if exponent == se.Rational(1, 2):
            return f"math.sqrt({self._print(base)[0]})", _ATOM
        if isinstance(exponent, se.Rational) and 2 * exponent == 3:
            return f"{self._within(base, _ATOM)} * math.sqrt({self._print(base)[0]})", _PRODUCT
        return (
            self._whole_power(base, exponent) if isinstance(exponent, se.Integer) else self._real_power(base, exponent)
        )

    def _whole_power(self, base: Any, exponent: Any) -> tuple[str, int]:
        if int(exponent) > _LARGEST_POWER:
            raise ModelError(f"the exponent {_brief(exponent)} is too large: there are powers up to 2**31 - 1")
        within = self._within(base, _ATOM)
        few = int(exponent) <= _LARGEST_PRODUCT
        return " * ".join([within] * int(exponent)) if few else f"{within} ** {exponent}", _PRODUCT

    def _real_power(self, base: Any, exponent: Any) -> tuple[str, int]:
        return f"math.pow({self._print(base)[0]}, {self._print(exponent)[0]})", _ATOM

    def _function(self, expression: Any) -> tuple[str, int]:
        kind = type(expression).__name__
        if kind in _CONSTANTS:
            return _CONSTANTS[kind], _ATOM
        if kind == "Piecewise":
            return self._piecewise(operands(expression)), _ATOM
        texts = [self._print(part)[0] for part in operands(expression)]
        if kind in _MIRRORED and is_number(operands(expression)[0]):
            kind, texts = _MIRRORED[kind], texts[::-1]
        if isinstance(expression, se.FunctionSymbol):
            return f"{function_name(expression)}({', '.join(texts)})", _ATOM
        if kind in MATH_NAMES:
            return f"math.{MATH_NAMES[kind]}({', '.join(texts)})", _ATOM
        return self._condition(kind, texts), _ATOM

    def _condition(self, kind: str, texts: list[str]) -> str:
        if kind in _RELATIONS:
            return f"({texts[0]} {_RELATIONS[kind]} {texts[1]})"
        if kind == "Not":
            return f"(not {texts[0]})"
        return "(" + f" {_JUNCTIONS[kind]} ".join(sorted(texts)) + ")"

    def _piecewise(self, arguments: tuple[Any, ...]) -> str:
        text = "math.nan"
        for value, condition in reversed(list(zip(arguments[::2], arguments[1::2], strict=True))):
            shown = self._print(value)[0]
            certain = type(condition).__name__ == "BooleanTrue"
            text = shown if certain else f"({shown} if {self._print(condition)[0]} else {text})"
        return text if text.startswith("(") else f"({text})"

    def _key(self, expression: Any) -> tuple[list[int], str]:
        """Where a term stands in a sum: by the ranks of its symbols, then by its text."""
        return sorted(self._rank.get(symbol, -1) for symbol in symbols_of(expression)), self._print(expression)[0]

    def _factor_key(self, expression: Any) -> tuple[bool, int, str]:
        """Where a factor stands in a product: constants first, sums last."""
        found = self._keys.get(expression)
        if found is None:
            ranks = [self._rank.get(symbol, -1) for symbol in symbols_of(expression)]
            text = self._print(expression)[0]
            found = self._keys[expression] = isinstance(expression, se.Add), -max(ranks, default=len(self._rank)), text
        return found


def double(number: Any) -> float:
    """A number of an expression as a double; ModelError where none is near it."""
    try:
        value = float(number)
    except (ArithmeticError, RuntimeError, TypeError, ValueError):
        raise ModelError(f"{_brief(number)} is no real number") from None
    if not isfinite(value) or (value == 0.0 and number != 0):
        size = "no finite number" if not isfinite(value) else "too small: a double holds 1e-308 and more"
        raise ModelError(f"the number {_brief(number)} is {size}; choose other units, or let a parameter hold it")
    return value


def _brief(number: Any) -> str:
    text = str(number)
    return text if len(text) <= 40 else f"{text[:12]}... of {len(text)} characters"


def _is_division(part: Any) -> bool:
    return (
        isinstance(part, se.Pow)
        and is_number(operands(part)[1])
        and operands(part)[1].is_negative
        and operands(part)[0] != se.E
    )
