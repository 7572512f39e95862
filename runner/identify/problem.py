"""An identification that was read: the residuals of its observations as a function of its unknowns."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from qddot.runner.checks import unknown
from qddot.runner.identify.schema import Identification, Observation, Scenario
from qddot.runner.inputs.csv_table import samples_from_csv
from qddot.runner.inputs.tables import table_at
from qddot.runner.load import Model
from qddot.runner.metrics.reading import curve_at, reading
from qddot.runner.solution import Solution
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.explain import explained
from qddot.runner.study.overrides import Tree, changed
from qddot.runner.study.read import StudyError, naming_file, place, read_tree
from qddot.runner.study.ready import Study, ready

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Trial:
    """A scenario and its study, as it is at the start of the search.

    observed: per observation its times (n,) or None, and its values (n,).
    """

    scenario: Scenario
    study: Study
    observed: tuple[tuple[Vector | None, Vector], ...]

    def solution(self, values: Mapping[str, float]) -> Solution:
        """The run with these values by dotted key."""
        return self.study.changed(values).run()


@dataclass(frozen=True, eq=False)
class Problem:
    """Everything that is given. names, lower, upper, start: of the n unknowns, in order."""

    path: Path
    given: Identification
    trials: tuple[Trial, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return tuple(self.given.unknowns)

    def column(self, what: str) -> Vector:
        """start, lower or upper of each unknown (n,)."""
        return np.array([getattr(each, what) for each in self.given.unknowns.values()])

    @property
    def observations(self) -> tuple[tuple[Trial, Observation], ...]:
        """Every observation with its trial, in the order of the residuals."""
        return tuple((trial, each) for trial in self.trials for each in trial.scenario.observations)

    def values(self, x: Vector) -> dict[str, float]:
        """The values by dotted key that the unknowns x (n,) stand for."""
        return _by_key(self.given, x)

    def computed(self, x: Vector) -> list[Vector]:
        """What the runs say for each observation, each (1,) or (points,)."""
        found = []
        for trial in self.trials:
            solution = trial.solution(self.values(x))
            pairs = zip(trial.scenario.observations, trial.observed, strict=True)
            try:
                found += [_said(solution, each, times) for each, (times, _) in pairs]
            except ValueError as error:
                raise StudyError(f"{self.path}: scenario {trial.scenario.name!r}: {error}") from error
        return found

    def residuals(self, x: Vector) -> Vector:
        """(computed - observed) / sigma, all observations one behind the other (m,)."""
        observed = [values for trial in self.trials for _, values in trial.observed]
        sigmas = [each.sigma for _, each in self.observations]
        rows = zip(self.computed(x), observed, sigmas, strict=True)
        return np.concatenate([(mine - theirs) / sigma for mine, theirs, sigma in rows])


def _said(solution: Solution, each: Observation, times: Vector | None) -> Vector:
    """What the run says where the observation has its number (1,), or its curve at `times` (n,)."""
    if times is not None:
        return curve_at(solution, each.quantity, times, change=each.change)
    window = {"after": each.after, "before": each.before, "at": each.at}
    return np.array([reading(solution, each.quantity, each.measure, change=each.change, **window)])


def read(path: Path) -> Problem:
    """Read and check an identification. Raises StudyError naming file, line and key."""
    text, tree = read_tree(path)
    try:
        given = Identification.model_validate(tree, context={"folder": path.parent})
    except ValidationError as error:
        raise StudyError(explained(path, text, error, Identification)) from None
    return Problem(path, given, tuple(_trial(path, given, number) for number in range(len(given.scenarios))))


def _by_key(given: Identification, x: Iterable[float]) -> dict[str, float]:
    """Values of the unknowns, in order, by dotted key."""
    return {key: float(value) for each, value in zip(given.unknowns.values(), x, strict=True) for key in each.keys}


def _trial(path: Path, given: Identification, number: int) -> Trial:
    scenario = given.scenarios[number]
    file = path.parent / (scenario.study or given.study)
    text, tree = read_tree(file, scenario.set)
    _refuse_unknown_keys(path, given, tree)
    start = _by_key(given, (each.start for each in given.unknowns.values()))
    with naming_file(file):
        study = ready(file, text, changed(tree, start))
    if any(each.file for each in scenario.observations):
        units = _units(study.model)
        places = (f"scenarios.{number}.observations.{k}" for k in range(len(scenario.observations)))
        pairs = zip(scenario.observations, places, strict=True)
        read_in = tuple(_with_curve(each, key, units, Amounts(path)) for each, key in pairs)
        scenario = scenario.model_copy(update={"observations": read_in})
    return Trial(scenario, study, tuple(_observed(each) for each in scenario.observations))


def _units(model: Model) -> dict[str, str]:
    """Quantity of a solution -> its unit."""
    units = {each.name: each.unit for each in (*model.tables.states, *model.tables.outputs)}
    return units | {channel.name: channel.unit for channel in model.tables.inputs}


def _with_curve(observation: Observation, key: str, units: Mapping[str, str], amounts: Amounts) -> Observation:
    """The observation with t and values from its file, in s and in the quantity's unit."""
    if observation.file is None:
        return observation
    if observation.quantity not in units:
        raise amounts.wrong(f"{key}.quantity", unknown("quantity", observation.quantity, units))
    file, (time, value) = amounts.file(f"{key}.file", observation.file), observation.columns
    with amounts.at(f"{key}.file"):
        t, values, row = samples_from_csv(file, time, value, unit=units[observation.quantity])
        table_at(t, values, "linear", None, row)  # names a bad sample by its line
    return observation.model_copy(update={"t": tuple(t.tolist()), "values": tuple(values.tolist())})


def _observed(observation: Observation) -> tuple[Vector | None, Vector]:
    if observation.value is not None:
        return None, np.array([observation.value])
    return np.array(observation.t), np.array(observation.values)


def _refuse_unknown_keys(path: Path, given: Identification, tree: Tree) -> None:
    """A key must name something that the study has, or one of a model's own names, which the run checks."""
    for name, each in given.unknowns.items():
        for key in each.keys:
            head, *rest = key.split(".")
            tables = ("parameters", "initial", "inputs", "road")
            if head not in tables or not rest:
                raise StudyError(f"{place(path, f'unknowns.{name}.key')}: {unknown('table', head, tables)}")
            if head == "inputs" and (len(rest) < 2 or rest[0] not in tree.get("inputs", {})):
                known = [f"inputs.{channel}.KEY" for channel in tree.get("inputs", {})]
                raise StudyError(f"{place(path, f'unknowns.{name}.key')}: {unknown('input key', key, known)}")
