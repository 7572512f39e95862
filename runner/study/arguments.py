"""From the words of a study to arguments of `simulate`: numbers in the model's units, signals, options."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from qddot.runner.checks import unknown
from qddot.runner.equilibrium import still
from qddot.runner.files import named_code
from qddot.runner.load import Model, load_for
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.base import Amount
from qddot.runner.study.events import study_events
from qddot.runner.study.integration import integration_arguments
from qddot.runner.study.memory import Memory
from qddot.runner.study.read import StudyError, place
from qddot.runner.study.schema import StudyTable
from qddot.runner.study.signals import study_signals


def settings(study: StudyTable, model: Model, path: Path, memory: Memory | None = None) -> dict[str, Any]:
    """The study's words as arguments of `simulate`: numbers in the model's units, signals, options.

    memory: of a study of which this is a change, whose signals and options will do where they are the same.
    """
    amounts, memory = Amounts(path), memory or Memory()
    parameters = study_parameters(study, model, amounts)
    return {
        "span": _span(study, amounts),
        "parameters": parameters,
        "inputs": study_signals(study, model, model.parameter_values(parameters), path, memory),
        "initial": None if study.initial == "equilibrium" else _initial(study.initial, model, amounts),
        "guess": _guess(study, model, amounts),
        **study_events(study, model, amounts),
        **memory(("options", study.integration), lambda: integration_arguments(study.integration, amounts)),
    }


def _span(study: StudyTable, amounts: Amounts) -> tuple[float, float]:
    t0, t1 = (amounts("span", t, "s") for t in study.span)
    if not t0 < t1:
        raise amounts.wrong("span", f"from {t0:g} to {t1:g} s; expected a start before the end")
    return t0, t1


def study_model(study: StudyTable, path: Path) -> Model:
    """The study's model; a generated module named by a path lies below the study's folder, see `named_code`."""
    own = study.model.endswith(".py") or "/" in study.model
    try:
        return load_for(path.parent, named_code(path.parent, study.model) if own else study.model)
    except ValueError as error:
        raise StudyError(f"{place(path, 'model')}: {error}") from error


def study_parameters(study: StudyTable, model: Model, amounts: Amounts) -> tuple[str | None, dict[str, float]]:
    """The study's parameter set and its own values, in the model's units: the `parameters` of `simulate`."""
    units = {parameter.name: parameter.unit for parameter in model.tables.parameters}
    return study.parameter_set, _named("parameters", "parameter", study.parameters, units, amounts)


def _initial(values: Mapping[str, Amount], model: Model, amounts: Amounts) -> dict[str, float]:
    return _named("initial", "state", values, {state.name: state.unit for state in model.tables.states}, amounts)


def _guess(study: StudyTable, model: Model, amounts: Amounts) -> dict[str, float] | None:
    """Where the search starts: for the static state, or for a state that fulfils the constraints."""
    if study.assemble:
        if not model.tables.constraints or study.initial == "equilibrium":
            why = "the model has no constraints" if study.initial != "equilibrium" else "the study gives no [initial]"
            raise amounts.wrong("assemble", f"{why}, so that no states are sought; leave it out")
        units = {state.name: state.unit for state in model.tables.states}
        return _named("assemble", "state", study.assemble, units, amounts)
    if not study.equilibrium_guess:
        return None
    if study.initial != "equilibrium":
        raise amounts.wrong(
            "equilibrium_guess", "the study gives [initial], so no equilibrium is sought; leave one out"
        )
    sought = [model.tables.states[i] for i in still(model)[0]]
    units = {state.name: state.unit for state in sought}
    return _named("equilibrium_guess", "coordinate", study.equilibrium_guess, units, amounts)


def _named(
    table: str, kind: str, values: Mapping[str, Amount], units: Mapping[str, str], amounts: Amounts
) -> dict[str, float]:
    for name in values:
        if name not in units:
            raise amounts.wrong(f"{table}.{name}", unknown(kind, name, units))
    return {name: amounts(f"{table}.{name}", value, units[name]) for name, value in values.items()}
