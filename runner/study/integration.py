"""The integration of a study as arguments of `simulate`: the method, and those options that stand for it."""

from typing import Any

from qddot.runner.checks import shown
from qddot.runner.methods import Method, find_method
from qddot.runner.options import CONTROLLED, SPACED, TABLE, TIMES
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.schema import Integration
from qddot.runner.takers import misfit, taken

#: Family of methods -> the table below [integration] that its methods read, too.
TABLE_OF = dict.fromkeys(SPACED, "fixed") | dict.fromkeys(CONTROLLED, "adaptive")


def integration_arguments(given: Integration, amounts: Amounts) -> dict[str, Any]:
    """The study's method and its options: those of [integration] and those of the table of the method's family.

    Raises StudyError for a method that there is not, for an option that it does not take, and for one given twice.
    """
    with amounts.at("integration.method"):
        method = find_method(given.method)
    own = _options("integration", given, method, amounts)
    shared = family_options(given, method, amounts)
    for name in own.keys() & shared.keys():
        key = f"integration.{TABLE_OF[method.family]}.{name}"
        raise amounts.wrong(key, f"integration.{name} is given, too; give one of them")
    return {"method": method.name} | own | shared


def family_options(given: Integration, method: Method, amounts: Amounts) -> dict[str, Any]:
    """The options in the table of a method's family, which count whatever method the study names."""
    table = TABLE_OF[method.family]
    return _options(f"integration.{table}", getattr(given, table), method, amounts)


def told(given: Integration) -> list[str]:
    """What a study says of its integration, a line a table: "integration: rk4, step = '1 ms'"."""
    lines = [f"integration: {', '.join([given.method, *_listed(given)])}"]
    for table, whose in (("fixed", "methods of constant step, and exact"), ("adaptive", "methods of variable step")):
        if said := _listed(getattr(given, table)):
            lines.append(f"{whose}: {', '.join(said)}")
    return lines


def _options(key: str, table: Any, method: Method, amounts: Amounts) -> dict[str, Any]:
    """The options that are given in a table, times in s; StudyError for one that the method does not take."""
    takes = [name for name in taken(method) if TABLE[name].study]
    for name in _given(table):
        if name not in takes:
            raise amounts.wrong(f"{key}.{name}", misfit(method, takes, name, _elsewhere(table, method, name)))
    return {
        name: _in_seconds(f"{key}.{name}", value, amounts) if name in TIMES else value
        for name, value in _given(table).items()
    }


def _elsewhere(table: Any, method: Method, name: str) -> str:
    """Where an option of [integration] may stand instead: in the table of the families that the method is not of."""
    other = "adaptive" if TABLE_OF[method.family] == "fixed" else "fixed"
    movable = isinstance(table, Integration) and name in type(getattr(table, other)).model_fields
    return f"put it under [integration.{other}]" if movable else ""


def _in_seconds(key: str, value: Any, amounts: Amounts) -> Any:
    return [amounts(key, each, "s") for each in value] if isinstance(value, tuple) else amounts(key, value, "s")


def _given(table: Any) -> dict[str, Any]:
    values = {name: getattr(table, name, None) for name in TABLE}
    return {name: value for name, value in values.items() if value is not None}


def _listed(table: Any) -> list[str]:
    return [f"{name} = {shown(value)}" for name, value in _given(table).items()]
