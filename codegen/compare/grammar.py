"""The grammar of expressions: Python's arithmetic and nothing else, read from its syntax tree and never evaluated.

    sum     = ["+" | "-"] product { ("+" | "-") product }
    product = power { ("*" | "/") power }
    power   = atom [ "**" power ]
    atom    = number | name | "(" sum ")" | function "(" sum { "," sum } ")"

A name is a letter, then letters, digits and underscores; functions are those of `FUNCTIONS` and the model's tables with
their derivatives, by the names that these have in the generated module; pi is the number.
"""

import ast
import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from math import inf, isinf, prod

from qddot.codegen.compare.tree import (
    Addend,
    Call,
    CompareError,
    Node,
    Number,
    Power,
    Product,
    Sum,
    Symbol,
    parts,
    symbols,
)

#: Functions and how many arguments each takes.
FUNCTIONS = {
    **dict.fromkeys(("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt"), 1),
    **dict.fromkeys(("abs", "sign"), 1),
    "atan2": 2,
}

#: The most digits of a literal power of numbers, so that a short text cannot ask for an endless number.
_MOST_BITS = 4000

Refuse = Callable[[int, str], CompareError]


def parse(text: str, places: Sequence[int], refuse: Refuse) -> Node:
    """Read an expression.

    places: for each character of the text, its offset in the file. refuse(offset, what) makes the error to raise.
    """
    if not text.strip():
        raise refuse(places[0] if places else 0, "expected an expression, found nothing")
    lead = len(text) - len(text.lstrip())
    try:
        tree = ast.parse(text.strip(), mode="eval")
        return _Reader(text, lead, places, refuse).node(tree.body)
    except SyntaxError as error:
        column = min(lead + (error.offset or 1) - 1, len(places) - 1)
        found = f"{text[column]!r}" if text[column:].strip() else "the end"
        raise refuse(places[column], f"this is no expression: {error.msg} at {found}") from None
    except (RecursionError, MemoryError):
        raise refuse(places[lead], "this expression is nested too deeply") from None


class _Reader:
    def __init__(self, text: str, lead: int, places: Sequence[int], refuse: Refuse) -> None:
        self._text, self._lead, self._places, self._refuse = text, lead, places, refuse
        self._bytes = text.strip().encode()

    def node(self, tree: ast.expr) -> Node:  # noqa: PLR0911 - one for each kind of node
        match tree:
            case ast.BinOp(op=ast.Add() | ast.Sub()):
                return self._sum(tree)
            case ast.BinOp(op=ast.Mult() | ast.Div()):
                return self._product(tree)
            case ast.BinOp(op=ast.Pow()):
                return self._power(tree)
            case ast.UnaryOp(op=ast.USub() | ast.UAdd()):
                at = self._at(tree)
                return Sum((Addend(isinstance(tree.op, ast.USub), self.node(tree.operand), at),), at)
            case ast.Name(id=name):
                return Symbol(name, self._at(tree))
            case ast.Call(func=ast.Name(id=name)):
                return self._call(name, tree)
            case ast.Constant(value=value) if type(value) in (int, float):
                return self._number(tree)
        raise self._error(tree, self._advice(tree))

    def _sum(self, tree: ast.expr) -> Sum:
        """The chain a + b - c, which Python's tree holds leaning to the left."""
        found: list[Addend] = []
        at = self._at(tree)
        while isinstance(tree, ast.BinOp) and isinstance(tree.op, ast.Add | ast.Sub):
            found.append(Addend(isinstance(tree.op, ast.Sub), self.node(tree.right), self._at(tree.right)))
            tree = tree.left
        first = self.node(tree)
        signed = isinstance(first, Sum) and len(first.addends) == 1
        front = first.addends if signed and isinstance(first, Sum) else (Addend(False, first, self._at(tree)),)
        return Sum((*front, *reversed(found)), at)

    def _product(self, tree: ast.expr) -> Node:
        """The chain a * b / c; a sign in front of the first factor is the whole product's."""
        at = self._at(tree)
        above: list[Node] = []
        below: list[Node] = []
        while isinstance(tree, ast.BinOp) and isinstance(tree.op, ast.Mult | ast.Div):
            (above if isinstance(tree.op, ast.Mult) else below).append(self.node(tree.right))
            tree = tree.left
        negative = isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.USub)
        first = tree.operand if isinstance(tree, ast.UnaryOp) and negative else tree
        product = Product((self.node(first), *reversed(above)), tuple(reversed(below)), at)
        return Sum((Addend(True, product, at),), at) if negative else product

    def _power(self, tree: ast.BinOp) -> Power:
        power = Power(self.node(tree.left), self.node(tree.right), self._at(tree))
        if _bits(power) > _MOST_BITS:
            raise self._error(tree, "this power is too large")
        return power

    def _call(self, name: str, tree: ast.Call) -> Call:
        if tree.keywords:
            raise self._error(tree, f"{name} takes its arguments one behind the other, without names")
        return Call(name, tuple(self.node(argument) for argument in tree.args), self._at(tree))

    def _number(self, tree: ast.Constant) -> Number:
        """The number as it is written, not as a double would have it."""
        if not isinstance(tree.value, float):
            return Number(Fraction(str(tree.value)), self._at(tree))
        text = self._bytes[tree.col_offset : tree.end_col_offset].decode()
        nothing = not re.search("[1-9]", text.lower().partition("e")[0])
        if isinf(tree.value) or (tree.value == 0 and not nothing):
            raise self._error(tree, f"{text} is no finite number, or too small: there are 1e-323 to 1e308, and 0")
        return Number(Fraction(0) if nothing else Fraction(text), self._at(tree))

    def _advice(self, tree: ast.expr) -> str:
        if isinstance(tree, ast.BinOp) and isinstance(tree.op, ast.BitXor):
            return "^ is no operator; write powers with **"
        if isinstance(tree, ast.Call) and not isinstance(tree.func, ast.Attribute):
            return "brackets behind brackets: between factors write *"
        return "only numbers, names, + - * / **, brackets and functions may stand here"

    def _at(self, tree: ast.expr) -> int:
        """The offset of a node in the file; Python counts bytes."""
        column = len(self._bytes[: tree.col_offset].decode(errors="ignore"))
        return self._places[self._lead + column]

    def _error(self, tree: ast.expr, what: str) -> CompareError:
        return self._refuse(self._at(tree), what)


def _bits(node: Node) -> float:
    """How long the numbers in an expression become when its powers are taken, at most."""
    match node:
        case Number(value, _):
            return float(max(value.numerator.bit_length(), value.denominator.bit_length()))
        case Power(base, exponent, _):
            return _bits(base) * _size(exponent)
        case _:
            return 1.0 + sum(map(_bits, parts(node)))


def _size(exponent: Node) -> float:
    """The magnitude of an exponent, at most; one with symbols in it is no number to be computed."""
    match exponent:
        case Number(value, _):
            return max(1.0, float(abs(value)))
        case Sum(found, _):
            return sum(_size(addend.node) for addend in found)
        case Product(above, below, _):
            return prod(map(_size, above)) if not below or all(isinstance(part, Number) for part in below) else inf
        case Power():
            return 1.0 if symbols(exponent) else inf
        case _:
            return 1.0
