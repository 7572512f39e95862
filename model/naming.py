"""The names a model may use, and how the name of a time derivative is made."""

import keyword
import re
from functools import cache

from sympy import Symbol

#: The most characters of a name: files and stores of results call what they hold so.
LONGEST = 100

#: Time, wherever a model depends on it explicitly.
t = Symbol("t")

_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")


def dotted(symbol: Symbol) -> Symbol:
    """The symbol of the time derivative: q_6 -> qdot_6 -> qddot_6, theta -> thetadot; prints as a dot in LaTeX."""
    return _dotted(symbol.name)


@cache
def _dotted(name: str) -> Symbol:
    base, underscore, index = name.partition("_")
    dotted_base = base.removesuffix("dot") + "ddot" if base.endswith("dot") and base != "dot" else base + "dot"
    return Symbol(dotted_base + underscore + index)


def name_problem(name: str) -> str | None:
    """Why a name cannot be used in generated code and files, or None; codegen refuses those that its functions use."""
    if not isinstance(name, str) or not _IDENTIFIER.match(name):
        return "is not a valid identifier (a letter, then letters, digits and underscores)"
    if keyword.iskeyword(name):
        return "is a Python keyword"
    if len(name) > LONGEST:
        return f"has {len(name)} characters, more than {LONGEST}"
    return None
