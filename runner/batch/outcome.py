"""What becomes of a block of runs, whichever way they go."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

#: The status of a run whose settings are refused, and of one that was not run yet.
REFUSED, NOT_RUN = 100, -1


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of a block of runs; rows of runs that were refused or left early hold NaN where there is nothing.

    samples (runs, count, n_quantities); final_states (runs, n_states); status (runs,): a Status or REFUSED;
    failed_at (runs,) s; failed_state (runs,): index or -1; steps, evaluations (runs,). refusals: row -> why a method
    refuses the run, such as a step too small for the time to advance.
    """

    samples: NDArray[np.float64]
    final_states: NDArray[np.float64]
    status: NDArray[np.int8]
    failed_at: NDArray[np.float64]
    failed_state: NDArray[np.int64]
    steps: NDArray[np.int64]
    evaluations: NDArray[np.int64]
    refusals: dict[int, str] = field(default_factory=dict)


def refused(runs: int, n_states: int, count: int, quantities: int) -> Outcome:
    """That of runs that were refused, all of them: engines write the rows of those that were not."""
    return Outcome(
        samples=np.full((runs, count, quantities), np.nan),
        final_states=np.full((runs, n_states), np.nan),
        status=np.full(runs, REFUSED, dtype=np.int8),
        failed_at=np.full(runs, np.nan),
        failed_state=np.full(runs, -1),
        steps=np.zeros(runs, dtype=np.int64),
        evaluations=np.zeros(runs, dtype=np.int64),
    )
