"""The quarter car: one wheel on its tyre, a quarter of the body on its spring and damper."""

from sympy import Rational, Symbol, symbols

from qddot.model.scene import Damper, Ground, Polygon, Spring, Wheel
from qddot.model.system import Coordinate, Input, Output, Parameter, Quantity, System


def system() -> System:
    """Two degrees of freedom about the static position; gravity is balanced by the springs' static load.

    The parameters are typical values of a mid-size passenger car, of no particular one.
    """
    z_s, z_u, z_r, m_s, m_u, k_s, k_t, c_s, delta_s = symbols("z_s z_u z_r m_s m_u k_s k_t c_s delta_s")
    zdot_s, zdot_u, deltadot_s = symbols("zdot_s zdot_u deltadot_s")
    half = Rational(1, 2)
    deflection = Quantity(delta_s, z_s - z_u, "m", "suspension deflection", rate=deltadot_s)
    return System(
        name="quarter_car",
        title="Quarter car on a road, 2 degrees of freedom",
        coordinates=(
            Coordinate(z_s, "m", "displacement of the sprung mass"),
            Coordinate(z_u, "m", "displacement of the unsprung mass"),
        ),
        parameters=(
            Parameter(m_s, 250.0, "kg", "sprung mass"),
            Parameter(m_u, 40.0, "kg", "unsprung mass"),
            Parameter(k_s, 1.6e4, "N/m", "suspension stiffness"),
            Parameter(k_t, 1.6e5, "N/m", "tyre stiffness"),
            Parameter(c_s, 1000.0, "N s/m", "suspension damping"),
        ),
        inputs=(Input(z_r, "m", "road height", position=0),),
        quantities=(deflection,),
        kinetic_energy=half * m_s * zdot_s**2 + half * m_u * zdot_u**2,
        potential_energy=half * k_s * delta_s**2 + half * k_t * (z_u - z_r) ** 2,
        dissipation=half * c_s * deltadot_s**2,
        outputs=(
            Output(Symbol("body_acceleration"), Symbol("zddot_s"), "m/s^2", "acceleration of the sprung mass"),
            deflection,
            Output(Symbol("tyre_force"), k_t * (z_r - z_u), "N", "dynamic tyre force"),
        ),
        scene=(
            Ground([(0, z_r)]),
            Spring((-0.12, z_u + 0.32), (-0.12, z_s + 1.1), 0.14),
            Damper((0.12, z_s + 1.1), (0.12, z_u + 0.32), 0.1),
            Wheel((0, z_u + 0.32), 0.32),
            Polygon([(-0.45, 1.1), (0.45, 1.1), (0.45, 1.3), (0.36, 1.4), (-0.36, 1.4), (-0.45, 1.3)], at=(0, z_s)),
        ),
    )
