"""One run of a study's sweep as a study of its own."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from qddot.runner.study.overrides import changed
from qddot.runner.study.read import StudyError, check, read, read_tree
from qddot.runner.study.schema import Study
from qddot.runner.study.sweep import sweep_of


def row_of(path: Path, changes: Mapping[str, Any], row: int) -> Study:
    """The study of one run of the sweep in a file, counted from 0. Raises StudyError where there is no such run."""
    text, tree = read_tree(path, changes)
    sweep = sweep_of(read(path, changes).sweep)
    if not 0 <= row < len(sweep):
        raise StudyError(f"{path}: --row {row}: the runs of the sweep are 0 to {len(sweep) - 1}")
    return check(path, text, changed(tree, sweep.changes(row)))
