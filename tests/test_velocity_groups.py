"""The mass matrix is judged in blocks of velocities that T couples: the verdict is that on the whole, and as cheap as
the largest block."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Add, Integer, cos, symbols

from qddot.model import inertia as judged
from qddot.model.inertia import Inertia, inertia
from qddot.model.velocity_groups import energies, groups

V = symbols("v_1:13")
Q, M = symbols("q m")


def _blocks(sizes: list[int], chance: random.Random, singular: int | None):  # type: ignore[no-untyped-def]
    """T as a sum of squares of random forms in shuffled groups of velocities; one form too few in the singular one."""
    order = list(range(sum(sizes)))
    chance.shuffle(order)
    terms, members = [], []
    for k, size in enumerate(sizes):
        own = sorted(order[sum(sizes[:k]) : sum(sizes[: k + 1])])
        members.append(tuple(own))
        for row in range(size - (k == singular)):
            numbers = [chance.choice((1, 2, 3)) + 5 * (row == column) for column in range(size)]
            terms.append((2 + cos(Q)) * Add(*(n * V[i] for n, i in zip(numbers, own, strict=True))) ** 2)
    chance.shuffle(terms)
    return Add(*terms), members


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(1, 4), min_size=1, max_size=3), st.integers(0, 10**6))
def test_blocks_that_are_regular_make_a_regular_matrix(sizes: list[int], seed: int) -> None:
    energy, members = _blocks(sizes, random.Random(seed), None)
    assert inertia(energy, V[: sum(sizes)], {}, {}) == Inertia()
    assert sorted(group.velocities for group in groups(energy, V[: sum(sizes)], {})) == sorted(members)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(2, 4), min_size=1, max_size=3), st.integers(0, 10**6), st.data())
def test_a_singular_block_is_found_with_its_velocities_alone(sizes: list[int], seed: int, data: st.DataObject) -> None:
    which = data.draw(st.integers(0, len(sizes) - 1))
    energy, members = _blocks(sizes, random.Random(seed), which)
    found = inertia(energy, V[: sum(sizes)], {}, {})
    assert found.singular
    assert found.massless
    assert set(found.massless) <= set(members[which])


def test_quantities_couple_what_they_are_made_of() -> None:
    u = symbols("u")
    found = groups(M * u**2 + M * V[2] ** 2, V[:3], {u: V[0] + V[1]})
    assert [group.velocities for group in found] == [(0, 1), (2,)]


def test_what_has_no_velocity_still_says_whether_t_has_a_value() -> None:
    assert inertia(V[0] ** 2 + symbols("d") ** Integer(2), V[:1], {}, {}) == Inertia()
    assert not inertia(V[0] ** 2 + (-1 - Q**2) ** 0.5, V[:1], {}, {}).is_known


@pytest.mark.parametrize("n", [2, 200])
def test_the_energy_is_asked_for_as_often_however_many_masses_there_are(
    n: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def counting(*given):  # type: ignore[no-untyped-def]
        function = energies(*given)
        return lambda *point: asked.append(1) or function(*point)

    monkeypatch.setattr(judged, "energies", counting)
    velocities = symbols(f"w_1:{n + 1}")
    assert inertia(Add(*(M * v**2 / 2 for v in velocities)), velocities, {}, {M: 1.0}) == Inertia()
    assert len(asked) == 4 + 3
