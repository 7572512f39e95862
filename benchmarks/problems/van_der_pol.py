"""Van der Pol's equation x'' = mu (1 - x^2) x' - x with mu = 1e3 and 1e6, over about 1.2 periods; stiff.

In the scaled time t / mu this is epsilon y'' = (1 - y^2) y' - y with epsilon = 1/mu^2 (E. Hairer, G. Wanner, Solving
Ordinary Differential Equations II, equation IV.1.5'), which the test set gives for epsilon = 1e-6, so for mu = 1e3.
"""

from benchmarks.problems.problem import Problem, kernel


@kernel
def van_der_pol(t, x, u, c, dx):
    """Displacement and rate; c = (mu,)."""
    dx[0] = x[1]
    dx[1] = c[0] * (1.0 - x[0] ** 2) * x[1] - x[0]


@kernel
def van_der_pol_jacobian(t, x, u, c, J):
    """Of `van_der_pol`."""
    J[0, 0], J[0, 1] = 0.0, 1.0
    J[1, 0], J[1, 1] = -2.0 * c[0] * x[0] * x[1] - 1.0, c[0] * (1.0 - x[0] ** 2)


def _problem(mu: float, end: tuple[float, float], citation: str) -> Problem:
    return Problem(
        name=f"Van der Pol {mu:.0e}".replace("e+0", "e"),
        set="stiff",
        rhs=van_der_pol,
        jacobian=van_der_pol_jacobian,
        span=(0.0, 2.0 * mu),
        x0=(2.0, 0.0),
        end=end,
        scale=(1.0, 1.0 / mu),
        constants=(mu,),
        citation=citation,
    )


PROBLEMS = (
    _problem(
        1e3,
        (0.1706167732170483e1, -0.8928097010247975e-3),
        "F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers 2.4 (2008): end point of vdpol, rescaled",
    ),
    _problem(
        1e6,
        (1.7055462175353, -0.893476362547e-6),
        "end point computed, not published: SciPy's Radau in Lienard's coordinates at rtol 1e-12 and Rodas5P at 3e-13 "
        "in the plane of phases agree to 13 digits",
    ),
)
