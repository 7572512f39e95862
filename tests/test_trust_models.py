"""What a System may hold: it is derived rightly, or refused by name, place and term. No other exception comes out."""

import math
import warnings
from dataclasses import replace

import mpmath
import pytest
import symengine as se
import sympy
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sympy import (
    Abs,
    Derivative,
    Dummy,
    Eq,
    Float,
    Function,
    Heaviside,
    I,
    IndexedBase,
    Integer,
    Integral,
    Limit,
    Matrix,
    Max,
    Min,
    Mod,
    Ne,
    Piecewise,
    Product,
    Rational,
    Subs,
    Sum,
    Symbol,
    Wild,
    Xor,
    acos,
    acosh,
    asin,
    asinh,
    atan2,
    cos,
    exp,
    floor,
    gamma,
    log,
    nan,
    oo,
    pi,
    sign,
    sin,
    sqrt,
    symbols,
    tan,
    zoo,
)  # fmt: skip
from sympy.core.function import Application

from qddot.codegen.generate import artefacts
from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower
from qddot.model.system import Coordinate, Input, ModelError, Output, Parameter, Quantity, System, t
from qddot.model.vocabulary import SMOOTH

x, y, xdot, ydot, xddot, m, k, d, s, sdot = symbols("x y xdot ydot xddot m k d s sdot")
DEFAULTS = {m: 2.0, k: 3.0, d: 0.5}
half = Rational(1, 2)


def system(potential=0, kinetic=None, defaults=DEFAULTS, **rest):
    """Two coordinates; the parameters are those that are used."""
    kinetic = half * m * (xdot**2 + ydot**2) if kinetic is None else kinetic
    expressions = [kinetic, potential, *rest.get("generalized_forces", {}).values(), rest.get("dissipation", 0)]
    expressions += [item.expression for item in (*rest.get("quantities", ()), *rest.get("outputs", ()))]
    used = set().union(*(getattr(each, "free_symbols", set()) for each in expressions))
    return System(
        name="tried",
        title="tried",
        coordinates=(Coordinate(x, "m", "first"), Coordinate(y, "m", "second")),
        parameters=[Parameter(each, value, "1", "parameter") for each, value in defaults.items() if each in used],
        kinetic_energy=kinetic,
        potential_energy=potential,
        **rest,
    )


def lowered(made):
    """The kernels of a system."""
    return lower(derive(made))


def evaluated(program, kernel, point):
    """What a kernel writes at a point, slowly, by slot."""
    values = {symbol.name: float(value) for symbol, value in point.items()}
    switches, known = program.equations.switches, {se.Symbol(name): value for name, value in values.items()}
    for side, function in switches.functions.items():
        values[str(side)] = float(switches.definitions.substitute([function], known)[0] > 0)
    values |= {str(mode): 0.0 for mode in program.equations.modes.functions}
    constants = program.kernels["constants"].evaluate(values)
    values |= {str(name): constants[f"constants[{i}]"] for i, name in enumerate(program.constants)}
    return program.kernels[kernel].evaluate(values)


def numeric(expression, arguments):
    """An expression by mpmath, kinks as they are defined."""
    step = {
        "Heaviside": lambda z, at_zero=0.5: mpmath.mpf(at_zero if z == 0 else z > 0),
        "Max": max,
        "Min": min,
    }
    return sympy.lambdify(arguments, expression, modules=[step, "mpmath"])


def slope(expression, by, point):
    """A derivative by central differences in 50 digits."""
    with mpmath.workdps(50):
        function, arguments = numeric(expression, list(point)), [mpmath.mpf(value) for value in point.values()]
        place, h = list(point).index(by), mpmath.mpf("1e-18")
        ends = []
        for side in (-h, h):
            moved = list(arguments)
            moved[place] += side
            ends.append(function(*moved))
        return float((ends[1] - ends[0]) / (2 * h))


POINTS = [
    {x: 0.31, y: -0.74, xdot: 0.2, ydot: -0.3, m: 2.0, k: 3.0, d: 0.5, t: 0.7},
    {x: -0.83, y: 0.27, xdot: 0.2, ydot: -0.3, m: 1.5, k: 2.0, d: 0.4, t: 0.1},
    {x: 1.37, y: 1.91, xdot: 0.2, ydot: -0.3, m: 1.0, k: 1.0, d: 1.2, t: 2.0},
]

REFUSED = {
    "no last branch": (Piecewise((k * x**2, x < 0)), "Piecewise((k*x**2, x < 0)): its last branch has a condition"),
    "division by zero": (x / (k - k) + k, "zoo*x: something is divided by zero"),
    "infinity": (oo * x, "oo*x: it is infinite"),
    "no number": (nan + x, "nan: it is no number"),
    "imaginary": (k * I * x, "I*k*x: it is complex, and a model is real"),
    "a negative number to a power": ((-1) ** x, "(-1)**x: a negative number to a power that is no whole number"),
    "a negative decimal to a power": (Float(-2.5) ** x, "(-2.5)**x: a negative number to a power"),
    "a root of a negative number": ((-8) ** Rational(1, 3) * x, "(-1)**(1/3): it is complex"),
    "a logarithm of a negative number": (log(-2) * x, "it is complex"),
    "an arc cosine beyond 1": (acos(2) * x, "acos(2): it is complex"),
    "the size of a logarithm of a sign": (Abs(log(sign(x))), "Abs(log(sign(x))): in one of its cases it compares what"),
    "the largest of roots": (Max(1, sqrt(sign(x))), "Max(1, sqrt(sign(x))): in one of its cases it compares what"),
    "a comparison of a sign's arc cosine": (
        Piecewise((x, acos(2 * sign(x)) > 0), (2 * x, True)),
        "in one of its cases it compares what is complex",
    ),
    "zero to a power": (Integer(0) ** x, "0**x: zero to a power has no derivative"),
    "Sum": (Sum(x**d, (d, 1, 3)), "Sum(x**d, (d, 1, 3)): Sum has no compiled form; write it out: .doit()"),
    "Product": (Product(x + d, (d, 1, 3)), "Product has no compiled form; write it out"),
    "Integral": (Integral(x * d, (d, 0, 1)), "Integral has no compiled form; write it out"),
    "Limit": (Limit(x * d, d, 0), "Limit has no compiled form; write it out"),
    "Subs": (Subs(sin(x), x, y), "Subs has no compiled form; write it out"),
    "Derivative": (Derivative(sin(x), x), "Derivative(sin(x), x): Derivative has no compiled form; write it out"),
    "a function of time": (k * Function("x")(t), "x(t): write plain symbols for coordinates and velocities"),
    "a function without formula": (k * Function("F")(x), "F(x): it has no formula; write one"),
    "a Dummy": (k * Dummy("x") ** 2, "x is a Dummy, which equals no other of its name: use Symbol('x')"),
    "a Wild": (k * Wild("x") ** 2, "x is a Wild, which equals no other of its name"),
    "a matrix": (Matrix([[k * x]]), "ImmutableDenseMatrix has no compiled form; take its entry, [0, 0]"),
    "an indexed base": (k * IndexedBase("q")[1], "q[1]: Indexed has no compiled form; write a plain Symbol"),
    "a comparison": (k * x > 0, "potential energy is a StrictGreaterThan, expected a SymPy expression"),
    "a truth value": (True, "potential energy is a bool, expected a SymPy expression"),
    "nothing": (None, "potential energy is a NoneType, expected a SymPy expression"),
    "a set": ({k * x}, "potential energy is a FiniteSet, expected a SymPy expression"),
    "a complex number": (1j, "1.0*I: it is complex"),
    "a real part": (Abs(exp(x)), "re(x): re has no compiled form; all symbols are real here; declare them so"),
    "rounding": (k * floor(x), "floor(x): floor has no compiled form; it jumps; write its pieces as a Piecewise"),
    "a remainder in a condition": (Piecewise((x, Mod(x, 2) > 1), (0, True)), "Mod(x, 2): Mod has no compiled form"),
    "an impulse": (k * Heaviside(x).diff(x), "DiracDelta(x): DiracDelta has no compiled form; an impulse is no force"),
    "a special function": (gamma(x), "gamma(x): gamma has no compiled form; there are Abs, Heaviside, Max"),
    "a constant without a name": (sympy.EulerGamma * x, "write its value, 0.5772156649015329"),
    "a huge number": (Integer(10) ** 400 * x, "too large for a floating-point number"),
    "a tiny number": (x / Integer(10) ** 400, "too small for a floating-point number"),
    "a huge exponent": (x ** (10**20), "x**100000000000000000000: the exponent is beyond 2147483647"),
    "an exclusive or": (Piecewise((x, Xor(x > 0, y > 0)), (0, True)), "Xor has no compiled form; write it with And"),
    "deep kinks": (Abs(Abs(Abs(Abs(x) - 1) - 1) - d), "kinks stand more than 3 deep within each other"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_model_cannot_hold_is_refused_by_term(case):
    expression, message = REFUSED[case]
    with pytest.raises(ModelError) as refused:
        system(expression)
    assert message in str(refused.value)
    assert str(refused.value).startswith("model tried: ")


def test_the_place_is_named():
    wrong = {
        "kinetic energy": {"kinetic": half * m * (xdot**2 + ydot**2) * gamma(x)},
        "dissipation": {"dissipation": gamma(xdot)},
        "generalized force of y": {"generalized_forces": {y: gamma(x)}},
        "quantity s": {"quantities": [Quantity(s, gamma(x), "1", "stretch")]},
        "output s": {"outputs": [Output(s, gamma(x), "1", "stretch")]},
        "position of s": {"inputs": [Input(s, "m", "road", position=gamma(2 + 0 * x) + sympy.zeta(k))]},
    }
    for place, changes in wrong.items():
        with pytest.raises(ModelError, match=f"{place} uses .* has no compiled form"):
            system(k * x**2, **changes)


def test_what_is_complex_behind_a_name_is_refused_where_it_is_compared():
    named = [Quantity(s, log(sign(x)), "1", "logarithm")]
    with pytest.raises(ModelError, match=r"potential energy uses Abs\(log\(sign\(x\)\)\): in one of its cases it comp"):
        system(k * Abs(s), quantities=named)


def test_a_matrix_in_the_kinetic_energy_is_refused():
    with pytest.raises(ModelError, match=r"kinetic energy uses Matrix.*take its entry, \[0, 0\]"):
        system(kinetic=Matrix([[half * m * (xdot**2 + ydot**2)]]))


def test_what_is_no_part_of_a_system_is_refused():
    for changes, message in (
        ({"coordinates": [x]}, "coordinates holds x, expected Coordinate"),
        ({"outputs": [x]}, "outputs holds x, expected Output or Quantity"),
        ({"generalized_forces": [x]}, "generalized_forces is a list, expected a mapping"),
        ({"name": 5}, "the name '5' is not a valid identifier"),
        ({"title": 5}, "has no title"),
    ):
        with pytest.raises(ModelError, match=message):
            replace(system(k * x**2), **changes)


# Kinks alone, of each other, in functions, in conditions: the force and its derivative, by differences of the energy.
KINKS = [
    Abs(x) * Abs(y), Abs(x) ** 3, Abs(sin(3 * x)), sin(Abs(x)), sign(x) ** 2 * x**2, sign(x) * x**2, log(Abs(x)),
    Max(x, y, 0) ** 2, Min(x, y, d, 2 * x) ** 3, Max(Abs(x), y) ** 2, Abs(Max(x, y)), Max(x, Min(y, d)),
    Heaviside(Abs(x) - d) * (Abs(x) - d) ** 2, Heaviside(x) * Heaviside(y, 0) * x**2 * y**2,
    sign(Abs(x) - d) * (x**2 - d**2), Abs(Abs(x) - d) ** 3, Abs(Abs(Abs(x) - 1) - d), Max(sin(Abs(x)), cos(y)) ** 2,
    sign(sin(Abs(x)) - d) * (sin(x) ** 2 - d**2), Piecewise((k * y * Abs(x) ** 2, y < 0), (Max(x, 0) * y**2, True)),
    Piecewise((x**2 * y, (y < 0) & (x > 0)), (x * y**3, True)),
    Piecewise((x * y, (x > 0) | (y > 0)), (x**3 * y, ~((x < 0) & (y < -1))), (-(x**3), True)),
    Piecewise((x**2, x > Piecewise((1, y < 0), (1, True))), (x**3, True)), Piecewise((sin(x) / x, Ne(x, 0)), (1, True)),
    Piecewise((x**2, Eq(x, 1)), (x**3, True)), Piecewise((x**2, x < 0), (x**3, x >= 0)), sqrt(x**2), sqrt(x**2) ** 3,
    Max(x, 0) ** 2.5, (x + 2) ** y, (x**2) ** (y + Abs(x)), exp(-Abs(x) / d) * k,
]  # fmt: skip


@pytest.mark.parametrize("potential", KINKS, ids=str)
def test_kinks_and_kinks_of_kinks_are_differentiated_rightly(potential):
    made = system(potential + d * x * k)
    program = lowered(made)
    for point in POINTS:
        found = evaluated(program, "rhs", point)
        for place, by in ((2, x), (3, y)):
            expected = -slope(made.potential_energy, by, point) / point[m]
            assert found[f"derivative[{place}]"] == pytest.approx(expected, rel=1e-12, abs=1e-12)
        jacobian = evaluated(program, "jacobian", point)
        for column, by in enumerate((x, y)):
            h = 1e-6
            up, down = (evaluated(program, "rhs", point | {by: point[by] + side}) for side in (h, -h))
            for row in (2, 3):
                expected = (up[f"derivative[{row}]"] - down[f"derivative[{row}]"]) / (2 * h)
                assert jacobian.get(f"matrix[{row}, {column}]", 0.0) == pytest.approx(expected, rel=1e-6, abs=1e-6)


#: Their force would be an impulse where they jump; no derivative shows it.
JUMPS = [
    k * Heaviside(Abs(x) - d), sign(x), sign(Abs(x) - d) * x**2, sign(sin(Abs(x)) - d) * y**2,
    Piecewise((k * Abs(x) ** 2, y < 0), (Max(x, 0) ** 2, True)), Piecewise((x**2, (y < 0) & (x > 0)), (x**3, True)),
    Piecewise((x**2, x > 3), (x**3, True)), Piecewise((x, x > 1e-3), (2 * x, True)) * y, Heaviside(xdot - 1) * y,
]  # fmt: skip


@pytest.mark.parametrize("potential", JUMPS, ids=str)
def test_an_energy_that_jumps_is_refused_with_its_place(potential):
    with pytest.raises(ModelError) as refused:
        system(potential + half * k * y**2)
    assert "potential energy jumps where " in str(refused.value)
    assert "its force would be an impulse, which is lost" in str(refused.value)


def test_what_may_jump_is_no_energy_of_what_moves():
    system(k * x**2 * Heaviside(t - 1))
    system(k * x**2, generalized_forces={x: -d * sign(xdot) * Heaviside(Abs(x) - d)})
    system(k * x**2, dissipation=d * xdot**2 * Heaviside(x))
    with pytest.raises(ModelError, match="dissipation jumps where xdot passes 1"):
        system(k * x**2, dissipation=d * Heaviside(xdot - 1))
    with pytest.raises(ModelError, match="kinetic energy jumps where x passes 0"):
        system(k * x**2, kinetic=half * m * (xdot**2 * (1 + Heaviside(x)) + ydot**2))


def test_the_rate_of_a_quantity_with_kinks_is_its_time_derivative():
    stretch = Quantity(s, Abs(x) + Max(y, 0), "m", "stretch", rate=sdot)
    program = lowered(system(k * s**2, quantities=[stretch], dissipation=d * sdot**2 / 2))
    for point in POINTS:
        rate = sum(slope(Abs(x) + Max(y, 0), q, point) * point[v] for q, v in ((x, xdot), (y, ydot)))
        stretch = abs(point[x]) + max(point[y], 0)
        force = -(2 * point[k] * stretch + point[d] * rate) * slope(Abs(x), x, point)
        assert evaluated(program, "rhs", point)["derivative[2]"] == pytest.approx(force / point[m], rel=1e-12)


def functions():
    """Every function class of SymPy, by name."""
    for name in sorted(dir(sympy.functions)):
        kind = getattr(sympy.functions, name)
        if isinstance(kind, type) and issubclass(kind, Application):
            yield name, kind


def applied(kind):
    """An application to x, with as many arguments as it takes; None where SymPy does not know one."""
    for arguments in ((x,), (x, half + y), (2, x), (1, 2, x), (1, 1, 1, x)):
        try:
            found = kind(*arguments)
        except Exception:
            continue
        if isinstance(found, sympy.Expr) and isinstance(found, kind) and found.has(x):
            return found
    return None


def test_every_function_of_sympy_agrees_with_it_or_is_refused():
    accepted = set()
    for name, kind in functions():
        expression = applied(kind)
        if expression is None:
            continue
        outputs = [Output(s, expression, "1", "value")]
        try:
            program = lowered(system(k * expression, outputs=outputs))
        except ModelError as refused:
            reasons = ("has no compiled form", "kinks", "jumps where")
            assert any(reason in str(refused) for reason in reasons), name
            accepted |= {name} if "jumps where" in str(refused) else set()
            continue
        accepted.add(name)
        for point in ({**POINTS[0], x: 0.31}, {**POINTS[0], x: 1.9}, {**POINTS[0], x: -0.47}):
            expected = numeric(expression, list(point))(*point.values())
            if isinstance(expected, mpmath.mpc | complex):
                continue  # outside its domain
            assert evaluated(program, "outputs", point)["values[0]"] == pytest.approx(float(expected), rel=1e-13), name
            force = -point[k] * slope(expression, x, point) / point[m]
            assert evaluated(program, "rhs", point)["derivative[2]"] == pytest.approx(force, rel=1e-12), name
    assert accepted >= {each.__name__ for each in SMOOTH} | {"Abs", "sign", "Max", "Min", "Heaviside"}


def test_functions_of_a_domain_are_accepted():
    made = system(k * (asin(x) + acosh(2 + y) + asinh(x) + tan(x) + atan2(y, x)))
    point = POINTS[0]
    expected = -slope(made.potential_energy, x, point) / point[m]
    assert evaluated(lowered(made), "rhs", point)["derivative[2]"] == pytest.approx(expected, rel=1e-12)


M_xy = half * m * ydot**2
DOMAINS = {
    "arc cosine of a small length": (half * m * xdot**2 * acos(x / d) ** 2 + M_xy, {d: 0.3}),
    "relativistic": (m * k**2 * (1 - sqrt(1 - (xdot**2 + ydot**2) / k**2)), {k: 1.0}),
    "relativistic, slow": (m * k**2 * (1 - sqrt(1 - (xdot**2 + ydot**2) / k**2)), {k: 3e8}),
    "crank": (M_xy + half * m * xdot**2 / sqrt(1 - ((d + k * sin(x)) / s) ** 2), {d: 0.1, k: 0.3, s: 1.0}),
    "far from the origin": (M_xy + half * m * xdot**2 * sqrt(x**2 - 900), {}),
    "a logarithm": (M_xy + half * m * xdot**2 * log(x - 5 * k), {k: 1.0}),
    "singular at the origin": (M_xy + half * m * x**2 * xdot**2, {}),
    "a mass of zero by default": (half * k * xdot**2 + M_xy, {k: 0.0}),
    "a divisor of zero by default": (half * m / k * xdot**2 + M_xy, {k: 0.0}),
    "masses of different size": (half * m * xdot**2 + half * k * ydot**2, {m: 1e9, k: 1e-9}),
    "a kink": (half * m * Max(xdot, 2 * xdot) ** 2 + M_xy * (1 + Abs(x)), {}),
}


@pytest.mark.parametrize("case", DOMAINS)
def test_kinetic_energies_of_any_domain_are_probed_where_they_have_a_value(case):
    kinetic, values = DOMAINS[case]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        artefacts(system(kinetic=kinetic, defaults=DEFAULTS | values), "tried.py")


def test_a_kinetic_energy_without_any_value_is_told_and_not_refused():
    with pytest.warns(UserWarning, match="the kinetic energy has no real value near the default parameters"):
        system(kinetic=M_xy + m * xdot**2 * sqrt(-2 - x**2))


@pytest.mark.parametrize(
    ("kinetic", "message"),
    [
        (m * (xdot + ydot), "the mass matrix is singular: a motion of x has no kinetic energy"),
        (half * m * xdot**2 + k * ydot, "the mass matrix is singular: a motion of y has no kinetic energy"),
        (half * m * (xdot + ydot) ** 2, "the mass matrix is singular: a motion of x, y together has no kinetic energy"),
        (m * sqrt(xdot**2 + ydot**2), "the mass matrix is singular"),
        (m * xdot * ydot, "the kinetic energy is not positive: a motion of x has no kinetic energy"),
        (m * xdot * ydot + m * ydot**2, "the kinetic energy is not positive: a motion of x has no kinetic energy"),
    ],
)
def test_a_mass_matrix_that_cannot_be_inverted_is_refused(kinetic, message):
    with pytest.raises(ModelError, match=message):
        system(kinetic=kinetic)


def test_symbols_with_assumptions_work_throughout():
    X, Xdot = symbols("x xdot", real=True)
    M, K = symbols("m k", positive=True)
    made = System(
        name="tried", title="tried", coordinates=[Coordinate(X, "m", "first")],
        parameters=[Parameter(M, 2.0, "kg", "mass"), Parameter(K, 3.0, "N/m", "stiffness")],
        kinetic_energy=half * M * xdot**2, potential_energy=half * K * sqrt(x**2) ** 2 + sqrt(K**2) * Abs(exp(X)),
        dissipation=half * k * Xdot**2, parameter_sets={"soft": {K: 1.0}}, outputs=[Output(s, K * X, "N", "force")],
    )  # fmt: skip
    assert made == replace(made, coordinates=[Coordinate(x, "m", "first")])
    point = {x: 0.3, xdot: -0.2, m: 2.0, k: 3.0}
    expected = (-3.0 * 0.3 - 3.0 * math.exp(0.3) + 3.0 * 0.2) / 2.0
    assert evaluated(lowered(made), "rhs", point)["derivative[1]"] == pytest.approx(expected, rel=1e-14)
    assert "Symbol" not in artefacts(made, "tried.py")["tried.py"]


@pytest.mark.parametrize(
    ("symbol", "message"),
    [
        (
            Symbol("x", positive=True),
            r"x is declared with positive=True, to which nothing keeps it during a run: write ",
        ),
        (Symbol("x", imaginary=True), r"symbols are real here: write Symbol\('x', real=True\)"),
        (Symbol("x", commutative=False), "x is declared with commutative=False, and symbols are real here"),
        (Symbol("k", negative=True), "parameter k is declared with negative=True, and has the value 3.0"),
        (Symbol("k", even=True), "parameter k is declared with .*, and has the value 3.0"),
        (Symbol("k", positive=True), "parameter k is declared with positive=True, and has the value -1.0"),
    ],
)
def test_assumptions_that_nothing_keeps_are_refused_with_what_to_write(symbol, message):
    with pytest.raises(ModelError, match=message):
        system(
            k * x**2 + symbol, parameter_sets={"other": {k: -1.0}} if symbol.is_positive and symbol.name == "k" else {}
        )


LEAVES = st.sampled_from([x, y, k, d, xdot, t, Integer(2), Rational(1, 3), Float(0.7), Integer(0), pi])
ODD_LEAVES = st.sampled_from([zoo, oo, nan, I, Integer(10) ** 400, Dummy("x"), gamma(x), Sum(x, (d, 1, 3))])
ONE = [
    sin,
    cos,
    exp,
    Abs,
    sign,
    Heaviside,
    sympy.tanh,
    sympy.atan,
    lambda e: sqrt(1 + e**2),
    lambda e: e**2,
    lambda e: -e,
]
ODD_ONE = [floor, lambda e: _gamma(e), sympy.re, log, sqrt, acos, lambda e: 1 / e]
TWO = [
    *(lambda a, b: a + b, lambda a, b: a * b, lambda a, b: a - b, Max, Min, lambda a, b: _power(1 + a**2, b)),
    lambda a, b: Piecewise((a, x < y), (b, True)),
    lambda a, b: Piecewise((a, (b > 0) | (x > d)), (b, True)),
]
ODD_TWO = [lambda a, b: _power(a, b), lambda a, b: Piecewise((a, b > 0)), lambda a, b: a / b]


def expressions(leaves, one, two):
    def grown(inner):
        return st.one_of(
            st.tuples(st.sampled_from(one), inner).map(lambda pair: _made(pair[0], pair[1])),
            st.tuples(st.sampled_from(two), inner, inner).map(lambda three: _made(*three)),
        )

    return st.recursive(leaves, grown, max_leaves=6)


def _power(base, exponent):
    """SymPy itself writes out the digits of a number to the power of another, were it all night long."""
    if exponent.is_Integer and abs(exponent) > 1000:
        raise ValueError(f"the power {exponent}")
    return base**exponent


def _gamma(argument):
    """The same with the digits of a factorial."""
    if argument.is_Rational and abs(argument) > 1000:
        raise ValueError(f"the gamma function of {argument}")
    return gamma(argument)


def _made(function, *arguments):
    """SymPy itself does not compare complex numbers; of numbers of hundreds of digits it fails over its own message."""
    try:
        return function(*arguments)
    except (AttributeError, TypeError, ValueError):
        return arguments[0]


RIGHT = expressions(LEAVES, ONE, TWO)
ANY = expressions(LEAVES | ODD_LEAVES, ONE + ODD_ONE, TWO + ODD_TWO)
LIMITS = {"deadline": None, "suppress_health_check": list(HealthCheck)}


@given(RIGHT)
@settings(max_examples=60, **LIMITS)
def test_whatever_is_built_of_known_nodes_has_the_right_forces(potential):
    try:
        made = system(potential + half * k * x**2)
        program = lowered(made)
    except ModelError as refused:
        reasons = ("kinks stand more than", "re(", "beyond 2147483647", "jumps where")
        assert any(reason in str(refused) for reason in reasons)
        return
    for point in POINTS:
        expected = slope(made.potential_energy, y, point)
        if not made.potential_energy.has(xdot) and math.isfinite(expected) and abs(expected) < 1e8:
            found = evaluated(program, "rhs", point)["derivative[3]"]
            assert found == pytest.approx(-expected / point[m], rel=1e-9, abs=1e-9)


@given(ANY)
@settings(max_examples=80, **LIMITS)
def test_whatever_is_built_is_derived_or_refused(potential):
    try:
        lowered(system(potential))
    except ModelError as refused:
        assert str(refused).startswith("model tried: ")
