"""Electrical circuits: the ring modulator, stiff, and the transistor amplifier, a differential-algebraic equation.

F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers, release 2.4 (2008), ringmod and transamp.
"""

import numpy as np
from numpy.typing import NDArray

from benchmarks.problems.problem import Problem, kernel

#: Ring modulator: capacities in F, inductances in H, resistances in ohm, by the rows of the state. CS is parasitic.
C, CS, CP, LH, LS1, LS2, LS3 = 1.6e-8, 2e-12, 1e-8, 4.45, 2e-3, 5e-4, 5e-4
R, RP, RG1, RG2, RG3, RI, RC = 25e3, 50.0, 36.3, 17.3, 17.3, 50.0, 600.0
STORAGE = np.array((C, C, CS, CS, CS, CS, CP, LH, LH, LS2, LS3, LS2, LS3, LS1, LS1))
#: Its diodes: current GAMMA (exp(DELTA u) - 1) at voltage u = DIODES x[2:7] + CARRIER * u_in2.
GAMMA, DELTA = 40.67286402e-9, 17.7493332
DIODES = np.array(((1.0, 0, -1, 0, -1), (0, -1, 0, 1, -1), (0, 1, 1, 0, 1), (-1, 0, 0, -1, 1)))
CARRIER = np.array((-1.0, -1.0, 1.0, 1.0))

#: Transistor amplifier: first and other resistances in ohm, thermal and operating voltage in V.
R0, RK, UF, UB, ALPHA, BETA = 1000.0, 9000.0, 0.026, 6.0, 0.99, 1e-6


def _linear_part() -> NDArray[np.float64]:
    """Of STORAGE x', (15, 15): all but diodes and inputs. The coils oppose what they feed, hence the antisymmetry."""
    A = np.zeros((15, 15))
    for i, j, part in ((0, 7, 1), (0, 9, -0.5), (0, 10, 0.5), (0, 13, 1), (2, 9, 1), (3, 10, -1)):
        A[i, j], A[j, i] = part, -part
    for i, j, part in ((1, 8, 1), (1, 11, -0.5), (1, 12, 0.5), (1, 14, 1), (4, 11, 1), (5, 12, -1)):
        A[i, j], A[j, i] = part, -part
    losses = (1 / R, 1 / R, 0, 0, 0, 0, 1 / RP, 0, 0, RG2, RG3, RG2, RG3, RI + RG1, RC + RG1)
    return A - np.diag(losses)


LINEAR = _linear_part()


@kernel
def ring_modulator(t, x, u, c, dx):
    """Voltages x[:7], currents x[7:] of a circuit that mixes a signal of 1 kHz with a carrier of 10 kHz (Horneber)."""
    signal, carrier = 0.5 * np.sin(2e3 * np.pi * t), 2.0 * np.sin(2e4 * np.pi * t)
    for i in range(15):
        dx[i] = 0.0
        for j in range(15):
            dx[i] += LINEAR[i, j] * x[j]
    dx[13] += signal
    for d in range(4):
        voltage = CARRIER[d] * carrier
        for i in range(5):
            voltage += DIODES[d, i] * x[2 + i]
        current = GAMMA * (np.exp(DELTA * voltage) - 1.0)
        for i in range(5):
            dx[2 + i] -= DIODES[d, i] * current
    for i in range(15):
        dx[i] /= STORAGE[i]


@kernel
def ring_modulator_jacobian(t, x, u, c, J):
    """Of `ring_modulator`."""
    carrier = 2.0 * np.sin(2e4 * np.pi * t)
    for i in range(15):
        for j in range(15):
            J[i, j] = LINEAR[i, j]
    for d in range(4):
        voltage = CARRIER[d] * carrier
        for i in range(5):
            voltage += DIODES[d, i] * x[2 + i]
        conductance = GAMMA * DELTA * np.exp(DELTA * voltage)
        for i in range(5):
            for j in range(5):
                J[2 + i, 2 + j] -= DIODES[d, i] * DIODES[d, j] * conductance
    for i in range(15):
        for j in range(15):
            J[i, j] /= STORAGE[i]


@kernel
def amplifier(t, x, u, c, dx):
    """Currents into the eight nodes; x are their voltages. Three capacitors make three of them algebraic."""
    first = BETA * (np.exp((x[1] - x[2]) / UF) - 1.0)
    second = BETA * (np.exp((x[4] - x[5]) / UF) - 1.0)
    dx[0] = (0.1 * np.sin(200.0 * np.pi * t) - x[0]) / R0
    dx[1] = (UB - 2.0 * x[1]) / RK - (1.0 - ALPHA) * first
    dx[2] = first - x[2] / RK
    dx[3] = (UB - x[3]) / RK - ALPHA * first
    dx[4] = (UB - 2.0 * x[4]) / RK - (1.0 - ALPHA) * second
    dx[5] = second - x[5] / RK
    dx[6] = (UB - x[6]) / RK - ALPHA * second
    dx[7] = -x[7] / RK


@kernel
def amplifier_jacobian(t, x, u, c, J):
    """Of `amplifier`."""
    J[:] = 0.0
    J[0, 0] = -1.0 / R0
    for i in range(1, 8):
        J[i, i] = -1.0 / RK
    for base in (1, 4):
        slope = BETA / UF * np.exp((x[base] - x[base + 1]) / UF)
        J[base, base] -= 1.0 / RK
        for row, part in ((base, ALPHA - 1.0), (base + 1, 1.0), (base + 2, -ALPHA)):
            J[row, base] += part * slope
            J[row, base + 1] -= part * slope


def _capacities() -> NDArray[np.float64]:
    """The singular mass matrix (8, 8) in F: capacitors k = 1 to 5 of k microfarad between or behind the nodes."""
    M = np.zeros((8, 8))
    for i, capacity in ((0, 1e-6), (3, 3e-6), (6, 5e-6)):
        M[i : i + 2, i : i + 2] = [[capacity, -capacity], [-capacity, capacity]]
    M[2, 2], M[5, 5] = 2e-6, 4e-6
    return M


# fmt: off
RING_END = (
    -0.2339057358486745e-1, -0.7367485485540825e-2, 0.2582956709291169, -0.4064465721283450, -0.4039455665149794,
    0.2607966765422943, 0.1106761861269975, 0.2939904342435596e-6, -0.2840029933642329e-7, 0.7267198267264553e-3,
    0.7929487196960840e-3, -0.7255283495698965e-3, -0.7941401968526521e-3, 0.7088495416976114e-4,
    0.2390059075236570e-4,
)
AMPLIFIER_END = (
    -0.5562145012262709e-2, 3.006522471903042, 2.849958788608128, 2.926422536206241, 2.704617865010554,
    2.761837778393145, 4.770927631616772, 1.236995868091548,
)
# fmt: on
CITATION = "F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers 2.4 (2008): equations and end point of "

PROBLEMS = (
    Problem(
        name="Ring modulator",
        set="stiff",
        rhs=ring_modulator,
        jacobian=ring_modulator_jacobian,
        span=(0.0, 1e-3),
        x0=15 * (0.0,),
        end=RING_END,
        scale=7 * (1e-2,) + 8 * (1e-5,),
        citation=CITATION + "ringmod",
    ),
    Problem(
        name="Transistor amplifier",
        set="stiff",
        rhs=amplifier,
        jacobian=amplifier_jacobian,
        span=(0.0, 0.2),
        x0=(0.0, UB / 2, UB / 2, UB, UB / 2, UB / 2, UB, 0.0),
        end=AMPLIFIER_END,
        scale=1.0,
        mass_matrix=_capacities(),
        citation=CITATION + "transamp",
    ),
)
