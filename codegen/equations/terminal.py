"""The equations as Unicode text for the terminal, no line longer than asked for."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from qddot.codegen.equations.document import Document, MassMatrix
from qddot.codegen.equations.entries import Entry
from qddot.codegen.equations.layout import Box, beside, joined, lines
from qddot.codegen.equations.phrases import Factor, Formula, Name
from qddot.codegen.equations.typesetter import Typesetter
from qddot.codegen.equations.unicode_script import UnicodeScript, boxed, columns, wrapped

_MARGIN, _INDENT, _NARROWEST = 2, 4, 40


def text(document: Document, width: int = 100) -> str:
    """The document in Unicode, its formulas broken between terms to `width` columns (at least 40).

    A single name or number that is wider stays whole.
    """
    return "\n".join(line.rstrip() for line in _Page(document, max(width, _NARROWEST)).all()) + "\n"


class _Page:
    def __init__(self, document: Document, width: int) -> None:
        self._document = document
        self._width = width
        self._write = Typesetter(UnicodeScript(document.dotted))

    def all(self) -> Iterator[str]:
        document = self._document
        yield from wrapped(document.title, self._width)
        yield from wrapped(f"{document.name}, from {document.source}", self._width)
        yield from self._table("Coordinates", document.coordinates)
        yield from self._table("Internal states", document.states)
        yield from self._table("Inputs", document.inputs)
        yield from self._defined("Quantities", document.quantities, document.definitions)
        yield from self._table("Tables", document.tables)
        yield from self._heading("Energies and dissipation function")
        yield from self._formulas(document.energies)
        if document.forces:
            yield from self._heading("Generalized forces")
            yield from self._formulas(document.forces)
        if document.constraints:
            yield from self._heading("Constraints")
            yield from self._formulas(document.constraints)
        yield from self._table("Multipliers, of forces -G'λ", document.multipliers)
        if document.events:
            yield from self._heading("Events")
        for event in document.events:
            yield from wrapped(f"{event.heading}:", self._width)
            yield from self._formulas(event.formulas)
        yield from self._motion()
        yield from self._mass(document.mass)
        yield from self._defined("Outputs", document.outputs, document.output_definitions)
        yield from self._parameters()

    def _heading(self, title: str) -> Iterator[str]:
        yield ""
        yield title
        yield "─" * columns(title)

    def _symbol(self, name: str) -> str:
        return self._write.script.name(name).text

    def _table(self, title: str, entries: Sequence[Entry]) -> Iterator[str]:
        if entries:
            yield from self._heading(title)
            yield from self._rows([(self._symbols(entry), entry.unit, entry.meaning) for entry in entries])

    def _symbols(self, entry: Entry) -> str:
        return ", ".join(self._symbol(name) for name in (entry.symbol, entry.rate) if name)

    def _defined(self, title: str, entries: Sequence[Entry], formulas: Sequence[Formula]) -> Iterator[str]:
        """Formula, unit and meaning side by side; where that is too wide, formulas first."""
        if not entries:
            return
        yield from self._heading(title)
        known = {formula.left.terms[0].above[0]: joined(self._write.formula(formula)) for formula in formulas}
        if all(box.width <= self._width // 2 for box in known.values()):
            yield from self._rows(list(self._definitions(entries, known)))
        else:
            yield from self._formulas(formulas)
            yield ""
            yield from self._rows([(self._symbols(entry), entry.unit, entry.meaning) for entry in entries])

    def _definitions(self, entries: Sequence[Entry], known: Mapping[Factor, Box]) -> Iterator[tuple[str, str, str]]:
        for entry in entries:
            box = known.get(Name(entry.symbol))
            yield box.text if box else self._symbol(entry.symbol), entry.unit, entry.meaning
            if entry.rate:
                yield known[Name(entry.rate)].text, f"{entry.unit}/s", "its rate"

    def _rows(self, rows: Sequence[Sequence[str]]) -> Iterator[str]:
        """Columns side by side; the last is wrapped, or below the others where it has no room."""
        widths = [max(columns(row[k]) for row in rows) for k in range(len(rows[0]) - 1)]
        margin = _MARGIN + sum(width + 2 for width in widths)
        beneath = self._width - margin < _NARROWEST // 2
        for row in rows:
            cells = [cell + " " * (width - columns(cell) + 2) for cell, width in zip(row, widths, strict=False)]
            indent = " " * (_MARGIN + _INDENT if beneath else margin)
            meaning = wrapped(row[-1], self._width, indent)
            front = " " * _MARGIN + "".join(cells)
            if beneath:
                yield front
                yield from meaning
            else:
                yield front + meaning[0][margin:]
                yield from meaning[1:]

    def _parameters(self) -> Iterator[str]:
        parameters = self._document.parameters
        if not parameters:
            return
        yield from self._heading("Parameters")
        yield from self._rows([(self._symbol(p.symbol), f"{p.default:.12g}", p.unit, p.meaning) for p in parameters])
        for chosen in self._document.parameter_sets:
            values = [f"{self._symbol(p.symbol)} = {p.values[chosen]:.12g}" for p in parameters if chosen in p.values]
            boxes = [boxed(value) for value in values] or [boxed("all defaults")]
            yield from self._lines([beside(boxed(f"{chosen}: "), joined(boxes, boxed(", "), after=True))])

    def _motion(self) -> Iterator[str]:
        yield from self._heading("Equations of motion")
        for entry, formula in self._document.equations:
            yield from wrapped(f"{self._symbol(entry.symbol)}, {entry.meaning}:", self._width)
            yield from self._formulas([formula])

    def _mass(self, mass: MassMatrix) -> Iterator[str]:
        yield from self._heading(f"Mass matrix ({mass.kind})")
        if mass.is_diagonal:
            entries = [joined(self._write.terms(mass.entry(k, k))) for k in range(mass.size)]
            inside = joined(entries, self._write.script.comma, after=True)
            yield from self._lines([beside(beside(boxed("M = diag("), inside), boxed(")"))])
            return
        yield from self._formulas(mass.formulas)

    def _formulas(self, formulas: Iterable[Formula]) -> Iterator[str]:
        for formula in formulas:
            yield from self._lines(self._write.formula(formula))

    def _lines(self, boxes: Iterable[Box]) -> Iterator[str]:
        for k, line in enumerate(lines(boxes, self._width - _MARGIN, _INDENT)):
            yield " " * (_MARGIN + (_INDENT if k else 0)) + "".join(box.text for box in line).strip()
