"""Kinds of inputs and roads that are a formula: a table of a study made of the function's arguments."""

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import create_model

from qddot.runner.inputs.formulas import Formula, defaults_of
from qddot.runner.study.base import Amount, Table


def tables_of(formulas: Mapping[str, Formula], base: type[Table]) -> tuple[type[Table], ...]:
    """A table for each formula: its kind is the name, its keys are the arguments and those of `base`."""
    return tuple(_table(name, formula, base) for name, formula in formulas.items())


def _table(name: str, formula: Formula, base: type[Table]) -> type[Table]:
    keys: Any = {key: (Amount, default) for key, default in defaults_of(formula).items()}
    keys["kind"] = (Literal[name], ...)
    called = f"{name}_{base.__name__}".title().replace("_", "")
    said = (formula.__doc__ or "").partition("\n")[0]
    return create_model(called, __base__=base, __doc__=said, **keys)
