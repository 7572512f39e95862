"""The equations as a LaTeX document, every formula broken between terms so that it fits the page."""

from collections.abc import Sequence
from typing import Any

from qddot.codegen.environment import environment
from qddot.codegen.equations.abridged import Display, Row, Table, abridged
from qddot.codegen.equations.document import Document
from qddot.codegen.equations.entries import Entry
from qddot.codegen.equations.latex_script import LatexScript, decimal
from qddot.codegen.equations.latex_text import escape, unit
from qddot.codegen.equations.layout import Box, beside, joined, lines
from qddot.codegen.equations.phrases import Formula, Name
from qddot.codegen.equations.typesetter import Typesetter

#: Widths in em of the page (A4, 10 pt, margins of 25 mm), of a display, and of one with its number.
_PAGE, _DISPLAY, _NUMBERED = 45.5, 43.5, 40.5

_INDENT = 2.0  # \qquad in front of a line that goes on
_LONG_LEFT = 14.0
_FORMULA_CELL = 24.0
_SETS_IN_ROW = 6
_GAP = 1.25  # between columns
_GAP_OF_COLUMNS = 1.0  # of a matrix


#: Bytes of a document at most: some hundred pages.
LARGEST = 300_000

#: Compiled with the import: it costs twice what writing a document does.
_TEMPLATE = environment("latex").get_template("equations.tex.jinja")


def tex(document: Document) -> str:
    """A complete LaTeX document, the same text for the same model on every machine; of large models the first rows."""
    sections = _sections(document, _Page(document))
    text = _TEMPLATE.render(sections, is_abridged=False)
    return text if len(text.encode()) <= LARGEST else _TEMPLATE.render(abridged(sections), is_abridged=True)


def _sections(document: Document, page: "_Page") -> dict[str, Any]:
    return dict(
        name=escape(document.name),
        title=escape(document.title),
        source=escape(document.source),
        raw_source="".join(c if c.isprintable() else " " for c in document.source),
        lagrange=lagrange(document),
        coordinates=page.table(document.coordinates),
        states=page.table(document.states),
        inputs=page.table(document.inputs),
        quantities=page.table(document.quantities),
        tables=page.table(document.tables),
        quantities_defined=page.defined(document.quantities, document.definitions),
        definitions=page.aligned(document.definitions),
        energies=page.aligned(document.energies),
        forces=page.aligned(document.forces),
        multipliers=page.table(document.multipliers),
        constraints=page.aligned(document.constraints),
        events=[(escape(event.heading), page.aligned(event.formulas)) for event in document.events],
        motion=page.equations(document.subjects, document.motion),
        left_out=document.left_out,
        state_motion=page.equations(document.state_subjects, document.state_motion),
        mass=page.mass(),
        mass_kind=document.mass.kind,
        size=document.mass.size + document.mass.left_out,
        rows_left_out=document.mass.left_out,
        outputs=page.table(document.outputs),
        outputs_defined=page.defined(document.outputs, document.output_definitions),
        output_definitions=page.aligned(document.output_definitions),
        parameters=page.parameters(),
        parameter_sets=page.parameter_sets(),
    )


def lagrange(document: Document) -> str:
    """Lagrange's equation in the paper's form (1); with L = T - Pi where Pi depends on velocities."""
    start, end = r"\frac{\mathrm{d}}{\mathrm{d}t} ", r" + \frac{\partial \Phi}{\partial \dot{q}_{k}} = Q_{k}"
    letter, potential = ("L", "") if document.is_generalized else ("T", r" + \frac{\partial \Pi}{\partial q_{k}}")
    inertia = (
        rf"\frac{{\partial {letter}}}{{\partial \dot{{q}}_{{k}}}} - \frac{{\partial {letter}}}{{\partial q_{{k}}}}"
    )
    if document.constraints:
        end = end.replace(" = ", r" + \sum_{j} \lambda_{j} G_{jk} = ")
    return start + inertia + potential + end + (r", \quad L = T - \Pi" if document.is_generalized else "")


class _Page:
    def __init__(self, document: Document) -> None:
        self._document = document
        self._write = Typesetter(LatexScript(document.dotted))

    def _symbol(self, name: str) -> Box:
        return self._write.script.name(name)

    def table(self, entries: Sequence[Entry]) -> Table:
        """Symbol, meaning, unit."""
        boxes = [
            joined([self._symbol(name) for name in (entry.symbol, entry.rate) if name], Box(r",\; ", 0.6))
            for entry in entries
        ]
        return _table([(box, entry.meaning, entry.unit) for box, entry in zip(boxes, entries, strict=True)])

    def defined(self, entries: Sequence[Entry], formulas: Sequence[Formula]) -> Table | None:
        """Formula, meaning, unit: what is defined, in one table; None where a formula is too wide for a column."""
        known = {formula.left.terms[0].above[0]: joined(self._write.formula(formula)) for formula in formulas}
        rows = []
        for entry in entries:
            symbol = known.get(Name(entry.symbol)) or self._symbol(entry.symbol)
            rows.append((symbol, entry.meaning, entry.unit))
            if entry.rate:
                rows.append((known[Name(entry.rate)], "its rate", f"{entry.unit}/s"))
        return _table(rows) if rows and max(box.width for box, _, _ in rows) <= _FORMULA_CELL else None

    def parameters(self) -> Table:
        """Symbol, meaning, default, unit."""
        entries = self._document.parameters
        values = [decimal(p.default) for p in entries]
        plain = _table([(self._symbol(p.symbol), p.meaning, p.unit) for p in entries], _column(values) + _GAP)
        rows = [
            (symbol, meaning, _math(value), unit)
            for (symbol, meaning, unit), value in zip(plain.rows, values, strict=True)
        ]
        return Table(tuple(rows), plain.meaning)

    def parameter_sets(self) -> list[tuple[list[str], Table]]:
        """Heads and tables with the parameters that some set changes; a few sets side by side."""
        names = self._document.parameter_sets
        changed = [p for p in self._document.parameters if p.values]
        tables = []
        for k in range(0, len(names), _SETS_IN_ROW):
            chosen = names[k : k + _SETS_IN_ROW]
            rows = tuple(
                tuple(
                    _math(box)
                    for box in (self._symbol(p.symbol), *(decimal(p.values.get(n, p.default)) for n in chosen))
                )
                for p in changed
            )
            tables.append(([escape(name.replace("_", " ")) for name in chosen], Table(rows, 0.0)))
        return tables

    def aligned(self, formulas: Sequence[Formula]) -> Display:
        """Formulas under each other, aligned at their relations."""
        lefts = [joined(self._write.terms(formula.left)) for formula in formulas]
        edge = max((left.width for left in lefts), default=0.0)
        if edge > _LONG_LEFT:
            return Display(1, tuple(Row("", _texts(self._write.formula(formula), _DISPLAY)) for formula in formulas))
        rights = [self._right(formula) for formula in formulas]
        widest = edge + max((sum(box.width for box in boxes) for boxes in rights), default=0.0)
        columns = min(4, len(rights), max(1, int((_DISPLAY + 2.0) / (widest + 2.0)))) if len(rights) > 3 else 1
        rows = (Row(left.text, _texts(boxes, _DISPLAY - edge)) for left, boxes in zip(lefts, rights, strict=True))
        return Display(columns, tuple(rows))

    def _right(self, formula: Formula) -> list[Box]:
        first, *others = self._write.terms(formula.right)
        return [beside(self._write.script.equals, first), *others]

    def equations(self, entries: Sequence[Entry], formulas: Sequence[Formula]) -> list[tuple[str, tuple[str, ...]]]:
        """What each equation is of, and its lines."""
        pairs = zip(entries, formulas, strict=True)
        return [(self._subject(entry), _texts(self._write.formula(formula), _NUMBERED)) for entry, formula in pairs]

    def _subject(self, entry: Entry) -> str:
        return f"{escape(entry.meaning[:1].upper() + entry.meaning[1:])}, {_math(self._symbol(entry.symbol))}"

    def mass(self) -> Display:
        """The mass matrix whole, or its diagonal, or its entries."""
        mass, name = self._document.mass, r"\mathbf{M}"
        if mass.multiple is not None:
            terms = mass.multiple.terms
            box = self._write.factor(mass.multiple) if len(terms) > 1 else joined(self._write.terms(mass.multiple))
            return Display(1, (Row(name, (rf"= {box.text} \, \mathbf{{I}}",)),))
        if not mass.is_diagonal or mass.size <= 3:
            matrix = self._matrix() if mass.size * _GAP_OF_COLUMNS <= _DISPLAY - 3.0 else None
            if matrix is not None and matrix.width <= _DISPLAY - 3.0:
                return Display(1, (Row(name, (f"= {matrix.text}",)),))
        if mass.is_diagonal:
            entries = [joined(self._write.terms(mass.entry(k, k))) for k in range(mass.size)]
            inside = joined(entries, self._write.script.comma, after=True)
            box = beside(beside(Box(r" = \operatorname{diag}(", 4.0), inside), Box(")", 0.4))
            return Display(1, (Row(name, _texts([box], _DISPLAY - 3.0)),))
        return self.aligned(mass.formulas)

    def _matrix(self) -> Box:
        mass = self._document.mass
        size = range(mass.size)
        cells = [[joined(self._write.terms(mass.entry(k, j), inner=True)) for j in size] for k in size]
        width = sum(max(row[j].width for row in cells) + _GAP_OF_COLUMNS for j in size) + 1.5
        body = r" \\[2pt] ".join(" & ".join(cell.text for cell in row) for row in cells)
        return Box(rf"\begin{{pmatrix}} {body} \end{{pmatrix}}", width)


def _texts(boxes: Sequence[Box], width: float) -> tuple[str, ...]:
    return tuple("".join(box.text for box in line).strip() for line in lines(boxes, width, _INDENT))


def _math(box: Box) -> str:
    return f"${box.text}$"


def _table(rows: Sequence[tuple[Box, str, str]], beside_it: float = 0.0) -> Table:
    """Cells of (symbol, meaning, unit), the meaning as wide as it needs or the page leaves."""
    room = _PAGE - _column([box for box, _, _ in rows]) - _column([_words(text) for _, _, text in rows]) - beside_it
    needed = _column([_words(meaning) for _, meaning, _ in rows])
    cells = tuple((_math(box), escape(meaning), unit(text)) for box, meaning, text in rows)
    return Table(cells, max(10.0, min(needed, room - 2 * _GAP)))


def _words(text: str) -> Box:
    return Box(text, 0.48 * len(text))


def _column(boxes: Sequence[Box]) -> float:
    """The width of a column, which has a head of one word."""
    return max((3.8, *(box.width for box in boxes)))
