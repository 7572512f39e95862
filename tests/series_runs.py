"""Machine code of series called as it is, without a method around it."""

import ctypes

import numpy as np

from qddot.runner.machine.memory import on_cache_line


def steps(code, now, before, last, relative, absolute, rtol, decay, order):
    """The steps (runs,) that coefficients (runs, n) of order 0, order - 1 and order allow, by the machine code."""
    places, (runs, n) = code.memory, now.shape
    memory, tolerances = on_cache_line(places.size), np.ones((2, places.state_stride))
    tolerances[0, :n], tolerances[1, :n] = relative, absolute
    for k, row in ((0, now), (order - 1, before), (order, last)):
        memory[places.states + k * places.state_stride :][: runs * n] = row.T.ravel()
    kinds = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double, ctypes.c_double]
    given = memory.ctypes.data, order, tolerances[0].ctypes.data, tolerances[1].ctypes.data, rtol, decay
    if runs == 1:
        return np.array([ctypes.CFUNCTYPE(ctypes.c_double, *kinds)(code.step)(*given)])
    found = on_cache_line(runs)
    ctypes.CFUNCTYPE(None, *kinds, ctypes.c_void_p)(code.step)(*given, found.ctypes.data)
    return found


def run(code, constants, first, inputs, order, t=0.0, sides=(), sense=1.0):
    """Coefficients (order + 1, n) by the machine code; inputs: rows of coefficients."""
    places = code.memory
    memory = on_cache_line(places.size)
    code.fill_factors(memory, np.asarray(constants, dtype=float))
    memory[:2] = sense, t
    memory[places.states : places.states + len(first)] = first
    memory[places.sides : places.sides + len(sides)] = sides
    for k, row in enumerate(inputs):
        memory[places.inputs + k * places.input_stride :][: len(row)] = row
    series = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64)(code.series)
    series(memory.ctypes.data, order)
    rows = memory[places.states :][: (order + 1) * places.state_stride].reshape(order + 1, -1)
    target = np.zeros(places.state_stride)
    sum_up = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64, ctypes.c_double, ctypes.c_void_p)(code.polynomial)
    sum_up(memory.ctypes.data, order, 0.125, target.ctypes.data)
    expected = sum(rows[k] * 0.125**k for k in range(order + 1))
    np.testing.assert_allclose(target, expected, rtol=1e-13, atol=1e-14)
    return rows[:, : len(first)]
