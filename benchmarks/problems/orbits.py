"""The Pleiades and the Arenstorf orbit: non-stiff, with close encounters that a constant step would not survive."""

from benchmarks.problems.problem import Problem, kernel

#: Of the Arenstorf orbit: the Moon's part of the mass.
MOON = 0.012277471


@kernel
def pleiades(t, x, u, c, dx):
    """Seven stars in a plane with masses 1 to 7: all x, all y, then their rates."""
    for i in range(14):
        dx[i] = x[14 + i]
        dx[14 + i] = 0.0
    for i in range(7):
        for j in range(i):
            across, up = x[i] - x[j], x[7 + i] - x[7 + j]
            d = (across * across + up * up) ** -1.5
            dx[14 + i] -= (j + 1) * across * d
            dx[21 + i] -= (j + 1) * up * d
            dx[14 + j] += (i + 1) * across * d
            dx[21 + j] += (i + 1) * up * d


@kernel
def arenstorf(t, x, u, c, dx):
    """The restricted three-body problem in rotating coordinates: position, velocity."""
    earth = 1.0 - MOON
    d1 = earth * ((x[0] + MOON) ** 2 + x[1] ** 2) ** -1.5
    d2 = MOON * ((x[0] - earth) ** 2 + x[1] ** 2) ** -1.5
    dx[0] = x[2]
    dx[1] = x[3]
    dx[2] = x[0] + 2.0 * x[3] - d1 * (x[0] + MOON) - d2 * (x[0] - earth)
    dx[3] = x[1] - 2.0 * x[2] - (d1 + d2) * x[1]


# fmt: off
STARS = (
    3.0, 3.0, -1.0, -3.0, 2.0, -2.0, 2.0, 3.0, -3.0, 2.0, 0.0, 0.0, -4.0, 4.0,
    0.0, 0.0, 0.0, 0.0, 0.0, 1.75, -1.5, 0.0, 0.0, 0.0, -1.25, 1.0, 0.0, 0.0,
)
STARS_END = (
    0.3706139143970502, 3.237284092057233, -3.222559032418324, 0.6597091455775310, 0.3425581707156584,
    1.562172101400631, -0.7003092922212495, -3.943437585517392, -3.271380973972550, 5.225081843456543,
    -2.590612434977470, 1.198213693392275, -0.2429682344935824, 1.091449240428980, 3.417003806314313,
    1.354584501625501, -2.590065597810775, 2.025053734714242, -1.155815100160448, -0.8072988170223021,
    0.5952396354208710, -3.741244961234010, 0.3773459685750630, 0.9386858869551073, 0.3667922227200571,
    -0.3474046353808490, 2.344915448180937, -1.947020434263292,
)
# fmt: on
ARENSTORF_START = (0.994, 0.0, 0.0, -2.00158510637908252240537862224)

PROBLEMS = (
    Problem(
        name="Pleiades",
        set="orbits",
        rhs=pleiades,
        span=(0.0, 3.0),
        x0=STARS,
        end=STARS_END,
        citation="E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.10 (PLEI); end "
        "point of F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers 2.4 (2008), II-4 (plei)",
    ),
    Problem(
        name="Arenstorf orbit",
        set="orbits",
        rhs=arenstorf,
        span=(0.0, 17.0652165601579625588917206249),
        x0=ARENSTORF_START,
        end=ARENSTORF_START,
        citation="E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.0 (AREN), "
        "equations (0.1) and (0.2): the orbit is closed, so the end is the start",
        scale=1.0,
    ),
)
