"""Trying the ends of a sweep before it starts."""

from collections.abc import Iterator

import numpy as np

from qddot.runner.batch.job import Job
from qddot.runner.batch.prepared import Run
from qddot.runner.study.read import StudyError
from qddot.runner.study.sweep import described


def probe(job: Job) -> Run:
    """Prepare the runs at the ends of all axes, so that a study that is wrong is refused before it starts; the first.

    Of axes over methods all values are tried, for each takes options of its own.

    Raises StudyError for words and units that cannot be; and for numbers that cannot be, where no run could start.
    """
    shape = job.sweep.shape or (1,)
    first, last = (0,) * len(shape), tuple(size - 1 for size in shape)
    ends = [tuple(last[i] if i == k else 0 for i in range(len(shape))) for k in range(len(shape))]
    ends += [tuple(j if i == k else 0 for i in range(len(shape))) for k in _of_methods(job) for j in range(shape[k])]
    started: list[Run] = []
    refused: list[str] = []
    for corner in dict.fromkeys([first, last, *ends]):
        run = int(np.ravel_multi_index(corner, shape))
        try:
            started.append(job.prepared(run))
        except StudyError as error:
            raise StudyError(f"{error}{described(job.sweep, run)}") from error
        except ValueError as error:
            refused.append(f"{job.path}: {error}{described(job.sweep, run)}")
    if not started:
        raise StudyError(refused[0])
    return started[0]


def _of_methods(job: Job) -> Iterator[int]:
    """The groups of axes that exchange the method."""
    for place, (members, _) in enumerate(job.sweep.groups):
        keys = [key for member in members for key in job.sweep.axes[member].keys]
        if "integration" in keys or "integration.method" in keys:
            yield place
