"""The runs of a study's sweep, each a study of its own."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from qddot.runner.study.overrides import Tree, changed
from qddot.runner.study.read import StudyError, check, naming_keys, read_tree
from qddot.runner.study.ready import Study, ready
from qddot.runner.study.sweep import Sweep, sweep_of

#: Tables that are the batch's own, not those of a run.
OWN_TABLES = ("sweep", "metrics", "outputs", "figure")


def apart(tree: Tree) -> tuple[Tree, Tree]:
    """The tables of a run, and those of the batch."""
    own = {name: tree[name] for name in OWN_TABLES if name in tree}
    return {name: value for name, value in tree.items() if name not in OWN_TABLES}, own


def sweep_in(path: Path, text: str, tree: Tree) -> Sweep:
    """The sweep in a study's tables, of which every key leads somewhere.

    The rest is not checked: it may lack what the sweep gives. Raises StudyError or, beginning with the key, ValueError.
    """
    base, own = apart(tree)
    sweep = sweep_of(check(path, text, {"model": "", "span": [0, 1], **own}).sweep)
    for i, axis in enumerate(sweep.axes):
        try:
            changed(base, {key: axis.setting(0) for key in axis.keys})
        except ValueError as error:
            raise ValueError(f"sweep.axes.{i}.key: {error}") from None
    return sweep


def row_of(path: Path, changes: Mapping[str, Any], row: int) -> Study:
    """The study of one run of the sweep in a file, counted from 0. Raises StudyError where there is no such run."""
    text, tree = read_tree(path, changes)
    with naming_keys(path, text):
        sweep = sweep_in(path, text, tree)
        if not 0 <= row < len(sweep):
            raise StudyError(f"{path}: --row {row}: the runs of the sweep are 0 to {len(sweep) - 1}")
        return ready(path, text, changed(tree, sweep.changes(row)))
