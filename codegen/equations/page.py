"""The equations as one HTML page with MathML: no script, nothing fetched; lines break as the screen asks."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from latex2mathml.converter import convert
from markupsafe import Markup, escape

from qddot.codegen.environment import environment
from qddot.codegen.equations.document import Document
from qddot.codegen.equations.entries import Entry
from qddot.codegen.equations.latex_script import LatexScript, decimal
from qddot.codegen.equations.layout import Box, beside, fitting, joined
from qddot.codegen.equations.phrases import Factor, Formula, Name
from qddot.codegen.equations.tex import lagrange
from qddot.codegen.equations.typesetter import Typesetter

#: What an equation is of, that symbol, and the pieces of the equation.
Equation = tuple[str, Markup, list[Markup]]

#: Wider pieces are cut further, in em; a piece that cannot be cut scrolls in its own box.
_PIECE = 28.0

_MATRIX = 6


@dataclass(frozen=True)
class Row:
    """A line of a table: the pieces of a formula or a symbol, its meaning, its unit."""

    pieces: Sequence[Markup]
    meaning: str
    unit: Markup


def html(document: Document) -> str:
    """A complete page, the same text for the same model on every machine."""
    page = _Page(document)
    return (
        environment("html")
        .get_template("equations.html.jinja")
        .render(
            document=document,
            lagrange=_math(lagrange(document)),
            coordinates=[page.symbols(entry) for entry in document.coordinates],
            states=[page.symbols(entry) for entry in document.states],
            inputs=[page.symbols(entry) for entry in document.inputs],
            quantities=page.defined(document.quantities, document.definitions),
            tables=[page.symbols(entry) for entry in document.tables],
            energies=[page.pieces(page.write.formula(formula)) for formula in document.energies],
            forces=[page.pieces(page.write.formula(formula)) for formula in document.forces],
            constraints=[page.pieces(page.write.formula(formula)) for formula in document.constraints],
            events=[
                (event.heading, [page.pieces(page.write.formula(formula)) for formula in event.formulas])
                for event in document.events
            ],
            multipliers=[page.symbols(entry) for entry in document.multipliers],
            motion=page.equations(document.subjects, document.motion),
            state_motion=page.equations(document.state_subjects, document.state_motion),
            mass=page.mass(),
            outputs=page.defined(document.outputs, document.output_definitions),
            parameters=[
                (page.symbol(p.symbol), p.meaning, _number(p.default), unit(p.unit)) for p in document.parameters
            ],
            parameter_sets=[
                (page.symbol(p.symbol), [_number(p.values.get(name, p.default)) for name in document.parameter_sets])
                for p in document.parameters
                if p.values
            ],
        )
    )


class _Page:
    def __init__(self, document: Document) -> None:
        self._document = document
        self.write = Typesetter(LatexScript(document.dotted))

    def symbol(self, name: str) -> Markup:
        return _math(self.write.script.name(name).text)

    def pieces(self, boxes: Sequence[Box]) -> list[Markup]:
        """One piece of MathML per term, so that the browser breaks lines between them."""
        found = fitting(boxes, _PIECE)
        return [_math(("{} " if k else "") + box.text) for k, box in enumerate(found)]

    def symbols(self, entry: Entry) -> Row:
        names = [name for name in (entry.symbol, entry.rate) if name]
        boxes = [self.write.script.name(name) for name in names]
        return Row([_math(joined(boxes, Box(r",\;", 0.6)).text)], entry.meaning, unit(entry.unit))

    def defined(self, entries: Sequence[Entry], formulas: Sequence[Formula]) -> list[Row]:
        known: Mapping[Factor, Formula] = {formula.left.terms[0].above[0]: formula for formula in formulas}
        rows = []
        for entry in entries:
            rows.append(Row(self._definition(entry.symbol, known), entry.meaning, unit(entry.unit)))
            if entry.rate:
                rows.append(Row(self._definition(entry.rate, known), "its rate", unit(f"{entry.unit}/s")))
        return rows

    def equations(self, entries: Sequence[Entry], formulas: Sequence[Formula]) -> list[Equation]:
        return [
            (_capitalized(entry.meaning), self.symbol(entry.symbol), self.pieces(self.write.formula(formula)))
            for entry, formula in zip(entries, formulas, strict=True)
        ]

    def _definition(self, name: str, known: Mapping[Factor, Formula]) -> list[Markup]:
        formula = known.get(Name(name))
        return [self.symbol(name)] if formula is None else self.pieces(self.write.formula(formula))

    def mass(self) -> list[list[Markup]]:
        """The mass matrix whole, or its diagonal, or its entries."""
        mass = self._document.mass
        if mass.is_diagonal and mass.size > 3:
            entries = [joined(self.write.terms(mass.entry(k, k))) for k in range(mass.size)]
            inside = joined(entries, self.write.script.comma, after=True)
            box = beside(beside(Box(r"\mathbf{M} = \mathrm{diag}(", 7.0), inside), Box(")", 0.4))
            return [self.pieces(box.cut() if box.cut else [box])]
        if mass.size <= _MATRIX:
            return [[_math(self._matrix())]]
        return [self.pieces(self.write.formula(formula)) for formula in mass.formulas]

    def _matrix(self) -> str:
        mass, size = self._document.mass, range(self._document.mass.size)
        rows = (" & ".join(joined(self.write.terms(mass.entry(k, j), inner=True)).text for j in size) for k in size)
        return r"\mathbf{M} = \begin{pmatrix} " + r" \\ ".join(rows) + r" \end{pmatrix}"


def unit(text: str) -> Markup:
    """A unit with its powers raised; 1 is a dash."""
    if text.strip() == "1":
        return Markup("–")
    parts = re.split(r"(?:\^|\*\*)(-?\d+)", text.strip())
    return Markup("").join(
        Markup("<sup>{}</sup>").format(part.replace("-", "−")) if k % 2 else escape(re.sub(r"[ *·]+", "\u202f", part))
        for k, part in enumerate(parts)
    )


def _capitalized(text: str) -> str:
    return text[:1].upper() + text[1:]


def _number(value: float) -> Markup:
    return _math(decimal(value).text)


@lru_cache(maxsize=4000)
def _math(text: str) -> Markup:
    # The text holds names of symbols, numbers and LaTeX commands of our own; names are letters, digits and underscores.
    written = convert(_SIZED.sub(r"\1", text.strip())).replace(' display="inline"', "")
    for pattern, replacement in _REPAIRS:
        written = pattern.sub(replacement, written)
    return Markup(written)


#: Brackets of a given size sit badly under an exponent; terms are low enough here without.
_SIZED = re.compile(r"\\[bB]igg?[lr]([()|])")

#: What MathML would set otherwise than LaTeX: a minus behind a relation or a bracket is a sign; a function stands apart
#: from what it multiplies; Greek capitals are upright.
_REPAIRS = (
    (re.compile(r"(<mo(?: [^>]*)?>(?:=|&#x0003D;|\(|&#x00028;)</mo>)<mo>(?=−|&#x02212;)"), r'\1<mo form="prefix">'),
    (
        re.compile(
            r"(</m(?:i|n|sub|sup|subsup|over|frac|style)>)(?=(?:<msup>)?<mi>(?:sin|cos|tan|arc\w+|\w+h|ln|exp)<)"
        ),
        r'\1<mspace width="0.167em"/>',
    ),
    (re.compile(r"<mo>(?=\||&#x0007C;)"), '<mo stretchy="false">'),
    (re.compile(r"<(/?)mtext>"), r"<\1mi>"),  # MathML takes text for space: an operator beside it would lose its own
    (re.compile(r"<mi>(?=&#x003(?:9[1-9A-F]|A[0-9]);)"), '<mi mathvariant="normal">'),
)
