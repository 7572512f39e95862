"""Dry friction: a force that slips at its limit against the velocity, and sticks below it."""

from dataclasses import dataclass, field

from sympy import Expr, Integer, Symbol, sign, sympify, tanh

from qddot.model.system import ModelError, Quantity
from qddot.units.amounts import amount_in

#: Units of what slides.
_SPEEDS = ("m/s", "rad/s")


@dataclass(frozen=True)
class Friction(Quantity):
    """The force of dry friction, a quantity: velocity is what slides; it sticks while |force| <= ratio * limit."""

    velocity: Expr = field(default_factory=lambda: Integer(0))
    limit: Expr = field(default_factory=lambda: Integer(0))
    ratio: Expr = field(default_factory=lambda: Integer(1))


def DryFriction(  # noqa: N802 - it stands among the classes of a model file
    symbol: Symbol,
    velocity: Expr,
    limit: Expr | float,
    unit: str,
    meaning: str,
    *,
    static: Expr | float | None = None,
    smooth: Expr | float | str | None = None,
) -> Quantity:
    """The quantity `symbol`, a force that a sliding velocity makes: limit * sign(velocity), and what holds it at rest.

    As a generalized force it stands with a minus: {x: -F_r}. Where velocity is zero and the force that keeps it there
    is not above the limit, or `static` where that is given, it sticks: the force is that of a constraint, and so is the
    output of that name. What follows from velocity = 0 is found by the method, which must locate switches.

    smooth: a velocity, "1 mm/s" or in the unit of `velocity`; then the force is limit * tanh(velocity / smooth), which
    creeps and never sticks, for every method. Raises ModelError for a combination that is none.
    """
    said = f"friction {symbol}"
    if smooth is None:
        ratio = Integer(1) if static is None else sympify(static) / sympify(limit)
        return Friction(symbol, sympify(limit) * sign(velocity), unit, meaning, None, velocity, sympify(limit), ratio)
    if static is not None:
        raise ModelError(f"{said} has both static and smooth, and what is smooth does not stick; leave one out")
    width = _speed(said, smooth) if isinstance(smooth, str) else sympify(smooth)
    if width.is_number and not width.is_positive:
        raise ModelError(f"{said}: smooth is {smooth}, expected a velocity above zero")
    return Quantity(symbol, sympify(limit) * tanh(velocity / width), unit, meaning)


def _speed(said: str, text: str) -> Expr:
    for unit in _SPEEDS:
        try:
            return sympify(amount_in(text, unit))
        except ValueError as error:
            reason = error
    raise ModelError(f"{said}: smooth {reason}") from None
