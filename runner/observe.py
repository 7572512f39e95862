"""Chosen states, outputs, inputs and energies at given points of a run, by name."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.checks import unknown
from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.inputs.signal import InputTable, stack
from qddot.runner.load import Model
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.pointers import call_kernel, pointer
from qddot.runner.tables import Quantity

#: What the `energy` kernel writes, in its order.
ENERGIES = (
    Quantity("kinetic_energy", "J", "kinetic energy"),
    Quantity("potential_energy", "J", "potential energy"),
    Quantity("dissipated_power", "W", "dissipated power"),
    Quantity("input_power", "W", "power put in by forces and inputs"),
)


@dataclass(frozen=True)
class Observer:
    """The quantities to observe: which of [states, outputs, inputs, energies], and which kernels they need."""

    model: Model
    quantities: tuple[Quantity, ...]
    places: tuple[int, ...]
    needs_outputs: bool
    needs_energy: bool

    def __call__(
        self, t: NDArray[np.float64], states: NDArray[np.float64], table: InputTable, c: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Values (n, n_quantities) at times t (n,) and states (n, n_states); at a jump, the limit from the right."""
        tables = self.model.tables
        kernels = [self.model.kernel(name) if needed else None for name, needed in self._needs()]
        sizes = (len(tables.outputs), len(ENERGIES))
        addresses = [pointer(k, abi.VECTOR_KERNEL, "a kernel") if k is not None else 0 for k in kernels]
        values = np.empty((len(t), len(self.places)))
        places = np.array(self.places, dtype=np.int64)
        places[places >= len(observable(self.model)) - len(ENERGIES)] += len(tables.modes)  # which rows have, too
        channels = (table, reader_for(table))
        _compiled_fill()(*addresses, *sizes, *channels, t, np.ascontiguousarray(states), c, places, values)
        return values

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantities."""
        return tuple(quantity.name for quantity in self.quantities)

    @property
    def sees_states_and_outputs(self) -> bool:
        """Whether none of the quantities is an input or an energy."""
        return all(place < len(self.model.tables.states) + len(self.model.tables.outputs) for place in self.places)

    def _needs(self) -> tuple[tuple[str, bool], ...]:
        return ("outputs", self.needs_outputs), ("energy", self.needs_energy)


def observer(model: Model, names: Sequence[str]) -> Observer:
    """The observer of these states, outputs, inputs and energies. Raises ValueError with the nearest name."""
    known = observable(model)
    all_names = [quantity.name for quantity in known]
    for name in names:
        if name not in all_names:
            raise ValueError(unknown("quantity", name, all_names))
    places = tuple(all_names.index(name) for name in names)
    first, last = len(model.tables.states), len(known) - len(ENERGIES)
    return Observer(
        model=model,
        quantities=tuple(known[place] for place in places),
        places=places,
        needs_outputs=any(first <= place < first + len(model.tables.outputs) for place in places),
        needs_energy=any(place >= last for place in places),
    )


def observable(model: Model) -> tuple[Quantity, ...]:
    """States, outputs and inputs of a model, and its energies."""
    tables = model.tables
    inputs = (Quantity(channel.name, channel.unit, channel.meaning) for channel in tables.courses)
    return (*tables.states, *tables.outputs, *inputs, *ENERGIES)


def fill(outputs, energy, n_outputs, n_energies, table, reader, t, states, c, places, values):
    """Write values (n, n_places); outputs, energy: addresses of kernels, 0 where nothing of theirs is wanted."""
    n, channels = states.shape[1], len(table.first)
    row = np.zeros(n + n_outputs + channels + n_energies)
    u, y, e = np.zeros(max(1, channels)), np.zeros(max(1, n_outputs)), np.zeros(n_energies)
    for i in range(len(t)):
        evaluate(table, reader, t[i], t[i], channels, u)
        if outputs != 0:
            call_kernel(outputs, t[i], states[i], u, c, y)
        if energy != 0:
            call_kernel(energy, t[i], states[i], u, c, e)
        for k in range(n):
            row[k] = states[i, k]
        for k in range(n_outputs):
            row[n + k] = y[k]
        for k in range(channels):
            row[n + n_outputs + k] = u[k]
        for k in range(n_energies):
            row[n + n_outputs + channels + k] = e[k]
        for j in range(len(places)):
            values[i, j] = row[places[j]]


@cache
def _compiled_fill() -> Any:
    address, places = types.int64, types.Array(types.int64, 1, "C")
    table = typeof(stack([], []))
    kernels, points = (address, address, types.int64, types.int64), (abi.VECTOR, abi.MATRIX)
    signature = types.void(*kernels, table, abi.VECTOR, *points, abi.VECTOR, places, abi.MATRIX)
    return compiled(signature, nogil=True)(fill)
