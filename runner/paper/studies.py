"""Studies of the paper as cases that are run again and again with other methods, inputs and values."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from runner.identify.measure import measured
from runner.identify.schema import Observation
from runner.inputs.signal import Signal
from runner.load import Model, Parameters
from runner.paper.schema import Run
from runner.simulate import simulate
from runner.solution import Solution
from runner.study.read import read
from runner.study.run import run_study, settings, study_model


@dataclass(frozen=True, eq=False)
class Case:
    """A study's model, span, parameters, inputs and start, for runs that choose the rest themselves."""

    model: Model
    span: tuple[float, float]
    parameters: Parameters
    inputs: Mapping[str, Signal]
    initial: Any

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
            **options,
        )


def case(path: Path, changes: Mapping[str, Any] | None = None) -> Case:
    """The case of a study file with these values by dotted key in place of its own."""
    study = read(path, changes)
    model = study_model(study, path)
    found = settings(study, model, path)
    return Case(model, *(found[name] for name in ("span", "parameters", "inputs", "initial")))


def number(folder: Path, given: Run) -> float:
    """What a claim takes of a run of its study."""
    solution = run_study(folder / given.study, changes=given.set)
    said = given.model_dump(exclude={"study", "set"})
    return float(measured(solution, Observation(**said, value=0.0, sigma=1.0), None)[0])
