"""The events of a study as those of `simulate`."""

from typing import Any

from qddot.runner.checks import unknown
from qddot.runner.load import Model
from qddot.runner.simulate import crossing
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.schema import StudyTable

_WAYS = {"rising": 1, "falling": -1, "both": 0}


def study_events(study: StudyTable, model: Model, amounts: Amounts) -> dict[str, Any]:
    """The option `events`, levels in the model's units; nothing where the study has none."""
    units = {each.name: each.unit for each in (*model.tables.states, *model.tables.outputs)}
    found = []
    for name, event in study.events.items():
        key = f"events.{name}"
        if event.of not in units:
            raise amounts.wrong(f"{key}.of", unknown("state or output", event.of, units))
        if any(name == own.name for own in model.tables.events):
            raise amounts.wrong(key, f"the model has an event of this name; choose another than {name!r}")
        level = amounts(f"{key}.level", event.level, units[event.of])
        with amounts.at(f"{key}.terminal"):
            found.append(
                crossing(model, event.of, level, direction=_WAYS[event.direction], terminal=event.terminal, called=name)
            )
    return {"events": found} if found else {}
