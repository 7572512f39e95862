"""Reading the tables of a generated module, and the checks that they are well formed."""

from collections.abc import Iterable, Sequence
from dataclasses import fields
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher

from qddot.runner import abi
from qddot.runner.matrices import Pattern, pattern
from qddot.runner.ranges import expanded, placed, take_turns
from qddot.runner.tables import (
    CONTACT,
    EVENT,
    IMPACT,
    REST,
    STATE,
    TIME,
    Channel,
    Constraint,
    EventRow,
    Lookup,
    Parameter,
    Quantity,
    Shape,
    Tables,
)

#: Shapes of a scene with how many numbers they have at least.
SHAPES = {"disc": 3, "bar": 5, "spring": 5, "damper": 5, "wheel": 3, "polygon": 10, "ground": 3, "arrow": 4}
MASS_MATRICES = ("constant", "diagonal", "configuration-dependent")


class LoadError(ValueError):
    """A model that cannot be loaded; the message says which, why and what to do."""


def read_tables(module: ModuleType) -> Tables:
    """The checked tables of a generated module; raises LoadError naming the table and the row."""
    if callable(getattr(module, "system", None)) and not hasattr(module, "NAME"):
        raise LoadError(
            f"{module.__file__} defines a model, and is no generated module: `qddot generate {module.__file__} "
            "--into FOLDER` writes the module to give here"
        )
    _check_edition(module)
    states, inputs = (
        _records(module, "STATE", Quantity, (str, str, str)),
        _records(module, "INPUT", Channel, (str, str, int, str, str)),
    )
    parameters = _records(module, "PARAMETER", Parameter, (str, (int, float), str, str))
    coordinates, rhs_inputs = _entry(module, "COORDINATES", int), _entry(module, "RHS_INPUTS", int)
    _check_sizes(module, len(states), coordinates, len(inputs), rhs_inputs)
    constraints, modes = _constraints(module), sum(channel.is_mode for channel in inputs)
    contacts = sum(channel.input == REST for channel in inputs)
    tables = Tables(
        name=_entry(module, "NAME", str),
        title=_entry(module, "TITLE", str),
        states=states,
        coordinates=coordinates,
        inputs=inputs,
        rhs_inputs=rhs_inputs,
        lookups=_lookups(module),
        positioned=_names(module, "POSITION") if hasattr(module, "POSITION") else (),
        outputs=_records(module, "OUTPUT", Quantity, (str, str, str)),
        parameters=parameters,
        parameter_sets=_parameter_sets(module),
        constant_names=(*(parameter.name for parameter in parameters), *_names(module, "CONSTANT")),
        linear=_entry(module, "LINEAR", bool),
        mass_matrix=_entry(module, "MASS_MATRIX", str),
        patterns=_patterns(module, len(states), coordinates, rhs_inputs, modes, constraints, contacts),
        constraints=constraints,
        projected=bool(constraints) and _entry(module, "PROJECTED", bool),
        recurrence=_entry(module, "RECURRENCE", str) if hasattr(module, "RECURRENCE") else "",
        events=_events(module),
        scene=_scene(module),
        without_recurrence=_entry(module, "WITHOUT_RECURRENCE", str) if hasattr(module, "WITHOUT_RECURRENCE") else "",
    )
    _check_names(module, tables)
    _check_channels(module, tables)
    _check_numbers(module, tables)
    _check_kernels(module, tables)
    return tables


def _fail(module: ModuleType, message: str) -> LoadError:
    return LoadError(f"{module.__file__}: {message}; generate the model again")


def _check_edition(module: ModuleType) -> None:
    found = getattr(module, "CONVENTION", 1 if hasattr(module, "NAME") else None)
    if found is not None and found != abi.EDITION:
        raise LoadError(
            f"{module.__file__} was generated for edition {found!r} of the calling convention and this is edition "
            f"{abi.EDITION}: generate it anew from its model (qddot generate)"
        )


def _constraints(module: ModuleType) -> tuple[Constraint, ...]:
    found = _records(module, "CONSTRAINT", Constraint, (str, bool, str, str)) if hasattr(module, "CONSTRAINT") else ()
    if any(late.on_positions > early.on_positions for early, late in pairwise(found)):
        raise _fail(module, "CONSTRAINT has one on velocities before one on positions")
    return found


def _events(module: ModuleType) -> tuple[EventRow, ...]:
    kinds = (str, int, bool, str, tuple, str)
    found = _records(module, "EVENT", EventRow, kinds) if hasattr(module, "EVENT") else ()
    for row in found:
        if row.kind not in (EVENT, IMPACT, CONTACT):
            raise _fail(
                module, f"EVENT {row.name} is of the kind {row.kind!r}, expected {EVENT}, {IMPACT} or {CONTACT}"
            )
    return found


def _scene(module: ModuleType) -> tuple[Shape, ...]:
    kinds = (str, str, int, bool, str)
    found = _records(module, "SCENE", Shape, kinds) if hasattr(module, "SCENE") else ()
    for i, shape in enumerate(found):
        if shape.kind not in SHAPES:
            raise _fail(module, f"SCENE[{i}] is of kind {shape.kind!r}, expected one of {', '.join(SHAPES)}")
        if shape.size - shape.conditional < SHAPES[shape.kind]:
            raise _fail(module, f"SCENE[{i}] has {shape.size} numbers, too few for a {shape.kind}")
    return found


def _patterns(
    module: ModuleType,
    states: int,
    coordinates: int,
    inputs: int,
    modes: int,
    constraints: Sequence[Constraint],
    contacts: int,
) -> dict[str, Pattern]:
    on_positions = sum(each.on_positions for each in constraints)
    shapes = {
        "jacobian": (states, states),
        "input_jacobian": (states, inputs),
        "mass": (coordinates, coordinates),
        "constraints": (coordinates + len(constraints), coordinates + 2),
        "tangent": (on_positions + len(constraints), states),
        "approach": (modes, states + 2),
        "resting_jacobian": (states, states),
        "resting_constraints": (coordinates + len(constraints) + contacts, coordinates + 2),
    }
    found: dict[str, Pattern] = {}
    absent = (() if constraints else abi.CONSTRAINED) + (() if modes else ("approach",))
    absent += () if contacts else abi.RESTING
    for name in (name for name in abi.MATRICES if name not in absent):
        try:
            found[name] = pattern(placed(_entry(module, name.upper(), tuple)), shapes[name], symmetric=name == "mass")
        except LoadError:
            raise
        except ValueError as error:
            raise _fail(module, f"{name.upper()}{'' if str(error).startswith('[') else ' '}{error}") from None
    return found


def _entry(module: ModuleType, name: str, kind: Any) -> Any:
    if not hasattr(module, name):
        raise _fail(module, f"no table {name}, so this is no generated model of this version")
    value = getattr(module, name)
    if not isinstance(value, kind):
        raise _fail(module, f"{name} is {value!r}, expected {getattr(kind, '__name__', 'a tuple')}")
    return value


def _records(module: ModuleType, name: str, record: Any, kinds: Sequence[Any]) -> tuple[Any, ...]:
    rows = _entry(module, name, (tuple, list))
    for i, row in enumerate(rows):
        if not all(_fits(each, kinds) for each in (row if take_turns(row) else (row,))):
            expected = ", ".join(each.name for each in fields(record))
            raise _fail(module, f"{name}[{i}] is {row!r}, expected ({expected})")
    return tuple(record(*row) for row in _expanded(module, name, rows))


def _fits(row: Any, kinds: Sequence[Any]) -> bool:
    return isinstance(row, tuple | list) and len(row) == len(kinds) and all(map(isinstance, row, kinds))


def _names(module: ModuleType, table: str) -> tuple[str, ...]:
    rows = _entry(module, table, (tuple, list))
    for i, row in enumerate(rows):
        if not isinstance(row, str):
            raise _fail(module, f"{table}[{i}] is {row!r}, expected a name")
    return tuple(_expanded(module, table, rows))


def _parameter_sets(module: ModuleType) -> dict[str, dict[str, float]]:
    sets = _entry(module, "PARAMETER_SETS", dict)
    return {key: dict(_expanded(module, f"PARAMETER_SETS[{key!r}]", values.items())) for key, values in sets.items()}


def _expanded(module: ModuleType, table: str, rows: Iterable[Any]) -> list[Any]:
    try:
        return expanded(rows)
    except ValueError as error:
        raise _fail(module, f"{table}: {error}") from None


def _lookups(module: ModuleType) -> tuple[Lookup, ...]:
    number = (int, float)
    return (
        _records(module, "TABLE", Lookup, (str, str, str, number, number, str, str)) if hasattr(module, "TABLE") else ()
    )


def _check_names(module: ModuleType, tables: Tables) -> None:
    seen = {"t", "time"}
    named = [each.name for each in tables.states] + [each.name for each in tables.outputs]
    for name in named + [each.name for each in tables.inputs]:
        if name in seen:
            raise _fail(module, f"the name {name!r} stands twice in STATE, INPUT and OUTPUT, or is that of time")
        seen.add(name)
    names = [parameter.name for parameter in tables.parameters]
    if len(set(names)) < len(names):
        raise _fail(module, f"PARAMETER names {max(names, key=names.count)!r} twice")
    states = [state.name for state in tables.states]
    for event in tables.events:
        if unknown_states := set(event.sets) - set(states):
            raise _fail(module, f"EVENT {event.name} sets {min(unknown_states)!r}, which is no state")
    for name in tables.positioned:
        if name not in tables.free_inputs:
            raise _fail(module, f"POSITION names {name!r}, which is no input")
    for key, overrides in tables.parameter_sets.items():
        for name in overrides:
            if name not in names:
                raise _fail(module, f"PARAMETER_SETS[{key!r}] sets {name!r}, which is no parameter")


def _check_channels(module: ModuleType, tables: Tables) -> None:
    values, places = tables.free_inputs, [(channel.input, channel.order) for channel in tables.inputs]
    for channel in tables.inputs:
        if channel.order not in (0, 1, 2):
            raise _fail(module, f"INPUT {channel.name} is of order {channel.order}, expected 0, 1 or 2")
        if channel.input in (TIME, STATE, REST) and channel.order == 0:
            continue
        if channel.input not in values or (channel.order == 0 and channel.input != channel.name):
            raise _fail(module, f"INPUT {channel.name} is {channel.what} of {channel.input!r}, which is no input")
    for channel, place in zip(tables.inputs, places, strict=True):
        if places.count(place) > 1 and channel.input not in (TIME, STATE, REST):
            raise _fail(module, f"INPUT has {channel.what} of {channel.input!r} twice")
    if len(tables.contacts) != sum(row.kind == CONTACT for row in tables.events):
        raise _fail(module, "INPUT has another number of contacts than EVENT")
    if any(channel.is_mode for channel in tables.courses):
        raise _fail(module, "INPUT has a mode before another channel")


def _check_sizes(module: ModuleType, states: int, coordinates: int, inputs: int, rhs_inputs: int) -> None:
    if not 1 <= coordinates <= states // 2:
        rows = f"STATE has {states} rows, COORDINATES is {coordinates}"
        raise _fail(module, f"{rows}: expected a coordinate or more, and in STATE as many velocities behind them")
    if not 0 <= rhs_inputs <= inputs:
        raise _fail(module, f"RHS_INPUTS is {rhs_inputs}, but INPUT has {inputs} rows")


def _check_numbers(module: ModuleType, tables: Tables) -> None:
    if tables.mass_matrix not in MASS_MATRICES:
        raise _fail(module, f"MASS_MATRIX is {tables.mass_matrix!r}, expected one of {', '.join(MASS_MATRICES)}")
    for parameter in tables.parameters:
        if not np.isfinite(parameter.default):
            raise _fail(module, f"PARAMETER {parameter.name} is {parameter.default}, expected a finite number")


def _check_kernels(module: ModuleType, tables: Tables) -> None:
    known = {
        "positions": tables.positioned,
        "switching": tables.sides,
        "modes": tables.modes,
        "approach": tables.modes,
        "events": tables.events,
        "scene": tables.scene,
    }
    absent = {name for name, rows in known.items() if not rows}
    absent |= set() if tables.constraints else set(abi.CONSTRAINED)
    absent |= set() if tables.contacts else set(abi.RESTING)
    for name, signature in abi.SIGNATURES.items():
        if name in absent:
            continue
        kernel = getattr(module, name, None)
        if not isinstance(kernel, Dispatcher):
            raise _fail(module, f"kernel {name!r} is missing or not compiled by numba")
        found, expected = kernel.py_func.__code__.co_argcount, len(signature.args)
        if found != expected:
            raise _fail(module, f"kernel {name!r} takes {found} arguments, expected {expected}")
        if kernel.targetoptions.get("error_model") != "numpy":
            raise _fail(module, f"kernel {name!r} raises at a division by zero instead of following IEEE rules")
