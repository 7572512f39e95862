"""The M113 carrier of paper 2116: five axles, hull heave and pitch, gun recoil, rough ground.

Numbered from 1, as in the paper: q[1] to q[5] are the axles, q[6] and q[7] heave and pitch of the hull.
"""

from sympy import Rational, Symbol, cos, pi, sin, symbols

from qddot.model.scene import Arrow, Bar, Damper, Ground, Polygon, Shape, Spring, Wheel
from qddot.model.system import Coordinate, Input, Output, Parameter, Quantity, System

AXLES = range(1, 6)
MASSES = range(1, 7)
HALF = Rational(1, 2)


def numbered(letter: str, count: int) -> dict[int, Symbol]:
    """Symbols letter_1 to letter_count by number."""
    return {i: Symbol(f"{letter}_{i}") for i in range(1, count + 1)}


q, qdot = numbered("q", 7), numbered("qdot", 7)
m, k, z = numbered("m", 6), numbered("k", 10), numbered("z", 5)
I_6, c_6, c_10, g, F = symbols("I_6 c_6 c_10 g F")
l_1, l_2, l_3, l_4, l_5, l_6, l_9, l_10, l_11, l_b = symbols("l_1 l_2 l_3 l_4 l_5 l_6 l_9 l_10 l_11 l_b")
a, d, ddot = numbered("a", 5), numbered("d", 5), numbered("ddot", 5)

# Geometry: how far each axle is behind the centre of mass, and by how much its suspension is stretched
arms = {1: -(l_3 + l_4 + l_11), 2: -(l_4 + l_11), 3: -l_11, 4: l_5 - l_11, 5: l_5 + l_6 - l_11}
geometry = (
    Quantity(l_11, l_1 - l_2 - l_3 - l_4, "m", "axle 3 to the centre of mass"),
    *(Quantity(a[i], arms[i], "m", f"axle {i} behind the centre of mass") for i in AXLES),
)
deflections = tuple(
    Quantity(d[i], q[6] + a[i] * q[7] - q[i], "m", f"suspension deflection, axle {i}", rate=ddot[i]) for i in AXLES
)

# Equations (2) to (4): kinetic energy, potential energy, dissipation and generalized forces
T = sum(HALF * m[i] * qdot[i] ** 2 for i in MASSES) + HALF * I_6 * qdot[7] ** 2
Pi = sum(HALF * k[i] * (q[i] - z[i]) ** 2 + HALF * k[i + 5] * d[i] ** 2 for i in AXLES)
Phi = HALF * c_6 * ddot[1] ** 2 + HALF * c_10 * ddot[5] ** 2
Q = {**{q[i]: -m[i] * g for i in MASSES}, q[7]: -F * (l_10 - l_9)}

outputs: tuple[Output | Quantity, ...] = (
    Output(Symbol("heave"), q[6], "m", "heave of the hull"),
    Output(Symbol("pitch"), q[7], "rad", "pitch of the hull"),
    Output(Symbol("heave_acceleration"), Symbol("qddot_6"), "m/s^2", "heave acceleration of the hull"),
    Output(Symbol("pitch_acceleration"), Symbol("qddot_7"), "rad/s^2", "pitch acceleration of the hull"),
    Output(Symbol("barrel_end"), q[6] - l_b * q[7], "m", "vertical displacement of the barrel end"),
    *deflections,
    *(Output(Symbol(f"tyre_force_{i}"), k[i] * (z[i] - q[i]), "N", f"tyre force, axle {i}") for i in AXLES),
)

# How it looks. The model's displacements count from springs without load, the scene's from the vehicle at rest
soft = {i: k[i] * k[i + 5] / (k[i] + k[i + 5]) for i in AXLES}
weight = {i: g * m[i] * k[i + 5] / (k[i] + k[i + 5]) for i in AXLES}
sums = [sum(soft[i] * a[i] ** power for i in AXLES) for power in range(3)]
load, moment = g * m[6] + sum(weight.values()), sum(a[i] * weight[i] for i in AXLES)
across = sums[0] * sums[2] - sums[1] ** 2
rest_6, rest_7 = (sums[1] * moment - sums[2] * load) / across, (sums[1] * load - sums[0] * moment) / across
rest = {i: (k[i + 5] * (rest_6 + a[i] * rest_7) - g * m[i]) / (k[i] + k[i + 5]) for i in AXLES}

RADIUS, TRACK = 0.29, 0.05
centre, tilt = (0, l_9 + q[6] - rest_6), rest_7 - q[7]  # of the hull: its centre of mass, its nose's way up
wheels = {i: (-a[i], RADIUS + TRACK + q[i] - rest[i]) for i in AXLES}


def on_hull(x: object, z: object) -> tuple[object, object]:
    """Where a place of the hull is: x ahead of its centre of mass, z above level ground at rest."""
    up = z - l_9
    return x * cos(tilt) - up * sin(tilt), centre[1] + x * sin(tilt) + up * cos(tilt)


def around(place: tuple[object, object], radius: float, degrees: tuple[int, ...]) -> list[tuple[object, object]]:
    """Places about another, at angles counted from straight ahead."""
    turned = [(cos(pi * angle / 180).evalf(), sin(pi * angle / 180).evalf()) for angle in degrees]
    return [(place[0] + radius * x, place[1] + radius * z) for x, z in turned]


def body(colour: str, *corners: tuple[float, float]) -> Polygon:
    """A part of the hull with corners (ahead, above level ground at rest)."""
    return Polygon([(x, z - l_9) for x, z in corners], at=centre, angle=tilt, colour=colour)


sprocket, idler = on_hull(2.0, 0.72), on_hull(-1.72, 0.62)
belt = (
    *around(sprocket, 0.27, (100, 60, 20, -20, -50)),
    *around(wheels[1], RADIUS + TRACK / 2, (-50, -75)),
    *((x, z - RADIUS - TRACK / 2) for x, z in wheels.values()),
    *around(wheels[5], RADIUS + TRACK / 2, (-105, -130)),
    *around(idler, 0.25, (230, 200, 160, 120, 90)),
)
muzzle = on_hull(l_b, l_10)
scene: tuple[Shape, ...] = (
    Ground([(-a[i], z[i]) for i in reversed(AXLES)]),
    body("olive", (2.05, 0.5), (2.34, 1.0), (1.6, 1.72), (-2.42, 1.72), (-2.52, 1.6), (-2.45, 0.5)),
    body("dark", (0.5, 1.72), (0.42, 2.02), (0.3, 2.42), (-0.55, 2.42), (-0.75, 2.05), (-0.75, 1.72)),
    Bar(on_hull(0.2, l_10), muzzle, 0.07, colour="grey"),
    *(Spring(wheels[i], on_hull(-a[i], 1.15), 0.16) for i in AXLES),
    *(Damper(on_hull(0.16 - a[i], 1.15), wheels[i], 0.1) for i in (1, 5)),
    Wheel(sprocket, 0.24),
    Wheel(idler, 0.22),
    *(Wheel(place, RADIUS) for place in wheels.values()),
    Polygon(belt, width=TRACK, filled=False, colour="dark"),
    Polygon(
        [(0.02, -0.03), (0.25, -0.2), (0.3, -0.08), (0.75, 0), (0.3, 0.08), (0.25, 0.2), (0.02, 0.03)],
        at=muzzle,
        angle=tilt,
        colour="yellow",
        when=F,
    ),
    Arrow(on_hull(-0.8, l_10), (-F, 0)),
)

parameters = (
    *(Parameter(m[i], 160.0 if i in (1, 5) else 120.0, "kg", f"unsprung mass, axle {i}") for i in AXLES),
    Parameter(m[6], 10120.0, "kg", "mass of the hull"),
    Parameter(I_6, 21900.0, "kg m^2", "pitch moment of inertia of the hull"),
    *(Parameter(k[i], 2.15e6, "N/m", f"tyre stiffness, axle {i}") for i in AXLES),
    *(Parameter(k[i + 5], 6.5e4, "N/m", f"suspension stiffness, axle {i}") for i in AXLES),
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
)

# Further sets: the paper's vehicle, its tyres as run, on the suspension of a public model of the M113, Project Chrono's
# (data/vehicle/M113/suspension/M113_TranslationalDamperSuspension_Left.json, which its README there traces to M. Wallin
# and others, Nonlinear Dyn. 74 (2013) 783, and M. F. R. Afonso, master's thesis, Concordia University, Montreal, 1989).
# A torsion bar of 2.5e4 N m/rad with 500 N m s/rad turns each of ten road arms; the wheel is 0.288 m beside the pivot.
# Linear about there: 3.0e5 N/m and 6.0e3 N s/m a wheel. An axle has two wheels; damped are the paper's two axles.
BAR_STIFFNESS, BAR_DAMPING, LEVER, WHEELS = 2.5e4, 500.0, 0.288, 2
public = {
    **{k[i]: 2.15e6 for i in AXLES},
    **{k[i + 5]: WHEELS * BAR_STIFFNESS / LEVER**2 for i in AXLES},
    **{c: WHEELS * BAR_DAMPING / LEVER**2 for c in (c_6, c_10)},
}
suspensions = {
    "as_run": {k[i]: 2.15e6 for i in AXLES},
    "as_printed": {k[i]: 2.15e7 for i in AXLES},
    "public": public,
}
loads = {"unloaded": {}, "loaded": {m[6]: 11360.0, I_6: 24600.0, l_1: 2.45}}


def system() -> System:
    """The paper's model, unloaded and loaded: tyres as run or as printed, or as run with a public suspension."""
    return System(
        name="m113",
        title="M113 carrier on rough ground under gun recoil, 7 degrees of freedom",
        coordinates=(
            *(Coordinate(q[i], "m", f"vertical displacement of axle {i}") for i in AXLES),
            Coordinate(q[6], "m", "heave of the hull"),
            Coordinate(q[7], "rad", "pitch of the hull"),
        ),
        inputs=(
            *(Input(z[i], "m", f"road height under axle {i}", position=-a[i]) for i in AXLES),
            Input(F, "N", "recoil force of the gun"),
        ),
        quantities=(*geometry, *deflections),
        kinetic_energy=T,
        potential_energy=Pi,
        dissipation=Phi,
        generalized_forces=Q,
        outputs=outputs,
        scene=scene,
        parameters=parameters,
        parameter_sets={
            f"{suspension}_{load}": {**values, **changed}
            for suspension, values in suspensions.items()
            for load, changed in loads.items()
        },
    )
