"""A gun's recoiling parts on a recuperator and a magnetorheological damper, whose voltage a PID law commands.

The damper is the modified Bouc-Wen model of Spencer, Dyke, Sain and Carlson, "Phenomenological model of a
magnetorheological damper", J. Eng. Mech. 123 (1997) 230-238, equations (11) to (19): a hysteresis z with a dashpot c_0
beside it, in series with a dashpot c_1, an accumulator k_1 beside all of them, and a voltage that lags behind.
"""

from sympy import Abs, Max, Min, Rational, Symbol, symbols

from qddot.model.scene import Arrow, Damper, Disc, Polygon, Spring
from qddot.model.system import Coordinate, Input, Output, Parameter, Quantity, State, System


def system() -> System:
    """One degree of freedom and four internal states; the travel counts from where the springs balance each other.

    The damper's constants are those of the prototype (some 1.5 kN at 2.25 V) in the article's table of the generalized
    model, as they are widely quoted; no printed copy was at hand to compare them with. Mass, recuperator and gains are
    assumptions: a rifle's recoil, which the damper's stroke of 25 mm can take.
    """
    x, xdot, y, ydot, z, u, e, F, m, k_r = symbols("x xdot y ydot z u e F m k_r")
    alpha, alpha_a, alpha_b, A, beta, gamma, eta = symbols("alpha alpha_a alpha_b A beta gamma eta")
    c_0, c_0a, c_0b, c_1, c_1a, c_1b, k_0, k_1 = symbols("c_0 c_0a c_0b c_1 c_1a c_1b k_0 k_1")
    v, w, u_c, u_m, k_p, k_i, k_d = symbols("v w u_c u_m k_p k_i k_d")
    half = Rational(1, 2)
    command = Quantity(u_c, Min(Max(w, 0), u_m), "V", "commanded voltage")
    barrel = [
        (-0.12, -0.035),
        (0.06, -0.035),
        (0.08, -0.018),
        (0.4, -0.018),
        (0.4, 0.018),
        (0.08, 0.018),
        (0.06, 0.035),
        (-0.12, 0.035),
    ]
    flash = [(0.405, -0.006), (0.44, -0.03), (0.47, -0.012), (0.52, 0), (0.47, 0.012), (0.44, 0.03), (0.405, 0.006)]
    cradle = [
        (-0.3, -0.16),
        (0.2, -0.16),
        (0.2, -0.045),
        (0.18, -0.045),
        (0.18, -0.13),
        (-0.28, -0.13),
        (-0.28, 0.03),
        (-0.3, 0.03),
    ]
    return System(
        name="recoil_damper",
        title="Recoiling parts on a magnetorheological damper under a PID law",
        coordinates=(Coordinate(x, "m", "travel of the recoiling parts"),),
        states=(
            State(y, (alpha * z + c_0 * xdot + k_0 * (x - y)) / (c_0 + c_1), "m", "travel of the inner dashpot"),
            State(z, A * v - gamma * Abs(v) * Abs(z) * z - beta * v * z**2, "m", "hysteresis of the damper"),
            State(u, eta * (u_c - u), "V", "voltage that acts"),
            State(e, x, "m s", "integral of the travel"),
        ),
        parameters=(
            Parameter(m, 60.0, "kg", "mass of the recoiling parts"),
            Parameter(k_r, 40000.0, "N/m", "stiffness of the recuperator"),
            Parameter(alpha_a, 14000.0, "N/m", "force of the hysteresis at no voltage"),
            Parameter(alpha_b, 69500.0, "N/(m V)", "force of the hysteresis per voltage"),
            Parameter(c_0a, 2100.0, "N s/m", "dashpot beside the hysteresis at no voltage"),
            Parameter(c_0b, 350.0, "N s/(m V)", "dashpot beside the hysteresis per voltage"),
            Parameter(c_1a, 28300.0, "N s/m", "dashpot in series at no voltage"),
            Parameter(c_1b, 295.0, "N s/(m V)", "dashpot in series per voltage"),
            Parameter(k_0, 4690.0, "N/m", "stiffness at high speed"),
            Parameter(k_1, 500.0, "N/m", "stiffness of the accumulator"),
            Parameter(A, 301.0, "1", "slope of the hysteresis"),
            Parameter(beta, 3.63e6, "1/m^2", "shape of the hysteresis"),
            Parameter(gamma, 3.63e6, "1/m^2", "shape of the hysteresis"),
            Parameter(eta, 190.0, "1/s", "rate at which the voltage follows"),
            Parameter(u_m, 2.25, "V", "greatest voltage"),
            Parameter(k_p, 40.0, "V/m", "gain of the travel"),
            Parameter(k_i, 100.0, "V/(m s)", "gain of its integral"),
            Parameter(k_d, 3.0, "V s/m", "gain of its rate"),
        ),
        inputs=(Input(F, "N", "force of the shot on the recoiling parts"),),
        quantities=(
            Quantity(w, k_p * x + k_i * e + k_d * xdot, "V", "voltage of the PID law"),
            command,
            Quantity(alpha, alpha_a + alpha_b * u, "N/m", "force of the hysteresis"),
            Quantity(c_0, c_0a + c_0b * u, "N s/m", "dashpot beside the hysteresis"),
            Quantity(c_1, c_1a + c_1b * u, "N s/m", "dashpot in series"),
            Quantity(v, xdot - ydot, "m/s", "speed of the hysteresis"),
        ),
        kinetic_energy=half * m * xdot**2,
        potential_energy=half * (k_r + k_1) * x**2,
        generalized_forces={x: F - c_1 * ydot},
        outputs=(
            Output(Symbol("damper_force"), c_1 * ydot + k_1 * x, "N", "force of the damper and its accumulator"),
            command,
        ),
        scene=(
            Polygon(cradle, colour="grey"),
            Spring((-0.28, 0.0), (-x - 0.12, 0.0), 0.035),
            Damper((-0.28, -0.09), (-x - 0.05, -0.09), 0.035),
            Polygon([(-0.05, -0.1), (-0.02, -0.1), (-0.02, -0.03), (-0.05, -0.03)], at=(-x, 0), colour="olive"),
            Polygon(barrel, at=(-x, 0), colour="olive"),
            Polygon(flash, at=(-x, 0), colour="yellow", when=F),
            Disc((-x - 0.035, -0.09), 0.008, colour="dark"),
            Arrow((-x - 0.12, 0.06), (-F, 0)),
        ),
    )
