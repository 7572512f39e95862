"""Signals that are a formula: a function whose arguments are numbers, each with its unit.

Such a function is all there is to say of a kind of input or road: a study's keys are its arguments, what is said of
it is its documentation.
"""

import inspect
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Annotated, Any, get_type_hints

from qddot.runner.inputs.signal import Signal

#: Numbers by their unit; `Value` is in that of the input that the signal drives.
Value = Annotated[float, ""]
Length = Annotated[float, "m"]
Angle = Annotated[float, "rad"]
Frequency = Annotated[float, "Hz"]

Formula = Callable[..., Signal]


def formulas(file: ModuleType) -> dict[str, Formula]:
    """The formulas that a file defines, by name."""
    own = {name: each for name, each in vars(file).items() if inspect.isfunction(each) and not name.startswith("_")}
    return {name: each for name, each in own.items() if each.__module__ == file.__name__ and _is_formula(each)}


def units_of(formula: Formula, own: str) -> Mapping[str, str]:
    """The unit of each argument; own: that of the input."""
    hints = get_type_hints(formula, include_extras=True)
    return {name: hints[name].__metadata__[0] or own for name in inspect.signature(formula).parameters}


def defaults_of(formula: Formula) -> Mapping[str, Any]:
    """The default of each argument, `...` for those that have none."""
    arguments = inspect.signature(formula).parameters.values()
    return {each.name: ... if each.default is inspect.Parameter.empty else each.default for each in arguments}


def _is_formula(function: Callable[..., Any]) -> bool:
    hints = get_type_hints(function, include_extras=True)
    numbers = (hasattr(hints.get(name), "__metadata__") for name in inspect.signature(function).parameters)
    return hints.get("return") is Signal and all(numbers)
