"""What an integrator is given and what it gives back; the same for every family of methods."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.piece import InputTable
from qddot.runner.matrices import PlacedKernel
from qddot.runner.tables import EventRow

#: The end of a run that only an event ends, in s from its start.
FOREVER = 1e100
#: The longest first step of such a run, s, or relative to its start.
FIRST_OF_FOREVER = 1e-3
Made = TypeVar("Made")


def unchecked(kind: type[Made], values: dict[str, Any]) -> Made:
    """A frozen dataclass of these values, others being plain defaults, in a fraction of the time its initializer takes.

    For what each run makes: nothing is checked, nor done after it, and the values are kept as they are.
    """
    made = object.__new__(kind)
    object.__setattr__(made, "__dict__", values)
    return made


#: What a problem has of a model's kernels.
KERNELS = ("rhs", "jacobian", "input_jacobian", "recurrences", "held", "acting", "switching", "approach")


class Status(IntEnum):
    """How a run ended. Drivers return these as integers; RUNNING means call again."""

    RUNNING = 0
    FINISHED = 1
    TERMINATED = 2  # by a terminal event
    NON_FINITE = 3  # a state became NaN, infinite or larger than the divergence limit
    STEP_UNDERFLOW = 4
    NEWTON_FAILURE = 5
    TOO_MANY_STEPS = 6
    TIME_LIMIT = 7
    INTERRUPTED = 8  # Ctrl-C
    NOT_STARTED = 9  # no static state to start from
    NO_EVENT = 10  # that would have ended a run without an end of its own
    PILED_UP = 11  # events that act come closer and closer in time

    __hash__ = int.__hash__  # an enumeration's own is Python's, and ten times as slow


@dataclass(frozen=True)
class Statistics:
    """Counts as MATLAB prints them."""

    steps: int = 0
    failed_attempts: int = 0
    evaluations: int = 0
    jacobians: int = 0
    factorizations: int = 0
    linear_solves: int = 0
    wall_time: float = 0.0


@dataclass(frozen=True, eq=False)
class Held:
    """Constraints on which a state is kept: their kernel, numbers of coordinates, of constraints, and on positions."""

    kernel: PlacedKernel
    coordinates: int
    constraints: int
    positions: int


@dataclass(frozen=True, eq=False)
class Resting:
    """What a problem has while contacts rest, in place of its own: kernels, and the gaps among what it is kept on."""

    rhs: Any
    jacobian: PlacedKernel | None
    events: Any
    held: Held | None


@dataclass(frozen=True, eq=False)
class Acting:
    """Events that act: the kernel events(t, x, u, c, v), v (count,), rows that say what they are, and the kernel rhs.

    places: of each event the states that it sets; first: where the values for them stand in v, of an impact what its
    impulse follows from (see `abi`). channels (n_events,): where the inputs say that a contact rests, -1 of all else.
    inertia: the kernel `mass`, or `constraints`; resting: gives what takes over while contacts rest.
    """

    kernel: Any
    rhs: Any
    count: int
    rows: tuple[EventRow, ...]
    places: tuple[tuple[int, ...], ...]
    first: tuple[int, ...]
    channels: NDArray[np.int64]
    inertia: PlacedKernel
    resting: Callable[[], Resting]


@dataclass(frozen=True, eq=False)
class Problem:
    """x' = rhs(t, x, u(t), c) from t0 to t1, kernels of the calling convention (see `abi`).

    initial_state (n_states,), constants (n_constants,), inputs: the channels rhs reads, at least `n_inputs` of them.
    mass_matrix (n_states, n_states): where given, mass_matrix x' = rhs; it may be singular (stiff methods only).
    jacobian: a jitted function that fills J (n_states, n_states), or a model's kernel with its pattern.
    input_jacobian: of a linear model, whose Jacobians are constant (exact propagation only). recurrences: the code of
    the states' Taylor series, a `SeriesCode` (Taylor's method only, which takes no rhs).
    held: the constraints on which the state is kept, None where there are none. acting: the events of the model that
    act, see `frame.acting`; None where it has none.
    switching: the kernel `modes` of the model's conditions in its state that are to be held (see `frame.hold`), n_modes
    of them, whose modes are the last channels; None where conditions are free. approach: the kernel of that name with
    its pattern, see `frame.slide`.
    by_item: rhs uses its arguments only item by item, as generated kernels do: pointers will do for it.
    sense: 1 where time is time, -1 where it is counted backwards (see `backward`).
    workplaces: what runs from other states work with again, see `started_from`; no other copy of a problem has them.
    """

    rhs: Any
    t0: float
    t1: float
    initial_state: NDArray[np.float64]
    constants: NDArray[np.float64]
    inputs: InputTable
    n_inputs: int
    state_names: tuple[str, ...]
    jacobian: Any = None
    mass_matrix: NDArray[np.float64] | None = None
    input_jacobian: PlacedKernel | None = None
    recurrences: Any = None
    held: Held | None = None
    acting: Acting | None = None
    switching: Any = None
    approach: Any = None
    n_modes: int = 0
    by_item: bool = False
    sense: int = 1
    workplaces: dict[Any, list[Any]] | None = field(default=None, init=False, repr=False)

    def started_from(
        self, x: NDArray[np.float64], workplaces: dict[Any, list[Any]], constants: NDArray[np.float64] | None = None
    ) -> "Problem":
        """The same from another initial state (n_states,), to be run where `workplaces` has what such runs need.

        constants: others, where they are given.
        """
        changed = {"initial_state": x, "workplaces": workplaces}
        return unchecked(Problem, vars(self) | changed | ({} if constants is None else {"constants": constants}))

    def without_kernels(self) -> "Problem":
        """The same, with nothing of a model's kernels: what can be pickled."""
        known: dict[str, Any] = dict.fromkeys(KERNELS)
        return replace(self, **known)

    def jacobian_at(self, t: float, x: NDArray[np.float64], u: NDArray[np.float64]) -> NDArray[np.float64]:
        """The Jacobian (n_states, n_states) that was given, with inputs u."""
        if isinstance(self.jacobian, PlacedKernel):
            return self.jacobian(t, x, u, self.constants)
        J = np.empty((len(x), len(x)))
        self.jacobian(t, x, u, self.constants, J)
        return J

    @property
    def longest_first_step(self) -> float:
        """The longest that one after a stop may be, s: a span without an end says nothing about how fast things go."""
        return FIRST_OF_FOREVER * max(1.0, abs(self.t0)) if self.t1 - self.t0 >= FOREVER else np.inf


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Saved points t (n,), states (n, n_states) and how the run ended.

    failed_at, failed_state: time and index of the state that left first, where the status is a failure.
    """

    t: NDArray[np.float64]
    states: NDArray[np.float64]
    status: Status
    statistics: Statistics
    failed_at: float = np.nan
    failed_state: int = -1
    extras: dict[str, Any] = field(default_factory=dict)
