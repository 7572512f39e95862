"""Reads formulas back from LaTeX and from the terminal's Unicode: what does a displayed equation say?"""

import math
import re
import unicodedata
from collections.abc import Mapping

FUNCTIONS = {
    **{f"\\{name}": getattr(math, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp")},
    **{r"\arctan": math.atan, r"\ln": math.log, r"\operatorname{erf}": math.erf, r"\operatorname{atan2}": math.atan2},
    r"\operatorname{sgn}": lambda x: math.copysign(1.0, x) if x else 0.0,
}
OPENING = ("(", r"\bigl(", r"\Bigl(", r"\biggl(")
CLOSING = (")", r"\bigr)", r"\Bigr)", r"\biggr)")
BARS = (r"\lvert", r"\bigl|", r"\Bigl|", r"\biggl|"), (r"\rvert", r"\bigr|", r"\Bigr|", r"\biggr|")
_SIGNS = (*OPENING, *CLOSING, *BARS[0], *BARS[1])
COMMANDS = (*FUNCTIONS, *_SIGNS, r"\frac{", r"\tfrac{", r"\sqrt{", r"\cdot", r"\pi", "^{")


class LatexReader:
    """The value of a formula; names: LaTeX of each symbol -> its value."""

    def __init__(self, names: Mapping[str, float]) -> None:
        self.names = names
        words = sorted((*names, *COMMANDS), key=len, reverse=True)
        self.pattern = re.compile("|".join(map(re.escape, words)) + r"|\d+(?:\.\d+)?|[-+/={},e]")

    def value(self, text: str) -> float:
        clean = re.sub(r"\\notag|\\\\|\\qquad|&|\{\}|\\,", " ", text)
        self.tokens = []
        at = 0
        while clean[at:].strip():
            at += len(clean[at:]) - len(clean[at:].lstrip())
            found = self.pattern.match(clean, at)
            assert found, f"cannot read {clean[at : at + 30]!r} in {text!r}"
            self.tokens.append(found[0])
            at = found.end()
        value = self.sum()
        assert not self.tokens, f"left over: {self.tokens} in {text!r}"
        return value

    def peek(self) -> str:
        return self.tokens[0] if self.tokens else ""

    def take(self, *expected: str) -> str:
        token = self.tokens.pop(0)
        assert not expected or token in expected, f"{token} instead of {expected}"
        return token

    def sum(self) -> float:
        sign = -1.0 if self.peek() == "-" else 1.0
        if self.peek() in ("-", "+"):
            self.take()
        total = sign * self.product()
        while self.peek() in ("-", "+"):
            total += self.product() if self.take() == "+" else -self.product()
        return total

    def product(self) -> float:
        value = self.power()
        while self.peek() not in ("", "+", "-", "}", ",", "=", *CLOSING, *BARS[1]):
            if self.peek() == "/":
                self.take()
                value /= self.power()
            else:
                if self.peek() == r"\cdot":
                    self.take()
                value *= self.power()
        return value

    def power(self) -> float:
        token = self.take()
        if token in FUNCTIONS:
            exponent = self.exponent()
            self.take(*OPENING)
            arguments = [self.sum()]
            while self.peek() == ",":
                self.take()
                arguments.append(self.sum())
            self.take(*CLOSING)
            return FUNCTIONS[token](*arguments) ** exponent
        base = self.atom(token)
        return base ** self.exponent()

    def exponent(self) -> float:
        if self.peek() != "^{":
            return 1.0
        self.take()
        value = self.sum()
        self.take("}")
        return value

    def atom(self, token: str) -> float:
        if token in self.names:
            return self.names[token]
        if token in OPENING or token in BARS[0]:
            value = self.sum()
            self.take(*(CLOSING if token in OPENING else BARS[1]))
            return value if token in OPENING else abs(value)
        if token in (r"\frac{", r"\tfrac{"):
            above = self.sum()
            self.take("}")
            self.take("{")
            below = self.sum()
            self.take("}")
            return above / below
        if token == r"\sqrt{":
            value = self.sum()
            self.take("}")
            return math.sqrt(value)
        return {r"\pi": math.pi, "e": math.e}.get(token) or float(token)


_ABOVE = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_KNOWN = {
    **{name: getattr(math, name) for name in ("atan2", "sinh", "cosh", "sin", "cos", "tan", "exp", "log")},
    "sgn": FUNCTIONS[r"\operatorname{sgn}"],
}


def terminal_value(text: str, names: Mapping[str, float]) -> float:
    """The value of one side of an equation as the terminal shows it."""
    values: dict[str, float] = {}
    words = sorted((*names, *_KNOWN), key=len, reverse=True)

    def bound(found: re.Match[str]) -> str:
        if found[0] in _KNOWN:
            return found[0]
        values[f"value_{len(values)}_"] = names[found[0]]
        return f"value_{len(values) - 1}_"

    code = re.sub("|".join(map(re.escape, words)), bound, text)
    code = re.sub(r"[½⅓⅔¼¾⅕⅖⅗⅘⅙⅚⅛⅜⅝⅞]", lambda found: f"({unicodedata.numeric(found[0])!r})", code)
    code = re.sub(r"[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+", lambda found: f"**({found[0].translate(_ABOVE)})", code)
    code = re.sub(r"\|([^|]*)\|", r"abs(\1)", code)
    code = code.replace("·", "*").replace("−", "-").replace("^", "**").replace("√", "sqrt").replace("π", "pi")
    constants = {"abs": abs, "sqrt": math.sqrt, "pi": math.pi, "e": math.e}
    return eval(code, {"__builtins__": {}, **constants, **_KNOWN, **values})
