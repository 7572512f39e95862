"""What is to be said about a comparison: words and formulas, for any script to write."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from qddot.codegen.compare.difference import Comparison
from qddot.codegen.compare.edits import Change
from qddot.codegen.compare.phrasing import formula, term
from qddot.codegen.compare.sheet import Sheet
from qddot.codegen.compare.tree import Addend, addends
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.order import Order
from qddot.codegen.equations.phrases import Formula, Name, Sum
from qddot.codegen.equations.phrases import term as alone
from qddot.codegen.equations.reading import Reader
from qddot.codegen.lagrange import Equations
from qddot.codegen.symbols import named

#: Words, and formulas between them.
Message = tuple[str | Sum, ...]


@dataclass(frozen=True)
class Remark:
    """One change in words: kind, line and column in the file (None for what is missing), and the message."""

    kind: str
    line: int | None
    column: int | None
    message: Message


@dataclass(frozen=True)
class Account:
    """One equation in words. factor: where the printed one is a multiple of the derived one."""

    label: str
    coordinate: str
    meaning: str
    equal: bool
    factor: Sum | None
    printed: Formula
    derived: Formula
    remarks: tuple[Remark, ...]


def accounts(sheet: Sheet, equations: Equations, comparisons: Sequence[Comparison]) -> tuple[Account, ...]:
    """What is to be said about each equation, in the order of the file."""
    derived = describe(equations, sheet.path.name).equations
    words = _Words(sheet, equations)
    return tuple(
        Account(
            label=each.written.label,
            coordinate=each.written.coordinate,
            meaning=derived[each.coordinate][0].meaning,
            equal=each.equal,
            factor=None if each.factor == 1 else words.sum(each.factor),
            printed=formula(each.written.left, each.written.right),
            derived=derived[each.coordinate][1],
            remarks=tuple(words.remark(change, each) for change in each.changes),
        )
        for each in comparisons
    )


class _Words:
    def __init__(self, sheet: Sheet, equations: Equations) -> None:
        self._sheet = sheet
        self._own = {named(f"{name} of the file"): named(name) for name in sheet.own}
        known = {str(symbol) for symbol in Order(equations).symbols}
        others = [named(name) for name in sorted(sheet.own) if name not in known]
        self._reader = Reader(Order(equations, others), turn=True, conditions=equations.conditions)

    def sum(self, expression: Any) -> Sum:
        return self._reader.sum(expression.subs(self._own))

    def remark(self, change: Change, comparison: Comparison) -> Remark:
        line, column = (None, None) if change.at is None else self._sheet.place(change.at)
        if change.kind == "missing" and change.derived is not None:
            message = self._missing(comparison.derived_terms[change.derived], change.derived < comparison.n_left)
            return Remark("missing", None, None, message)
        if change.kind == "remainder":
            return self._remainder(change.expression)
        at_right = {addend.at: addend for addend in addends(comparison.written.right)}
        return Remark(change.kind, line, column, self._misprint(_as_written(change, at_right)))

    def _misprint(self, change: Change) -> Message:
        inside = _in(change)
        if change.found and change.expected:
            return (*_list(change.found), " should be ", *_list(change.expected), *inside)
        if change.found:
            return (*_list(change.found), " is one factor too many", *inside)
        addend = Sum((term(change.addend or _known(change.term)),))
        inside = inside if change.addend != change.term else ()
        if change.expected:
            return ("the factor ", *_list(change.expected), " is missing in ", addend, *inside)
        if change.kind == "sign":
            return (addend, " has the wrong sign", *inside)
        if change.kind == "extra":
            return (addend, " does not belong here", *inside)
        return (addend, " should be ", self.sum(change.factor), " times as large", *inside)

    def _missing(self, expression: Any, on_left: bool) -> Message:
        side = "left" if on_left else "right"
        return (self.sum(expression if on_left else -expression), f" is missing on the {side}")

    def _remainder(self, expression: Any) -> Remark:
        """A product alone: what is negative in printed - derived is missing on the left side."""
        read = self.sum(expression)
        if read.terms[0].negative:
            return Remark("missing", None, None, (self.sum(-expression), " is missing on the left"))
        return Remark("extra", None, None, (read, " is too much on the left"))


def _as_written(change: Change, at_right: Mapping[int, Addend]) -> Change:
    """The change with the terms of the right side under their own signs."""
    term, addend = (None if a is None else at_right.get(a.at, a) for a in (change.term, change.addend))
    return replace(change, term=term, addend=addend)


def _in(change: Change) -> Message:
    return (", in ", Sum((term(change.term),))) if change.term is not None else ()


def _known(addend: Addend | None) -> Addend:
    assert addend is not None  # only what is missing has no term
    return addend


def _list(names: Sequence[str]) -> Message:
    """A, b and c."""
    found: list[str | Sum] = []
    for k, name in enumerate(names):
        if k:
            found.append(" and " if k == len(names) - 1 else ", ")
        found.append(Sum((alone(Name(name)),)))
    return tuple(found)
