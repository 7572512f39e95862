"""A chain of masses of 1 kg, springs of 1000 N/m and dampers of 1 N s/m, shaken at its foot by a sine from rest."""

from typing import Any

import numpy as np
from numba import njit
from scipy.linalg import expm

import qddot
from benchmarks.cases.case import Case, Floats
from qddot.runner.load import Model

STIFFNESS, DAMPING, AMPLITUDE, FREQUENCY = 1000.0, 1.0, 0.05, 1.0
OMEGA = 2 * np.pi * FREQUENCY


def shaken(model: Model, end: float) -> Case:
    """One run; its start has no displacement, and the speed of the foot is that of the sine from the beginning."""
    n = len(model.coordinate_names)
    keywords = {"inputs": {"w": qddot.signal.sine(AMPLITUDE, FREQUENCY)}}
    return Case(
        model=model,
        starts=np.zeros((1, 2 * n)),
        constants=model.constants(model.parameter_values())[None],
        given=np.zeros((1, 0)),
        parts=((np.array([end]), 0.0),),
        equations=_equations,
        inputs=_inputs,
        one=lambda case: keywords,
        many=lambda case: keywords,
        solution=by_matrix_exponential,
        atol=1e-2,
    )


def by_matrix_exponential(case: Case) -> Floats:
    """Final state (1, 2n): the steady vibration X e^(i omega t) and, by expm, what is left of the start."""
    n, end = case.n, case.end
    springs = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    springs[-1, -1] = 1.0
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-STIFFNESS * springs, -DAMPING * springs]])
    b = np.zeros(2 * n, dtype=np.complex128)
    b[n] = AMPLITUDE * (STIFFNESS + 1j * OMEGA * DAMPING)
    X = np.linalg.solve(1j * OMEGA * np.eye(2 * n) - A, b)
    rest = expm(A * end) @ (case.starts[0] - X.imag)
    return ((X * np.exp(1j * OMEGA * end)).imag + rest)[None]


def _equations(t: Any, q: Any, v: Any, peak: Any, given: Any, f: Any) -> tuple[None, list[Any]]:
    foot, rate = AMPLITUDE * f.sin(OMEGA * t), AMPLITUDE * OMEGA * f.cos(OMEGA * t)
    below, rate_below = [foot, *q[:-1]], [rate, *v[:-1]]
    pull = [STIFFNESS * (q[i] - below[i]) + DAMPING * (v[i] - rate_below[i]) for i in range(len(q))]
    return None, [*(pull[i + 1] - pull[i] for i in range(len(q) - 1)), -pull[-1]]


@njit
def _inputs(t, peak, given, u):
    u[0] = AMPLITUDE * np.sin(OMEGA * t)
    u[1] = AMPLITUDE * OMEGA * np.cos(OMEGA * t)
