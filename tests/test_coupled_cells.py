"""Equal parts on a hub, all coupled by its motion: one loop over them gives what each written out gives."""

from dataclasses import dataclass
from pathlib import Path
from runpy import run_path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from sympy import Add, Rational, Symbol, cos, sin, symbols

import qddot
from qddot.codegen import lagrange
from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower
from qddot.codegen.render import module
from qddot.model.pendulum import system as pendulum
from qddot.model.system import Coordinate, Input, Output, Parameter, Quantity, State, System
from qddot.runner.machine.coupled import table_of
from qddot.runner.ranges import expanded, placed

HALF = Rational(1, 2)
X, TURN, XDOT, TURNDOT = symbols("x turn xdot turndot")


@dataclass(frozen=True)
class Wheel:
    """n arms on a hub; named: their speeds have names; own: lengths of each; the rest: what else there is.

    jumbled: parameters stand in the order of their names as texts.
    """

    n: int
    named: bool = False
    own: bool = False
    two: bool = False
    interleaved: bool = False
    hub_last: bool = False
    odd: int | None = None
    inputs: bool = False
    states: bool = False
    jumbled: bool = False


wheels = st.builds(
    Wheel,
    n=st.integers(8, 13),
    odd=st.none() | st.integers(0, 12),
    **dict.fromkeys(("named", "own", "two", "interleaved", "hub_last", "inputs", "states", "jumbled"), st.booleans()),
)


def system(kind: Wheel, name: str = "wheel") -> System:
    """A hub that slides and turns, with arms that swing on its rim, and sliders on them."""
    arms = range(1, kind.n + 1)
    a, b = ([Symbol(f"{letter}_{i}") for i in arms] for letter in "ab")
    adot, bdot = ([Symbol(f"{letter}dot_{i}") for i in arms] for letter in "ab")
    M, I, m, r, k, c, g = symbols("M I m r k c g")  # noqa: E741
    lengths = [Symbol(f"l_{i}") if kind.own else Symbol("l") for i in arms]
    kinetic, potential, dissipation, quantities = [M * XDOT**2 / 2, I * TURNDOT**2 / 2], [], [c * XDOT**2 / 2], []
    for i in range(kind.n):
        at, length = TURN + a[i], lengths[i] + (b[i] if kind.two else 0)
        speeds = {
            "v": XDOT - length * sin(at) * (TURNDOT + adot[i]) + r * cos(TURN) * TURNDOT,
            "w": length * cos(at) * (TURNDOT + adot[i]) + r * sin(TURN) * TURNDOT + (bdot[i] if kind.two else 0),
        }
        for letter, speed in speeds.items():
            symbol = Symbol(f"{letter}_{i + 1}")
            quantities.append(Quantity(symbol, speed, "m/s", f"speed {letter} of arm {i + 1}"))
            kinetic.append(m * (symbol if kind.named else speed) ** 2 / 2)
        potential += [m * g * length * sin(at), HALF * k * (a[i] - HALF) ** 2]
        potential += [HALF * k * b[i] ** 2] if kind.two else []
        potential += [k * cos(3 * a[i])] if i == kind.odd else []
        dissipation += [c * adot[i] ** 2 / 2 + (c * bdot[i] ** 2 / 2 if kind.two else 0)]
    z = [Symbol(f"z_{i}") for i in arms]
    u = [Symbol(f"u_{i}") for i in arms]
    forces = {each: torque * cos(each) for each, torque in zip(a, u, strict=True)} if kind.inputs else {}
    forces |= {each: forces.get(each, 0) - slow for each, slow in zip(a, z, strict=True)} if kind.states else {}
    hub = [Coordinate(X, "m", "place of the hub"), Coordinate(TURN, "rad", "angle of the hub")]
    of_arms = [*a, *(b if kind.two else ())]
    if kind.two and kind.interleaved:
        of_arms = [each for pair in zip(a, b, strict=True) for each in pair]
    coordinates = [Coordinate(each, "1", f"coordinate {each}") for each in of_arms]
    parameters = [
        (M, 9),
        (I, 7),
        (m, 1),
        (r, 0.6),
        (k, 2),
        (c, 0.1),
        (g, 9.81),
        *((each, 0.4) for each in dict.fromkeys(lengths)),
    ]
    parameters.sort(key=lambda each: str(each[0]) if kind.jumbled else "")
    return System(
        name=name,
        title="Arms on a hub",
        coordinates=(*coordinates, *hub) if kind.hub_last else (*hub, *coordinates),
        quantities=tuple(quantities) if kind.named else (),
        states=tuple(State(z[i], adot[i] - z[i], "1", f"filter {i}") for i in range(kind.n)) if kind.states else (),
        inputs=tuple(Input(each, "N m", f"torque {each}") for each in u) if kind.inputs else (),
        parameters=tuple(Parameter(each, float(value), "1", f"{each}") for each, value in parameters),
        kinetic_energy=Add(*kinetic),
        potential_energy=Add(*potential),
        dissipation=Add(*dissipation),
        generalized_forces=forces,
        outputs=(
            Output(Symbol("thrust"), M * Symbol("xddot"), "N", "force on the hub"),
            Output(Symbol("swing"), Add(*(Symbol(f"addot_{i}") for i in arms)), "rad/s^2", "sum of accelerations"),
        ),
    )


def text_of(made: System, *, folds: bool) -> str:
    """The module, its accelerations solved for at run time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lagrange, "_LONGEST_ELIMINATION", 0)
        patch.setattr(lagrange, "_SPARSE", 0)
        return module(lower(derive(made), folds=folds), "test.py", ())


def function(text: str, name: str) -> str:
    """The text of one of its functions, without the docstring."""
    return text.split(f"\ndef {name}(")[1].split("\n@")[0].split('"""')[2]


def model_of(text: str, path):
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, "utf-8")
    return qddot.load(path)


class Solved:
    """What a module calls, by NumPy: M on and above the diagonal is filled, and M a = f solved."""

    def blank(self, rows, columns):
        return np.zeros((rows, columns))

    def coupled(self, n, factors):
        return np.zeros((n, n)), np.zeros(n), table_of(factors)

    def decoupled(self, M, factors, f):
        self.whole = np.triu(M) + np.triu(M, 1).T
        f[:] = np.linalg.solve(self.whole, f)

    def slopes(self, M, factors, forces, values, start):
        n, columns = forces.shape
        for row, slopes in zip(factors[factors[n] :], np.linalg.solve(self.whole, forces), strict=True):
            values[start + row * columns : start + (row + 1) * columns] = slopes


def kernels(path: Path, seed: int) -> dict[str, np.ndarray]:
    """What the functions of a module give, run as Python at a state, an input and a time drawn by a seed."""
    found, rng = run_path(str(path)), np.random.default_rng(seed)
    solved = Solved()
    stand_ins = {name: getattr(solved, name) for name in ("blank", "coupled", "decoupled", "slopes")}
    found["rhs"].py_func.__globals__.update(stand_ins)
    parameters = [row[1:2] for row in expanded(found["PARAMETER"])]
    x, u = rng.uniform(-0.5, 0.5, len(expanded(found["STATE"]))), rng.uniform(-1, 1, len(expanded(found["INPUT"])))
    c = np.zeros(len(parameters) + len(expanded(found["CONSTANT"])))
    found["constants"].py_func(np.ravel(parameters), c)
    sizes = {"rhs": len(x), "energy": 4, "outputs": 2}
    sizes |= {name: sum(map(len, placed(found[name.upper()]))) for name in ("jacobian", "input_jacobian", "mass")}
    given = {name: np.full(size, np.nan) for name, size in sizes.items()}
    for name, values in given.items():
        found[name].py_func(0.3, x, u, c, values)
    return given


@settings(max_examples=3, deadline=None, print_blob=True)
@given(kind=wheels, seed=st.integers(0, 2**32 - 1))
@example(kind=Wheel(8), seed=1)
@example(kind=Wheel(9, named=True, own=True, two=True, interleaved=True, states=True), seed=2)
@example(kind=Wheel(12, own=True, jumbled=True), seed=4)
@example(kind=Wheel(10, named=True, two=True, hub_last=True, inputs=True, odd=4), seed=3)
def test_a_loop_over_parts_gives_what_they_give_written_out(kind, seed, tmp_path_factory):
    made = system(kind)
    loops, plain = (text_of(made, folds=folds) for folds in (True, False))
    assert "decoupled(" in plain
    assert "range(" not in function(plain, "rhs")
    folder, found = tmp_path_factory.mktemp("wheel"), []
    for text in (loops, plain):
        (folder / "wheel.py").write_text(text, "utf-8")
        found.append(kernels(folder / "wheel.py", seed))
    one, other = found
    for name, value in one.items():
        scale = 1e-11 * max(1.0, np.abs(other[name]).max(initial=0.0))
        np.testing.assert_allclose(value, other[name], rtol=1e-11, atol=scale, err_msg=name)


@pytest.mark.parametrize(
    "kind",
    [
        {},
        {"own": True, "named": True},
        {"two": True, "interleaved": True, "inputs": True},
        {"two": True, "states": True},
    ],
    ids=str,
)
def test_what_is_computed_does_not_grow_with_the_number_of_parts(kind):
    few, many = (text_of(system(Wheel(n, **kind)), folds=True) for n in (9, 14))
    for name in ("rhs", "jacobian", "energy", "outputs"):
        one, other = (function(text, name) for text in (few, many))
        assert "for " in one
        assert len(other) < 1.03 * len(one), name


def test_what_is_done_for_the_same_parts_is_one_loop():
    """The hub's rows are sums over the arms, and so is what the solved accelerations go into."""
    made = text_of(system(Wheel(9, named=True)), folds=True)
    filled, solved = function(made, "rhs").split("decoupled(")
    assert filled.count("for ") == 1
    assert "mass_matrix[9, 10] = mass_matrix[9, 10] + " in filled
    assert "for " in solved
    before, after = function(made, "jacobian").split("decoupled(")
    assert before.split("coupled(")[1].count("for ") == 1
    assert sum("forces[" in loop for loop in after.split("\n    for ")[1:]) == 1


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """A model with loops over its parts, and the same with all of them written out."""
    made, folder = system(Wheel(8, named=True, own=True)), tmp_path_factory.mktemp("both")
    return [model_of(text_of(made, folds=folds), folder / str(folds) / "wheel.py") for folds in (True, False)]


@pytest.mark.parametrize("method", ["dop853", "ode15s", "taylor"])
def test_runs_of_loops_are_those_of_parts_written_out(both, method):
    initial = {"x": 0.1, "turn": 0.4, "a_3": 0.3, "adot_8": -1.0}
    given = {"initial": initial, "method": method, "rtol": 1e-9, "atol": 1e-11}
    loops, plain = (qddot.simulate(model, (0, 0.5), **given) for model in both)
    np.testing.assert_allclose(loops.states[-1], plain.states[-1], rtol=0, atol=1e-8)


def test_an_odd_part_stays_beside_the_loop():
    text = function(text_of(system(Wheel(15, odd=5)), folds=True), "rhs")
    assert "math.sin(3" in text
    assert "for " in text


def test_where_no_half_of_what_is_written_repeats_all_is_written_out():
    """A row of its own length for each link of a pendulum is no cell: loops would be as many as rows."""
    assert "for " not in function(text_of(pendulum(12), folds=True), "rhs")
