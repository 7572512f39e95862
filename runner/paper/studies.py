"""Studies of the paper as cases that are run again and again with other methods, inputs and values."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from qddot.runner.equilibrium import Guess
from qddot.runner.identify.measure import measured
from qddot.runner.identify.schema import Observation
from qddot.runner.inputs.signal import Signal
from qddot.runner.load import Model, Parameters
from qddot.runner.paper.schema import Run
from qddot.runner.simulate import simulate
from qddot.runner.solution import Solution
from qddot.runner.study.read import read
from qddot.runner.study.run import run_study, settings, study_model


@dataclass(frozen=True)
class Studies:
    """The studies of a folder by their file names; parameter_set: taken by all of them in place of their own."""

    folder: Path
    parameter_set: str | None = None

    def path(self, name: str) -> Path:
        """The file of a study."""
        return self.folder / name

    def case(self, name: str, changes: Mapping[str, Any] | None = None) -> "Case":
        """The case of a study with these values by dotted key in place of its own."""
        return case(self.path(name), self._changed(changes))

    def number(self, given: Run) -> float:
        """What a claim takes of a run of its study."""
        solution = run_study(self.path(given.study), changes=self._changed(given.set))
        said = given.model_dump(exclude={"study", "set"})
        return float(measured(solution, Observation(**said, value=0.0, sigma=1.0), None)[0])

    def vehicle(self, name: str) -> str | None:
        """The parameter set that a study runs with."""
        return self.parameter_set or read(self.path(name)).parameter_set

    def _changed(self, changes: Mapping[str, Any] | None) -> dict[str, Any]:
        own = {} if self.parameter_set is None else {"parameter_set": self.parameter_set}
        return {**own, **(changes or {})}


@dataclass(frozen=True, eq=False)
class Case:
    """A study's model, span, parameters, inputs and start, for runs that choose the rest themselves."""

    model: Model
    span: tuple[float, float]
    parameters: Parameters
    inputs: Mapping[str, Signal]
    initial: Any
    guess: Guess

    def run(
        self,
        method: str,
        options: Mapping[str, Any],
        inputs: Mapping[str, Signal | float] | None = None,
        span: tuple[float, float] | None = None,
    ) -> Solution:
        """A run by this method, with some inputs exchanged and perhaps another span."""
        return simulate(
            self.model,
            span or self.span,
            method=method,
            parameters=self.parameters,
            inputs={**self.inputs, **(inputs or {})},
            initial=self.initial,
            guess=self.guess,
            **options,
        )


def case(path: Path, changes: Mapping[str, Any] | None = None) -> Case:
    """The case of a study file with these values by dotted key in place of its own."""
    study = read(path, changes)
    model = study_model(study, path)
    found = settings(study, model, path)
    return Case(model, *(found[name] for name in ("span", "parameters", "inputs", "initial", "guess")))
