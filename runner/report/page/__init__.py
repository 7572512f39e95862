"""One HTML page that needs nothing but itself: style, script, data and the plotting library are in it."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from qddot.runner.files import written_aside

_HERE = Path(__file__).parent
#: uPlot 1.6.32 by Leon Sorokin, MIT: the package `uplot` of npm, its licence beside it, unchanged.
_LIBRARY, _LIBRARY_STYLE = "uplot/uPlot.iife.min.js", "uplot/uPlot.min.css"
#: What the place of a plot begins with: a page without one has no library.
_PLOT = '<div class="plot"'
#: What the last line of the page's script does: nothing before it failed.
_READY = 'document.documentElement.dataset.ready = "yes";'
#: The slider of a common time: plots over time with `cursor` show the same moment.
CURSOR = (
    '<div class="cursor" hidden><label for="cursor">Time</label>'
    '<input type="range" id="cursor"><output for="cursor"></output></div>\n'
)


@dataclass(frozen=True)
class Section:
    """A part of the page: its title, and its content as HTML; style and script: of its own, beside the page's."""

    title: str
    content: str
    style: str = ""
    script: str = ""

    @property
    def anchor(self) -> str:
        """What links point at."""
        return "".join(c if c.isalnum() else "-" for c in self.title.lower())


def write_page(
    path: Path,
    title: str,
    source: str,
    sections: Sequence[Section],
    plots: Sequence[Any] = (),
    data: Mapping[str, Any] | None = None,
) -> Path:
    """Write the page. plots: what `plot` shows, in order. data: what scripts of sections read as `data.own`.

    Raises ValueError where a number in plots or data is not finite.
    """
    cursor = CURSOR if any(each.get("cursor") for each in plots) else ""
    contents = "".join(f'<li><a href="#{each.anchor}">{escape(each.title)}</a></li>' for each in sections)
    main = "\n".join(
        f'<section aria-labelledby="{each.anchor}"><h2 id="{each.anchor}">{escape(each.title)}</h2>\n'
        f"{each.content}</section>"
        for each in sections
    )
    known = json.dumps({"plots": list(plots), "own": dict(data or {})}, allow_nan=False, separators=(",", ":"))
    library, drawing = (
        (part_of_page(_LIBRARY), (part_of_page("plots.js"), part_of_page("moment.js"))) if _PLOT in main else ("", ())
    )
    styles = [part_of_page(_LIBRARY_STYLE), part_of_page("page.css"), *(each.style for each in sections if each.style)]
    own = (f"{{\n{each.script}}}" for each in sections if each.script)
    scripts = ['"use strict";', part_of_page("page.js"), *drawing, *own, _READY]
    text = Template(part_of_page("page.html")).substitute(
        title=escape(title),
        source=escape(source),
        contents=contents,
        main=cursor + main,
        data=known.replace("<", "\\u003c"),
        style="\n".join(styles),
        script="\n".join(scripts),
        library=library,
    )
    with written_aside(path) as aside:
        aside.write_text(text, encoding="utf-8")
    return path


def table(heads: Sequence[str], rows: Iterable[Sequence[Any]], numbers: Sequence[int] = (), kind: str = "") -> str:
    """A table of texts, those of the columns `numbers` to the right; a cell may be (text, class).

    kind: its class; `cards` lists the cells of a row under each other on a narrow screen.
    """
    classes = ["number" if k in numbers else "" for k in range(len(heads))]
    columns = list(zip(heads, classes, strict=True))
    head = "".join(f'<th scope="col" class="{c}">{escape(text)}</th>' for text, c in columns)
    body = "".join(
        "<tr>" + "".join(_cell(cell, text, c) for cell, (text, c) in zip(row, columns, strict=True)) + "</tr>\n"
        for row in rows
    )
    return (
        f'<div class="wide" tabindex="0"><table class="{kind}"><thead><tr>{head}</tr></thead>\n'
        f"<tbody>{body}</tbody></table></div>"
    )


def _cell(cell: Any, head: str, kind: str) -> str:
    text, own = cell if isinstance(cell, tuple) else (cell, "")
    return f'<td class="{f"{kind} {own}".strip()}" data-head="{escape(head)}">{escape(str(text))}</td>'


def part_of_page(name: str) -> str:
    """The text of a file beside this one: a section's script, or its HTML."""
    return (_HERE / name).read_text("utf-8")


def embedded(page: str) -> str:
    """The main part of another page as the content of a section: its headings a level down, its anchors kept apart.

    Raises ValueError where the page has none.
    """
    found = re.search(r"<main>(.*)</main>", page, re.DOTALL)
    if found is None:
        raise ValueError("the page of equations has no main part")
    body = re.sub(r"<(/?)h3", r"<\1h4", found[1])
    return re.sub(r'id="', 'id="model-', re.sub(r"<(/?)h2", r"<\1h3", body))


def plot(index: int, title: str) -> str:
    """The place of a plot, with its download."""
    return (
        f"<h3>{escape(title)}</h3>\n"
        f'{_PLOT} data-plot="{index}" tabindex="0" role="group" aria-label="{escape(title)}: plot; arrows move the '
        'cursor, plus and minus zoom, Escape shows all"></div>\n'
        f'<button type="button" data-download="{index}">Download as CSV</button>\n'
    )


def linked_plot(title: str, kind: str, column: str) -> str:
    """The place of a plot that a section's script draws, with what is told of the cursor below."""
    return (
        f"<figure><figcaption>{escape(title)}</figcaption>"
        f'{_PLOT} data-linked="{kind}" data-column="{escape(column)}" role="group" aria-label="{escape(title)}"></div>'
        '<p class="key">\u00a0</p></figure>\n'
    )
