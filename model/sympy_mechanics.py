"""Models from SymPy's mechanics: a `LagrangesMethod` or a `KanesMethod` as a System.

Coordinates are functions of time there (`dynamicsymbols`) and plain symbols of the same names here. A Kane's method is
taken by its bodies and loads, its speeds written by the rates of its coordinates: then it is Lagrange's.
"""

import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

from sympy import Basic, Derivative, Expr, Float, Matrix, Symbol, sympify
from sympy.core.function import AppliedUndef

from qddot.model.constraints import Constraint, Rolling
from qddot.model.naming import dotted, t
from qddot.model.system import Coordinate, Input, ModelError, Output, Parameter, System

if TYPE_CHECKING:
    from sympy.physics.mechanics import KanesMethod, LagrangesMethod

Multiplier = tuple[str, str, str]
#: What a System holds of it, constraints on positions, constraints on velocities.
Taken = tuple[dict[str, Any], list[Expr], list[Expr]]

#: Points at which constraints are compared, digits of the comparison, what is zero there.
_POINTS, _DIGITS, _ZERO = 3, 40, 1e-25


def from_sympy(
    method: "LagrangesMethod | KanesMethod",
    name: str,
    title: str,
    *,
    coordinates: Sequence[Coordinate],
    parameters: Sequence[Parameter],
    inputs: Sequence[Input] = (),
    multipliers: Sequence[Multiplier] = (),
    outputs: Sequence[Output] = (),
    scene: Sequence[Any] = (),
    parameter_sets: Mapping[str, Mapping[Symbol, float]] | None = None,
) -> System:
    """The model that a method of SymPy's mechanics describes.

    coordinates: one for each of the method's, which may be given as it is there, `Coordinate(q, "rad", "angle")`; so
    may inputs, functions of time that are no coordinates, outputs, which may use speeds and multipliers, too, and the
    shapes of the scene.
    multipliers: (name, unit, meaning) of those of the constraints, holonomic ones first.

    A Lagrangian is split into T, which vanishes at rest, and Pi. Loads become generalized forces. Raises ModelError,
    naming what has no place in a System.
    """
    kinds = {each.__name__ for each in type(method).__mro__} & {"LagrangesMethod", "KanesMethod"}
    if not kinds:
        raise ModelError(f"from_sympy: found a {type(method).__name__}, expected a LagrangesMethod or a KanesMethod")
    given = [replace(each, symbol=_symbol(each.symbol)) for each in coordinates]
    channels = [replace(each, symbol=_symbol(each.symbol)) for each in inputs]
    _refuse_others(name, method.q, given)
    reading = _Reading(name, [*given, *channels], [each[0] for each in multipliers])
    take = _from_kane if "KanesMethod" in kinds else _from_lagrange
    parts, on_positions, on_velocities = take(name, method, reading, given)
    return System(
        name=name,
        title=title,
        coordinates=given,
        parameters=parameters,
        inputs=channels,
        constraints=_constraints(name, multipliers, on_positions, on_velocities),
        outputs=[replace(each, expression=reading(each.expression)) for each in outputs],
        scene=[_everywhere(reading, each) for each in scene],
        parameter_sets=parameter_sets or {},
        **parts,
    )


class _Reading:
    """What turns functions of time into the symbols of a model; `also` holds what stands for others, such as speeds."""

    def __init__(self, name: str, moving: Sequence[Any], multipliers: Sequence[str]) -> None:
        self._name = name
        self.also: dict[Any, Any] = {}
        self._symbols: dict[str, tuple[Symbol, ...]] = {
            **{f"lam{k + 1}": (Symbol(each),) for k, each in enumerate(multipliers)},  # as SymPy calls them
            **{str(each.symbol): (each.symbol, each.rate, dotted(each.rate)) for each in moving},
        }

    def __call__(self, expression: Any) -> Any:
        """The expression in plain symbols. Raises ModelError for a function of time that is not declared."""
        written = sympify(expression).doit().xreplace(self.also).doit()
        found = sorted(written.atoms(Derivative, AppliedUndef), key=str)
        changed = {each: self._plain(each) for each in found if isinstance(each, Derivative) or each.args == (t,)}
        return written.xreplace(changed)

    def _plain(self, function: Any) -> Any:
        order = function.derivative_count if isinstance(function, Derivative) else 0
        inner = function.expr if order else function
        known = self._symbols.get(inner.func.__name__, ())
        if order < len(known):
            return known[order]
        if known:
            raise ModelError(f"model {self._name}: {function} is used, a derivative of {inner} that a System has not")
        hint = f'Input({inner.func.__name__}, "...", "...") where it is given from outside'
        raise ModelError(f"model {self._name}: {inner} is no coordinate of the method and no input: declare it, {hint}")


def _everywhere(reading: _Reading, value: Any) -> Any:
    """A shape of a scene with what stands in it read, lists of places too; what is no expression as it is."""
    if isinstance(value, tuple | list):
        return tuple(_everywhere(reading, each) for each in value)
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{each.name: _everywhere(reading, getattr(value, each.name)) for each in fields(value)})
    return reading(value) if isinstance(value, Basic) else value


def _symbol(given: Any) -> Any:
    return Symbol(given.func.__name__) if isinstance(given, AppliedUndef) else given


def _refuse_others(name: str, theirs: Iterable[Any], ours: Sequence[Coordinate]) -> None:
    expected, found = [str(_symbol(each)) for each in theirs], [str(each.symbol) for each in ours]
    if sorted(expected) != sorted(found):
        raise ModelError(
            f"model {name}: the method has the coordinates {', '.join(expected)}, and {', '.join(found) or 'none'} are "
            "declared: declare each of them, with its unit and meaning"
        )


def _from_lagrange(name: str, method: Any, reading: _Reading, given: Sequence[Coordinate]) -> Taken:
    """T, Pi and Q; constraints on positions and on velocities."""
    lagrangian = reading(method._L[0])
    potential = -lagrangian.xreplace({each.rate: sympify(0) for each in given})
    on_positions = [reading(each) for each in method._hol_coneqs]
    on_velocities = [reading(each) for each in method.coneqs[len(on_positions) :]]
    forces = _forces(method.forcelist, method.inertial, reading, given)
    parts = {"kinetic_energy": lagrangian + potential, "potential_energy": potential}
    return {**parts, "generalized_forces": forces}, on_positions, on_velocities


def _from_kane(name: str, method: Any, reading: _Reading, given: Sequence[Coordinate]) -> Taken:
    """The same of bodies and loads."""
    if method._uaux:
        found = ", ".join(str(_symbol(each)) for each in method._uaux)
        raise ModelError(
            f"model {name}: auxiliary speeds ({found}) have no place in a System: make the method without them, and "
            "ask for the force as the multiplier of a constraint"
        )
    if not method.bodies:
        raise ModelError(f"model {name}: the method has no bodies: give them to KanesMethod, bodies=[...]")
    reading.also = _speeds(name, method)
    frame = method._inertial
    kinetic = sum((reading(body.kinetic_energy(frame)) for body in method.bodies), sympify(0))
    forces = _forces(method.forcelist, frame, reading, given)
    on_positions = [reading(each) for each in method._f_h]
    velocities = method._k_nh * method.u + method._f_nh if method._k_nh else ()
    on_velocities = _others([reading(each) for each in velocities], on_positions, given)
    return {"kinetic_energy": kinetic, "generalized_forces": forces}, on_positions, on_velocities


def _speeds(name: str, method: Any) -> dict[Any, Any]:
    """Each generalized speed by the rates of the coordinates: k_u u + k_q qdot + f = 0 solved for u."""
    by_speeds, by_rates, rest = method._k_ku_implicit, method._k_kqdot_implicit, method._f_k_implicit
    if not by_rates or by_speeds.rows != by_speeds.cols:
        raise ModelError(
            f"model {name}: {len(method.u)} generalized speeds are not those of {len(method.q)} coordinates: give as "
            "many speeds as coordinates, and what holds them to each other as velocity_constraints"
        )
    right = by_rates * Matrix([q.diff(t) for q in method.q]) + rest
    try:
        found = -by_speeds.LUsolve(right)
    except (ValueError, ZeroDivisionError) as error:
        raise ModelError(
            f"model {name}: the kinematic equations cannot be solved for the generalized speeds: {error}"
        ) from None
    return dict(zip(method.u, found, strict=True))


def _forces(loads: Any, frame: Any, reading: _Reading, given: Sequence[Coordinate]) -> dict[Symbol, Expr]:
    """Generalized forces: each load along the derivative, by the rates, of the velocity of what it acts on."""
    found: dict[Symbol, Expr] = {each.symbol: sympify(0) for each in given}
    for where, load in loads or ():
        moves = where.ang_vel_in if hasattr(where, "ang_vel_in") else where.vel
        velocity, force = (_components(vector, frame, reading) for vector in (moves(frame), load))
        for each in given:
            found[each.symbol] += velocity.diff(each.rate).dot(force)
    return {symbol: force for symbol, force in found.items() if force != 0}


def _components(vector: Any, frame: Any, reading: _Reading) -> Matrix:
    return Matrix([0, 0, 0]) if vector == 0 else vector.to_matrix(frame).applyfunc(reading)


def _others(velocities: Sequence[Expr], positions: Sequence[Expr], given: Sequence[Coordinate]) -> list[Expr]:
    """The constraints on velocities that are no derivatives of those on positions: found by numbers, at points."""
    rows = [[*(each.diff(c.symbol) for c in given), each.diff(t)] for each in positions]
    found = []
    for each in velocities:
        still = each.xreplace({c.rate: sympify(0) for c in given})
        row = [*(each.diff(c.rate) for c in given), still]
        if not rows or all(_rank(points, [*rows, row]) > _rank(points, rows) for points in range(_POINTS)):
            found.append(each)
    return found


def _rank(seed: int, rows: Sequence[Sequence[Expr]]) -> int:
    """The rank of a matrix of expressions where all symbols have random values."""
    chance, matrix = random.Random(seed), Matrix(rows)
    values = {symbol: Float(chance.uniform(0.5, 1.5), _DIGITS) for symbol in sorted(matrix.free_symbols, key=str)}
    rank: int = matrix.xreplace(values).evalf(_DIGITS).rank(iszerofunc=lambda x: abs(x) < _ZERO)
    return rank


def _constraints(
    name: str, multipliers: Sequence[Multiplier], on_positions: Sequence[Expr], on_velocities: Sequence[Expr]
) -> list[Any]:
    kinds = [*((Constraint, each) for each in on_positions), *((Rolling, each) for each in on_velocities)]
    if len(kinds) != len(multipliers):
        raise ModelError(
            f"model {name}: the method has {len(on_positions)} constraints on positions and {len(on_velocities)} on "
            f"velocities, and {len(multipliers)} multipliers are given: name each, (name, unit, meaning), in that order"
        )
    return [
        kind(Symbol(symbol), expression, unit, meaning)
        for (kind, expression), (symbol, unit, meaning) in zip(kinds, multipliers, strict=True)
    ]
