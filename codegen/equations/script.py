"""What a script must say: how names, numbers and signs are written."""

from collections.abc import Sequence
from typing import Protocol

from qddot.codegen.equations.layout import Box
from qddot.codegen.equations.phrases import Value


class Script(Protocol):
    """How names, numbers and signs are written: LaTeX or plain Unicode. `inner`: in brackets, fractions are small."""

    is_flat: bool
    plus: Box
    minus: Box
    negative: Box
    times: Box
    comma: Box
    equals: Box
    slash: Box

    def between(self, left: Box, right: Box) -> Box:
        """What stands between two factors."""

    def name(self, name: str) -> Box:
        """A symbol."""

    def indexed(self, letter: str, indices: tuple[str | int, ...]) -> Box:
        """A symbol of the theory with indices."""

    def number(self, value: Value, inner: bool) -> Box:
        """A number that is not negative."""

    def constant(self, name: str) -> Box:
        """The number pi or e."""

    def fraction(self, above: Box, below: Box) -> Box:
        """A fraction with a line; not asked for where `is_flat`."""

    def raised(self, base: Box, exponent: Box) -> Box:
        """A power."""

    def root(self, inner: Box) -> Box:
        """A square root."""

    def function(self, name: str) -> Box:
        """A function's name."""

    def primes(self, count: int) -> Box:
        """What derivatives of a function of one argument have behind its name."""

    def partial(self, argument: int) -> Box:
        """What the derivative by one of several arguments, counted from 1, has before the function's name."""

    def brackets(self, height: int) -> tuple[Box, Box]:
        """Brackets around what is so high."""

    def bars(self, height: int) -> tuple[Box, Box]:
        """Absolute value."""

    def relation(self, sign: str) -> Box:
        """A comparison, `and` or `or`."""

    def summation(self, index: str, first: int, last: int) -> Box:
        """The sign of a sum over numbers."""

    def cases(self, rows: Sequence[tuple[Box, Box | None]]) -> Box:
        """Values with their conditions."""
