"""The tables of a generated module as records: what it says about its model."""

from dataclasses import dataclass, field

from qddot.runner.checks import unknown
from qddot.runner.matrices import Pattern


@dataclass(frozen=True)
class Quantity:
    """A state or an output."""

    name: str
    unit: str
    meaning: str


#: The input of a channel that is a side of a condition in time.
TIME = "t"
#: That of one that is the mode of a condition in the state.
STATE = "x"
#: That of one that says whether the contact of an impact rests.
REST = "0"
#: What an event is: one that gives values to states, an impact, an impact that can rest.
EVENT, IMPACT, CONTACT = "event", "impact", "contact"


@dataclass(frozen=True)
class Channel:
    """An entry of u: an input (order 0), its first or its second time derivative, or a condition's side or mode.

    input: whose value or derivative it is; TIME of a side of a condition in time, STATE of the mode of one in state,
    REST of what is 1 while a contact rests.
    """

    name: str
    input: str
    order: int
    unit: str
    meaning: str

    @property
    def is_mode(self) -> bool:
        """Whether it holds a condition in the state; an input may be called as these are."""
        return self.input == STATE and self.order == 0 and self.name != STATE

    @property
    def what(self) -> str:
        """What it is, of its input."""
        return ("the value", "the rate", "the second rate")[self.order]


@dataclass(frozen=True)
class Parameter:
    """A parameter and its default."""

    name: str
    default: float
    unit: str
    meaning: str


@dataclass(frozen=True)
class Constraint:
    """A constraint by the name of its multiplier; on_positions: else on velocities alone."""

    name: str
    on_positions: bool
    unit: str
    meaning: str


@dataclass(frozen=True)
class EventRow:
    """An event of the model: direction as in `frame.events`; `sets`: the states that take new values there.

    kind: EVENT, IMPACT or CONTACT.
    """

    name: str
    direction: int
    terminal: bool
    meaning: str
    sets: tuple[str, ...]
    kind: str = EVENT


@dataclass(frozen=True)
class Shape:
    """A shape of the scene: how many numbers it has in the kernel `scene`, the last of them shows it where conditional.

    note: of a ground the names of the inputs that are its heights, of a wheel "rolls", of a polygon "line".
    """

    kind: str
    colour: str
    size: int
    conditional: bool
    note: str


@dataclass(frozen=True)
class Lookup:
    """A table of a state: its points go from `first` to `last`; what is outside is "refuse" where it has no value."""

    name: str
    unit: str
    meaning: str
    first: float
    last: float
    argument: str
    outside: str


@dataclass(frozen=True)
class Tables:
    """What a generated module says about its model.

    states: coordinates, their velocities in the same order, internal states. positioned: inputs that act at a place
    along the way of travel, in the order of the kernel `positions`. patterns: of the matrices, by their kernels' names.
    recurrence: the table of the states' Taylor series, or in without_recurrence the function that has none.
    constraints: those on positions first. projected: whether the state is kept on them after each step. events: in the
    order of the kernel `events`. scene: how the model looks, in the order of the kernel `scene`.
    """

    name: str
    title: str
    states: tuple[Quantity, ...]
    coordinates: int
    inputs: tuple[Channel, ...]
    rhs_inputs: int
    positioned: tuple[str, ...]
    outputs: tuple[Quantity, ...]
    parameters: tuple[Parameter, ...]
    parameter_sets: dict[str, dict[str, float]] = field(hash=False)
    constant_names: tuple[str, ...]
    linear: bool
    mass_matrix: str
    patterns: dict[str, Pattern] = field(hash=False)
    lookups: tuple[Lookup, ...]
    recurrence: str = ""
    without_recurrence: str = ""
    constraints: tuple[Constraint, ...] = ()
    projected: bool = False
    events: tuple[EventRow, ...] = ()
    scene: tuple[Shape, ...] = ()

    @property
    def n_positions(self) -> int:
        """How many constraints are on positions."""
        return sum(each.on_positions for each in self.constraints)

    @property
    def free_inputs(self) -> tuple[str, ...]:
        """Names of the inputs that are given; the others are derivatives of these, or follow from time."""
        return tuple(channel.name for channel in self.inputs if channel.order == 0 and channel.input == channel.name)

    @property
    def sides(self) -> tuple[str, ...]:
        """Names of the channels that say on which side of a condition in time a run is."""
        return tuple(channel.name for channel in self.inputs if channel.input == TIME)

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the channels that say whether contacts rest, in the order of the events that can."""
        return tuple(channel.name for channel in self.inputs if channel.input == REST)

    @property
    def modes(self) -> tuple[str, ...]:
        """Names of the channels that hold conditions in the state on a side, the last ones."""
        return tuple(channel.name for channel in self.inputs if channel.is_mode)

    @property
    def courses(self) -> tuple[Channel, ...]:
        """The channels that have a course in time: all but the modes."""
        return self.inputs[: len(self.inputs) - len(self.modes)]

    def refuse_derivative(self, name: str) -> None:
        """Raise ValueError where the signal of an input is given under another name: an unknown one, or of its rate."""
        channel = next((channel for channel in self.courses if channel.name == name), None)
        if channel is None:
            raise ValueError(f"model {self.name}: {unknown('input', name, self.free_inputs)}")
        if channel.input == TIME:
            raise ValueError(
                f"model {self.name}: {name} follows from t and parameters ({channel.meaning}): leave it out"
            )
        if channel.input == REST:
            raise ValueError(f"model {self.name}: {name} follows from the run ({channel.meaning}): leave it out")
        if channel.order:
            raise ValueError(f"model {self.name}: {name} is {channel.what} of {channel.input}; give {channel.input}")
