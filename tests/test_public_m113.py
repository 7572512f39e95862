"""The M113 on the suspension of a public model: its numbers by hand, and what the documentation says of the claims."""

import re
from pathlib import Path

import numpy as np
import pytest
from commands import command

import qddot
from qddot import load, modes
from qddot.paper.claims import Judged, read, verdict
from qddot.paper.schema import Claim
from qddot.paper.studies import Studies
from qddot.paper.tables import claims_page

ROOT = Path(__file__).parent.parent
PAPER = ROOT / "studies" / "paper" / "paper.toml"


@pytest.fixture(scope="module")
def model():
    return load("m113")


def values(model, name):
    names = [parameter.name for parameter in model.tables.parameters]
    return dict(zip(names, model.parameter_values(name), strict=True))


def test_only_the_suspension_is_that_of_the_public_model(model):
    """Two torsion bars an axle, 2.5e4 N m/rad and 500 N m s/rad at a lever of 0.288 m: about 3.0e5 and 6e3 a wheel."""
    for load_ in ("unloaded", "loaded"):
        own, public = values(model, f"as_run_{load_}"), values(model, f"public_{load_}")
        changed = {name for name in own if own[name] != public[name]}
        assert changed == {"k_6", "k_7", "k_8", "k_9", "k_10", "c_6", "c_10"}
        assert public["k_7"] / 2 == pytest.approx(3.0e5, rel=0.01)
        assert public["c_6"] / 2 == pytest.approx(6.0e3, rel=0.01)
        assert public["k_7"] * 0.288**2 == pytest.approx(2 * 2.5e4)
        assert public["c_6"] * 0.288**2 == pytest.approx(2 * 500.0)


def test_its_springs_give_way_by_centimetres_where_the_papers_need_more_than_the_arm_is_long(model):
    """Static deflections balance forces and moments of the hull: -k sum(d) = m g, sum(a d) = 0."""
    greatest = {}
    for name in ("as_run_unloaded", "public_unloaded"):
        p = values(model, name)
        state = qddot.equilibrium(model, name)
        first = -(p["l_1"] - p["l_2"])
        a = first + np.concatenate([[0.0], np.cumsum([p["l_3"], p["l_4"], p["l_5"], p["l_6"]])])
        d = state[5] + a * state[6] - state[:5]
        assert -p["k_6"] * d.sum() == pytest.approx(p["m_6"] * p["g"])
        assert a @ d == pytest.approx(0.0, abs=1e-9)
        greatest[name] = -d.min()
    assert greatest["as_run_unloaded"] == pytest.approx(0.463, abs=1e-3)
    assert greatest["as_run_unloaded"] > np.hypot(0.288, 0.134)  # the whole road arm of the public model
    assert greatest["public_unloaded"] == pytest.approx(0.463 * 6.5e4 / 6.028e5, abs=1e-3)


def rows():
    """Of the table in the documentation: claim -> its cells."""
    text = (ROOT / "docs" / "public_m113.md").read_text("utf-8")
    found = re.findall(r"^\| `(\w+)` \| (.*) \|$", text, re.M)
    return {name: cells.split(" | ") for name, cells in found}


def test_the_documentation_has_every_claim_with_its_verdicts(model):
    """The table is what `qddot paper --parameters public_unloaded` writes; what is quickly computed is so here."""
    paper, table = read(PAPER), rows()
    assert list(table) == list(paper.claims)
    studies = Studies(PAPER.parent, "public_unloaded")
    periods = sorted((each.damped_period for each in modes(model, "public_unloaded")), reverse=True)
    own = {"modes.vehicle.period_1": periods[0], "modes.vehicle.period_2": periods[1]}
    own["modes.vehicle.half_period_1"] = periods[0] / 2
    checked = 0
    for name, claim in paper.claims.items():
        *_, computed, said, before = table[name]
        assert before == claim.expected, name
        assert said == verdict(claim, float(computed.split()[0])), name
        value = studies.number(claim.run) if claim.run is not None else own.get(claim.number or "")
        if value is not None:
            assert float(computed.split()[0]) == pytest.approx(value / claim.scale, rel=1e-3), name
            checked += 1
    assert checked == 8


def test_the_table_of_claims_is_markdown():
    claim = Claim(where="3.2", says="x", number="n", value=5.0, unit="mm", expected="holds")
    judged = [Judged("deep", claim, 1.23456, "differs")]
    assert claims_page(judged, None) == (
        "| claim | where | the paper | computed | verdict |\n|---|---|---|---|---|\n"
        "| `deep` | 3.2 | 5 mm | 1.235 mm | differs |\n"
    )
    assert claims_page(judged, "soft").splitlines()[0] == (
        "| claim | where | the paper | with `soft` | verdict | with the paper's |"
    )
    assert claims_page(judged, "soft").splitlines()[2] == "| `deep` | 3.2 | 5 mm | 1.235 mm | differs | holds |"


def test_a_set_that_is_not_there_is_named_before_anything_is_computed(tmp_path):
    done = command("paper", "--parameters", "public_unlaoded", "--into", tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert "did you mean 'public_unloaded'" in done.stderr
    assert len(done.stderr.splitlines()) == 1
