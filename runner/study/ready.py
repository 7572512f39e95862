"""A study made ready to run: read, changed, checked, its model loaded and its signals built, once for many runs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Unpack

from qddot.runner.inputs.signal import Signal
from qddot.runner.keywords import OptionKeywords
from qddot.runner.load import Model
from qddot.runner.methods import find_method
from qddot.runner.simulate import Simulation, prepare
from qddot.runner.solution import Solution
from qddot.runner.study import schema
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.arguments import settings, study_model
from qddot.runner.study.integration import family_options
from qddot.runner.study.library import Entry, entries, folders
from qddot.runner.study.memory import Memory
from qddot.runner.study.overrides import Tree, changed
from qddot.runner.study.read import check, naming_file, read_tree

#: What a study says beside how to integrate, by the names of `simulate`.
_GIVEN = ("span", "parameters", "inputs", "initial", "guess", "events")
#: Options of which one says what to save.
_SAVING = ("output_times", "every", "refine")


@dataclass(frozen=True, eq=False)
class Study:
    """A study of a file, ready to run as it stands or with some of it exchanged; `read_study` makes one.

    path: its file, for messages and for the files it names, with its `text`. tree: its tables, changed but neither
    completed from the library nor checked; tables: those, checked, with their defaults: `tables.inputs["F"].duration`.
    memory: what changes of a study share.
    """

    path: Path
    text: str
    tree: Tree
    tables: schema.StudyTable
    model: Model
    memory: Memory = field(default_factory=Memory, repr=False)

    def __repr__(self) -> str:
        """Its file and its model."""
        return f"<Study {self.path} of {self.model.name}>"

    @cached_property
    def arguments(self) -> Mapping[str, Any]:
        """Those of `simulate` by name, in the model's units: span, parameters, inputs, initial, guess, method, options.

        Raises StudyError for words, and StudyError or ValueError for numbers, that cannot be.
        """
        return settings(self.tables, self.model, self.path, self.memory)

    @property
    def span(self) -> tuple[float, float]:
        """Start and end, s."""
        return self.arguments["span"]

    @property
    def inputs(self) -> Mapping[str, Signal]:
        """The signals by input name."""
        return self.arguments["inputs"]

    def changed(self, changes: Mapping[str, Any]) -> "Study":
        """The study with these values by dotted key ("parameters.m_6": 11360) in place of its own.

        What stays (model, signals, the library) is neither read nor made again. Raises StudyError.
        """
        with naming_file(self.path):
            return _whole(ready(self.path, self.text, changed(self.tree, changes), self))

    def prepare(
        self,
        *,
        method: str | None = None,
        step: float | None = None,
        span: tuple[float, float] | None = None,
        inputs: Mapping[str, Signal | float] | None = None,
        **options: Unpack[OptionKeywords],
    ) -> Simulation:
        """The run, ready to be called as often as wanted.

        method: in place of the study's, whose options go with it, but for those of [integration.fixed] and
        [integration.adaptive], of which the method reads its own. step and options: in place of the study's one by
        one; output_times, every and refine, which say what to save, in place of each other, too. span: another.
        inputs: signals or numbers by name, in place of the study's or beside them.
        Raises StudyError for anything that cannot be.
        """
        given = {name: value for name, value in self.arguments.items() if method is None or name in _GIVEN}
        with naming_file(self.path):
            if method is not None:
                given |= family_options(self.tables.integration, find_method(method), Amounts(self.path))
            if any(options.get(name) is not None for name in _SAVING):
                given = {name: value for name, value in given.items() if name not in _SAVING}
            own = {"method": method, "step": step, "span": span}
            given |= {name: value for name, value in own.items() if value is not None} | options
            given["inputs"] = {**self.inputs, **(inputs or {})}
            return prepare(self.model, **given)

    def run(
        self,
        *,
        method: str | None = None,
        step: float | None = None,
        span: tuple[float, float] | None = None,
        inputs: Mapping[str, Signal | float] | None = None,
        on_failure: str = "raise",
        **options: Unpack[OptionKeywords],
    ) -> Solution:
        """Run it; arguments as of `prepare`. Raises IntegrationError where it fails, unless on_failure is "return"."""
        ready_run = self.prepare(method=method, step=step, span=span, inputs=inputs, **options)
        with naming_file(self.path):
            return ready_run(on_failure=on_failure)


def run_study(
    path: str | Path,
    progress: Callable[[float], None] | None = None,
    on_failure: str = "raise",
    changes: Mapping[str, Any] | None = None,
) -> Solution:
    """Run a study file, with these values by dotted key ("parameters.m_6": 11360) in place of the file's.

    Raises StudyError for anything in the file that cannot be, and IntegrationError where the run fails on its way,
    unless on_failure is "return".
    """
    return read_study(path, changes).run(progress=progress, on_failure=on_failure)


def read_study(path: str | Path, changes: Mapping[str, Any] | None = None) -> Study:
    """A study file made ready to run, with these values by dotted key ("parameters.m_6": 11360) in place of the file's.

    Raises StudyError naming file, line and key of everything in it that cannot be.
    """
    with naming_file(Path(path)):
        return _whole(ready(Path(path), *read_tree(Path(path), changes)))


def _whole(study: Study) -> Study:
    """The study, with its words made numbers and signals at once."""
    study.arguments.keys()
    return study


def ready(path: Path, text: str, tree: Tree, before: Study | None = None, model: Model | None = None) -> Study:
    """The study in these tables, its words not yet numbers; before: one of which it is a change, and shares with it.

    model: that of the study, where it is loaded already.
    Raises StudyError for tables that cannot be.
    """
    memory = Memory() if before is None else before.memory

    def library() -> Mapping[str, Entry]:
        return memory("library", lambda: entries(*folders(path)))

    tables = check(path, text, tree, library)
    if before is None:
        return Study(path, text, tree, tables, model or study_model(tables, path), memory)
    if tables.model != before.tables.model:  # whose inputs are others
        return Study(path, text, tree, tables, study_model(tables, path))
    return Study(path, text, tree, tables, before.model, memory)
