"""Tables of the terminal that are written at once read as those that rich draws."""

import io
import random
import re

import pytest
from rich.console import Console
from rich.table import Table

from qddot.runner.report.plain_table import PlainTable
from qddot.runner.report.tables import plain_table

#: Also what only rich can write: markup, pictures, several lines, and texts that are wider than they are long.
CELLS = ("", "x", "hull_pitch", "m/s", "-0.01234", "θ̇", "路面 4", "a mean of some length", "[b]x", "a:b:", "two\nlines")


def printed(table, **how):
    console = Console(file=io.StringIO(), emoji=False, **how)
    console.print(table)
    return console.file.getvalue()


def made(rng):
    count = rng.randint(0, 7)
    heads = (rng.choice(CELLS[1:8]) for _ in range(count))
    table = plain_table(rng.choice(["", "", "A title"]), *heads, numbers=rng.randint(0, count))
    for _ in range(rng.randint(0, 6)):
        table.add_row(*(rng.choice(CELLS[: rng.choice([8, 11])]) for _ in range(rng.randint(0, count))))
    return table


@pytest.mark.parametrize("width", [20, 80, 200])
def test_at_any_width_a_table_reads_as_the_one_that_rich_draws(width, monkeypatch):
    rng = random.Random(width)
    for number in range(60):
        table = made(rng)
        how = {"width": width, "markup": bool(number % 2), "force_terminal": number % 3 == 0}
        ours = printed(table, **how)
        with monkeypatch.context() as patch:
            patch.setattr(PlainTable, "__rich_console__", Table.__rich_console__)
            theirs = printed(table, **how)
        styles = re.compile(r"\x1b\[[\d;]*m")
        assert styles.sub("", ours) == styles.sub("", theirs)


def test_headings_are_bold_on_a_terminal():
    table = plain_table("", "quantity", "unit")
    table.add_row("x", "m")
    assert printed(table, width=40, force_terminal=True) == "\x1b[1mquantity  unit\x1b[0m\nx         m   \n"
