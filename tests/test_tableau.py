import numpy as np
import pytest

from qddot.runner.methods import METHODS, find_method
from qddot.runner.tableaux.butcher import ButcherTableau, density, elementary_weights, rooted_trees
from qddot.runner.tableaux.pages.rk4 import METHOD as RK4

PAGES = [method.tableau for method in METHODS.values() if method.family == "fixed"]


def rk4_with(**changes):
    given = {
        "name": "changed",
        "order": 4,
        "c": [0, 0.5, 0.5, 1],
        "A": [[], [0.5], [0, 0.5], [0, 0, 1]],
        "b": np.array([1, 2, 2, 1]) / 6,
        "citation": "",
    }
    return ButcherTableau(**(given | changes))


def test_rooted_trees_are_as_many_as_counted_by_cayley():
    assert [len(rooted_trees(order)) for order in range(1, 9)] == [1, 1, 2, 4, 9, 20, 48, 115]


def test_densities_of_order_four_are_those_of_hairer_table_ii_2_2():
    assert sorted(density(tree) for tree in rooted_trees(4)) == [4, 8, 12, 24]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_order_claimed_is_the_highest_that_holds(page):
    residuals = [
        abs(page.b @ elementary_weights(tree, page.A) - 1 / density(tree)) for tree in rooted_trees(page.order + 1)
    ]
    assert max(residuals) > 1e-3


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_coefficients_cannot_be_changed(page):
    with pytest.raises(ValueError, match="read-only"):
        page.b[0] = 2.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"c": [0, 0.5, 1]}, r"c has shape \(3,\), expected \(4,\)"),
        ({"A": [[], [0.5], [0, 0.5], [0, 0, 1, 1]]}, "not strictly lower triangular"),
        ({"A": [[], [0.5], [0.5], [0, 0, 1]]}, r"order 4: the condition of tree"),
        ({"c": [0, 0.5, 0.4, 1]}, r"row 3 of A sums to 0.5, expected c = 0.4"),
        ({"c": [0, 0.5, 0, 1], "A": [[], [0.5], [], [0, 0, 1]]}, "stage 3 repeats the first"),
        ({"order": 5}, "b is not of order 5"),
        ({"order": 0}, "the order of b is 0"),
        ({"b_hat": [1, 0, 0, 0], "order_hat": 2}, "b_hat is not of order 2"),
        ({"b_hat": [1, 0, 0], "order_hat": 1}, "b_hat has shape"),
        ({"P": np.zeros((4, 2))}, "P does not sum to b"),
        ({"P": np.zeros((3, 2))}, "P has shape"),
        ({"P": np.array([[0, 1], [0, 2], [0, 2], [0, 1]]) / 6, "order_dense": 1}, "dense output is not of order 1"),
    ],
)
def test_wrong_tableau_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        rk4_with(**changes)


def test_cubic_dense_output_of_rk4_is_of_order_three():
    P = [[1, -3 / 2, 2 / 3], [0, 1, -2 / 3], [0, 1, -2 / 3], [0, -1 / 2, 2 / 3]]
    assert rk4_with(P=P, order_dense=3).P.shape == (4, 3)


def test_first_same_as_last_is_derived_from_the_coefficients():
    bogacki_shampine = ButcherTableau(
        name="bs3",
        order=3,
        c=[0, 1 / 2, 3 / 4, 1],
        A=[[], [1 / 2], [0, 3 / 4], [2 / 9, 1 / 3, 4 / 9]],
        b=[2 / 9, 1 / 3, 4 / 9, 0],
        citation="",
        b_hat=[7 / 24, 1 / 4, 1 / 3, 1 / 8],
        order_hat=2,
    )
    assert bogacki_shampine.first_same_as_last
    assert bogacki_shampine.evaluations_per_step == 3
    assert not any(page.first_same_as_last for page in PAGES)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_each_slope_has_its_weight_in_the_stage_behind_it_and_the_last_in_the_step(page):
    *behind, last = page.along
    assert last == page.b[-1]
    assert behind == [page.A[i + 1, i] for i in range(page.stages - 1)]


def test_a_tableau_whose_stages_lean_on_earlier_slopes_says_so():
    third = 1 / 3  # the 3/8-rule, HNW table II.1.2
    rule = rk4_with(
        name="3/8", c=[0, third, 2 * third, 1], A=[[], [third], [-third, 1], [1, -1, 1]], b=np.array([1, 3, 3, 1]) / 8
    )
    with pytest.raises(ValueError, match="3/8: a stage leans on more slopes than the last"):
        _ = rule.along


def test_methods_are_found_by_name():
    assert find_method("rk4").tableau is RK4
    assert [METHODS[name].stages for name in ("euler", "heun", "midpoint", "rk4")] == [1, 2, 2, 4]


def test_unknown_method_names_the_nearest():
    with pytest.raises(ValueError, match=r"unknown method 'Rk4x'; did you mean 'rk4'\?"):
        find_method("Rk4x")
