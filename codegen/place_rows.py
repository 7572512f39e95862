"""The places of a matrix as rows of a table, those that count together as one text:

    (0, 1), (1, 2), (2, 3), ... -> "{0..98}: {0..98} {1..99}"

`runner.ranges` reads them.
"""

from collections.abc import Sequence
from typing import Any

from qddot.codegen.cells import Signature, runs
from qddot.codegen.ranges import counting


def place_rows(rows: Sequence[tuple[int, ...]]) -> tuple[Any, ...]:
    """The columns of each row; of rows that repeat a text of their ranges, that of the row first."""
    signed = [Signature(len(columns), (row, *columns)) for row, columns in enumerate(rows)]
    found: list[Any] = []
    at = 0
    for run in runs(signed):
        found += rows[at : run.first]
        for signature, steps in zip(signed[run.first :], run.steps, strict=False):
            row, *columns = (counting(*each, run.count) for each in zip(signature.leaves, steps, strict=True))
            found.append(" ".join((f"{row}:", *columns)))
        at = run.behind
    return (*found, *rows[at:])
