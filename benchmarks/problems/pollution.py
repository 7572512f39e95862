"""The air pollution model of the Dutch national institute, 25 reactions of 20 species; stiff.

J. G. Verwer, "Gauss-Seidel iteration for stiff ODEs from chemical kinetics", SIAM J. Sci. Comput. 15 (1994) 1243-1250;
F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers, release 2.4 (2008), pollu.
"""

import numpy as np
from numpy.typing import NDArray

from benchmarks.problems.problem import Problem, kernel

# fmt: off
#: Rate constants of reactions 1 to 25.
RATES = np.array((
    0.35, 26.6, 1.23e4, 8.6e-4, 8.2e-4, 1.5e4, 1.3e-4, 2.4e4, 1.65e4, 9e3, 0.022, 1.2e4, 1.88,
    1.63e4, 4.8e6, 3.5e-4, 0.0175, 1e8, 4.44e11, 1240.0, 2.1, 5.78, 0.0474, 1780.0, 3.12,
))
#: The species that react in reactions 1 to 25, numbered from 1; 0 where there is but one.
REACTANTS = np.array((
    (1, 0), (2, 4), (5, 2), (7, 0), (7, 0), (7, 6), (9, 0), (9, 6), (11, 2), (11, 1), (13, 0), (10, 2), (14, 0),
    (1, 6), (3, 0), (4, 0), (4, 0), (16, 0), (16, 0), (17, 6), (19, 0), (19, 0), (1, 4), (19, 1), (20, 0),
))
#: For species 1 to 20, the reactions that use it up (negative) and that make it; twice where two are made.
BALANCES = (
    (-1, -10, -14, -23, -24, 2, 3, 9, 11, 12, 22, 25), (-2, -3, -9, -12, 1, 21), (-15, 1, 17, 19, 22),
    (-2, -16, -17, -23, 15), (-3, 4, 4, 6, 7, 13, 20), (-6, -8, -14, -20, 3, 18, 18), (-4, -5, -6, 13),
    (4, 5, 6, 7), (-7, -8), (-12, 7, 9), (-9, -10, 8, 11), (9,), (-11, 10), (-13, 12), (14,), (-18, -19, 16),
    (-20,), (20,), (-21, -22, -24, 23, 25), (-25, 24),
)
END = (
    0.5646255480022769e-01, 0.1342484130422339e+00, 0.4139734331099427e-08, 0.5523140207484359e-02,
    0.2018977262302196e-06, 0.1464541863493966e-06, 0.7784249118997964e-01, 0.3245075353396018e+00,
    0.7494013383880406e-02, 0.1622293157301561e-07, 0.1135863833257075e-07, 0.2230505975721359e-02,
    0.2087162882798630e-03, 0.1396921016840158e-04, 0.8964884856898295e-02, 0.4352846369330103e-17,
    0.6899219696263405e-02, 0.1007803037365946e-03, 0.1772146513969984e-05, 0.5682943292316392e-04,
)
# fmt: on
START = {2: 0.2, 4: 0.04, 7: 0.1, 8: 0.3, 9: 0.01, 17: 0.007}


def _stoichiometry() -> NDArray[np.float64]:
    """Molecules of each species (20,) made by each reaction (25,), as (25, 20)."""
    made = np.zeros((25, 20))
    for species, reactions in enumerate(BALANCES):
        for reaction in reactions:
            made[abs(reaction) - 1, species] += np.sign(reaction)
    return made


MADE = _stoichiometry()


@kernel
def pollution(t, x, u, c, dx):
    """Mass action kinetics of the reactions."""
    dx[:] = 0.0
    for r in range(25):
        a, b = REACTANTS[r]
        speed = RATES[r] * x[a - 1]
        if b > 0:
            speed *= x[b - 1]
        for i in range(20):
            dx[i] += MADE[r, i] * speed


@kernel
def pollution_jacobian(t, x, u, c, J):
    """Of `pollution`."""
    J[:] = 0.0
    for r in range(25):
        a, b = REACTANTS[r]
        for i in range(20):
            if b > 0:
                J[i, a - 1] += MADE[r, i] * RATES[r] * x[b - 1]
                J[i, b - 1] += MADE[r, i] * RATES[r] * x[a - 1]
            else:
                J[i, a - 1] += MADE[r, i] * RATES[r]


PROBLEMS = (
    Problem(
        name="Pollution",
        set="stiff",
        rhs=pollution,
        jacobian=pollution_jacobian,
        span=(0.0, 60.0),
        x0=tuple(START.get(i, 0.0) for i in range(1, 21)),
        end=END,
        scale=1e-9,
        citation="J. G. Verwer, SIAM J. Sci. Comput. 15 (1994) 1243-1250; end point of F. Mazzia, C. Magherini, Test "
        "Set for Initial Value Problem Solvers 2.4 (2008), pollu",
    ),
)
