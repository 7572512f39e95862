"""Trying the ends of a sweep before it starts."""

import numpy as np

from qddot.runner.batch.job import Job
from qddot.runner.batch.prepared import Run
from qddot.runner.study.read import StudyError
from qddot.runner.study.sweep import described


def probe(job: Job) -> Run:
    """Prepare the runs at the ends of all axes, so that a study that is wrong is refused before it starts; the first.

    Raises StudyError for words and units that cannot be; and for numbers that cannot be, where no run could start.
    """
    shape = job.sweep.shape or (1,)
    first, last = (0,) * len(shape), tuple(size - 1 for size in shape)
    ends = [tuple(last[i] if i == k else 0 for i in range(len(shape))) for k in range(len(shape))]
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
