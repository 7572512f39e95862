"""Contact of two bodies, or of one and the ground: rigid, by impacts that come to rest, or compliant, by a force."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

from sympy import Expr, Max, Piecewise, Rational, Symbol, sympify

from qddot.model.contents import symbols
from qddot.model.events import Impact
from qddot.model.naming import dotted

if TYPE_CHECKING:
    from qddot.model.system import System

_HERTZ = Rational(3, 2)
#: What the numbers of a compliant contact are expected to be.
_NUMBERS: dict[str, tuple[str, Callable[[float], bool]]] = {
    "stiffness": ("a number above 0", lambda k: 0 < k < inf),
    "exponent": ("a number of at least 1", lambda n: 1 <= n < inf),
    "damping": ("a number above 0", lambda a: 0 < a < inf),
}


@dataclass(frozen=True)
class Contact:
    """What pushes two bodies apart where the gap between them is closed: its force is an output of this symbol.

    unit: the force's, such that the gap times it is an energy: N where the gap is a length.

    Without stiffness it is rigid: an `Impact` that gives restitution back (0 where it is not given) and comes to rest.

    With stiffness k it is compliant: with the depth d = -gap the force is k d^exponent (1 + 3/2 damping d') where d is
    above zero, and never below zero. Without damping that is Hertz's, exponent 3/2 for smooth bodies (K. L. Johnson,
    Contact Mechanics (1985), section 4.2), an energy k d^(exponent + 1)/(exponent + 1). With damping, s/m, it is that
    of K. H. Hunt and F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440-445, doi:10.1115/1.3423596: bodies that approach
    at v part at about (1 - damping v) v. Stiffness, exponent and damping are made of parameters.
    """

    symbol: Symbol
    gap: Expr
    unit: str
    meaning: str
    restitution: Expr | float | None = None
    stiffness: Expr | float | None = None
    exponent: Expr | float | None = None
    damping: Expr | float | None = None

    @property
    def gap_symbol(self) -> Symbol:
        """The quantity that the gap of a compliant contact is."""
        return Symbol(f"gap_{self.symbol}")

    @property
    def impact(self) -> Impact:
        """What a rigid contact is."""
        restitution = 0.0 if self.restitution is None else self.restitution
        name, force = str(self.symbol), self.symbol
        return Impact(self.gap, name, self.meaning, restitution=restitution, force=force, unit=self.unit)


@dataclass(frozen=True)
class Compliance:
    """What a compliant contact adds to a model: rows of quantities, to potential energy and to dissipation."""

    quantities: tuple[dict[str, Any], ...]
    potential: Expr
    dissipation: Expr


def compliance(contact: Contact) -> Compliance:
    """The energy, the dissipation and the quantities of a compliant contact.

    Phi = k d^n phi(d') with phi' = 3/2 damping d', but -1 at least, so that -dPhi/dqdot is what damps.
    """
    gap, k = contact.gap_symbol, sympify(contact.stiffness)
    n = _HERTZ if contact.exponent is None else sympify(contact.exponent)
    depth = Max(-gap, 0)
    named: dict[str, Any] = {"symbol": gap, "expression": contact.gap, "meaning": f"gap: {contact.meaning}"}
    force, dissipation = k * depth**n, sympify(0)
    if contact.damping is not None:
        named["rate"] = dotted(gap)
        speed, a = -named["rate"], _HERTZ * sympify(contact.damping)
        dissipation = force * Piecewise((a * speed**2 / 2, 1 + a * speed > 0), (-speed - 1 / (2 * a), True))
        force = force * Max(1 + a * speed, 0)
    given = {"symbol": contact.symbol, "expression": force, "unit": contact.unit, "meaning": contact.meaning}
    return Compliance((named, given), k * depth ** (n + 1) / (n + 1), dissipation)


def problems_of_contacts(system: "System") -> Iterator[str]:
    """What is wrong with the contacts of a model, before they become what they are made of."""
    fixed = {parameter.symbol for parameter in system.parameters}
    positions = {coordinate.symbol for coordinate in system.coordinates}
    moving = {coordinate.rate for coordinate in system.coordinates}
    named = {quantity.symbol: quantity.expression for quantity in system.quantities}
    for each in system.contacts:
        place = f"contact {each.symbol}"
        reached = _reached(each.gap, named)
        if reached & moving or not reached & positions:
            yield f"{place}: its gap is {each.gap}, expected a distance made of coordinates, and of no velocity"
        if each.stiffness is None:
            for name in ("exponent", "damping"):
                if getattr(each, name) is not None:
                    yield f"{place} has {name} and no stiffness, without which it is rigid; give a stiffness"
            yield from _number(place, "restitution", each.restitution, "a number from 0 to 1", lambda e: 0 <= e <= 1)
            continue
        if each.restitution is not None:
            yield (
                f"{place} has stiffness and restitution, which follows from the damping there: about (1 - e)/v for "
                "bodies that approach at v; leave one out"
            )
        for name, (wanted, fits) in _NUMBERS.items():
            value = getattr(each, name)
            yield from _number(place, name, value, wanted, fits)
            for symbol in sorted(symbols(value) - fixed, key=str):
                yield f"{place}: {name} depends on {symbol}; it may depend on parameters alone"


def _number(place: str, name: str, value: Any, wanted: str, fits: Callable[[float], bool]) -> Iterator[str]:
    """What is wrong with a number, where it is one."""
    if value is None or (isinstance(value, Expr) and not value.is_number):
        return
    number = isinstance(value, Expr | int | float) and not isinstance(value, bool)
    if not number or not fits(float(value)):
        yield f"{place} has the {name} {value!r}, expected {wanted}, or an expression"


def _reached(expression: Any, named: dict[Symbol, Any]) -> set[Symbol]:
    """The symbols of an expression, quantities written out."""
    found, waiting = set[Symbol](), list(symbols(expression))
    while waiting:
        symbol = waiting.pop()
        if symbol not in found:
            found.add(symbol)
            waiting += symbols(named.get(symbol))
    return found
