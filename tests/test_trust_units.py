"""No text that is not a number with a unit is read as a number, and every unit is worth what it is worth."""

import math
import re
import subprocess
import sys
from pathlib import Path

import pint
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from promptness import within
from sympy import Symbol
from test_walls import ROOT

from qddot.model.system import Coordinate, Input, ModelError, Parameter, System
from qddot.runner.inputs.csv_table import table_from_csv
from qddot.runner.study.batch_schema import SweepTable
from qddot.runner.study.sweep import sweep_of
from qddot.runner.study.units import magnitude
from qddot.units.amounts import amount_in, number_and_unit
from qddot.units.names import _BASE_NAMES
from qddot.units.table import PREFIXED, PREFIXES, TABLE, TEMPERATURES
from qddot.units.worth import to_base, unit_of

SLIPS = {
    "12,5 N": 'write "12.5 N"',
    "2,15e6 N/m": 'write "2.15e6 N/m"',
    "0,5 m": 'write "0.5 m"',
    ",5 m": 'write ".5 m"',
    "1,250 N": 'write "1.250 N" or "1250 N"',
    "1.250,5 N": "write a decimal point, and nothing between thousands",
    "10 000 N": 'write "10000 N"',
    "1 250 N/m": 'write "1250 N/m"',
    "10\u202f000 N": 'write "10000 N"',
    "10'000 N": 'write "10000 N"',
    "10_000 N": 'write "10000 N"',
    "2 3 m": "two numbers",
    "10 1": "two numbers",
    "1/2 m": "a unit holds no numbers",
    "2 1/2 m": "a unit holds no numbers",
    "1.2.3 N": "'.3' after the number 1.2",
    "−5 N": 'write "-5 N"',
    "٣ m": "begins with no number",
    "nan m": "begins with no number",
    "inf": "begins with no number",
    "": "begins with no number",
    "N": "begins with no number",
    "5 m^0.5": "no whole number",
    "5 m s-1": "write N m for a product, s^-1 for a power",
    "5 N-m": "write N m for a product",
    "5 kgg": "unknown unit 'kgg'; did you mean 'kg'?",
    "5 Pas": "write Pa s, or Pa",
    "5 m2": "unknown unit 'm2'; did you mean 'm^2'?",
    "5 potatoes": "unknown unit 'potatoes'; expected units such as kg, m, s",
    "500 Nm": "write N m for newton metres",
    "1 ton": "write t (1000 kg), short_ton or long_ton",
    "1 kton": "write t (1000 kg), short_ton or long_ton",
    "1 ton_force": "write tf (1000 kgf), short_ton_force or long_ton_force",
    "1 gallon": "imperial_gallon",
    "20 dB": "no multiple of a unit of the SI",
    "5 degC/s": "stands in no product",
    "__import__('os').getcwd()": "begins with no number",
}


@pytest.mark.parametrize("text", SLIPS)
@pytest.mark.parametrize("unit", ["N", "m", "N/m", "kg", "K", "1"])
def test_a_slip_is_refused_with_what_to_write(text, unit):
    with pytest.raises(ValueError, match="is no number with a unit") as refused:
        magnitude("here", text, unit)
    assert SLIPS[text] in str(refused.value)
    assert str(refused.value).startswith("here: ")


@pytest.mark.parametrize(
    "text",
    [
        "9**(99*99*99*99) ms",
        "1 " + "*s" * 2000,
        "1 " + "*s" * 40,
        "1 m^999999999",
        "1 " + "(" * 50 + "km" + "^9)" * 15,
        "1 (((((((km^12)^12)^12)^12)^12)^12)^12)",
        "9" * 10**6,
        "1 " + "x" * 100,
        "1e999999999 m",
    ],
)
def test_an_attack_is_refused_at_once_and_in_few_words(text):
    said = r"expected|at most|no unit|unknown|understood|whole number|early"
    with within(1.0), pytest.raises(ValueError, match=said) as refused:
        magnitude("here", text, "ms")
    assert len(str(refused.value)) < 300


def test_a_slip_is_refused_wherever_numbers_are_read(tmp_path):
    for axis in (
        {"linspace": ["0,5 km/h", "40 km/h", 4]},
        {"values": ["13 N", "12,5 N"]},
        {"values": [13, "10 000 N"]},
        {"uniform": ["1 250 N", "2000 N"]},
    ):
        with pytest.raises(ValueError, match=r"sweep\.axes\.0\.\w+: '.*' is no number with a unit: .* write"):
            sweep_of(SweepTable.model_validate({"samples": 1, "axes": [{"key": "parameters.a", **axis}]}))
    with pytest.raises(ValueError, match=r"sweep\.axes\.0\.unit: 'kgg': unknown unit 'kgg'; did you mean 'kg'"):
        sweep_of(SweepTable.model_validate({"axes": [{"key": "parameters.a", "range": [0, 3], "unit": "kgg"}]}))
    table = tmp_path / "table.csv"
    for text, message in {
        "0;1 250\n1;2\n2;3\n": "line 1: '1 250' is not a number, and a heading begins with no digit",
        "t;F\n0;1\n1;1 250\n": "line 3, column 'F': '1 250' is not a number",
        "t [s];F [kgg]\n0;1\n1;2\n": r"column 'F': unknown unit \[kgg\]: unknown unit 'kgg'; did you mean 'kg'",
        "t [s];F [ton]\n0;1\n1;2\n": "column 'F': .* write t",
        "t [s];F [1,5 N]\n0;1\n1;2\n": "column 'F': unknown unit .* a unit holds no numbers",
    }.items():
        table.write_text(text)
        with pytest.raises(ValueError, match=message):
            table_from_csv(table)


def test_an_axis_of_ratios_has_plain_numbers():
    found = sweep_of(SweepTable.model_validate({"axes": [{"key": "parameters.a", "range": [0, 3], "unit": "1"}]}))
    assert [found.changes(run)["parameters.a"] for run in range(3)] == [0, 1, 2]


def test_labels_that_begin_with_a_digit_stay_labels():
    found = sweep_of(
        SweepTable.model_validate({"axes": [{"key": "inputs.F.from", "values": ["30mm_gun", "12mm_gun"]}]})
    )
    assert [found.changes(run)["inputs.F.from"] for run in range(2)] == ["30mm_gun", "12mm_gun"]


TURN = 2 * math.pi
RIGHT = [
    ("6400 mil", "rad", TURN),
    ("6400 mils", "deg", 360.0),
    ("1 t", "kg", 1000.0),
    ("1 short_ton", "kg", 907.18474),
    ("1 long_ton", "kg", 1016.0469088),
    ("2 cycles/m", "1/m", 2.0),
    ("2 cycle/s", "Hz", 2.0),
    ("120 cycles/min", "Hz", 2.0),
    ("2 J/cycle", "J", 2.0),
    ("3 cycles", "1", 3.0),
    ("3 1/m", "cycle/m", 3.0),
    ("2 cycles/m", "rad/m", 2 * TURN),
    ("2 turn/m", "cycle/m", 2.0),
    ("600 rpm", "rad/s", 10 * TURN),
    ("600 rpm", "turn/s", 10.0),
    ("600 revolutions/min", "rpm", 600.0),
    ("1 turn", "deg", 360.0),
    ("180 °", "rad", math.pi),
    ("2 Hz", "1/min", 120.0),
    ("200 /min", "Hz", 200 / 60),
    ("2 1/s", "Hz", 2.0),
    ("500 N m/rad", "N m", 500.0),
    ("500 N m", "N m/rad", 500.0),
    ("3 N m s", "N m s/rad", 3.0),
    ("30 deg", "1", math.pi / 6),
    ("5 %", "1", 0.05),
    ("0.5", "rad", 0.5),
    ("20 degC", "K", 293.15),
    ("212 degF", "degC", 100.0),
    ("5 N s/m", "kg/s", 5.0),
    ("5 m/s^2", "m/s**2", 5.0),
    ("5 m s^-2", "m/s/s", 5.0),
    ("5 m s⁻²", "m/(s s)", 5.0),
    ("5 kg·m²", "kg m^2", 5.0),
    ("5e3N", "kN", 5.0),
    ("5\u00a0kN", "N", 5000.0),
    ("5 * s", "s", 5.0),
    ("36 km/h", "m/s", 10.0),
    ("1.1 mm", "m", 0.0011),
    ("1 lbf", "N", 4.4482216152605),
    ("60 mph", "m/s", 26.8224),
    ("1 psi", "Pa", 6894.757293168361),
]


@pytest.mark.parametrize(("text", "unit", "value"), RIGHT)
def test_an_amount_is_what_it_is(text, unit, value):
    assert magnitude("here", text, unit) == pytest.approx(value, rel=1e-14)
    number, given_unit = number_and_unit(text)
    if given_unit and unit != "1":
        assert amount_in(f"{value!r} {unit}", given_unit) == pytest.approx(number, rel=1e-12)


PER = ["1/s", "1/min", "Hz", "1/m", "1/s^2", "m^3", "m/s", "m^2/Hz", "N", "W"]


@pytest.mark.parametrize("per", PER)
@pytest.mark.parametrize(
    "angle", ["rad", "deg", "mil", "turn", "revolution", "circle", "rpm s", "mrad", "arcmin", "sr"]
)
def test_an_angle_is_never_taken_for_a_count(per, angle):
    """Off by 2 pi: rad/s for Hz, rpm for rounds per minute, m^3/rad for m^3 of ISO 8608."""
    for given_unit, wanted in (
        (f"{angle} ({per})", per),
        (per, f"{angle} ({per})"),
        (f"({per})/({angle})", per),
    ):
        with pytest.raises(ValueError, match="one counts angles, the other does not; give it in"):
            amount_in(f"2 {given_unit}", wanted)


@pytest.mark.parametrize("per", PER)
def test_a_cycle_counts_as_one_where_no_angle_is_meant(per):
    assert amount_in(f"2 cycles ({per})", per) == 2.0
    assert amount_in(f"2 ({per})/cycle", per) == 2.0
    assert amount_in(f"2 cycles ({per})", f"rad ({per})") == pytest.approx(2 * TURN)
    assert amount_in(f"2 cycles ({per})", f"turn ({per})") == pytest.approx(2.0)


REGISTRY = pint.get_application_registry()
REGISTRY.parse_unit_name("m")  # reads its definitions
OURS = {"turn", "cycle", "cycles", "mil", "rpm", "rps"}
NAMES = [*TABLE, *(prefix + unit for prefix in PREFIXES for unit in PREFIXED)]


def in_pint(quantity):
    base = quantity.to_base_units()
    return base.magnitude, {_BASE_NAMES.get(name, name): power for name, power in base.unit_items()}


@pytest.mark.parametrize("name", [*NAMES, *TEMPERATURES])
def test_the_table_says_what_pint_says(name):
    if name in OURS:
        return
    unit, (value, dimension) = unit_of(name), in_pint(REGISTRY.Quantity(1.0, name))
    assert dict(unit.dimension) == dimension
    assert float(unit.factor + unit.zero) == pytest.approx(value, rel=1e-14)


def test_every_unit_of_pint_is_worth_what_pint_says_or_refused():
    refused = 0
    named = [name for name in dir(REGISTRY) if name.isidentifier() and not name.startswith("_")]
    named = [name for name in named if REGISTRY.parse_unit_name(name) and name not in NAMES]
    for name in named:
        try:
            unit = unit_of(name)
        except ValueError as error:
            assert re.search("no multiple of a unit of the SI|means several things; write", str(error)), name
            refused += 1
            continue
        angles = [base for base, _ in unit.dimension if base in ("turn", "cycle")]
        value, dimension = in_pint(REGISTRY.Quantity(1.0, REGISTRY.parse_unit_name(name)[0][1]))
        dimension.pop("count", None)
        if not REGISTRY.parse_unit_name(name)[0][0] and not angles:
            assert dict(unit.dimension) == dimension, name
            assert float(unit.factor + unit.zero) == pytest.approx(value, rel=1e-12), name
    assert len(named) > 500
    assert refused < 60


factor = st.tuples(st.sampled_from([name for name in NAMES if name not in OURS]), st.integers(-3, 3).filter(bool))
numbers = st.floats(-1e12, 1e12).filter(lambda number: number == 0 or abs(number) > 1e-12)


def written(factors, signs):
    """The product as a text, by divisions where a power is negative, or by negative powers, as the signs say."""
    text = ""
    for (name, power), (divided, sign) in zip(factors, signs, strict=False):
        divides = divided and power < 0 and text
        text += ("/" if divides else sign if text else "") + name
        shown = -power if divides else power
        text += "" if shown == 1 else f"^{shown}"
    return text


@given(numbers, st.lists(factor, min_size=1, max_size=5), st.data())
@settings(deadline=None, max_examples=300)
def test_random_amounts_are_worth_what_pint_says(number, factors, data):
    signs = data.draw(
        st.lists(st.tuples(st.booleans(), st.sampled_from([" ", "*", " * ", "·"])), min_size=5, max_size=5)
    )
    unit, respelled = written(factors, signs), written(factors[::-1], signs)
    expected = REGISTRY.Quantity(number, "dimensionless")
    for name, power in factors:
        expected = expected * REGISTRY.Quantity(1.0, name) ** power
    value, dimension = in_pint(expected)
    assert dict(unit_of(unit).dimension) == {name: power for name, power in dimension.items() if power}
    assert to_base(unit)(number) == pytest.approx(value, rel=1e-12, abs=1e-300)
    assert amount_in(f"{number!r} {unit}", respelled) == pytest.approx(number, rel=1e-14)


alphabet = st.sampled_from(
    [
        *"0123456789",
        *".,-+eE_'−",
        " ",
        "\u00a0",
        *"*/^()·²⁻",
        "**",
        "N",
        "m",
        "s",
        "kg",
        "rad",
        "°",
        "%",
        "1/",
        "٣",
        "x",
    ]
)
NUMBER = r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?"


@given(st.lists(alphabet, max_size=14).map("".join))
@example("1e5")
@example("5 1/s")
@example("5*1/s")
@example("0kg0")
@settings(deadline=None, max_examples=1000)
def test_no_text_that_is_not_number_and_unit_is_read_as_a_number(text):
    try:
        number, unit = number_and_unit(text)
    except ValueError as error:
        assert str(error).startswith(f"{text!r} is no number with a unit: ")
        return
    said = re.match(rf"[ \u00a0]*(?P<number>{NUMBER})(?P<rest>.*)", text)
    assert said is not None
    assert number == float(said["number"])
    rest = re.sub(r"^[ \u00a0]*\*?[ \u00a0]*1[ \u00a0]*/", "/", said["rest"])
    rest = re.sub(r"(\^|\*\*)(\([-+]?[0-9]+\)|[-+]?[0-9]+)", "", rest)  # powers
    assert not re.search(r"[0-9.,'_+−٣-]", rest)
    assert unit.strip() == unit
    unit_of(unit or "1")


def test_units_of_models_are_checked():
    x, m, k, F = (Symbol(name) for name in ("x", "m", "k", "F"))
    rate = Symbol("xdot")

    def system(*, mass="kg", place="m", stiffness="N/m", force="N"):
        return System(
            "spring",
            "a spring",
            [Coordinate(x, place, "place")],
            [Parameter(m, 1.0, mass, "mass"), Parameter(k, 1.0, stiffness, "stiffness")],
            m * rate**2 / 2,
            k * x**2 / 2,
            generalized_forces={x: F},
            inputs=[Input(F, force, "force")],
        )

    assert system().name == "spring"
    for given_units, message in {
        ("mass", "kgg"): "the unit of m is 'kgg': unknown unit 'kgg'; did you mean 'kg'",
        ("place", "potatoes"): "the unit of x is 'potatoes': unknown unit 'potatoes'; expected units",
        ("stiffness", "N/m2"): "the unit of k is 'N/m2': unknown unit 'm2'; did you mean 'm\\^2'",
        ("stiffness", "1,5 N/m"): "the unit of k is '1,5 N/m': ",
        ("force", "ton"): "the unit of F is 'ton': 'ton' means several things; write t",
    }.items():
        with pytest.raises(ModelError, match=message):
            system(**{given_units[0]: given_units[1]})


def test_units_of_the_table_need_no_pint():
    code = """
import sys
from qddot.units.amounts import amount_in
amount_in("65 kN/m", "N/m"), amount_in("200 rpm", "rad/s"), amount_in("20 km/h", "m/s"), amount_in("5 mm", "m")
import qddot.model.m113
sys.exit("pint" in sys.modules)
"""
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


def test_the_texts_of_units_in_models_and_studies_are_in_the_table():
    code = """
import sys
from pathlib import Path
from qddot.runner.load import available, load
from qddot.runner.study.read import read
from qddot.runner.study.arguments import settings, study_model
for path in sorted(Path("studies").glob("*.toml")):
    study = read(path)
    settings(study, study_model(study, path), path)
sys.exit("pint" in sys.modules)
"""
    assert subprocess.run([sys.executable, "-c", code], cwd=Path(ROOT), check=False).returncode == 0
