"""The one table of options: what is said of them elsewhere, for editors and for studies, agrees with it."""

from dataclasses import fields
from typing import get_args

import pytest

import qddot
from qddot.runner.keywords import BatchKeywords
from qddot.runner.lanes.way import way_of
from qddot.runner.methods import METHODS
from qddot.runner.options import CONTROLLED, MANY, SPACED, TABLE, TIMES
from qddot.runner.study.integration import TABLE_OF
from qddot.runner.study.schema import Integration
from qddot.runner.takers import taken


def test_the_table_is_that_of_the_fields():
    assert list(TABLE) == [each.name for each in fields(qddot.Options)]
    plain = qddot.Options()
    assert all(getattr(plain, name) is None for name in TABLE)


def test_an_option_is_taken_by_families_or_methods_that_there_are():
    known = {method.family for method in METHODS.values()} | set(METHODS)
    for option in TABLE.values():
        assert option.takers
        assert set(option.takers) <= known, option.name
        assert set(option.many) <= set(option.takers), option.name


def test_keywords_of_many_runs_are_those_of_the_table():
    assert set(BatchKeywords.__annotations__) == set(MANY)


def test_a_study_takes_what_the_table_says_and_times_with_their_unit():
    tables = ("method", "fixed", "adaptive")
    keys = {name: each.annotation for name, each in Integration.model_fields.items() if name not in tables}
    assert set(keys) == {name for name, option in TABLE.items() if option.study}
    with_unit = {
        name
        for name, annotation in keys.items()
        if str in _leaves(annotation) and name not in ("controller", "switching")
    }
    assert with_unit == set(TIMES) & set(keys)


@pytest.mark.parametrize(("table", "families"), [("fixed", SPACED), ("adaptive", CONTROLLED)])
def test_a_table_of_families_holds_what_a_method_of_them_takes(table, families):
    own = {name for method in METHODS.values() if method.family in families for name in taken(method)}
    keys = Integration.model_fields[table].annotation.model_fields
    assert set(keys) == {name for name in own if TABLE[name].study}
    assert {family for family, its in TABLE_OF.items() if its == table} == set(families)


def _leaves(annotation):
    inner = get_args(annotation)
    return {annotation} if not inner else set().union(*map(_leaves, inner))


OTHER = {
    "time_limit": 5.0,
    "controller": "PI",
    "switching": "locate",
    "max_order": 3,
    "bdf": True,
    "events": (qddot.crossing(qddot.load("quarter_car"), "z_s"),),
}


def test_every_option_of_a_single_run_is_tried():
    assert set(OTHER) == {name for name, option in TABLE.items() if not (option.many or option.sampled)}


@pytest.mark.parametrize("name", OTHER)
@pytest.mark.parametrize("method", ["rk4", "exact"])
def test_a_run_with_an_option_of_a_single_run_goes_alone(name, method):
    model = qddot.load("quarter_car")
    way, reason = way_of(model, METHODS[method], qddot.Options(**{name: OTHER[name]}))
    assert way == "alone"
    assert name in reason


def test_runs_go_the_way_that_their_method_and_model_take():
    linear, plain = qddot.load("quarter_car"), qddot.Options(max_step=0.1, rtol=1e-5)
    ways = {name: way_of(linear, method, plain)[0] for name, method in METHODS.items()}
    assert ways.pop("exact") == "exact"
    assert {name for name, way in ways.items() if way == "alone"} == {"ode15s", "rodas5p", "auto"}
    assert set(ways.values()) == {"lanes", "alone"}
