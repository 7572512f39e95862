"""`method="auto"` for a batch: once for all its runs."""

import numpy as np

from qddot.runner.auto import choose_for_many
from qddot.runner.lanes.scalar import problem_of
from qddot.runner.lanes.task import Task
from qddot.runner.lanes.way import way_of
from qddot.runner.methods import find_method
from qddot.runner.options import Options


def chosen(task: Task) -> tuple[Task, str]:
    """The same batch by the method that `auto` chooses, and why: by a run that reads most of its inputs."""
    series = task.runs and way_of(task.model, find_method("taylor"), Options())[0] == "lanes"
    by_series = (lambda: problem_of(task, _farthest(task))) if series else None
    method, options, why = choose_for_many(task.model, task.options, by_series)
    return task.by(method, options), why


def _farthest(task: Task) -> int:
    """The run that goes the farthest way through tables of its inputs."""
    span = task.arrays["t1"] - task.arrays["t0"]
    return int(np.argmax(np.abs(task.inputs.rate).sum(axis=1) * span))
