"""Integrating a block of runs and sampling them: the one place that knows how runs are advanced."""

from collections.abc import Hashable, Sequence
from typing import Protocol

from qddot.runner.batch.alone import alone
from qddot.runner.batch.outcome import Outcome, refused
from qddot.runner.batch.prepared import Run
from qddot.runner.batch.sampling import Sampling
from qddot.runner.batch.together import alike, together
from qddot.runner.lanes.way import Way, way_of
from qddot.runner.observe import Observer


class Engine(Protocol):
    """Integrates runs that are alike, as pairs (row, run), on the calling thread, and leaves each in its row."""

    def __call__(
        self, runs: Sequence[tuple[int, Run]], observer: Observer, sampling: Sampling, outcome: Outcome, /
    ) -> None:
        """Raises nothing for a run that is refused: why stands in the outcome."""


ENGINES: dict[Way, Engine] = {"lanes": together, "exact": together, "alone": alone}


def run_block(runs: Sequence[Run | None], observer: Observer, sampling: Sampling) -> Outcome:
    """Integrate the runs of a block, None where the settings were refused; releases the interpreter's lock.

    Runs of one method and its options go together, in lanes or exactly, where the method and the model do, the others
    one by one. Lanes round otherwise than a run alone.
    """
    outcome = refused(len(runs), len(observer.model.state_names), sampling.count, len(observer.places))
    groups: dict[tuple[Way, Hashable], list[tuple[int, Run]]] = {}
    for row, run in enumerate(runs):
        if run is not None:
            way, _ = way_of(observer.model, run.simulation.method, run.simulation.options)
            groups.setdefault((way, None if way == "alone" else alike(run)), []).append((row, run))
    for (way, _), members in groups.items():
        ENGINES[way](members, observer, sampling, outcome)
    return outcome
