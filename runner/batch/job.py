"""A batch made ready: the study checked, its runs prepared one by one when their block comes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.batch.prepared import Run
from qddot.runner.batch.sampling import Sampling, sampling_of
from qddot.runner.batch.wanted import check_outputs, request_of
from qddot.runner.equilibrium import Guess, rest, resting_inputs
from qddot.runner.inputs.piece import InputTable
from qddot.runner.load import Model
from qddot.runner.metrics.measure import Measure, measure, quantity_of
from qddot.runner.observe import Observer, observer
from qddot.runner.simulate import prepare
from qddot.runner.study import ready
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.memory import Memory
from qddot.runner.study.overrides import Tree, changed
from qddot.runner.study.read import StudyError, check, naming_keys, read_tree
from qddot.runner.study.rows import apart, sweep_in
from qddot.runner.study.schema import StudyTable
from qddot.runner.study.sweep import Sweep, described

#: Bytes of samples that a block may take, and the most runs in one.
BLOCK_BYTES, MOST_IN_BLOCK = 32 * 2**20, 128
#: A batch has at least so many blocks, if it has the runs: the cores share them evenly.
LEAST_BLOCKS = 16
#: Static states that are remembered.
REMEMBERED = 4096


@dataclass(frozen=True, eq=False)
class Job:
    """All that the runs of a batch have in common.

    tree: a run's study as tables, with changes of the command line; own: the tables of the batch; study: all of them,
    with the settings of the first run. first: that run, of which the others are changes. keep: places among the
    observer's quantities of the trajectories that are kept, one sample in `every`. block: runs in one.
    """

    tree: Tree
    own: Tree
    study: StudyTable
    first: ready.Study
    sweep: Sweep
    sampling: Sampling
    observer: Observer
    measures: tuple[Measure, ...]
    keep: tuple[int, ...]
    every: int
    block: int
    static_states: Memory = field(default_factory=lambda: Memory(REMEMBERED))

    @property
    def path(self) -> Path:
        """The study's file."""
        return self.first.path

    @property
    def text(self) -> str:
        """What stands in it."""
        return self.first.text

    @property
    def model(self) -> Model:
        """The model of all runs."""
        return self.first.model

    @property
    def blocks(self) -> int:
        """How many blocks there are."""
        return -(-len(self.sweep) // self.block)

    def runs(self, block: int) -> range:
        """The runs of a block."""
        return range(block * self.block, min((block + 1) * self.block, len(self.sweep)))

    def prepared(self, run: int) -> Run:
        """A run ready to be integrated. Raises StudyError or ValueError where its settings are refused."""
        first = self.first
        study = ready.ready(first.path, first.text, changed(first.tree, self.sweep.changes(run)), first)
        return Run(prepare(study.model, **study.arguments, at_rest=self._rest), study.inputs)

    def _rest(
        self, model: Model, c: NDArray[np.float64], table: InputTable, t0: float, guess: Guess
    ) -> NDArray[np.float64]:
        """The static state; runs that differ only in what comes after the start share it."""
        key = c.tobytes() + resting_inputs(table, t0).tobytes() + repr(guess).encode()
        return self.static_states(key, lambda: rest(model, c, table, t0, guess))


def read_job(path: Path, changes: Mapping[str, Any] | None = None) -> Job:
    """The batch that a study file describes. Raises StudyError naming file, line and key of what cannot be."""
    text, tree = read_tree(path, changes)
    return job_of(path, text, tree)


def job_of(path: Path, text: str, tree: Tree, model: Model | None = None) -> Job:
    """The batch in these tables; `path` and its `text` are for messages and for the files the study names.

    model: that of the study, where it is loaded already.
    """
    with naming_keys(path, text):
        return _job(path, text, tree, model)


def _job(path: Path, text: str, tree: Tree, model: Model | None) -> Job:
    base, own = apart(tree)
    sweep = sweep_in(path, text, tree)
    settings = changed(base, sweep.changes(0))
    study, first = check(path, text, settings | own), ready.ready(path, text, settings, model=model)
    model = first.model
    interval = study.outputs.interval
    wanted = None if interval is None else Amounts(path)("outputs.interval", interval, "s")
    arguments = _arguments(first, sweep)
    _check_saving(arguments)
    sampling = sampling_of(arguments, wanted)
    requests = {name: request_of(path, name, table, model) for name, table in study.metrics.items()}
    check_outputs(study, sweep, model)
    names = dict.fromkeys([*study.outputs.keep, *(quantity_of(name, each) for name, each in requests.items())])
    watch = observer(model, tuple(names))
    return Job(
        tree=base,
        own=own,
        study=study,
        first=first,
        sweep=sweep,
        sampling=sampling,
        observer=watch,
        measures=tuple(measure(name, each, watch.quantities, sampling.times) for name, each in requests.items()),
        keep=tuple(range(len(study.outputs.keep))),
        every=study.outputs.every,
        block=_block(study.sweep.block, 8 * sampling.count * len(names), len(sweep)),
    )


def _arguments(first: ready.Study, sweep: Sweep) -> Mapping[str, Any]:
    try:
        return first.arguments
    except StudyError as error:
        raise StudyError(f"{error}{described(sweep, 0)}") from error


def _check_saving(arguments: Mapping[str, Any]) -> None:
    """Options of a single run that say what to save, and would say nothing here; `every` spaces the samples."""
    for name in ("output_times", "refine"):
        if arguments.get(name) is not None:
            raise ValueError(
                f"integration.{name}: a batch samples its runs evenly; leave it out, and give outputs.interval"
            )


def _block(chosen: int | None, bytes_a_run: int, runs: int) -> int:
    """How many runs are in a block; it depends on the study alone, for a store is gone on with on any machine."""
    if chosen is not None and chosen < 1:
        raise ValueError(f"sweep.block: {chosen}; expected a number of runs, at least 1")
    return chosen or max(1, min(MOST_IN_BLOCK, BLOCK_BYTES // bytes_a_run, -(-runs // LEAST_BLOCKS)))
