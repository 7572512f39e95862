"""Models and values for tests of what is displayed."""

import random
import re
from functools import cache

import symengine as se
from sympy import Abs, Rational, Symbol, cos, exp, pi, sin, sqrt, symbols

from qddot.codegen.equations.document import Document
from qddot.codegen.equations.notation import describe
from qddot.codegen.lagrange import Equations, derive
from qddot.model import cart_pole, chain, double_pendulum, half_car, m113, one_axle, pendulum, quarter_car
from qddot.model.system import Coordinate, Input, Output, Parameter, Quantity, System, t

HOSTILE = r"50 % of <script>alert('x')</script> & \input{/etc/passwd} $x_1^2$ ~ {a}} # Übermaß Π ≤ 漢 " + "ö" * 90


def crane() -> System:
    """A model with words for names, roots, fractions, an exponential, time, an absolute value and a long product."""
    reach, angle, reach_rate, angle_rate = symbols("reach angle reachdot angledot")
    m, k, c, g, tau, omega, motor = symbols("m k c g tau omega motor")
    stretch, stretch_rate = symbols("stretch stretch_rate")
    spring = Quantity(stretch, sqrt(reach**2 + m * reach / k) - m * g / k, "m", HOSTILE, rate=stretch_rate)
    return System(
        name="crane",
        title=HOSTILE,
        coordinates=(Coordinate(reach, "m", "reach of the boom"), Coordinate(angle, "rad", HOSTILE)),
        parameters=(
            *(Parameter(s, 1.5, "kg m^2 s^-1", HOSTILE) for s in (m, k, c, g, tau)),
            Parameter(omega, 2e-7, "1", "frequency"),
        ),
        inputs=(Input(motor, "N%", "motor"),),
        quantities=(spring,),
        kinetic_energy=m * (reach_rate**2 + (reach * angle_rate) ** 2 * (2 + sin(angle)) ** 2) / 2,
        potential_energy=k * stretch**2 / 2
        - m * g * reach * cos(angle)
        + m * g * exp(-t / tau) * reach / (2 * pi + tau),
        dissipation=c * angle_rate**2 * Abs(angle_rate) / 3 + Rational(2, 7) * c * reach_rate**2 * exp(-2 * t / tau),
        generalized_forces={reach: motor * cos(omega * t) / (1 + reach**2) ** Rational(3, 2), angle: -motor * (m - k)},
        outputs=(
            Output(Symbol("rope_force_at_the_upper_end"), k * stretch + motor, "N", "rope"),
            Output(Symbol("angle_squared"), (angle - reach) ** 2 * 0.25 + Symbol("reachddot"), "1", "square"),
        ),
    )


MODELS = {
    system.name: system
    for system in (
        *(module.system() for module in (m113, one_axle, quarter_car, half_car, double_pendulum, cart_pole)),
        *(chain.system(10), chain.system(30), pendulum.system(3), pendulum.system(5), crane()),
    )
}


@cache
def derived(name: str) -> Equations:
    return derive(MODELS[name])


@cache
def documents(name: str) -> Document:
    return describe(derived(name), f"model/{name}.py")


def random_point(equations, seed: int) -> dict[se.Symbol, float]:
    """A value for every symbol, those of quantities from their definitions."""
    dice = random.Random(seed)
    free = (*equations.parameters, *equations.coordinates, *equations.velocities, *equations.accelerations)
    point = {symbol: dice.uniform(0.3, 1.7) for symbol in (*free, *equations.inputs, *equations.rates, equations.time)}
    point |= dict.fromkeys(equations.modes.functions, 0.0)
    for symbol, expression in equations.definitions.expressions.items():
        point[symbol] = at(expression, point)
    return point


def printed(script, symbol) -> str:
    """A symbol as a formula shows it."""
    return script.name(str(symbol)).text


def at(expression, point) -> float:
    return float(se.sympify(expression).subs(point).n(53, real=True))


def motion_residual(equations, k: int, point) -> float:
    """M qddot - f of coordinate k."""
    mass = {(i, j): entry for i, j in equations.mass for entry in [equations.mass[i, j]]}
    row = [mass.get((max(k, j), min(k, j)), 0) for j in range(len(equations.coordinates))]
    inertia = sum(at(entry, point) * point[a] for entry, a in zip(row, equations.accelerations, strict=True))
    return inertia - at(equations.forces[k], point)


def displays(source: str, environment: str) -> list[str]:
    """Bodies of the displays of one kind."""
    return re.findall(rf"\\begin\{{{environment}\}}\n?(.*?)\\end\{{{environment}\}}", source, re.DOTALL)
