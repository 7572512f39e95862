"""A comparison as text for the terminal, as LaTeX, and as data."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from qddot.codegen.compare.wording import Account, Message, Remark
from qddot.codegen.environment import environment
from qddot.codegen.equations.latex_script import LatexScript
from qddot.codegen.equations.latex_text import escape
from qddot.codegen.equations.layout import joined, lines
from qddot.codegen.equations.phrases import Formula
from qddot.codegen.equations.typesetter import Typesetter
from qddot.codegen.equations.unicode_script import UnicodeScript, wrapped
from qddot.words import be, counted

_DISPLAY = 38.0
_KIND, _INDENT = 9, 4


def summary(accounts: Sequence[Account]) -> str:
    """One line: how many are equal, how many differ and in what."""
    wrong = [account for account in accounts if not account.equal]
    counts = Counter(remark.kind for account in wrong for remark in account.remarks)
    kinds = ", ".join(f"{kind} {count}" for kind, count in sorted(counts.items()))
    different = f"; {len(wrong)} {'differ' if len(wrong) > 1 else 'differs'} ({kinds})" if wrong else ""
    equal = len(accounts) - len(wrong)
    verb, derived = be(1 if len(accounts) == 1 else equal), "the one" if len(accounts) == 1 else "those"
    return f"{equal} of {counted(len(accounts), 'equation')} {verb} equal to {derived} derived{different}"


def text(accounts: Sequence[Account], dotted: frozenset[str], width: int = 100) -> str:
    """Every equation with its verdict; of those that differ, both forms and what differs, place by place."""
    write = Typesetter(UnicodeScript(dotted))
    found = [line for account in accounts for line in _Lines(write, max(width, 40)).account(account)]
    return "\n".join(line.rstrip() for line in [*found, "", summary(accounts)]) + "\n"


class _Lines:
    def __init__(self, write: Typesetter, width: int) -> None:
        self._write, self._width = write, width

    def account(self, account: Account) -> Iterator[str]:
        verdict = "equal" if account.equal else "differs"
        label = f"{account.label} " if account.label != account.coordinate else ""
        if account.factor is not None:
            verdict += f", as {self._math(account.factor)} times the derived equation"
        yield f"{label}{self._write.script.name(account.coordinate).text}, {account.meaning}: {verdict}"
        if account.equal:
            return
        yield from self._formula("printed", account.printed)
        yield from self._formula("derived", account.derived)
        for remark in account.remarks:
            yield from self._remark(remark)

    def _formula(self, head: str, formula: Formula) -> Iterator[str]:
        boxes = self._write.formula(formula)
        for k, line in enumerate(lines(boxes, self._width - _INDENT - _KIND, 2)):
            front = " " * _INDENT + (f"{head:{_KIND}}" if not k else " " * (_KIND + 2))
            yield front + "".join(box.text for box in line).strip()

    def _remark(self, remark: Remark) -> Iterator[str]:
        place = f"  (line {remark.line}, column {remark.column})" if remark.line else ""
        said = "".join(part if isinstance(part, str) else self._math(part) for part in remark.message) + place
        rows = wrapped(said, self._width, " " * (_INDENT + _KIND))
        yield " " * _INDENT + f"{remark.kind:{_KIND}}" + rows[0].lstrip()
        yield from rows[1:]

    def _math(self, total: Any) -> str:
        return joined(self._write.terms(total)).text


def latex(accounts: Sequence[Account], title: str, dotted: frozenset[str]) -> str:
    """A complete LaTeX document."""
    write = Typesetter(LatexScript(dotted))

    def formula(each: Formula) -> list[str]:
        return ["".join(box.text for box in line).strip() for line in lines(write.formula(each), _DISPLAY, 2.0)]

    def math(total: Any) -> str:
        return f"${joined(write.terms(total)).text}$"

    def message(parts: Message) -> str:
        return "".join(escape(part) if isinstance(part, str) else math(part) for part in parts)

    equations = [
        {
            "label": escape(account.label) if account.label != account.coordinate else "",
            "coordinate": f"${write.script.name(account.coordinate).text}$",
            "meaning": escape(account.meaning),
            "equal": account.equal,
            "factor": None if account.factor is None else math(account.factor),
            "printed": formula(account.printed),
            "derived": formula(account.derived),
            "remarks": [(escape(r.kind), message(r.message), r.line, r.column) for r in account.remarks],
        }
        for account in accounts
    ]
    template = environment("latex").get_template("compare.tex.jinja")
    return template.render(title=escape(title), equations=equations, summary=escape(summary(accounts)))


def records(accounts: Sequence[Account], dotted: frozenset[str]) -> list[dict[str, Any]]:
    """The same as data: plain dictionaries, formulas in Unicode and in LaTeX."""
    plain, tex = Typesetter(UnicodeScript(dotted)), Typesetter(LatexScript(dotted))

    def message(write: Typesetter, parts: Message) -> str:
        return "".join(part if isinstance(part, str) else joined(write.terms(part)).text for part in parts)

    def formula(write: Typesetter, each: Formula) -> str:
        return "".join(box.text for box in write.formula(each))

    return [
        {
            "label": account.label,
            "coordinate": account.coordinate,
            "equal": account.equal,
            "factor": None if account.factor is None else joined(plain.terms(account.factor)).text,
            "printed": formula(plain, account.printed),
            "derived": formula(plain, account.derived),
            "printed_latex": formula(tex, account.printed),
            "derived_latex": formula(tex, account.derived),
            "differences": [
                {"kind": r.kind, "line": r.line, "column": r.column, "text": message(plain, r.message)}
                for r in account.remarks
            ],
        }
        for account in accounts
    ]
