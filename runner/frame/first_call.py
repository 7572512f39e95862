"""The first call of a function that nobody generated, with arrays of exactly the sizes that a run has, and checked.

Kernels index without bounds checks: one that reads c[2] of two constants reads what lies behind them. So a rhs, a
Jacobian or an event from outside is called once as plain Python, where numpy checks every index, or, where it does not
run as such, as an uncached copy compiled with bounds checks. That covers the branch which this call takes: t0, x0.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numba.core.errors import NumbaError
from numpy.typing import NDArray

from qddot.runner.frame.events import Event
from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.options import Options
from qddot.runner.problem import Problem

#: What a result holds before the call, in two calls: what still does, or has only been added to, was not written.
UNWRITTEN = (1.25e300, 1.75e300)
#: Entries by which an array is made longer to find out whether it is the one that is too short.
LONGER = 4096

#: Functions that were called, with the sizes of their arrays.
_seen: set[tuple[Any, ...]] = set()

Arrays = dict[str, NDArray[np.float64]]


def check_first_calls(problem: Problem, options: Options) -> None:
    """Call what was not generated once; ValueError naming the function and the array that it leaves, or leaves out."""
    n = len(problem.initial_state)
    if not problem.by_item:
        _check("rhs", problem.rhs, problem, (n,))
        if problem.jacobian is not None:
            _check("jacobian", problem.jacobian, problem, (n, n))
    for i, event in enumerate(options.events):
        if isinstance(event, Event):
            _check(f"events[{i}]", event.function, problem, None)


def _check(what: str, function: Any, problem: Problem, shape: tuple[int, ...] | None) -> None:
    arrays = _arrays(problem)
    key = (function, shape, *(len(array) for array in arrays.values()))
    if not hasattr(function, "py_func") or key in _seen:
        return
    call = _caller(function, problem.t0, arrays, shape)
    if call is None:  # it does not compile, or raises an error of its own: the run says so
        return
    try:
        results = [call(arrays, number) for number in UNWRITTEN]
    except IndexError as error:
        raise ValueError(_told(what, call, arrays, shape, error)) from None
    if shape is not None:
        left = np.argwhere((results[0] == UNWRITTEN[0]) & (results[1] == UNWRITTEN[1]))
        if len(left):
            name, place = "dx" if len(shape) == 1 else "J", ", ".join(map(str, left[0]))
            raise ValueError(f"{what} does not write {name}[{place}]; x0 has {len(arrays['x0'])} states")
    _seen.add(key)


def _arrays(problem: Problem) -> Arrays:
    inputs = problem.inputs
    u = np.zeros(max(1, len(inputs.first)))
    evaluate(inputs, reader_for(inputs), float(problem.t0), float(problem.t0), len(inputs.first), u)
    return {"x0": problem.initial_state, "inputs": u, "constants": problem.constants}


def _caller(
    function: Any, t: float, arrays: Arrays, shape: tuple[int, ...] | None
) -> Callable[[Arrays, float], NDArray[np.float64]] | None:
    """Calls a checked copy of the function; None where there is none that runs."""

    def caller(checked: Any) -> Callable[[Arrays, float], NDArray[np.float64]]:
        def call(given: Arrays, number: float, longer: int = 0) -> NDArray[np.float64]:
            result = np.full(() if shape is None else tuple(size + longer for size in shape), number)
            copies = [array.copy() for array in given.values()]
            with np.errstate(all="ignore"):
                checked(float(t), *copies, *([] if shape is None else [result]))
            return result

        return call

    for make in (lambda: function.py_func, lambda: njit(boundscheck=True, error_model="numpy")(function.py_func)):
        call = caller(make())
        try:
            call(arrays, UNWRITTEN[0])
        except IndexError:
            pass
        except (NumbaError, Exception):
            continue
        return call
    return None


def _told(
    what: str,
    call: Callable[..., NDArray[np.float64]],
    arrays: Arrays,
    shape: tuple[int, ...] | None,
    error: IndexError,
) -> str:
    """Which array the function leaves: the one that mends it when it is longer."""
    for name, array in arrays.items():
        try:
            call(arrays | {name: np.concatenate([array, np.zeros(LONGER)])}, UNWRITTEN[0])
        except IndexError:
            continue
        return f"{what} reads {name} beyond the {len(array)} given: {error}"
    sizes = ", ".join(f"{name} {len(array)}" for name, array in arrays.items())
    try:
        call(arrays, UNWRITTEN[0], 1 if shape is not None and len(shape) > 1 else LONGER)
    except IndexError:
        return f"{what} reads or writes its arrays beyond their ends: {error}; their lengths are {sizes}"
    return f"{what} writes beyond the {shape} of its last argument, as x0 has {len(arrays['x0'])} states: {error}"
