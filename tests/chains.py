"""Chains of all kinds: what a cell is made of, and where one is another, drawn at random."""

from dataclasses import dataclass, field, replace

from hypothesis import strategies as st
from sympy import Rational, Symbol, cos, exp, tanh

from qddot.model.system import Coordinate, Input, Output, Parameter, Quantity, State, System

HALF = Rational(1, 2)


@dataclass(frozen=True)
class Kind:
    """n cells; odd: those with a spring of their own; own: parameters of each cell; the rest: what else there is."""

    n: int
    odd: frozenset[int] = field(default_factory=frozenset)
    own: bool = False
    two: bool = False
    interleaved: bool = False
    second: bool = False
    cubic: bool = False
    coupling: str = ""
    ground: str = ""
    hub: bool = False
    named: bool = False
    states: bool = False
    inputs: bool = False
    reversed: bool = False


kinds = st.builds(
    Kind,
    n=st.integers(9, 30),
    odd=st.frozensets(st.integers(0, 29), max_size=2),
    ground=st.sampled_from(["", "cos", "tanh", "quotient"]),
    coupling=st.sampled_from(["", "exp", "cos"]),
    **dict.fromkeys(
        ("own", "two", "interleaved", "second", "cubic", "hub", "named", "states", "inputs", "reversed"),
        st.booleans(),
    ),
)


def renamed(made: System, names: dict[str, str]) -> System:
    """The same system with other names of symbols in its parameters and energies."""
    changed = {Symbol(old): Symbol(new) for old, new in names.items()}
    return replace(
        made,
        parameters=tuple(replace(each, symbol=changed.get(each.symbol, each.symbol)) for each in made.parameters),
        kinetic_energy=made.kinetic_energy.xreplace(changed),
        potential_energy=made.potential_energy.xreplace(changed),
        dissipation=made.dissipation.xreplace(changed),
        outputs=tuple(replace(each, expression=each.expression.xreplace(changed)) for each in made.outputs),
    )


def system(kind: Kind, name: str = "row") -> System:  # noqa: PLR0912 - a branch for each thing that there may be
    """A chain of this kind."""
    cells = range(1, kind.n + 1)
    x, y = ([Symbol(f"{each}_{i}") for i in cells] for each in "xy")
    xdot, ydot = ([Symbol(f"{each}dot_{i}") for i in cells] for each in "xy")
    parameters: dict[str, Parameter] = {}

    def parameter(letter: str, i: int | None = None) -> Symbol:
        symbol = Symbol(f"{letter}_{i + 1}" if i is not None and kind.own else letter)
        parameters.setdefault(str(symbol), Parameter(symbol, 1.5, "1", f"parameter {letter}"))
        return symbol

    families = [(x, xdot), (y, ydot)] if kind.two else [(x, xdot)]
    kinetic, potential, dissipation, outputs, quantities, states = [], [], [], [], [], []
    for q, v in families:
        for i in range(kind.n):
            kinetic.append(HALF * parameter("m", i) * v[i] ** 2)
            stretch, rate = (q[i] - q[i - 1], v[i] - v[i - 1]) if i else (q[0], v[0])
            if kind.named and q is x:
                name_of = Symbol(f"s_{i + 1}")
                quantities.append(Quantity(name_of, stretch, "1", f"stretch {i + 1}"))
                stretch = name_of
            potential.append(HALF * parameter("k", i) * stretch**2)
            dissipation.append(HALF * parameter("c") * rate**2)
            if kind.cubic:
                potential.append(parameter("b", i) * stretch**4 / 4)
            if kind.coupling == "exp":
                potential.append(parameter("l", i) * (exp(-stretch) + stretch))
            elif kind.coupling == "cos":
                potential.append(-parameter("l", i) * cos(stretch))
            if kind.second and i > 1:
                potential.append(HALF * parameter("d") * (q[i] - q[i - 2]) ** 2)
            if kind.ground == "cos":
                potential.append(-parameter("g") * cos(q[i]))
            elif kind.ground == "quotient":
                potential.append(parameter("g") / (2 + q[i] ** 2))
            if i in kind.odd:
                potential.append(parameter("e") * q[i] ** 2)
    if kind.two:
        potential += [parameter("a") * x[i] * y[i] ** 2 for i in range(kind.n)]
    h, hdot = Symbol("h"), Symbol("hdot")
    if kind.hub:
        kinetic.append(parameter("M") * hdot**2)
        potential += [HALF * parameter("k_h") * (h - each) ** 2 for each in x]
    u = [Symbol(f"u_{i}") for i in cells]
    forces = {x[i]: u[i] for i in range(kind.n)} if kind.inputs else {}
    if kind.ground == "tanh":
        forces = {each: forces.get(each, 0) - parameter("g") * tanh(speed) for each, speed in zip(x, xdot, strict=True)}
    if kind.states:
        z = [Symbol(f"z_{i}") for i in cells]
        states = [State(z[i], (x[i] - z[i]) / parameter("tau"), "1", f"filter {i + 1}") for i in range(kind.n)]
        forces = {x[i]: forces.get(x[i], 0) - parameter("f") * z[i] for i in range(kind.n)}
    outputs += [
        Output(Symbol(f"p_{i + 1}"), parameter("m", i) * xdot[i], "1", f"momentum {i + 1}") for i in range(kind.n)
    ]
    outputs.append(Output(Symbol("p"), sum(parameter("m", i) * xdot[i] for i in range(kind.n)), "1", "momentum"))
    ordered = [each for q, _ in families for each in q]
    if kind.two and kind.interleaved:
        ordered = [each for pair in zip(x, y, strict=True) for each in pair]
    ordered = ordered[::-1] if kind.reversed else ordered
    made = [Coordinate(each, "1", f"displacement {each}") for each in [*([h] if kind.hub else []), *ordered]]
    return System(
        name=name,
        title="A row",
        coordinates=tuple(made),
        states=tuple(states),
        parameters=tuple(parameters.values()),
        inputs=tuple(Input(each, "1", f"force {each}") for each in u) if kind.inputs else (),
        quantities=tuple(quantities),
        kinetic_energy=kinetic,
        potential_energy=potential,
        dissipation=dissipation,
        generalized_forces=forces,
        outputs=tuple(outputs),
    )
