"""Formulas as one line of Unicode: ½·m₆·q̇₆², θ̈₁, √(x)."""

import unicodedata
from collections.abc import Sequence, Set
from fractions import Fraction

from qddot.codegen.equations.layout import Box, beside
from qddot.codegen.equations.phrases import Value
from qddot.codegen.equations.spelling import GREEK, is_counted, spelling

_DIGITS_BELOW = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
_BELOW = _DIGITS_BELOW | str.maketrans("ijkmn+-", "ᵢⱼₖₘₙ₊₋")
_DIGITS_ABOVE = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_DOTS = ("", "\u0307", "\u0308", "\u20db")
_VULGAR = {
    **{Fraction(1, 2): "½", Fraction(1, 3): "⅓", Fraction(2, 3): "⅔", Fraction(1, 4): "¼", Fraction(3, 4): "¾"},
    **{Fraction(1, 5): "⅕", Fraction(2, 5): "⅖", Fraction(3, 5): "⅗", Fraction(4, 5): "⅘", Fraction(1, 6): "⅙"},
    **{Fraction(5, 6): "⅚", Fraction(1, 8): "⅛", Fraction(3, 8): "⅜", Fraction(5, 8): "⅝", Fraction(7, 8): "⅞"},
}
_SIGNS = {"<": " < ", "<=": " ≤ ", ">": " > ", ">=": " ≥ ", "=": " = ", "!=": " ≠ ", "and": " and ", "or": " or "}


def columns(text: str) -> int:
    """How many columns a text takes: marks that combine take none, wide characters two."""
    if text.isascii():
        return len(text)
    return sum(0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)


def wrapped(text: str, width: int, indent: str = "") -> list[str]:
    """Words filled into lines of `width` columns, each behind the indent; a word that is too long is cut."""
    room = max(width - len(indent), 2)
    found = [""]
    for word in text.split():
        for piece in _pieces(word, room):
            if found[-1] and columns(found[-1]) + 1 + columns(piece) > room:
                found.append("")
            found[-1] += f" {piece}" if found[-1] else piece
    return [indent + line for line in found]


def _pieces(word: str, room: int) -> list[str]:
    found = [""]
    for character in word:
        if columns(found[-1] + character) > room:
            found.append("")
        found[-1] += character
    return found


def boxed(text: str) -> Box:
    """A box of that text, its width in columns."""
    return Box(text, columns(text))


class UnicodeScript:
    """The `Script` of the terminal; declared: names that may carry dots though they are words."""

    plus, minus, negative = boxed(" + "), boxed(" − "), boxed("−")
    is_flat = True
    times, comma, slash, equals = boxed("·"), boxed(", "), boxed("/"), boxed(" = ")

    def __init__(self, declared: Set[str] = frozenset()) -> None:
        self._declared = declared

    def between(self, left: Box, right: Box) -> Box:
        """A dot."""
        return self.times

    def name(self, name: str) -> Box:
        """q_6 as q₆, theta_1 as θ₁; words and letters below stay as they are typed: barrel_end, k_tf."""
        read = spelling(name, self._declared)
        if read.is_words:
            return boxed(name)
        letter = GREEK.get(read.letter, read.letter)
        return boxed(unicodedata.normalize("NFC", letter + _DOTS[read.dots]) + _below(read.indices))

    def indexed(self, letter: str, indices: tuple[str | int, ...]) -> Box:
        """Q of θ₁ as Q[θ₁], M of 2 and 1 as M₂₁."""
        if all(isinstance(index, int) and index < 10 for index in indices):
            return boxed(letter + "".join(map(str, indices)).translate(_DIGITS_BELOW))
        return boxed(f"{letter}[{', '.join(self.name(i).text if isinstance(i, str) else str(i) for i in indices)}]")

    def number(self, value: Value, inner: bool) -> Box:
        """½, 3/2, 2.5, 1.5e-06."""
        if isinstance(value, Fraction):
            return boxed(_VULGAR.get(value, str(value)))
        return boxed(repr(value))

    def constant(self, name: str) -> Box:
        """Π stays for the potential energy: the number is π."""
        return boxed({"pi": "π", "e": "e"}[name])

    def fraction(self, above: Box, below: Box) -> Box:
        """There is no line, so this is not asked for."""
        raise NotImplementedError

    def raised(self, base: Box, exponent: Box) -> Box:
        """x², x⁻¹, x^(3/2)."""
        if exponent.text.lstrip("−").isdigit():
            return beside(base, boxed(exponent.text.replace("−", "-").translate(_DIGITS_ABOVE)))
        return beside(base, boxed(f"^({exponent.text})"))

    def root(self, inner: Box) -> Box:
        """√(x)."""
        return beside(beside(boxed("√("), inner), boxed(")"))

    def function(self, name: str) -> Box:
        """The name itself."""
        return boxed(name)

    def primes(self, count: int) -> Box:
        """As many primes."""
        return boxed("′" * count)

    def partial(self, argument: int) -> Box:
        """∂₁."""
        return boxed(f"∂{argument}".translate(_DIGITS_BELOW))

    def brackets(self, height: int) -> tuple[Box, Box]:
        """Of one size."""
        return boxed("("), boxed(")")

    def bars(self, height: int) -> tuple[Box, Box]:
        """|x|."""
        return boxed("|"), boxed("|")

    def relation(self, sign: str) -> Box:
        """≤ and its like."""
        return boxed(_SIGNS[sign])

    def summation(self, index: str, first: int, last: int) -> Box:
        """Σ[i=2…100]."""
        return boxed(f"Σ[{index}={first}…{last}] ")

    def cases(self, rows: Sequence[tuple[Box, Box | None]]) -> Box:
        """{x if x ≥ 0; 0 otherwise}."""
        written = [
            beside(value, boxed(" otherwise") if condition is None else beside(boxed(" if "), condition))
            for value, condition in rows
        ]
        inside = written[0]
        for row in written[1:]:
            inside = beside(beside(inside, boxed("; ")), row)
        return beside(beside(boxed("{"), inside), boxed("}"))


def _below(indices: tuple[str, ...]) -> str:
    if len(indices) == 1 and (indices[0].isdigit() or is_counted(indices[0])):
        return indices[0].translate(_BELOW)
    return "".join(f"_{GREEK.get(index, index)}" for index in indices)
