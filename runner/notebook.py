"""How results look in a notebook: small tables, curves as inline pictures, equations as mathematics."""

import re
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

#: Width and height of a curve in pixels, and the most points that it has.
WIDTH, HEIGHT, POINTS = 160, 28, 320
#: Rows that a table shows before it says how many more there are.
MOST_ROWS = 24


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], below: str = "") -> str:
    """An HTML table under a title. Cells are texts, escaped but where they begin with "<svg"."""
    shown = list(rows)
    more = f"<p>and {len(shown) - MOST_ROWS} more</p>" if len(shown) > MOST_ROWS else ""
    head = "".join(f"<th>{escape(column)}</th>" for column in columns)
    body = "".join(f"<tr>{''.join(f'<td>{_cell(cell)}</td>' for cell in row)}</tr>" for row in shown[:MOST_ROWS])
    foot = f"<p>{escape(below)}</p>" if below else ""
    return f"<p><b>{escape(title)}</b></p><table><tr>{head}</tr>{body}</table>{more}{foot}"


def _cell(text: str) -> str:
    return text if text.startswith("<svg") else escape(text)


def curve(t: NDArray[np.float64], values: NDArray[np.float64]) -> str:
    """A curve (n,) over t (n,) as a small inline picture: the least and the greatest value of each of its columns."""
    known = np.isfinite(values) & np.isfinite(t)
    if known.sum() < 2 or t[known].min() == t[known].max():
        return ""
    t, values = t[known], values[known]
    low, span = float(values.min()), float(np.ptp(values)) or 1.0
    chosen = thinned(t, values, POINTS)
    x, y = (t[chosen] - t.min()) / np.ptp(t) * WIDTH, HEIGHT - 2 - (values[chosen] - low) / span * (HEIGHT - 4)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    line = f'<polyline points="{points}" fill="none" stroke="#0072B2" stroke-width="1.2"/>'
    return f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}">{line}</svg>'


def thinned(t: NDArray[np.float64], values: NDArray[np.float64], most: int) -> NDArray[np.int64]:
    """Which points of a curve (n,) draw it, about `most`: the least and the greatest value of each of its columns."""
    if len(t) <= most or not np.ptp(t):
        return np.arange(len(t))
    column = np.minimum((t - t.min()) / np.ptp(t) * most / 2, most / 2 - 1).astype(int)
    return np.unique(np.concatenate([_extremes(column, values), [0, len(t) - 1]]))


def _extremes(column: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.int64]:
    """Where the least and the greatest value of each column stand."""
    order = np.lexsort((values, column))
    first = np.flatnonzero(np.diff(column[order], prepend=-1))
    last = np.append(first[1:], len(order)) - 1
    return order[np.concatenate([first, last])]


def equations(module: Path) -> str:
    """The equations of motion that were generated beside a module, as TeX that a notebook sets; "" without any."""
    page = module.with_suffix(".tex")
    if not page.is_file():
        return ""
    found = re.findall(
        r"\\equationof\{[^}]*\}\{[^\n]*\}\n(\\begin\{align\}.*?\\end\{align\})", page.read_text(), re.DOTALL
    )
    return "".join(f"$${each.replace('{align}', '{aligned}')}$$" for each in found)
