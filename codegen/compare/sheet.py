"""A file of hand-written equations.

    # a comment, to the end of the line
    model m113                      the shipped model whose equations they are; the command line may say it instead,
                                    and it alone may name a file that defines one, which is run
    symbols l_7 l_8                 names of the file's own, which the model lacks or which do not mean the model's
    let I = I_6                     an abbreviation: the author's name for an expression
    (5) q_1: m_1*qddot_1 + k_1*(q_1 - z_1)
             - k_6*d_1 = -m_1*g     a label in brackets (or none), the coordinate or internal state, an equation;
                                    indented lines go on

Names are the model's: coordinates, velocities, accelerations, states, parameters, inputs, rates, quantities and t.
Expressions are those of `grammar`.
"""

import re
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from pathlib import Path

from qddot.codegen.compare.grammar import FUNCTIONS, parse
from qddot.codegen.compare.tree import Call, CompareError, Lookup, Node, exchanged, symbols
from qddot.words import nearest

#: The functions of tables: name -> table, orders of the derivative by its arguments.
Tables = Mapping[str, tuple[str, tuple[int, ...]]]

_NAME = r"[A-Za-z][A-Za-z0-9_]*"
_DIRECTIVE = re.compile(r"(model|symbols|let)\b(?!\s*:)")
_EQUATION = re.compile(rf"(?:\((?P<label>[^()]*)\)\s*)?(?P<coordinate>{_NAME})\s*:")


@dataclass(frozen=True)
class Written:
    """An equation of the file: left = right; label: what stands in brackets in front, or the name.

    coordinate: what it is of, a coordinate or an internal state.
    """

    label: str
    coordinate: str
    left: Node
    right: Node
    at: int


@dataclass(frozen=True)
class Sheet:
    """All that a file says. own: its own symbols; meanings: its abbreviations, in order."""

    path: Path
    text: str
    model: str | None
    own: frozenset[str]
    meanings: dict[str, Node]
    equations: tuple[Written, ...]

    def place(self, at: int) -> tuple[int, int]:
        """Line and column, from 1, of an offset."""
        before = self.text[:at]
        return before.count("\n") + 1, at - (before.rfind("\n") + 1) + 1

    def error(self, at: int, what: str) -> CompareError:
        """The error for a place of the file."""
        line, column = self.place(at)
        return CompareError(f"{self.path}, line {line}, column {column}: {what}")

    def checked(self, known: Sequence[str], coordinates: Sequence[str], tables: Tables) -> "Sheet":
        """The sheet with calls of the model's tables taken for what they are; CompareError for an unknown name.

        tables: name of a function -> the table and the orders of the derivative that it is.
        """
        names = {*known, *self.own, "pi"}
        for at, wanted in ((equation.at, equation.coordinate) for equation in self.equations):
            if wanted not in coordinates:
                raise self.error(at, f"{wanted} has no equation{nearest(wanted, coordinates)}")
        for name, meaning in self.meanings.items():  # an abbreviation may use those before it
            self._check_symbols(meaning, names)
            names.add(name)
        for equation in self.equations:
            self._check_symbols(equation.left, names)
            self._check_symbols(equation.right, names)

        def settled(node: Node) -> Node:
            return exchanged(node, lambda call: self._settled(call, tables))

        meanings = {name: settled(meaning) for name, meaning in self.meanings.items()}
        equations = (replace(each, left=settled(each.left), right=settled(each.right)) for each in self.equations)
        return replace(self, meanings=meanings, equations=tuple(equations))

    def _settled(self, call: Call, tables: Tables) -> Node:
        """A call as it is, or as one of a table."""
        table, orders = tables.get(call.function, ("", ()))
        if call.function not in FUNCTIONS and not table:
            there = ", ".join(sorted({*FUNCTIONS, *tables}))
            raise self.error(call.at, f"{call.function} is no function (there are {there}); between factors write *")
        count = len(orders) if table else FUNCTIONS[call.function]
        if len(call.arguments) != count:
            raise self.error(call.at, f"{call.function} takes {count} argument{'s' if count > 1 else ''}")
        return Lookup(table, orders, call.arguments, call.at) if table else call

    def _check_symbols(self, node: Node, names: Set[str]) -> None:
        for symbol in symbols(node):
            if symbol.name not in names:
                hint = nearest(symbol.name, sorted(names)) or "; there is no name like it"
                own = f"declare it with `symbols {symbol.name}` if the equations mean a name of their own"
                raise self.error(symbol.at, f"unknown symbol {symbol.name}{hint}; {own}")


def read(path: Path) -> Sheet:
    """Read a file of equations; CompareError with line and column for anything that does not follow the grammar."""
    try:
        text = path.read_bytes().decode("utf-8-sig").replace("\r\n", "\n")
    except (OSError, UnicodeDecodeError) as error:
        raise CompareError(f"{path}: {error}") from None
    return _Builder(Sheet(path, text, None, frozenset(), {}, ())).sheet()


@dataclass(frozen=True)
class _Statement:
    """A statement without its comments, on one line; places: the offset of each character in the file."""

    text: str
    places: tuple[int, ...]

    def part(self, start: int, end: int | None = None) -> tuple[str, tuple[int, ...]]:
        return self.text[start:end], self.places[start:end]


class _Builder:
    def __init__(self, empty: Sheet) -> None:
        self._file = empty
        self._model: str | None = None
        self._own: set[str] = set()
        self._meanings: dict[str, Node] = {}
        self._equations: list[Written] = []

    def sheet(self) -> Sheet:
        for statement in self._statements():
            self._add(statement)
        if not self._equations:
            raise CompareError(f"{self._file.path}: there is no equation; write `q_1: left = right`")
        found = (self._model, frozenset(self._own), self._meanings, tuple(self._equations))
        return Sheet(self._file.path, self._file.text, *found)

    def _statements(self) -> Iterator[_Statement]:
        text, places = "", list[int]()
        offset = 0
        for line in self._file.text.split("\n"):
            content = line.partition("#")[0].rstrip()
            if content and not content[0].isspace() and text:
                yield _Statement(text, tuple(places))
                text, places = "", []
            if content.strip():
                text += content + " "
                places += range(offset, offset + len(content) + 1)
            offset += len(line) + 1
        if text:
            yield _Statement(text, tuple(places))

    def _add(self, statement: _Statement) -> None:
        if directive := _DIRECTIVE.match(statement.text):
            start = directive.end()
            {"model": self._set_model, "symbols": self._declare, "let": self._let}[directive[1]](statement, start)
        elif head := _EQUATION.match(statement.text):
            self._equation(statement, head)
        else:
            raise self._error(
                statement, 0, "expected model, symbols, let, or an equation such as (5) q_1: left = right"
            )

    def _set_model(self, statement: _Statement, start: int) -> None:
        name = statement.text[start:].strip()
        if not name or " " in name or self._model is not None:
            raise self._error(statement, 0, "expected one model, such as `model m113`, once in a file")
        if not re.fullmatch(_NAME, name):
            where = "a file of equations names shipped models only; give the path of one on the command line"
            raise self._error(statement, 0, f"{name!r} is no model's name: {where}, --model {name}")
        self._model = name

    def _declare(self, statement: _Statement, start: int) -> None:
        names = statement.text[start:].replace(",", " ").split()
        for name in names:
            self._check_name(statement, name)
        self._own.update(names)

    def _let(self, statement: _Statement, start: int) -> None:
        name, equals, _ = statement.text[start:].partition("=")
        if not equals:
            raise self._error(statement, start, "expected `let name = expression`")
        self._check_name(statement, name.strip())
        meaning = parse(*statement.part(start + len(name) + 1), self._file.error)
        for symbol in symbols(meaning):
            if symbol.name == name.strip():
                raise self._file.error(symbol.at, f"{symbol.name} is explained by itself")
        self._meanings[name.strip()] = meaning

    def _check_name(self, statement: _Statement, name: str) -> None:
        if not re.fullmatch(_NAME, name) or name in FUNCTIONS or name == "pi":
            raise self._error(statement, 0, f"{name!r} cannot be a name: a letter, then letters, digits, underscores")
        if name in self._own or name in self._meanings:
            raise self._error(statement, 0, f"{name} is declared twice")

    def _equation(self, statement: _Statement, head: re.Match[str]) -> None:
        start = head.end()
        sides = statement.text[start:].split("=")
        if len(sides) != 2:
            raise self._error(statement, start - 1, f"an equation has one =, found {len(sides) - 1}")
        middle = start + len(sides[0])
        left = parse(*statement.part(start, middle), self._file.error)
        right = parse(*statement.part(middle + 1), self._file.error)
        coordinate = head["coordinate"]
        label = f"({head['label'].strip()})" if head["label"] else coordinate
        self._equations.append(Written(label, coordinate, left, right, statement.places[head.start("coordinate")]))

    def _error(self, statement: _Statement, column: int, what: str) -> CompareError:
        return self._file.error(statement.places[column], what)
