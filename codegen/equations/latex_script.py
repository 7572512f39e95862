"""Formulas in LaTeX, with an estimate of how wide each comes out in Computer Modern, in em."""

from collections.abc import Sequence, Set
from fractions import Fraction

from qddot.codegen.equations.latex_text import greek
from qddot.codegen.equations.layout import Box, beside
from qddot.codegen.equations.phrases import Value
from qddot.codegen.equations.spelling import GREEK, Spelling, is_counted, spelling

# Widths of cmmi10 in hundredths of an em, italic correction included, from its metric file (tftopl cmmi10.tfm).
# Every width is an upper bound: a formula that is too wide by the estimate breaks early, never late.
_ITALIC = {
    **dict(zip("ABCDEFGHIJKLM", (75, 81, 78, 86, 80, 78, 79, 91, 52, 65, 92, 68, 108), strict=True)),
    **dict(zip("NOPQRSTUVWXYZ", (91, 79, 78, 79, 77, 67, 72, 79, 80, 108, 91, 80, 75), strict=True)),
    **dict(zip("abcdefghijklm", (53, 43, 43, 52, 47, 60, 52, 58, 34, 47, 55, 32, 88), strict=True)),
    **dict(zip("nopqrstuvwxyz", (60, 48, 50, 49, 48, 47, 36, 57, 52, 75, 57, 53, 51), strict=True)),
}
_GREEK_WIDTHS = dict(
    zip(
        GREEK,
        (
            *(64, 62, 58, 48, 41, 51, 54, 50, 35, 58, 58, 60, 55, 49, 61, 52, 61, 55, 58, 60, 63, 69, 66),
            *(63, 83, 78, 69, 67, 75, 72, 78, 72, 78, 72),
        ),
        strict=True,
    )
)
_SMALL = 0.8  # seven-point letters are wider for their size
_SIGNS = {"<": "<", "<=": r"\leq", ">": ">", ">=": r"\geq", "=": "=", "!=": r"\neq"}
_FUNCTIONS = {"asin": r"\arcsin", "acos": r"\arccos", "atan": r"\arctan", "log": r"\ln"}
_PLAIN_FUNCTIONS = {"sin", "cos", "tan", "sinh", "cosh", "tanh", "exp"}
_SIZES = ((r"(", r")"), (r"\bigl(", r"\bigr)"), (r"\Bigl(", r"\Bigr)"), (r"\biggl(", r"\biggr)"))
_BARS = ((r"\lvert ", r" \rvert"), (r"\bigl| ", r" \bigr|"), (r"\Bigl| ", r" \Bigr|"), (r"\biggl| ", r" \biggr|"))


class LatexScript:
    """The `Script` of LaTeX with amsmath; declared: names that may carry dots though they are words."""

    plus, minus, negative = Box(" + ", 1.23), Box(" - ", 1.23), Box("-", 0.78)
    is_flat = False
    times, comma = Box(r"\cdot ", 0.73), Box(", ", 0.45)
    slash, equals = Box(" / ", 0.5), Box(" = ", 1.34)

    def __init__(self, declared: Set[str] = frozenset()) -> None:
        self._declared = declared
        self._names: dict[str, Box] = {}

    def between(self, left: Box, right: Box) -> Box:
        """Nothing but a thin space around words."""
        return Box(r" \, ", 0.17) if _is_words(left) or _is_words(right) else Box(" ", 0.0)

    def name(self, name: str) -> Box:
        r"""qdot_6 as \dot{q}_{6}; words upright: \text{barrel end}."""
        if name not in self._names:
            read = spelling(name, self._declared)
            letter = _letter(read)
            indices = [_index(index) for index in read.indices]
            below = "_{" + ",".join(text for text, _ in indices) + "}" if indices else ""
            width = letter.width + sum(width + 0.08 for _, width in indices)
            self._names[name] = Box(f"{letter.text}{below}", width)
        return self._names[name]

    def indexed(self, letter: str, indices: tuple[str | int, ...]) -> Box:
        """Q of q_6, M of 2 and 1."""
        boxes = [self.name(index) if isinstance(index, str) else _digits(str(index)) for index in indices]
        comma = "" if all(isinstance(index, int) and index < 10 for index in indices) else ","
        return Box(
            f"{letter}_{{{comma.join(box.text for box in boxes)}}}",
            1.0 + sum(_SMALL * box.width + 0.1 for box in boxes),
        )

    def number(self, value: Value, inner: bool) -> Box:
        r"""12, \frac{1}{2}, 2.5, 1.5 \cdot 10^{-6}."""
        if not isinstance(value, Fraction):
            return decimal(value)
        if value.denominator == 1:
            return _digits(str(value))
        above, below = map(str, value.as_integer_ratio())
        if inner:
            return Box(rf"\tfrac{{{above}}}{{{below}}}", 0.45 * max(len(above), len(below)) + 0.25, 1)
        return Box(rf"\frac{{{above}}}{{{below}}}", 0.51 * max(len(above), len(below)) + 0.25, 2)

    def constant(self, name: str) -> Box:
        """Upright e would be a unit's; both stay italic, as the author's symbols are."""
        return Box({"pi": r"\pi", "e": "e"}[name], 0.62)

    def fraction(self, above: Box, below: Box) -> Box:
        """With a line."""
        return Box(rf"\frac{{{above.text}}}{{{below.text}}}", max(above.width, below.width) + 0.25, 3)

    def raised(self, base: Box, exponent: Box) -> Box:
        """A power."""
        small = Box(f"^{{{exponent.text}}}", _SMALL * exponent.width + 0.06)
        return beside(base, small)

    def root(self, inner: Box) -> Box:
        """A square root."""
        return Box(rf"\sqrt{{{inner.text}}}", inner.width + 1.0, inner.height + 1)

    def function(self, name: str) -> Box:
        """Upright."""
        text = _FUNCTIONS.get(name, f"\\{name}" if name in _PLAIN_FUNCTIONS else rf"\operatorname{{{name}}}")
        return Box(text, 0.48 * len(name) + 0.18)

    def primes(self, count: int) -> Box:
        """As many primes."""
        return Box("'" * count, 0.25 * count)

    def partial(self, argument: int) -> Box:
        """The sign of partial derivatives with the number of the argument."""
        return Box(rf"\partial_{{{argument}}}", 1.0)

    def brackets(self, height: int) -> tuple[Box, Box]:
        """Of the size that fits; a line may break between them, so the size is given."""
        left, right = _SIZES[min(height, len(_SIZES) - 1)]
        size = min(height, len(_SIZES) - 1)
        return Box(left, 0.4 + 0.1 * size, height + 1), Box(right, 0.4 + 0.1 * size, height + 1)

    def bars(self, height: int) -> tuple[Box, Box]:
        """Absolute value."""
        left, right = _BARS[min(height, len(_BARS) - 1)]
        return Box(left, 0.3, height + 1), Box(right, 0.3, height + 1)

    def relation(self, sign: str) -> Box:
        """A comparison, or a word between conditions."""
        if sign in _SIGNS:
            return Box(f" {_SIGNS[sign]} ", 1.35)
        return Box(rf" \text{{ {sign} }} ", 2.3)

    def summation(self, index: str, first: int, last: int) -> Box:
        """A sigma with the first number below and the last one above."""
        return Box(rf"\sum_{{{index}={first}}}^{{{last}}} ", 1.6 + 0.2 * len(str(first)), 3)

    def cases(self, rows: Sequence[tuple[Box, Box | None]]) -> Box:
        """Values and conditions behind one brace."""
        conditions = [r"\text{otherwise}" if c is None else rf"\text{{if }} {c.text}" for _, c in rows]
        written = [f"{value.text} & {when}" for (value, _), when in zip(rows, conditions, strict=True)]
        width = max(value.width for value, _ in rows) + max(4.5 if c is None else c.width + 1.0 for _, c in rows)
        return Box(r"\begin{cases} " + r" \\ ".join(written) + r" \end{cases}", width + 2.0, 3)


def decimal(value: float) -> Box:
    """A decimal number as short as it reads back the same: 0.68, 21900, 2.15 times a power of ten."""
    if value and not 1e-3 <= abs(value) < 1e6:
        mantissa, _, exponent = f"{value!r}".partition("e")
        if not exponent:
            mantissa, _, exponent = f"{value:.16e}".partition("e")
            digits = repr(value).replace("-", "").replace(".", "").strip("0")
            mantissa = ("-" if value < 0 else "") + digits[0] + (f".{digits[1:]}" if len(digits) > 1 else "")
        mantissa = mantissa.removesuffix(".0")
        head = "" if mantissa == "1" else rf"{mantissa} \cdot "
        return Box(f"{head}10^{{{int(exponent)}}}", 0.51 * len(mantissa) + 3.2)
    return _digits(repr(float(value)).removesuffix(".0"))


def _digits(text: str) -> Box:
    return Box(text, 0.51 * len(text))


def _is_words(box: Box) -> bool:
    return box.text.startswith((r"\text{", r"\dot{\text{", r"\ddot{\text{"))


def _letter(read: Spelling) -> Box:
    text, width = _upright(read.letter) if read.is_words else _symbol(read.letter)
    if read.dots:
        text = rf"\{'d' * read.dots}ot{{{text}}}"
    return Box(text, width)


def _symbol(letter: str) -> tuple[str, float]:
    if letter in GREEK:
        return greek(letter), _GREEK_WIDTHS[letter] / 100
    return letter, _ITALIC[letter] / 100


def _index(index: str) -> tuple[str, float]:
    if index.isdigit():
        return index, 0.42 * len(index)
    if is_counted(index):
        return index, 0.5 * len(index)
    text, width = _symbol(index) if len(index) == 1 or index in GREEK else _upright(index)
    return text, _SMALL * width


def _upright(words: str) -> tuple[str, float]:
    return rf"\text{{{words}}}", 0.56 * len(words)
