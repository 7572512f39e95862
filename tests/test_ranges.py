"""Rows of tables that count are written once and read back as they were, whatever texts they hold."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qddot.codegen.place_rows import place_rows
from qddot.codegen.ranges import compressed
from qddot.runner.ranges import expanded, placed

CASES = [
    ([("q_1", "axle 1"), ("q_2", "axle 2"), ("q_3", "hull")], [("q_{1..2}", "axle {1..2}"), ("q_3", "hull")]),
    ([("k_6", 2.0, "axle 1"), ("k_7", 2.0, "axle 2")], [("k_{6..7}", 2.0, "axle {1..2}")]),
    ([("k_6", 2.0, "axle 1"), ("k_7", 2.5, "axle 2")], None),
    ([("k_9", "a"), ("k_10", "a"), ("k_11", "a")], [("k_{9..11}", "a")]),
    ([("l_3", "axle 1 to axle 2"), ("l_4", "axle 2 to axle 3")], [("l_{3..4}", "axle {1..2} to axle {2..3}")]),
    ([("a_1", "in 2 m"), ("a_2", "in 2 m")], [("a_{1..2}", "in 2 m")]),
    ([("a_1", "a {1..3}"), ("a_2", "a {1..3}")], None),
    ([("a", "row 1"), ("a", "row 2")], None),
    ([("m_1", "x"), ("m_3", "x")], None),
    (["a_1", "a_2", "g", "a_3"], ["a_{1..2}", "g", "a_3"]),
]


@pytest.mark.parametrize(("rows", "expected"), CASES, ids=str)
def test_rows_that_count_become_one(rows, expected):
    assert compressed(rows) == (rows if expected is None else expected)
    assert expanded(compressed(rows)) == rows


TEXTS = st.lists(st.sampled_from(["a", "_", "0", "1", "2", "9", "10", "{", "}", "{1..2}", "..", "٣", " "]), max_size=5)
ROWS = st.lists(st.tuples(*[TEXTS.map("".join)] * 2, st.sampled_from([1.0, 2.0])), max_size=8)


@settings(deadline=None)
@given(ROWS)
def test_what_is_compressed_is_read_back_as_it_was(rows):
    rows = [("x" + name.replace("{", "").replace("}", ""), text, number) for name, text, number in rows]
    assert expanded(compressed(rows)) == rows


@settings(deadline=None)
@given(st.integers(1, 12), st.integers(1, 12), st.integers(0, 300))
def test_a_table_does_not_grow_with_the_chain(first, offset, count):
    rows = [(f"q_{first + k}", 1.0, f"mass {offset + k}") for k in range(count)]
    assert len(compressed(rows)) == min(count, 1)
    assert expanded(compressed(rows)) == rows


@pytest.mark.parametrize("row", ["q_{2..1}", ("q_{1..3}", "axle {1..2}"), ("q_{1..99999999999}", "axle")], ids=str)
def test_ranges_that_do_not_fit_are_refused(row):
    with pytest.raises(ValueError, match="expected ranges of one length that rise"):
        expanded([row])


@settings(deadline=None)
@given(st.integers(1, 3), st.integers(8, 40), st.integers(-3, 3).filter(bool), st.booleans())
def test_rows_that_take_turns_do_not_grow_with_the_chain(kinds, count, step, down):
    first = 200
    rows = [(f"{'mkc'[kind]}_{first + step * k}", 1.0, f"cell {k}") for k in range(count) for kind in range(kinds)]
    found = compressed(rows, turns=True)
    assert len(found) == 1
    assert expanded(found) == rows
    assert expanded(compressed(rows)) == rows
    named = compressed([row[0] for row in rows][::kinds])
    assert named == [f"m_{{{first}..{first + step * (count - 1)}{f'..{step}' if step != 1 else ''}}}"]


def test_rows_that_take_turns_are_as_many():
    with pytest.raises(ValueError, match="expected ranges of one length in rows that take turns"):
        expanded([(("m_{1..3}", 1.0), ("k_{1..2}", 1.0))])


ROWS_OF_PLACES = st.lists(
    st.lists(st.integers(0, 5), unique=True, max_size=3).map(sorted).map(tuple), min_size=1, max_size=3
)


@settings(deadline=None)
@given(ROWS_OF_PLACES, ROWS_OF_PLACES, st.integers(0, 30), st.integers(0, 2))
def test_places_of_a_matrix_are_read_back_as_they_were(cell, others, count, step):
    repeated = [tuple(column + step * k for column in row) for k in range(count) for row in cell]
    rows = (*others, *repeated, *others)
    found = place_rows(rows)
    assert placed(found) == rows
    assert len(found) <= len(place_rows((*others, *repeated[: 8 * len(cell)], *others))) + 14


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (("{0..9}: {0..8}",), "ranges of one length"),
        (("{0..9} {0..9}",), "expected the ranges of rows and columns"),
        (("{0..9}: x",), "expected the ranges of rows and columns"),
        (((1,), "{0..9}: {0..9}"), "gives row 0, which is there already"),
        (("{1..9}: {1..9}",), "has no row 0"),
    ],
)
def test_places_that_do_not_fit_are_refused(rows, message):
    with pytest.raises(ValueError, match=message):
        placed(rows)
