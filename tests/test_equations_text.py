"""The equations as a person reads them: what is displayed is what was derived, in every rendering."""

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from displayed import MODELS, at, derived, displays, documents, motion_residual, printed, random_point
from latex_reader import LatexReader, terminal_value

from qddot.codegen.equations.latex_script import LatexScript
from qddot.codegen.equations.latex_text import escape
from qddot.codegen.equations.page import html
from qddot.codegen.equations.spelling import Spelling, spelling
from qddot.codegen.equations.terminal import text
from qddot.codegen.equations.tex import tex
from qddot.codegen.equations.typesetter import Typesetter
from qddot.codegen.equations.unicode_script import UnicodeScript


@pytest.mark.parametrize("name", MODELS)
def test_the_typeset_equations_of_motion_say_what_was_derived(name):
    equations, document = derived(name), documents(name)
    script = LatexScript(document.dotted)
    shown = displays(tex(document), "align")
    assert len(shown) == len(equations.coordinates)
    for seed in range(3):
        point = random_point(equations, seed)
        reader = LatexReader({printed(script, symbol): value for symbol, value in point.items()})
        for k, formula in enumerate(shown):
            left, right = map(reader.value, formula.split("="))
            assert left - right == pytest.approx(motion_residual(equations, k, point), rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("name", MODELS)
def test_the_typeset_energies_say_what_the_author_wrote(name):
    equations, document = derived(name), documents(name)
    script = LatexScript(document.dotted)
    (shown,) = (body for body in displays(tex(document), r"alignat\*") if body.startswith("{1}\nT "))
    pattern = r"T +& = (.*?)\\\\\n\\Pi +& = (.*?)\\\\\n\\Phi +& = (.*)"
    found = re.match(pattern, shown.removeprefix("{1}\n"), re.DOTALL).groups()
    point = random_point(equations, 5)
    reader = LatexReader({printed(script, symbol): value for symbol, value in point.items()})
    for formula, energy in zip(found, (equations.kinetic, equations.potential, equations.dissipation), strict=True):
        assert reader.value(formula) == pytest.approx(at(energy, point), rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("width", [60, 100])
def test_the_terminal_equations_of_motion_say_what_was_derived(name, width):
    equations, document = derived(name), documents(name)
    script = UnicodeScript(document.dotted)
    section = text(document, width).split("Equations of motion\n")[1].split("\nMass matrix")[0].splitlines()[1:]
    blocks = re.split(r"\n(?:\S[^\n]*\n)+", "\n" + "\n".join(section))  # headings begin in the first column
    formulas = [" ".join(block.split()) for block in blocks if block.strip()]
    assert len(formulas) == len(equations.coordinates)
    point = random_point(equations, 7)
    names = {script.name(str(symbol)).text: value for symbol, value in point.items()}
    for k, formula in enumerate(formulas):
        left, right = (terminal_value(side, names) for side in formula.split(" = "))
        assert left - right == pytest.approx(motion_residual(equations, k, point), rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("name", MODELS)
def test_definitions_and_mass_matrix_of_the_document_have_the_derived_values(name):
    equations, document = derived(name), documents(name)
    script = LatexScript(document.dotted)
    write = Typesetter(script)
    point = random_point(equations, 11)
    reader = LatexReader({printed(script, symbol): value for symbol, value in point.items()})

    def value(total) -> float:
        return reader.value("".join(box.text for box in write.terms(total)))

    for formula, (symbol, expression) in zip(
        document.definitions, equations.definitions.expressions.items(), strict=True
    ):
        assert value(formula.left) == point[symbol]
        assert value(formula.right) == pytest.approx(at(expression, point), rel=1e-12)
    for place, entry in equations.mass.items():
        assert value(document.mass.entries[place]) == pytest.approx(at(entry, point), rel=1e-12)


def test_the_m113_reads_as_in_the_paper():
    shown = text(documents("m113"), 120)
    assert "Φ = ½·c₆·ḋ₁² + ½·c₁₀·ḋ₅²" in shown
    assert "m₁·q̈₁ + k₁·(q₁ − z₁) − k₆·d₁ − c₆·ḋ₁ = −m₁·g" in shown
    assert "m₆·q̈₆ + k₆·d₁ + k₇·d₂ + k₈·d₃ + k₉·d₄ + k₁₀·d₅ + c₆·ḋ₁ + c₁₀·ḋ₅ = −m₆·g" in shown
    assert "d₁ = q₆ + a₁·q₇ − q₁ " in shown


def test_trigonometry_and_common_factors_are_gathered():
    assert "½·(m₁ + m₂)·l₁²·θ̇₁²" in text(documents("double_pendulum"), 120)
    assert "½·m_p·L·ẋ·θ̇·cos(θ) + ⅙·m_p·L²·θ̇²" in text(documents("cart_pole"), 120)
    assert "+ 2·m·L²·θ̇₂²·sin(θ₁ − θ₂) + m·L²·θ̇₃²·sin(θ₁ − θ₃) + 3·m·L·g·sin(θ₁)" in text(documents("pendulum"), 200)
    assert "k·(q₁ − w) + k·(q₁ − q₂)" in text(documents("chain"), 120)


@pytest.mark.parametrize("name", MODELS)
def test_every_coordinate_has_its_equation_and_every_symbol_its_meaning(name):
    document = documents(name)
    source, page = tex(document), html(document)
    for entry in (
        *document.coordinates,
        *document.inputs,
        *document.parameters,
        *document.quantities,
        *document.outputs,
    ):
        assert escape(entry.meaning) in source
        assert printed(LatexScript(document.dotted), entry.symbol) in source
    assert page.count('<span class="number">') == len(document.coordinates)
    for chosen in document.parameter_sets:
        assert escape(chosen.replace("_", " ")) in source
        assert chosen in page


def test_the_texts_are_the_same_under_any_hash_seed():
    code = """
import hashlib
from qddot.codegen.lagrange import derive
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.page import html
from qddot.codegen.equations.terminal import text
from qddot.codegen.equations.tex import tex
from qddot.model import double_pendulum, m113, pendulum
digest = hashlib.sha256()
for system in (m113.system(), double_pendulum.system(), pendulum.system(5)):
    document = describe(derive(system), f"model/{system.name}.py")
    digest.update((tex(document) + html(document) + text(document)).encode())
print(digest.hexdigest())
"""
    here = hashlib.sha256()
    for name in ("m113", "double_pendulum", "pendulum_5"):
        here.update((tex(documents(name)) + html(documents(name)) + text(documents(name))).encode())
    root = Path(__file__).parent.parent
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", code],
            env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": str(root)},
            stdout=subprocess.PIPE,
            text=True,
        )
        for seed in ("0", "4711")
    ]
    assert [run.communicate()[0].strip() for run in runs] == [here.hexdigest()] * 2


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("qddot_6", Spelling("q", 2, ("6",))),
        ("ddot_1", Spelling("d", 1, ("1",))),
        ("dddot_1", Spelling("d", 2, ("1",))),
        ("thetadot", Spelling("theta", 1, ())),
        ("m1", Spelling("m", 0, ("1",))),
        ("k_tf", Spelling("k", 0, ("tf",))),
        ("tyre_force_1", Spelling("tyre force", 0, ("1",))),
        ("heavedot", Spelling("heave", 1, ())),
        ("robot", Spelling("robot", 0, ())),
    ],
)
def test_names_are_read_as_a_person_would(name, expected):
    assert spelling(name, frozenset({"heave"})) == expected
