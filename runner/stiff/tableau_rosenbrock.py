"""Rosenbrock methods as pages that check themselves.

Notation of E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (HW), section IV.7, in the form that is
computed, (IV.7.25): with U_i = sum_j gamma_ij k_j,

    (M/(h gamma) - J) U_i = f(t + c_i h, x + sum_j a_ij U_j) + M sum_j (C_ij/h) U_j + h d_i df/dt
    x_new = x + sum_i m_i U_i
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.tableaux.butcher import Tree, density, nodes, rooted_trees

#: Rounding allowed in an order condition, relative to its largest term.
TOLERANCE = 2e-13


#: Lists when a tableau is written down, float64 arrays once it is born.
Coefficients = Any


@dataclass(frozen=True, eq=False)
class RosenbrockTableau:
    """A Rosenbrock method of s stages whose last stage is its error estimate, as in stiffly accurate embedded pairs.

    a, C: rows of the strictly lower triangles, (s, s) once made. c, d (s,), m (s,), error (s,): weights of the U_i.
    dense (3, s): x(t + theta h) = (1 - theta) x + theta (x_new + (1 - theta) (D_1 + theta (D_2 + theta D_3))) with
    D = dense U.
    alpha, beta (s, s): the classical coefficients they come from, with gamma on the diagonal of beta.
    Raises ValueError naming the condition that fails: row sums, order conditions of the method, of the embedded one, of
    dense output.
    """

    name: str
    order: int
    gamma: float
    a: Coefficients
    C: Coefficients
    c: Coefficients
    d: Coefficients
    m: Coefficients
    error: Coefficients
    dense: Coefficients
    citation: str
    alpha: NDArray[np.float64] = field(init=False)
    beta: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        """Turn the coefficients into arrays, recover the classical ones and check them."""
        s = len(self.m)
        for name in ("a", "C"):
            rows = [[*row, *[0.0] * (s - len(row))] for row in getattr(self, name)]
            object.__setattr__(self, name, np.array(rows, dtype=np.float64))
        for name in ("c", "d", "m", "error", "dense"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=np.float64))
        gammas = np.linalg.inv(np.eye(s) / self.gamma - self.C)
        object.__setattr__(self, "alpha", self.a @ gammas)
        object.__setattr__(self, "beta", self.alpha + gammas)
        self._check_rows(gammas)
        weights = self.m @ gammas
        self._check_order("the method", weights[None], self.order, self._step_powers)
        self._check_order("the embedded method", weights[None] - self.error @ gammas, self.order - 1, self._step_powers)
        self._check_order("dense output", self._dense_weights(gammas), self.order - 1, self._dense_powers)

    @property
    def stages(self) -> int:
        """Number of stages s."""
        return len(self.m)

    def elementary_weights(self, tree: Tree) -> NDArray[np.float64]:
        """Phi_i(t) (s,) (HW, theorem IV.7.3): alpha where the tree branches, beta where it does not."""
        if len(tree) == 1:
            return self.beta @ self.elementary_weights(tree[0])
        return np.prod([np.ones(self.stages), *(self.alpha @ self.elementary_weights(t) for t in tree)], axis=0)

    def _check_rows(self, gammas: NDArray[np.float64]) -> None:
        for what, found, expected in (("c", self.alpha.sum(axis=1), self.c), ("d", gammas.sum(axis=1), self.d)):
            if np.abs(found - expected).max() > 1e3 * TOLERANCE:
                raise ValueError(f"tableau {self.name}: {what} is {expected}, but its row sums are {found}")

    def _dense_weights(self, gammas: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weights of the k_i at theta, theta^2, theta^3, theta^4, (4, s)."""
        m, (D1, D2, D3) = self.m, self.dense
        return np.array([m + D1, D2 - D1, D3 - D2, -D3]) @ gammas

    @staticmethod
    def _step_powers(tree: Tree) -> NDArray[np.float64]:
        return np.array([1.0 / density(tree)])

    @staticmethod
    def _dense_powers(tree: Tree) -> NDArray[np.float64]:
        return np.where(np.arange(1, 5) == nodes(tree), 1.0 / density(tree), 0.0)

    def _check_order(self, what: str, weights: NDArray[np.float64], order: int, powers: object) -> None:
        for tree in (tree for p in range(1, order + 1) for tree in rooted_trees(p)):
            phi = self.elementary_weights(tree)
            allowed = TOLERANCE * max(1.0, np.abs(weights * phi).max() * self.stages)
            found, expected = weights @ phi, powers(tree)  # type: ignore[operator]
            if np.abs(found - expected).max() > allowed:
                raise ValueError(
                    f"tableau {self.name}: {what} is not of order {order}: the condition of tree {tree} of order "
                    f"{nodes(tree)} gives {found}, expected {expected}"
                )


_LAST_ROW = [
    -7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946,
]  # fmt: skip

RODAS5P = RosenbrockTableau(
    name="rodas5p",
    order=5,
    gamma=0.21193756319429014,
    a=[
        [],
        [3.0],
        [2.849394379747939, 0.45842242204463923],
        [-6.954028509809101, 2.489845061869568, -10.358996098473584],
        [2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641],
        _LAST_ROW,
        [*_LAST_ROW, 1.0],
        [*_LAST_ROW, 1.0, 1.0],
    ],
    C=[
        [],
        [-14.155112264123755],
        [-17.97296035885952, -2.859693295451294],
        [147.12150275711716, -1.41221402718213, 71.68940251302358],
        [165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306],
        [24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471],
        [30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623,
         -28.087943162872662],
        [37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047, -40.06618937091002,
         -54.66780262877968, -9.48861652309627],
    ],
    c=[0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1.0, 1.0, 1.0],
    d=[0.21193756319429014, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734, 2.325825639765069, 0, 0, 0],
    m=[*_LAST_ROW, 1.0, 1.0, 1.0],
    error=[0, 0, 0, 0, 0, 0, 0, 1.0],
    dense=[
        [25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204, 0.524948541321073,
         1.1241088310450404, 0.4272876194431874, -0.17202221070155493],
        [-9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796, 20.176138334709044,
         15.98066361424651, -6.789040303419874, -6.710236069923372],
        [11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643, -52.072871366152654,
         -59.78993625266729, -0.15582684282751913, 4.883087185713722],
    ],
    citation="G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P, BIT Numer. Math. 63 (2023) 27",
)  # fmt: skip
