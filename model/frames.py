"""Rotations and rigid bodies in space, as expressions for a model: matrices from angles or quaternions, T and Pi.

    turned = about("z", psi) @ about("x", phi) @ about("y", theta)      turned.matrix, turned.angular_velocity
    T = kinetic_energy(m, (I_x, I_y, I_z), velocity(position, rates), turned.angular_velocity)

Where bodies stand on bodies, `Named` gives what one is written in to the next by name, so that nothing is written out
twice: `named.rotation("B", turned)`, `named.vector("v_B", ...)`, and `carried` points on bodies.

A rotation takes a body from where its axes are those of space to where they are: matrix * (components in body axes) =
components in space.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sympy import Expr, ImmutableMatrix, Matrix, Rational, Symbol, cos, sin, sympify

from qddot.model.naming import dotted
from qddot.model.system import Quantity

__all__ = [
    "Named",
    "Point",
    "Rotation",
    "about",
    "carried",
    "from_quaternion",
    "kinetic_energy",
    "norm",
    "potential_energy",
    "rates_of",
    "velocity",
]

_AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
_HALF = Rational(1, 2)


@dataclass(frozen=True)
class Rotation:
    """A rotation: its matrix (3, 3), body to space, and the angular velocity (3,) that goes with it, in body axes."""

    matrix: ImmutableMatrix
    angular_velocity: ImmutableMatrix

    def __matmul__(self, then: "Rotation") -> "Rotation":
        """Turn by this one, and then by another about the axes that it has turned."""
        omega = then.matrix.T * self.angular_velocity + then.angular_velocity
        return Rotation(ImmutableMatrix(self.matrix * then.matrix), ImmutableMatrix(omega))

    def __mul__(self, vector: Sequence[Expr]) -> ImmutableMatrix:
        """Components in space (3,) of a vector given in body axes."""
        return ImmutableMatrix(self.matrix * Matrix(vector))


@dataclass(frozen=True)
class Point:
    """A point of a body: its position (3,) and its velocity (3,), in space."""

    position: ImmutableMatrix
    velocity: ImmutableMatrix


@dataclass(frozen=True)
class Named:
    """Quantities that a model of many bodies is written in: `quantities` is for the `System`."""

    quantities: list[Quantity] = field(default_factory=list)

    def vector(self, name: str, components: Sequence[Expr], unit: str) -> ImmutableMatrix:
        """The symbols name_x, name_y, name_z (3,) of these components."""
        return ImmutableMatrix([self._named(f"{name}_{k}", c, unit) for k, c in zip("xyz", components, strict=True)])

    def rotation(self, name: str, turned: Rotation) -> Rotation:
        """The same rotation by names: A_name_xx of its matrix, row by row, and omega_name_x of its angular velocity."""
        entries = [
            self._named(f"A_{name}_{j}{k}", turned.matrix["xyz".index(j), "xyz".index(k)], "1")
            for j in "xyz"
            for k in "xyz"
        ]
        return Rotation(ImmutableMatrix(3, 3, entries), self.vector(f"omega_{name}", turned.angular_velocity, "rad/s"))

    def _named(self, name: str, expression: Expr, unit: str) -> Symbol:
        self.quantities.append(Quantity(Symbol(name), expression, unit, "component, named by `frames`"))
        return self.quantities[-1].symbol


def about(axis: str, angle: Expr, rate: Expr | None = None) -> Rotation:
    """A rotation by an angle about x, y or z.

    rate: of the angle; by default the dotted name of a symbol that is a coordinate, so give 0 for a parameter.
    Raises ValueError for another axis, or for an angle that is no symbol and has no rate.
    """
    if axis not in _AXES:
        raise ValueError(f"axis is {axis!r}, expected x, y or z")
    if rate is None and not isinstance(angle, Symbol):
        raise ValueError(f"the angle {angle} is no symbol: give its rate")
    turns = dotted(angle) if rate is None else sympify(rate)
    c, s = cos(angle), sin(angle)
    k = "xyz".index(axis)
    i, j = (k + 1) % 3, (k + 2) % 3
    matrix = Matrix.eye(3)
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
    return Rotation(ImmutableMatrix(matrix), ImmutableMatrix(turns * Matrix(_AXES[axis])))


def from_quaternion(q: Sequence[Symbol], rates: Sequence[Expr] | None = None) -> Rotation:
    """The rotation that a quaternion of length 1 stands for: q = (cos(a/2), e sin(a/2)), by a about e.

    rates: of q; the dotted names by default. The constraint that keeps the length is `norm(q)` = 0.
    """
    if len(q) != 4:
        raise ValueError(f"a quaternion has four components, and {len(q)} are given")
    w, x, y, z = q
    wdot, xdot, ydot, zdot = [dotted(each) for each in q] if rates is None else rates
    matrix = [
        [w**2 + x**2 - y**2 - z**2, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w**2 - x**2 + y**2 - z**2, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w**2 - x**2 - y**2 + z**2],
    ]
    omega = [
        2 * (w * xdot - x * wdot - y * zdot + z * ydot),
        2 * (w * ydot - y * wdot - z * xdot + x * zdot),
        2 * (w * zdot - z * wdot - x * ydot + y * xdot),
    ]
    return Rotation(ImmutableMatrix(matrix), ImmutableMatrix(omega))


def norm(q: Sequence[Symbol]) -> Expr:
    """What a `Constraint` makes vanish so that a quaternion stays one of length 1; its multiplier is in N m."""
    return sum((each**2 for each in q), sympify(0)) - 1


def rates_of(*symbols: Symbol) -> dict[Symbol, Symbol]:
    """Coordinates -> their velocities, by the dotted names."""
    return {symbol: dotted(symbol) for symbol in symbols}


def velocity(position: Sequence[Expr], rates: Mapping[Symbol, Expr]) -> ImmutableMatrix:
    """The derivative by time (3,) of a position, by the chain rule."""
    return ImmutableMatrix([_derivative(sympify(each), rates) for each in position])


def carried(origin: Point, turned: Rotation, arm: Sequence[Expr]) -> Point:
    """The point of a body that is `arm` (3,) away, in body axes, from another point of it."""
    speed = turned.matrix * Matrix(turned.angular_velocity).cross(Matrix(arm))
    position = Matrix(origin.position) + turned.matrix * Matrix(arm)
    return Point(ImmutableMatrix(position), ImmutableMatrix(Matrix(origin.velocity) + speed))


def kinetic_energy(mass: Expr, inertia: Sequence[Expr] | Matrix, velocity: Matrix, angular_velocity: Matrix) -> Expr:
    """T of a rigid body: velocity (3,) of its centre of mass in space, angular velocity (3,) in body axes.

    inertia: about the centre of mass in body axes, the three principal moments or the symmetric matrix (3, 3).
    """
    tensor = inertia if isinstance(inertia, Matrix | ImmutableMatrix) else Matrix.diag(*inertia)
    v, w = Matrix(velocity), Matrix(angular_velocity)
    return _HALF * mass * v.dot(v) + _HALF * w.dot(tensor * w)


def potential_energy(mass: Expr, position: Sequence[Expr], gravity: Sequence[Expr]) -> Expr:
    """Pi of a body at a position in a uniform field: gravity (3,) in space, such as (0, 0, -g)."""
    return -mass * Matrix(gravity).dot(Matrix(position))


def _derivative(expression: Expr, rates: Mapping[Symbol, Expr]) -> Expr:
    moving = sorted(expression.free_symbols & rates.keys(), key=str)
    return sum((expression.diff(symbol) * rates[symbol] for symbol in moving), sympify(0))
