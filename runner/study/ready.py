"""A study made ready to run: read, changed, checked, its model loaded and its signals built, once for many runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Unpack

from qddot.runner.inputs.signal import Signal
from qddot.runner.keywords import OptionKeywords
from qddot.runner.load import Model
from qddot.runner.simulate import Simulation, prepare
from qddot.runner.solution import Solution
from qddot.runner.study import schema
from qddot.runner.study.overrides import Tree, changed
from qddot.runner.study.read import StudyError, check, read_tree
from qddot.runner.study.run import settings, study_model

#: What a study says beside how to integrate, by the names of `simulate`.
_GIVEN = ("span", "parameters", "inputs", "initial", "guess")


@dataclass(frozen=True, eq=False)
class Study:
    """A study of a file, ready to run as it stands or with some of it exchanged; `read_study` makes one.

    path: its file, for messages and for the files it names, with its `text`. tree: its tables, changed but neither
    completed from the library nor checked; tables: those, checked, with their defaults: `tables.inputs["F"].duration`.
    arguments: those of `simulate` by name, in the model's units: span, parameters, inputs, initial, guess, method and
    its options.
    """

    path: Path
    text: str
    tree: Tree
    tables: schema.Study
    model: Model
    arguments: Mapping[str, Any]

    @property
    def span(self) -> tuple[float, float]:
        """Start and end, s."""
        return self.arguments["span"]

    @property
    def inputs(self) -> Mapping[str, Signal]:
        """The signals by input name."""
        return self.arguments["inputs"]

    def changed(self, changes: Mapping[str, Any]) -> "Study":
        """The study with these values by dotted key ("parameters.m_6": 11360) in place of its own."""
        try:
            tree = changed(self.tree, changes)
        except ValueError as error:
            raise StudyError(f"{self.path}: {error}") from None
        return _ready(self.path, self.text, tree, self)

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

        method: in place of the study's, whose options go with it. step and options: in place of the study's one by one.
        span: another. inputs: signals or numbers by name, in place of the study's or beside them.
        Raises StudyError for anything that cannot be.
        """
        given = {name: value for name, value in self.arguments.items() if method is None or name in _GIVEN}
        own = {"method": method, "step": step, "span": span}
        given |= {name: value for name, value in own.items() if value is not None} | options
        given["inputs"] = {**self.inputs, **(inputs or {})}
        try:
            return prepare(self.model, **given)
        except StudyError:
            raise
        except ValueError as error:
            text = str(error)
            raise StudyError(text if text.startswith(str(self.path)) else f"{self.path}: {text}") from error

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
        return self.prepare(method=method, step=step, span=span, inputs=inputs, **options)(on_failure=on_failure)


def read_study(path: str | Path, changes: Mapping[str, Any] | None = None) -> Study:
    """A study file made ready to run, with these values by dotted key ("parameters.m_6": 11360) in place of the file's.

    Raises StudyError naming file, line and key of everything in it that cannot be.
    """
    return _ready(Path(path), *read_tree(Path(path), changes), None)


def _ready(path: Path, text: str, tree: Tree, before: Study | None) -> Study:
    """The study in these tables; before: one of the same file, whose model need not be loaded again."""
    found = check(path, text, tree)
    known = before is not None and before.tables.model == found.model
    model = before.model if before is not None and known else study_model(found, path)
    return Study(path, text, tree, found, model, settings(found, model, path))
