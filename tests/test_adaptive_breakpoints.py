"""Inputs that jump or begin while everything is at rest: no pulse is stepped over, at any tolerance."""

import numpy as np
import pytest
from adaptive_runs import ADAPTIVE, forced, run
from numba import njit

from qddot.runner.inputs.shapes import pulse_train
from qddot.runner.inputs.signal import Signal
from qddot.runner.machine.memory import address, integers
from qddot.runner.problem import Status

OMEGA, DAMPING = 40.0, 0.05
C = (OMEGA, DAMPING)


def half_sine(start, length, impulse):
    return pulse_train(times=[start], duration=length, impulse=impulse)


def step_up(at, to):
    return Signal(np.array([[at - 1, *[0.0] * 7], [at, to, *[0.0] * 6]]), np.array([at]))


def flow(A, x, times):
    """States exp(A t) x, (n, len(x))."""
    values, vectors = np.linalg.eig(A)
    weights = np.linalg.solve(vectors, np.asarray(x, dtype=complex))
    return ((np.exp(np.outer(times, values)) * weights) @ vectors.T).real


def after_half_sine(times, start, length, impulse):
    """The oscillator's exact state (n, 2): oscillator and sine together are linear."""
    frequency = np.pi / length
    peak = impulse * frequency / 2
    oscillator = np.array([[0, 1], [-(OMEGA**2), -2 * DAMPING * OMEGA]])
    A = np.zeros((4, 4))
    A[:2, :2], A[1, 2], A[2, 3], A[3, 2] = oscillator, peak, frequency, -frequency
    pushed = flow(A, (0, 0, 0, 1), np.clip(times - start, 0, length))[:, :2]
    at_end = flow(A, (0, 0, 0, 1), [length])[0, :2]
    free = flow(oscillator, at_end, np.maximum(times - start - length, 0))
    return np.where((times > start + length)[:, None], free, pushed)


@pytest.mark.parametrize("length", [0.1, 1e-3, 1e-6])
@pytest.mark.parametrize("method", ADAPTIVE)
def test_the_trap(method, length):
    """At rest for a second of ten, then one pulse; rtol 1e-3, no maximum step."""
    trajectory = run(forced, (0, 10), (0, 0), method, c=C, inputs=(half_sine(1.0, length, 1.0),), max_step=10.0)
    exact = after_half_sine(trajectory.t, 1.0, length, 1.0)
    size = np.abs(after_half_sine(np.linspace(1, 1.3, 301), 1.0, length, 1.0)[:, 0]).max()
    assert np.abs(trajectory.states[:, 0] - exact[:, 0]).max() < 0.05 * size
    assert {1.0, 1.0 + length} <= set(trajectory.t)


@pytest.mark.parametrize(("rtol", "error"), [(1e-1, 0.5), (1e-2, 0.2), (1e-6, 1e-4)])
@pytest.mark.parametrize("method", ADAPTIVE)
def test_no_tolerance_loses_the_pulse(method, rtol, error):
    pulses = (half_sine(1.0, 0.1, 1.0),)
    tolerances = {"rtol": rtol, "atol": 1e-3 * rtol, "max_step": 10.0, "output_times": np.linspace(0, 10, 5001)}
    trajectory = run(forced, (0, 10), (0, 0), method, c=C, inputs=pulses, **tolerances)
    exact = after_half_sine(trajectory.t, 1.0, 0.1, 1.0)[:, 0]
    assert np.abs(trajectory.states[:, 0] - exact).max() < error * np.abs(exact).max()


@pytest.mark.parametrize("method", ADAPTIVE)
def test_order_survives_a_jump(method):
    """The step before takes the left limit of the force, the one after takes the right one."""
    trajectory = run(
        forced,
        (0, 0.4),
        (0, 0),
        method,
        c=(OMEGA, 0.0),
        inputs=(step_up(0.123, 1600.0),),
        rtol=1e-9,
        atol=1e-9,
        refine=1,
    )
    exact = np.where(trajectory.t > 0.123, 1 - np.cos(OMEGA * (trajectory.t - 0.123)), 0.0)
    assert np.abs(trajectory.states[:, 0] - exact).max() < 3e-7
    np.testing.assert_array_equal(trajectory.states[trajectory.t <= 0.123], 0.0)


@pytest.mark.parametrize("method", ["ode45", "dop853"])
def test_a_ramp_of_many_pieces_without_breakpoints_is_not_taken_for_a_constant(method):
    """u = t in a hundred linear pieces: x'' = u from rest, x = t^3/6."""
    starts = np.arange(100) * 0.01
    pieces = np.zeros((100, 8))
    pieces[:, 0], pieces[:, 1], pieces[:, 2] = starts, starts, 1.0
    trajectory = run(forced, (0, 1), (0, 0), method, c=(0.0, 0.0), inputs=(Signal(pieces, np.empty(0)),), rtol=1e-8)
    np.testing.assert_allclose(trajectory.states[:, 0], trajectory.t**3 / 6, atol=1e-9)


def test_breakpoints_that_are_one_in_floating_point_are_landed_on_once():
    signal = step_up(0.5, 1.0)
    close = Signal(signal.pieces, np.array([0.0, 0.5, np.nextafter(0.5, 1), 1.0, np.nextafter(1.0, 2)]))
    trajectory = run(forced, (0, 1), (0, 0), c=(0.0, 0.0), inputs=(close,), refine=1)
    assert trajectory.status == Status.FINISHED
    assert np.diff(trajectory.t).min() > 1e-12
    assert trajectory.states[-1, 0] == pytest.approx(0.125)


@njit
def counting(t, x, u, c, dx):
    """`forced`, undamped, that counts its calls at the address c0."""
    integers(np.int64(c[0]), 1)[0] += 1
    dx[0] = x[1]
    dx[1] = u[0] - 1600.0 * x[0]


@pytest.mark.parametrize("method", ADAPTIVE)
def test_evaluations_are_counted_as_the_kernel_is_called(method):
    """Across restarts, failed attempts and dense output."""
    calls = np.zeros(1, dtype=np.int64)
    pulse, times = half_sine(0.3, 0.1, 1.0), np.linspace(0, 1, 40)
    trajectory = run(
        counting, (0, 1), (0, 0), method, c=(address(calls),), inputs=(pulse,), rtol=1e-6, output_times=times
    )
    assert calls[0] == trajectory.statistics.evaluations
    assert trajectory.statistics.failed_attempts > 0
