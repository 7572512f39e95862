"""Who uses whom in a model: what is used nowhere, too early, in a circle, or where it means nothing."""

import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING

from sympy import Symbol, sympify

from qddot.model.constraints import moving_part
from qddot.model.contents import accelerations, energies, expressions, outputs, positions, reached, symbols
from qddot.model.definitions import LoopError
from qddot.model.inertia import inertia

if TYPE_CHECKING:
    from qddot.model.system import State, System


def order(system: "System") -> Iterator[str]:
    """Quantities that use later ones, or have a rate that would need the rate of a rate."""
    later = {quantity.symbol for quantity in system.quantities}
    later |= {quantity.rate for quantity in system.quantities if quantity.rate is not None}
    for quantity in system.quantities:
        for symbol in sorted(symbols(quantity.expression) & later, key=str):
            itself = symbol in (quantity.symbol, quantity.rate)
            yield f"quantity {quantity.symbol} uses {'itself' if itself else f'{symbol}, which comes later'}"
        later -= {quantity.symbol, quantity.rate}
    yield from _second_rates(system)


def _second_rates(system: "System") -> Iterator[str]:
    """Quantities whose rate would need the rate of a rate."""
    held: dict[Symbol, set[Symbol]] = {}
    needed = {coordinate.rate: "accelerations" for coordinate in system.coordinates}
    needed |= {state.rate: f"the second derivative of {state.symbol}" for state in system.states}
    for channel in system.inputs:
        highest = next(accelerations(channel), channel.rate)
        order = "second" if highest == channel.rate else "third"
        needed[highest] = f"the {order} derivative of {channel.symbol}"
    for quantity in system.quantities:
        found = {inner for symbol in symbols(quantity.expression) for inner in held.get(symbol, {symbol})}
        held[quantity.symbol] = found
        if quantity.rate is None:
            continue
        if rates := found & needed.keys():
            rate = min(rates, key=str)
            yield f"quantity {quantity.symbol} depends on {rate}, so its rate would need {needed[rate]}"
        needed[quantity.rate] = f"the second derivative of {quantity.symbol}"


def loops(system: "System") -> Iterator[str]:
    """Rates of states that need each other."""
    try:
        _ = system.definitions
    except LoopError as error:
        yield f"{error}: an algebraic loop; solve these equations for the rates by hand"


def still_energies(system: "System") -> Iterator[str]:
    """Energies that depend on rates of states."""
    rates = {state.rate: state.symbol for state in system.states}
    for place, expression in energies(system):
        for rate in sorted(reached(system, expression) & rates.keys(), key=str):
            yield (
                f"{place} depends on {rate}, the rate of the state {rates[rate]}, and may depend on {rates[rate]} "
                f"alone; give what depends on {rate} as a generalized force"
            )


def fixed_positions(system: "System") -> Iterator[str]:
    """Positions of inputs that move."""
    fixed = {parameter.symbol for parameter in system.parameters}
    for symbol, expression in system.definitions.items():
        if symbols(expression) <= fixed:
            fixed.add(symbol)
    for place, expression in positions(system):
        for symbol in sorted(symbols(expression) - fixed, key=str):
            yield f"{place} depends on {symbol}, which moves; it may depend on parameters alone"


def unused(system: "System") -> Iterator[str]:
    """What is declared and used nowhere; a state that nothing reads is an integral for the results: a warning."""
    used = {symbol for _, expression in (*expressions(system), *outputs(system)) for symbol in symbols(expression)}
    for parameter in system.parameters:
        if parameter.symbol not in used:
            yield f"parameter {parameter.symbol} is used nowhere; remove it, or check the expressions for a slip"
    for channel in system.inputs:
        if not {channel.symbol, channel.rate, *accelerations(channel)} & used:
            yield f"input {channel.symbol} is used nowhere; remove it, or check the expressions for a slip"
    shown = {output.symbol for output in system.outputs}
    for quantity in system.quantities:
        if not {quantity.symbol, quantity.rate} & (used | shown):
            yield f"quantity {quantity.symbol} is used nowhere; remove it, or list it among the outputs"
    for state in unread(system):
        warnings.warn(
            f"model {system.name}: nothing depends on the state {state.symbol}: it is integrated for the results alone",
            stacklevel=2,
        )


def unread(system: "System") -> Iterator["State"]:
    """States that nothing depends on but their own rates."""
    held = [symbols(expression) for _, expression in (*expressions(system), *outputs(system))]
    for state in system.states:
        own = symbols(state.derivative)
        readers = sum(bool({state.symbol, state.rate} & each) for each in held)
        if readers == ({state.symbol, state.rate} & own != set()):
            yield state


def massless(system: "System") -> Iterator[str]:
    """Coordinates, and motions, without kinetic energy."""
    kinetic_energy = system.kinetic_energy
    for constraint in system.constraints:  # M + G' G is regular where M is on what the constraints allow
        kinetic_energy += moving_part(system, constraint) ** 2
    used = reached(system, kinetic_energy)
    velocities = [coordinate.rate for coordinate in system.coordinates]
    if not reached(system, system.kinetic_energy).intersection(velocities):
        yield f"the kinetic energy depends on no velocity ({', '.join(sorted(map(str, velocities)))})"
        return
    missing = [coordinate for coordinate in system.coordinates if coordinate.rate not in used]
    for coordinate in missing:
        yield (
            f"coordinate {coordinate.symbol} has no inertia: the kinetic energy does not depend on {coordinate.rate}, "
            f"{'and no constraint acts on it, ' if system.constraints else ''}so the mass matrix is singular"
        )
    if missing:
        return
    defaults = {parameter.symbol: float(parameter.default) for parameter in system.parameters}
    quantities = {symbol: expression for symbol, expression in system.definitions.items() if symbol in used}
    found = inertia(sympify(kinetic_energy), velocities, quantities, defaults)
    if found.massless:
        names = ", ".join(str(system.coordinates[k].symbol) for k in found.massless)
        together = " together" if len(found.massless) > 1 else ""
        together += ", which the constraints allow," if system.constraints else ""
        what = "the mass matrix is singular" if found.singular else "the kinetic energy is not positive"
        yield f"{what}: a motion of {names}{together} has no kinetic energy"
    elif not found.is_known:
        warnings.warn(
            f"model {system.name}: the kinetic energy has no real value near the default parameters, nor at the other "
            "points that were tried; whether the mass matrix can be inverted is not known",
            stacklevel=2,
        )
