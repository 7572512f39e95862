"""Explicit Runge-Kutta methods as pages of a book: frozen Butcher tableaux that check themselves at birth.

Notation of Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (HNW), chapter II: stage slopes
k_i = f(t + c_i h, y + h sum_j a_ij k_j), step y + h sum_i b_i k_i.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Rounding allowed in a condition, relative to the largest coefficient: published decimals have 16 digits.
TOLERANCE = 2e-14

Tree = tuple["Tree", ...]


@cache
def rooted_trees(order: int) -> tuple[Tree, ...]:
    """All rooted trees of `order` nodes (1, 1, 2, 4, 9, 20, ...); a tree is the sorted tuple of its branches."""
    if order == 1:
        return ((),)
    return tuple(sorted({grown for tree in rooted_trees(order - 1) for grown in _with_one_more_leaf(tree)}))


def _with_one_more_leaf(tree: Tree) -> Iterator[Tree]:
    yield tuple(sorted((*tree, ())))
    for i, branch in enumerate(tree):
        for grown in _with_one_more_leaf(branch):
            yield tuple(sorted((*tree[:i], grown, *tree[i + 1 :])))


def nodes(tree: Tree) -> int:
    """The order of a tree, written rho(t)."""
    return 1 + sum(nodes(branch) for branch in tree)


def density(tree: Tree) -> int:
    """gamma(t) (HNW, definition II.2.10): the order condition of a tree is sum_i b_i Phi_i(t) = 1/gamma(t)."""
    product = nodes(tree)
    for branch in tree:
        product *= density(branch)
    return product


def elementary_weights(tree: Tree, A: NDArray[np.float64]) -> NDArray[np.float64]:
    """Phi_i(t) for each stage i (HNW, theorem II.2.11), shape (stages,)."""
    weights = np.ones(len(A))
    for branch in tree:
        weights *= A @ elementary_weights(branch, A)
    return weights


@dataclass(frozen=True, eq=False)
class ButcherTableau:
    """An explicit Runge-Kutta method of s stages; numbers may be given as floats, integers or fractions.

    c (s,), A (s, s) strictly lower triangular (rows may be given short), b (s,).
    b_hat (s,), order_hat: the embedded method, whose difference from b estimates the error.
    P (s, d), order_dense: dense output y(t + theta h) = y + h sum_i k_i (P_i1 theta + ... + P_id theta^d).
    Raises ValueError naming the method and the condition that fails: shapes, A explicit, c_i = sum_j a_ij, all order
    conditions of b, b_hat and P.
    """

    name: str
    order: int
    c: Any
    A: Any
    b: Any
    citation: str
    b_hat: Any = None
    order_hat: int = 0
    P: Any = None
    order_dense: int = 0

    def __post_init__(self) -> None:
        """Turn the coefficients into read-only arrays and check them."""
        stages = len(self.b)
        rows = [[*row, *[0] * (stages - len(row))] for row in self.A]
        for name, value in {"c": self.c, "A": rows, "b": self.b, "b_hat": self.b_hat, "P": self.P}.items():
            if value is not None:
                array = np.array(value, dtype=np.float64)
                array.flags.writeable = False
                object.__setattr__(self, name, array)
        self._check_shapes(stages)
        self._check_conditions()

    @property
    def stages(self) -> int:
        """Number of stages s, a last stage that the next step reuses included."""
        return len(self.b)

    @property
    def along(self) -> Any:
        """The weight of each slope in the stage behind it, (s,), of the last one in the step itself.

        Raises ValueError where a stage leans on more than the slope before it.
        """
        if not np.array_equal(self.A, np.diag(np.diag(self.A, -1), -1)):
            raise ValueError(f"tableau {self.name}: a stage leans on more slopes than the last one")
        return np.array([*np.diag(self.A, -1), self.b[-1]])

    @property
    def first_same_as_last(self) -> bool:
        """Whether the last stage is the first of the next step (FSAL): its row of A is b and its c is 1."""
        return bool(self.stages > 1 and self.c[-1] == 1 and np.array_equal(self.A[-1], self.b))

    @property
    def evaluations_per_step(self) -> int:
        """Evaluations of the right-hand side that a step costs."""
        return self.stages - self.first_same_as_last

    def _check_shapes(self, s: int) -> None:
        wanted = {"c": (s,), "A": (s, s), "b": (s,), "b_hat": (s,)}
        for name, shape in wanted.items():
            value = getattr(self, name)
            if value is not None and value.shape != shape:
                raise ValueError(f"tableau {self.name}: {name} has shape {value.shape}, expected {shape}")
        if self.P is not None and (self.P.ndim != 2 or len(self.P) != s):
            raise ValueError(f"tableau {self.name}: P has shape {self.P.shape}, expected ({s}, degree)")
        if np.triu(self.A).any():
            raise ValueError(f"tableau {self.name}: A is not strictly lower triangular, so the method is not explicit")
        for i in np.flatnonzero(~self.A[1:].any(axis=1)) + 2:
            raise ValueError(f"tableau {self.name}: row {i} of A vanishes, so that stage {i} repeats the first")

    def _check_conditions(self) -> None:
        allowed = TOLERANCE * max(1.0, np.abs(self.A).max(), np.abs(self.b).max())
        for i, (c, row) in enumerate(zip(self.c, self.A, strict=True)):
            if abs(row.sum() - c) > allowed:
                raise ValueError(f"tableau {self.name}: row {i + 1} of A sums to {row.sum()}, expected c = {c}")
        self._check_order("b", self.b, self.order, allowed)
        if self.b_hat is not None:
            self._check_order("b_hat", self.b_hat, self.order_hat, allowed)
        if self.P is not None:
            self._check_dense(allowed)

    def _check_order(self, name: str, b: NDArray[np.float64], order: int, allowed: float) -> None:
        if order < 1:
            raise ValueError(f"tableau {self.name}: the order of {name} is {order}, expected at least 1")
        for tree in (tree for p in range(1, order + 1) for tree in rooted_trees(p)):
            found, expected = b @ elementary_weights(tree, self.A), 1 / density(tree)
            if abs(found - expected) > allowed:
                raise ValueError(
                    f"tableau {self.name}: {name} is not of order {order}: the condition of tree {tree} of order "
                    f"{nodes(tree)} gives {found}, expected 1/{density(tree)}"
                )

    def _check_dense(self, allowed: float) -> None:
        """Each power of theta is a condition (HNW, II.6): sum_i P_ij Phi_i(t) = 1/gamma(t) where j = rho(t), else 0."""
        allowed *= max(1.0, np.abs(self.P).max())
        if np.abs(self.P.sum(axis=1) - self.b).max() > allowed:
            raise ValueError(f"tableau {self.name}: dense output at theta = 1 is not the step: P does not sum to b")
        for tree in (tree for p in range(1, self.order_dense + 1) for tree in rooted_trees(p)):
            expected = np.zeros(self.P.shape[1])
            expected[nodes(tree) - 1] = 1 / density(tree)
            if np.abs(elementary_weights(tree, self.A) @ self.P - expected).max() > allowed:
                raise ValueError(f"tableau {self.name}: dense output is not of order {self.order_dense} (tree {tree})")
