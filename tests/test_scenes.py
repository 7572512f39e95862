"""How models look: places beside the models' own kinematics, what a scene must not be, parts and what is generated."""

import ast

import numpy as np
import pytest
import sympy
from derived import generated_module
from models import shipped_once
from sympy import Rational, Symbol, cos, floor, pi, sin, symbols

import qddot
from qddot.codegen.generate import artefacts, formatted
from qddot.codegen.sources import shipped_names
from qddot.model import (
    Arrow,
    Bar,
    Constraint,
    Coordinate,
    Damper,
    Disc,
    Ground,
    Input,
    ModelError,
    Output,
    Parameter,
    Part,
    Polygon,
    Spring,
    System,
    Wheel,
)
from qddot.model.scene import numbers, scene_numbers
from qddot.runner.load import LoadError
from qddot.runner.ranges import expanded
from qddot.runner.scene.frames import numbers_at

x, xdot, xddot, m, k, w, theta, L = symbols("x xdot xddot m k w theta L")
HALF = Rational(1, 2)


def mass(**given):
    held = {
        "name": "mass",
        "title": "Mass on a spring",
        "coordinates": [Coordinate(x, "m", "displacement")],
        "parameters": [Parameter(m, 2.0, "kg", "mass"), Parameter(k, 80.0, "N/m", "stiffness")],
        "inputs": [Input(w, "m", "ground", position=0)],
        "kinetic_energy": HALF * m * xdot**2,
        "potential_energy": HALF * k * (x - w) ** 2,
    }
    return System(**held | given)


def test_a_scene_is_its_expressions(system, kernels, points):
    """The kernel beside SymPy's own arithmetic, number by number."""
    names = [Symbol("t"), *(c.symbol for c in system.coordinates), *(c.rate for c in system.coordinates)]
    names += [Symbol(row[0]) for row in expanded(kernels.INPUT)] + [each.symbol for each in system.parameters]
    definitions = []
    for symbol, definition in system.definitions.items():
        definitions.append(sympy.lambdify([names], definition, modules="math"))
        names.append(symbol)
    written = [expression for _, _, expression in scene_numbers(system)]
    reference = sympy.lambdify([names], written, modules="math")
    for time, state, u, p, c in points[:5]:
        found = np.empty(len(written))
        kernels.scene.py_func(time, state, u, c, found)
        known = [time, *state, *u, *p]
        for definition in definitions:
            known.append(definition(known))
        assert found == pytest.approx(reference(known), rel=1e-11, abs=1e-11)


def drawn(name, run, t):
    """The numbers (n,) of each shape of a shipped model's scene at a time of a run, in order."""
    simulation, at = run.between.simulation, run.at([t])
    n = run.n_states
    channels = at.values[:, n + run.n_outputs :]
    found = numbers_at(simulation.model, simulation.problem.constants, np.array([t]), at.values[:, :n], channels)[0]
    shapes = simulation.model.tables.scene
    return at, np.split(found, np.cumsum([shape.size for shape in shapes])[:-1])


def of_kind(name, parts, kind):
    return [part for shape, part in zip(qddot.load(name).tables.scene, parts, strict=True) if shape.kind == kind]


def test_rods_end_where_the_models_outputs_say_and_keep_their_lengths():
    start = {"double_pendulum": {"theta_1": 1.0, "theta_2": -2.0}, "pendulum": {"theta_1": 0.4, "theta_3": 2.0}}
    start["cart_pole"] = {"theta": 2.0, "x": 0.3}
    ends = {"double_pendulum": ("x_2", "y_2"), "pendulum": ("x_tip", "y_tip"), "cart_pole": ("x_tip",)}
    for name, initial in start.items():
        run = qddot.simulate(qddot.load(name), (0, 1), method="dop853", initial=initial)
        at, parts = drawn(name, run, 0.7)
        bars = of_kind(name, parts, "bar")
        for number, output in zip(bars[-1][2:4], ends[name], strict=False):
            assert number == pytest.approx(at[output][0], abs=1e-12)
        for bar in bars:
            assert np.hypot(*(bar[2:4] - bar[:2])) == pytest.approx(1.0, abs=1e-12)


def test_a_linkage_is_closed_and_the_arrow_is_the_force_in_its_pin():
    model = qddot.load("four_bar")
    guess = {"theta_2": 0.7, "theta_3": 1.6}
    initial = {"theta_1": 0.35, "thetadot_1": 3.0}
    run = qddot.simulate(model, (0, 0.5), method="dop853", rtol=1e-9, initial=initial, guess=guess)
    at, parts = drawn("four_bar", run, 0.4)
    rocker, coupler, crank = of_kind("four_bar", parts, "bar")
    assert coupler[2:4] == pytest.approx(rocker[2:4], abs=1e-9)  # where the two constraints hold them together
    assert crank[2:4] == pytest.approx([at["x_pin"][0], at["y_pin"][0]], abs=1e-12)
    (arrow,) = of_kind("four_bar", parts, "arrow")
    assert arrow[2:] == pytest.approx([at["lam_x"][0], at["lam_y"][0]], rel=1e-9)


@pytest.mark.parametrize("chosen", [None, *qddot.load("m113").tables.parameter_sets])
def test_the_m113_stands_level_on_its_wheels_whatever_its_springs_and_load(chosen):
    """The scene's closed form of the static state, beside Newton's."""
    model = qddot.load("m113")
    rest = qddot.equilibrium(model, chosen)
    c = model.constants(model.parameter_values(chosen))
    found = numbers_at(model, c, np.zeros(1), rest[None], np.zeros((1, len(model.tables.inputs))))[0]
    parts = np.split(found, np.cumsum([shape.size for shape in model.tables.scene])[:-1])
    hull = of_kind("m113", parts, "polygon")[0]
    assert hull[-4:-1] == pytest.approx([0.0, 1.3, 0.0], abs=1e-9)
    assert [wheel[1] for wheel in of_kind("m113", parts, "wheel")[2:]] == pytest.approx([0.34] * 5, abs=1e-9)
    muzzle = of_kind("m113", parts, "bar")[0][2:4]
    assert muzzle == pytest.approx([3.0, 2.3])


def test_the_m113s_gun_moves_with_its_barrel_and_fires_forward():
    model = qddot.load("m113")
    shot = qddot.signal.pulse_train(times=[0.1], duration=0.1, impulse=605.0)
    run = qddot.simulate(model, (0, 1), method="exact", step=1e-3, parameters="as_run_unloaded", inputs={"F": shot})
    before, firing, after = (drawn("m113", run, t) for t in (0.0, 0.15, 0.6))
    moved = after[0]["barrel_end"][0] - before[0]["barrel_end"][0]  # for small angles
    gun = [of_kind("m113", parts, "bar")[0] for _, parts in (before, after)]
    assert abs(moved) > 0.01
    assert gun[1][3] - gun[0][3] == pytest.approx(moved, rel=0.02)
    flash = of_kind("m113", firing[1], "polygon")[-1]
    assert flash[-1] > 0 and of_kind("m113", after[1], "polygon")[-1][-1] == 0
    assert max(flash[0:-5:2]) > 0.5  # its tip ahead of the muzzle
    (recoil,) = of_kind("m113", firing[1], "arrow")
    assert recoil[2] == pytest.approx(-firing[0]["F"][0]) and recoil[2] < 0


def test_every_shipped_model_has_a_scene_that_moves():
    for name in shipped_names():
        system = shipped_once(name)
        held = set().union(*(sympy.sympify(each).free_symbols for _, _, each in scene_numbers(system)))
        coordinates = {coordinate.symbol for coordinate in system.coordinates}
        assert coordinates <= held, name
        assert all(channel.symbol in held for channel in system.inputs if channel.unit == "m"), name


def test_nothing_that_is_computed_depends_on_a_scene():
    """The text of the module without the scene's table and function is that of the model without a scene."""
    bare, seen = (
        formatted(artefacts(each, "m.py"))["mass.py"]
        for each in (mass(), mass(scene=[Ground([(0, w)]), Spring((0, w), (0, 1 + x)), Disc((0, 1 + x), 0.1)]))
    )

    def without(text):
        body = [node for node in ast.parse(text).body if "SCENE" not in ast.unparse(node)[:6]]
        return [ast.unparse(node) for node in body if getattr(node, "name", "") != "scene"]

    assert "SCENE" not in bare and "def scene" not in bare and "SCENE" in seen
    assert without(bare) == without(seen)


def test_a_scene_may_use_what_outputs_may(tmp_path):
    """Accelerations, multipliers, reactions: the thread's pull on a bead that hangs from it."""
    y, ydot, yddot, lam = symbols("y ydot yddot lam")
    system = System(
        name="bead",
        title="Bead on a thread",
        coordinates=[Coordinate(x, "m", "across"), Coordinate(y, "m", "up")],
        parameters=[Parameter(m, 0.5, "kg", "mass"), Parameter(L, 1.2, "m", "length")],
        kinetic_energy=HALF * m * (xdot**2 + ydot**2),
        potential_energy=Rational(981, 100) * m * y,
        constraints=[Constraint(lam, (x**2 + y**2 - L**2) / (2 * L), "N", "pull")],
        scene=[
            Arrow((x, y), (Symbol("reaction_x"), Symbol("reaction_y"))),
            Arrow((x, y), (-lam * x / L, -lam * y / L)),
            Arrow((x, y), (m * xddot, m * yddot)),
        ],
    )
    model = qddot.load(qddot.generate(system, tmp_path))
    c = model.constants(model.parameter_values())
    at = 0.7
    state = np.array([[1.2 * np.sin(at), -1.2 * np.cos(at), 0.3 * np.cos(at), 0.3 * np.sin(at)]])
    pull, other, total = numbers_at(model, c, np.zeros(1), state, np.zeros((1, 0)))[0].reshape(3, 4)[:, 2:]
    toward_pivot = np.array([-np.sin(at), np.cos(at)])
    expected = 0.5 * (9.81 * np.cos(at) + 0.3**2 / 1.2)  # the weight's part along the thread, and v^2 / L
    assert pull == pytest.approx(expected * toward_pivot, rel=1e-12)
    assert other == pytest.approx(pull, rel=1e-12)
    assert total == pytest.approx(pull - np.array([0, 0.5 * 9.81]), rel=1e-12)


F = Symbol("F")


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (3, "scene[0] is 3, expected Disc, Bar, Spring, Damper, Wheel, Polygon, Ground, Arrow"),
        (Spring(0, (0, x)), "scene[0], spring: start is 0, expected a pair (x, y)"),
        (Bar((0, 0), (0, x, 1)), "scene[0], bar: end is (0, x, 1), expected a pair (x, y)"),
        (Polygon([(0, 0), (1, 1)]), "scene[0], polygon: it has 2 corners, expected 3 or more"),
        (Ground([]), "scene[0], ground: it has 0 points, expected 1 or more"),
        (Ground(x), "scene[0], ground: points is x, expected pairs (x, y)"),
        (Ground([0, x]), "scene[0], ground: points is (0, x), expected pairs (x, y)"),
        (Disc((0, x), colour="bleu"), "scene[0], disc: the colour 'bleu' is not known; did you mean blue?"),
        (Disc((0, x), colour="#fff"), "the colour '#fff' is not known, expected one of blue, olive, sand,"),
        (Polygon([(0, 0), (1, 1), (x, 0)], filled=1), "scene[0], polygon: filled is 1, expected True or False"),
        (Spring((0, "w"), (0, x)), "scene[0], spring: start, y is a str, expected a SymPy expression"),
        (Disc((0, True)), "scene[0], disc: at, y is a bool, expected a SymPy expression"),
        (Spring((0, w), (0, x + k)), None),
        (Disc((0, k * x)), "scene[0], disc: at, y is in kg m/s^2, expected m: it is k*x"),
        (Damper((0, w), (0, x), m), "scene[0], damper: width is in kg, expected m: it is m"),
        (Wheel((0, x), 0.3, angle=x), "scene[0], wheel: angle is in m, expected rad: it is x"),
        (Arrow((0, x), (0, m * xdot)), "scene[0], arrow: force, y is in kg m/s, expected N: it is m*xdot"),
        (Disc((0, F)), "scene[0], disc: at, y uses F, which is not declared"),
        (Disc((0, Symbol("wdott"))), "at, y uses wdott, which is not declared; did you mean wdot?"),
        (Disc((0, floor(x))), "scene[0], disc: at, y uses floor(x): floor has no compiled form"),
        (Disc((0, x), 1 / sympy.Integer(0)), "scene[0], disc: radius uses zoo: something is divided by zero"),
    ],
)
def test_a_bad_scene_is_refused_by_name(shape, message):
    if message is None:
        mass(scene=[shape])  # x + k: nothing is certain of a sum of a length and a stiffness
        return
    with pytest.raises(ModelError) as caught:
        mass(scene=[shape])
    assert message in str(caught.value)


def test_all_that_is_wrong_is_told_at_once():
    with pytest.raises(ModelError) as caught:
        mass(scene=[Disc((0, k * x)), Wheel((0, x), k)])
    assert "scene[0], disc" in str(caught.value) and "scene[1], wheel: radius" in str(caught.value)


def test_what_a_scene_alone_uses_is_used():
    r = Symbol("r")
    parameters = [
        Parameter(m, 2.0, "kg", "mass"),
        Parameter(k, 80.0, "N/m", "stiffness"),
        Parameter(r, 0.1, "m", "size"),
    ]
    with pytest.raises(ModelError, match="parameter r is used nowhere"):
        mass(parameters=parameters)
    assert mass(parameters=parameters, scene=[Disc((0, x), r)]).scene[0].radius == r


def test_parts_carry_their_scenes_with_them():
    z, ahead, c = symbols("z ahead c")
    wheel = Part(
        "wheel",
        coordinates=[Coordinate(z, "m", "height")],
        parameters=[Parameter(m, 1.0, "kg", "mass"), Parameter(ahead, 1.0, "m", "place")],
        kinetic_energy=HALF * m * Symbol("zdot") ** 2,
        scene=[Wheel((ahead, z), 0.3), Spring((ahead, z), (ahead, Symbol("h")), when=Symbol("zdot"))],
    )
    body = Part(
        "body",
        coordinates=[Coordinate(Symbol("h"), "m", "height")],
        parameters=[Parameter(c, 2.0, "kg", "mass")],
        kinetic_energy=c * Symbol("hdot") ** 2,
        scene=[Polygon([(0, 0), (1, 0), (0, 1)], at=(0, Symbol("h")))],
    )
    system = (body + wheel("1", ahead=2.0) + wheel("2", "rear", ahead=-Symbol("b"))
              + Part("base", parameters=[Parameter(Symbol("b"), 1.5, "m", "half")])).system("car", "Car")  # fmt: skip
    kinds = [type(shape).__name__ for shape in system.scene]
    assert kinds == ["Polygon", "Wheel", "Spring", "Wheel", "Spring"]
    assert [str(each) for _, _, each in numbers(system.scene[1])] == ["ahead_1", "z_1", "0.3"]
    assert [str(each) for _, _, each in numbers(system.scene[4])] == ["-b", "z_2", "-b", "h", "0", "zdot_2"]
    renamed = wheel.renamed({"z": "y"})
    assert [str(each) for _, _, each in numbers(renamed.scene[1])][-1] == "ydot"


def test_a_float_of_zero_is_zero(tmp_path):
    """In a place as in an energy: 0.0 was refused as too small."""
    system = mass(potential_energy=HALF * k * (x - w) ** 2 + 0.0, scene=[Spring((0.0, w), (0.0, x))])
    module = generated_module(system, tmp_path)
    values = np.empty(5)
    module.scene.py_func(0.0, np.array([0.5, 0.0]), np.array([0.1, 0.0]), np.array([2.0, 80.0, 40.0]), values)
    assert values.tolist() == [0.0, 0.1, 0.0, 0.5, 0.0]


def test_angles_of_a_turned_body_count_as_in_mathematics(tmp_path):
    """A polygon and a bar that say the same place in two ways, drawn."""
    from qddot.runner.scene.frames import Box
    from qddot.runner.scene.strokes import strokes

    corner = (L * cos(theta) - HALF * L * sin(theta), L * sin(theta) + HALF * L * cos(theta))
    system = System(
        name="plate",
        title="Plate",
        coordinates=[Coordinate(theta, "rad", "angle")],
        parameters=[Parameter(L, 2.0, "m", "length")],
        kinetic_energy=L**2 * Symbol("thetadot") ** 2 / L**2,
        outputs=[Output(Symbol("turns"), theta / (2 * pi), "1", "turns")],
        scene=[Polygon([(0, 0), (L, HALF * L), (0, L)], angle=theta), Bar((0, 0), corner)],
    )
    model = qddot.load(qddot.generate(system, tmp_path))
    state = np.array([[0.7, 0.0]])
    found = numbers_at(model, model.constants(model.parameter_values()), np.zeros(1), state, np.zeros((1, 0)))[0]
    plate, bar = model.tables.scene
    box = Box(-3.0, -3.0, 3.0, 3.0)
    turned = strokes(plate, found[: plate.size].tolist(), box, None, 0.0)[0].points[1]
    end = strokes(bar, found[plate.size :].tolist(), box, None, 0.0)[0].points[1]
    assert turned == pytest.approx(end, abs=1e-12)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ('"spring"', '"sprung"', r"SCENE\[1\] is of kind 'sprung', expected one of disc, bar, spring"),
        ('("spring", "orange", 5,', '("spring", "orange", 4,', r"SCENE\[1\] has 4 numbers, too few for a spring"),
        ('("spring", "orange", 5,', '("spring", "orange", "5",', r"SCENE\[1\] is .*expected \(kind, colour, size,"),
        ("def scene(", "def scenes(", "kernel 'scene' is missing"),
    ],
)
def test_a_malformed_scene_of_a_module_is_refused(tmp_path, before, after, message):
    path = qddot.generate(mass(scene=[Ground([(0, w)]), Spring((0, w), (0, x))]), tmp_path)
    text = path.read_text()
    assert text.count(before) == 1
    path.write_text(text.replace(before, after))
    with pytest.raises(LoadError, match=message):
        qddot.load(path)


def test_the_kernel_is_compiled_when_it_is_wanted(tmp_path):
    model = qddot.load(qddot.generate(mass(scene=[Disc((0, x))]), tmp_path))
    run = qddot.simulate(model, (0, 1), step=0.01)
    assert "scene" not in model._kernels
    run.animate()
    assert "scene" in model._kernels
