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
from qddot.runner.inputs.signal import InputTable
from qddot.runner.load import Model
from qddot.runner.metrics.measure import Measure, measure, quantity_of
from qddot.runner.observe import Observer, observer
from qddot.runner.simulate import prepare
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.overrides import Tree, changed
from qddot.runner.study.read import StudyError, check, place, read_tree
from qddot.runner.study.run import settings, study_model
from qddot.runner.study.schema import Study
from qddot.runner.study.sweep import Sweep, described, sweep_of

#: Bytes of samples that a block may take, and the most runs in one.
BLOCK_BYTES, MOST_IN_BLOCK = 32 * 2**20, 128
#: A batch has at least so many blocks, if it has the runs: the cores share them evenly.
LEAST_BLOCKS = 16
#: Static states that are remembered.
REMEMBERED = 4096
#: Tables that are the batch's own, not those of a run.
OWN_TABLES = ("sweep", "metrics", "outputs", "figure")


@dataclass(frozen=True, eq=False)
class Job:
    """All that the runs of a batch have in common.

    tree: a run's study as tables, with changes of the command line; own: the tables of the batch. keep: places among
    the observer's quantities of the trajectories that are kept, one sample in `every`. block: runs in one.
    """

    path: Path
    text: str
    tree: Tree
    own: Tree
    study: Study
    model: Model
    sweep: Sweep
    sampling: Sampling
    observer: Observer
    measures: tuple[Measure, ...]
    keep: tuple[int, ...]
    every: int
    block: int
    static_states: dict[bytes, NDArray[np.float64]] = field(default_factory=dict)

    @property
    def blocks(self) -> int:
        """How many blocks there are."""
        return -(-len(self.sweep) // self.block)

    def runs(self, block: int) -> range:
        """The runs of a block."""
        return range(block * self.block, min((block + 1) * self.block, len(self.sweep)))

    def prepared(self, run: int) -> Run:
        """A run ready to be integrated. Raises StudyError or ValueError where its settings are refused."""
        study = check(self.path, self.text, changed(self.tree, self.sweep.changes(run)))
        arguments = settings(study, self.model, self.path)
        return Run(prepare(self.model, **arguments, at_rest=self._rest), arguments["inputs"])

    def _rest(
        self, model: Model, c: NDArray[np.float64], table: InputTable, t0: float, guess: Guess
    ) -> NDArray[np.float64]:
        """The static state; runs that differ only in what comes after the start share it."""
        key = c.tobytes() + resting_inputs(table, t0).tobytes() + repr(guess).encode()
        found = self.static_states.get(key)
        if found is None:
            found = rest(model, c, table, t0, guess)
            if len(self.static_states) >= REMEMBERED:
                self.static_states.clear()
            self.static_states[key] = found
        return found


def read_job(path: Path, changes: Mapping[str, Any] | None = None) -> Job:
    """The batch that a study file describes. Raises StudyError naming file, line and key of what cannot be."""
    text, tree = read_tree(path, changes)
    return job_of(path, text, tree)


def job_of(path: Path, text: str, tree: Tree) -> Job:
    """The batch in these tables; `path` and its `text` are for messages and for the files the study names."""
    try:
        return _job(path, text, tree)
    except StudyError:
        raise
    except ValueError as error:
        key, colon, rest_of_it = str(error).partition(": ")
        known = colon and key.split(".")[0] in Study.model_fields
        raise StudyError(f"{place(path, key, text)}: {rest_of_it}" if known else f"{path}: {error}") from error


def _job(path: Path, text: str, tree: Tree) -> Job:
    own = {name: tree[name] for name in OWN_TABLES if name in tree}
    base = {name: value for name, value in tree.items() if name not in OWN_TABLES}
    sweep = _sweep(check(path, text, {"model": "", "span": [0, 1], **own}), base)
    study = check(path, text, changed(base, sweep.changes(0)) | own)
    model = study_model(study, path)
    interval = study.outputs.interval
    wanted = None if interval is None else Amounts(path)("outputs.interval", interval, "s")
    sampling = sampling_of(_first_settings(study, path, model, sweep), wanted)
    requests = {name: request_of(path, name, table, model) for name, table in study.metrics.items()}
    check_outputs(study, sweep, model)
    names = dict.fromkeys([*study.outputs.keep, *(quantity_of(name, each) for name, each in requests.items())])
    watch = observer(model, tuple(names))
    return Job(
        path=path,
        text=text,
        tree=base,
        own=own,
        study=study,
        model=model,
        sweep=sweep,
        sampling=sampling,
        observer=watch,
        measures=tuple(measure(name, each, watch.quantities, sampling.times) for name, each in requests.items()),
        keep=tuple(range(len(study.outputs.keep))),
        every=study.outputs.every,
        block=_block(study.sweep.block, 8 * sampling.count * len(names), len(sweep)),
    )


def _first_settings(study: Study, path: Path, model: Model, sweep: Sweep) -> dict[str, Any]:
    try:
        return settings(study, model, path)
    except StudyError as error:
        raise StudyError(f"{error}{described(sweep, 0)}") from error


def _sweep(study: Study, base: Tree) -> Sweep:
    """The sweep, of which every key leads somewhere."""
    sweep = sweep_of(study.sweep)
    for i, axis in enumerate(sweep.axes):
        try:
            changed(base, {key: axis.setting(0) for key in axis.keys})
        except ValueError as error:
            raise ValueError(f"sweep.axes.{i}.key: {error}") from None
    return sweep


def _block(chosen: int | None, bytes_a_run: int, runs: int) -> int:
    """How many runs are in a block; it depends on the study alone, for a store is gone on with on any machine."""
    if chosen is not None and chosen < 1:
        raise ValueError(f"sweep.block: {chosen}; expected a number of runs, at least 1")
    return chosen or max(1, min(MOST_IN_BLOCK, BLOCK_BYTES // bytes_a_run, -(-runs // LEAST_BLOCKS)))
