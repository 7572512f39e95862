"""The M113 carrier of paper 2116: five axles, hull heave and pitch, gun recoil, rough ground; equations (2) to (4)."""

from sympy import Rational, Symbol, symbols

from model.system import Coordinate, Input, Output, Parameter, Quantity, System

AXLES = range(1, 6)


def system() -> System:
    """The paper's model, with its four parameter sets: unloaded and loaded, stiffness as run and as printed."""
    q = symbols("q_1:8")
    qdot = symbols("qdot_1:8")
    z = symbols("z_1:6")
    m = symbols("m_1:7")
    k = symbols("k_1:11")
    l_1, l_2, l_3, l_4, l_5, l_6, l_9, l_10 = symbols("l_1 l_2 l_3 l_4 l_5 l_6 l_9 l_10")
    a = symbols("a_1:6")
    d = symbols("d_1:6")
    ddot = symbols("ddot_1:6")
    i_6, c_6, c_10, g, f, l_11, l_b = symbols("I_6 c_6 c_10 g F l_11 l_b")
    arms = (-(l_3 + l_4 + l_11), -(l_4 + l_11), -l_11, l_5 - l_11, l_5 + l_6 - l_11)
    half = Rational(1, 2)

    deflections = tuple(
        Quantity(d[i], q[5] + a[i] * q[6] - q[i], "m", f"suspension deflection, axle {i + 1}", rate=ddot[i])
        for i in range(5)
    )
    return System(
        name="m113",
        title="M113 carrier on rough ground under gun recoil, 7 degrees of freedom",
        coordinates=(
            *(Coordinate(q[i - 1], "m", f"vertical displacement of axle {i}") for i in AXLES),
            Coordinate(q[5], "m", "heave of the hull"),
            Coordinate(q[6], "rad", "pitch of the hull"),
        ),
        parameters=(
            *(Parameter(m[i - 1], 160.0 if i in (1, 5) else 120.0, "kg", f"unsprung mass, axle {i}") for i in AXLES),
            Parameter(m[5], 10120.0, "kg", "mass of the hull"),
            Parameter(i_6, 21900.0, "kg m^2", "pitch moment of inertia of the hull"),
            *(Parameter(k[i - 1], 2.15e6, "N/m", f"tyre stiffness, axle {i}") for i in AXLES),
            *(Parameter(k[i + 4], 6.5e4, "N/m", f"suspension stiffness, axle {i}") for i in AXLES),
            Parameter(c_6, 1800.0, "N s/m", "suspension damping, axle 1"),
            Parameter(c_10, 1800.0, "N s/m", "suspension damping, axle 5"),
            Parameter(l_1, 2.34, "m", "front of the hull to its centre of mass"),
            Parameter(l_2, 0.68, "m", "front of the hull to axle 1"),
            Parameter(l_3, 0.66, "m", "axle 1 to axle 2"),
            Parameter(l_4, 0.66, "m", "axle 2 to axle 3"),
            Parameter(l_5, 0.66, "m", "axle 3 to axle 4"),
            Parameter(l_6, 0.66, "m", "axle 4 to axle 5"),
            Parameter(l_9, 1.3, "m", "height of the centre of mass"),
            Parameter(l_10, 2.3, "m", "height of the gun's line of fire"),
            Parameter(l_b, 3.0, "m", "barrel end ahead of the centre of mass (assumed, not in the paper)"),
            Parameter(g, 9.81, "m/s^2", "acceleration of gravity"),
        ),
        inputs=(
            *(Input(z[i - 1], "m", f"road height under axle {i}", position=-a[i - 1]) for i in AXLES),
            Input(f, "N", "recoil force of the gun"),
        ),
        quantities=(
            Quantity(l_11, l_1 - l_2 - l_3 - l_4, "m", "axle 3 to the centre of mass"),
            *(Quantity(a[i - 1], arms[i - 1], "m", f"axle {i} behind the centre of mass") for i in AXLES),
            *deflections,
        ),
        kinetic_energy=sum(half * m[i] * qdot[i] ** 2 for i in range(6)) + half * i_6 * qdot[6] ** 2,
        potential_energy=sum(half * k[i] * (q[i] - z[i]) ** 2 + half * k[i + 5] * d[i] ** 2 for i in range(5)),
        dissipation=half * c_6 * ddot[0] ** 2 + half * c_10 * ddot[4] ** 2,
        generalized_forces={**{q[i]: -m[i] * g for i in range(6)}, q[6]: -f * (l_10 - l_9)},
        outputs=(
            Output(Symbol("heave"), q[5], "m", "heave of the hull"),
            Output(Symbol("pitch"), q[6], "rad", "pitch of the hull"),
            Output(Symbol("heave_acceleration"), Symbol("qddot_6"), "m/s^2", "heave acceleration of the hull"),
            Output(Symbol("pitch_acceleration"), Symbol("qddot_7"), "rad/s^2", "pitch acceleration of the hull"),
            Output(Symbol("barrel_end"), q[5] - l_b * q[6], "m", "vertical displacement of the barrel end"),
            *deflections,
            *(
                Output(Symbol(f"tyre_force_{i}"), k[i - 1] * (z[i - 1] - q[i - 1]), "N", f"tyre force, axle {i}")
                for i in AXLES
            ),
        ),
        parameter_sets={
            f"{stiffness}_{load}": {
                **{k[i]: value for i in range(5)},
                **({m[5]: 11360.0, i_6: 24600.0, l_1: 2.45} if load == "loaded" else {}),
            }
            for stiffness, value in (("as_run", 2.15e6), ("as_printed", 2.15e7))
            for load in ("unloaded", "loaded")
        },
    )
