"""Parts that models are put together from: `(hull + axle("1", position=a_1) + axle("2", position=a_2)).system(...)`.

A part declares what it brings. What it uses and does not declare is another part's: names connect.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from sympy import Expr, Integer, Symbol, sympify

from qddot.model.assumptions import plain
from qddot.model.constraints import Constraint, Rolling
from qddot.model.contact import Contact
from qddot.model.contents import HELD
from qddot.model.copies import MARK, bound, marked, names_of_copy, renamed, said
from qddot.model.definitions import LoopError, as_sum, definitions, in_order
from qddot.model.events import Event
from qddot.model.joining import SUMS, joined
from qddot.model.scene import Shape
from qddot.model.system import Coordinate, Input, ModelError, Output, Parameter, Quantity, State, System


@dataclass(frozen=True)
class Part:
    """A part of a model: what a `System` has, as far as this part brings it.

    Called with a mark it gives a copy of itself whose names carry the mark, m -> m_1, tyre_force -> tyre_force_1; where
    a name holds {}, the mark stands there (Symbol("k_t{}") -> k_tf). In a meaning {} is the label ("mass of the {}
    wheel"); a meaning without it has the label behind: "unsprung mass, axle 1". Names that are used and not declared
    stay what they are, and so do those in `shared`, which all copies have in common.

    Parts are added. Energies and generalized forces add up; declarations stand side by side, those of copies of one
    part together; what two parts declare alike is one. `system` makes the model. A generalized force may be given on a
    quantity: it acts on the coordinates that move the quantity, by virtual work.

    Raises ModelError that names the parts and the symbol, and says what to do.
    """

    name: str
    coordinates: Sequence[Coordinate] = ()
    parameters: Sequence[Parameter] = ()
    kinetic_energy: Expr = field(default_factory=lambda: Integer(0))
    potential_energy: Expr = field(default_factory=lambda: Integer(0))
    dissipation: Expr = field(default_factory=lambda: Integer(0))
    generalized_forces: Mapping[Symbol, Expr] = field(default_factory=dict)
    inputs: Sequence[Input] = ()
    quantities: Sequence[Quantity] = ()
    outputs: Sequence[Output | Quantity] = ()
    parameter_sets: Mapping[str, Mapping[Symbol, float]] = field(default_factory=dict)
    states: Sequence[State] = ()
    constraints: Sequence[Constraint | Rolling] = ()
    baumgarte: Sequence[Expr] | None = None
    events: Sequence[Event] = ()
    contacts: Sequence[Contact] = ()
    scene: Sequence[Shape] = ()
    shared: Sequence[Symbol] = ()
    #: What it is made of, and for each of its symbols the one that copies of a part have in its place.
    pieces: tuple[str, ...] = field(default=(), repr=False)
    stems: Mapping[str, str] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "pieces", self.pieces or (self.name,))
        for name, kinds in HELD.items():
            object.__setattr__(self, name, tuple(getattr(self, name)))
            for item in getattr(self, name):
                if type(item).__name__ not in kinds or not isinstance(item.symbol, Symbol):
                    raise ModelError(f"part {self.name}: {name} holds {item!r}, expected {' or '.join(kinds)}")
        for name in ("shared", "events", "scene"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for name in SUMS:
            value = as_sum(getattr(self, name))
            if not isinstance(value, Expr):
                what = f"{name.replace('_', ' ')} is a {type(value).__name__}"
                raise ModelError(f"part {self.name}: {what}, expected a SymPy expression")
            object.__setattr__(self, name, value)

    def __call__(self, mark: str, label: str | None = None, /, **given: Expr | float) -> "Part":
        """A copy whose names carry a mark.

        label: what meanings say of it, the part's name and the mark where it is not given. given: declared name ->
        what stands for it. A number is the default of a parameter; a symbol of another part takes the name's place; an
        expression takes the place of a parameter, and makes of a coordinate or an input a quantity of that name, whose
        rate follows.
        """
        return bound(marked(self, mark, label or f"{self.name} {mark}"), names_of_copy(self, mark), given)

    def renamed(self, names: Mapping[str, str]) -> "Part":
        """The same part with other names; rates and accelerations that are not named themselves follow."""
        return renamed(self, names)

    def __add__(self, other: "Part") -> "Part":
        """Both parts as one."""
        return joined(self, other) if isinstance(other, Part) else NotImplemented

    def system(self, name: str, title: str) -> System:
        """The model that this part is. Raises ModelError where it is none."""
        for item in (each for kind in HELD for each in getattr(self, kind)):
            if MARK in f"{item.symbol}{item.meaning}":
                raise ModelError(
                    f"model {name}: {item.symbol} ({item.meaning}) holds {MARK}, where a mark and its label go: "
                    f'add a copy of its part, as {self.pieces[0].replace(" ", "_")}("1")'
                )
        theirs = {each.name for each in fields(System)} - {"name", "title"}
        held: dict[str, Any] = {each: getattr(self, each) for each in theirs}
        try:
            held["quantities"] = _sorted(self.quantities)
        except LoopError as error:
            raise ModelError(
                f"model {name}: {error}: quantities in a circle; give one of them by coordinates"
            ) from None
        held["generalized_forces"] = _on_coordinates(self)
        return System(**held, name=name, title=title)


def _sorted(quantities: Sequence[Quantity]) -> tuple[Quantity, ...]:
    """The quantities, each behind those that it uses. Raises LoopError where they use each other."""
    given = plain(tuple(quantities))
    of_rates = {each.rate: each.symbol for each in given if each.rate is not None}
    uses = {each.symbol: sympify(each.expression).xreplace(of_rates) for each in given}
    by_name = {said(each.symbol): each for each in quantities}
    return tuple(by_name[said(symbol)] for symbol in in_order(uses))


def _on_coordinates(part: Part) -> dict[Symbol, Expr]:
    """The generalized forces, those on quantities as they act on coordinates: Q_k = F d(quantity)/dq_k."""
    found = dict(part.generalized_forces)
    bare = plain(part)
    for quantity in bare.quantities:
        for symbol in [each for each in found if said(each) == said(quantity.symbol)]:
            force, place = found.pop(symbol), quantity.symbol
            for name, definition in reversed(in_order(definitions(bare)).items()):
                place = place.xreplace({name: definition})
            for given, coordinate in zip(part.coordinates, bare.coordinates, strict=True):
                if (slope := place.diff(coordinate.symbol)) != 0:
                    found[given.symbol] = found.get(given.symbol, Integer(0)) + slope * force
    return found
