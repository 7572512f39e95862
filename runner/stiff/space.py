"""Where a stiff method works: vectors, matrices, inputs by address (see `memory`); a run's scalars in one record."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.abi import MATRIX_KERNEL, VECTOR_KERNEL
from qddot.runner.frame.consistent import mass_matrix
from qddot.runner.frame.space import make_space, space_layout
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.linear_algebra import find_lapack
from qddot.runner.machine.memory import VIEW, matrix, record_at
from qddot.runner.machine.pointers import pointer
from qddot.runner.matrices import PlacedKernel
from qddot.runner.options import Options
from qddot.runner.problem import Problem
from qddot.runner.stiff.band import Band
from qddot.runner.stiff.matrix import fields_of, structure_of

#: Rows of the vectors v that every stiff method has: present and new state, f, atol/rtol (relative to at least that an
#: error counts), the least rtol over that of the state, RELATIVE/(size against which errors count), three rows of
#: scratch, a state within the step, and the step as a polynomial, v[X] + theta v[POLYNOMIAL] + ... + theta^5
#: v[POLYNOMIAL + 4]. A method's own rows follow from OWN. As np.int64, because numba compiles a function again for
#: every literal int that it is called with.
X, X_NEW, F, THRESHOLD, RELATIVE, WEIGHTS, SHIFTED, F_SHIFTED, F_OPPOSITE, WITHIN, POLYNOMIAL = np.arange(11)
DEGREE = 5
OWN = POLYNOMIAL + DEGREE

#: Scalars of a run. t, t_new: the step in hand; length: its full length, where an event ends it early; h the step size,
#: h_max its limit, h_min its least value at t; first_step: of the first segment, 0 for automatic; longest_first: the
#: longest that it may be, in any. segment_end: the stop that the run is heading for. worst: state with the largest
#: error or correction. part: of the step that is left where a condition leaves its side, else 1. algebraic: the mass
#: matrix is singular. central: Jacobians without a kernel are of central differences.
CONTROL = [
    *((name, "f8") for name in ("t", "t_new", "length", "h", "h_min", "h_max", "first_step", "longest_first")),
    *((name, "f8") for name in ("segment_end", "rtol", "limit", "part")),
    *((name, "i8") for name in ("phase", "max_steps", "steps", "failed_attempts", "evaluations", "jacobians")),
    *((name, "i8") for name in ("factorizations", "linear_solves", "failed_state", "worst")),
    *((name, "?") for name in ("reaches_end", "fresh_jacobian", "singular", "unit_mass", "algebraic", "central")),
]


def control_type(own: list[Any]) -> np.dtype:
    """The type of a run's record of scalars: the common ones, then a method's own."""
    return np.dtype([*CONTROL, *own], align=True)


#: What `scalars` points to, as far as all methods have it.
scalars_at = record_at(control_type([]))

#: Fields beside those of every space. Of jacobian_kernel `entries` values (entries,) and
#: their places in the matrix (entries,), places 0 where it fills the matrix itself; work: the vectors, (rows, n); mass,
#: its pseudo_inverse, jacobian, factors (n, n); pivots (n,). Where the `structure` of the Jacobian is another, see
#: `matrix`, there is no mass, and jacobian and factors are `cells` numbers each, with place_of (n,), scratch, and lower
#: and upper of a `band`, or begins, columns and diagonals of `sparse` rows. factor_routine, solve_routine: LAPACK's.
#: scalars: the record of the run's scalars, s.
SPACE = space_layout(
    "entries values places rows mass pseudo_inverse jacobian factors pivots "
    "cells structure lower upper place_of scratch begins columns diagonals factor_routine solve_routine scalars"
)
space_at = record_at(SPACE)


@compiled(**VIEW)
def vectors(space):
    """All rows of v, (rows, n)."""
    return matrix(space.work, space.rows, space.n)


def space_for(problem: Problem, options: Options, rows: int) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """A space that holds the initial state, thresholds and mass matrix, and the arrays it points into.

    Raises ValueError for a mass matrix of the wrong shape, or an atol that is not one number or one for each state.
    """
    n, structure = len(problem.initial_state), structure_of(problem)
    own: dict[str, NDArray[Any]] = {
        "work": _initial_vectors(problem, options, rows),
        "pivots": np.zeros(n, dtype=np.int64),
        **(_dense(problem) if structure is None else structure.arrays()),
    }
    kernel, entries = 0, 0
    if isinstance(problem.jacobian, PlacedKernel):
        pattern = problem.jacobian.pattern
        entries = pattern.entries
        kernel = pointer(problem.jacobian.kernel, VECTOR_KERNEL, "jacobian")
        own |= {
            "values": np.zeros(entries),
            "places": pattern.places() if structure is None else structure.places(pattern),
        }
    elif problem.jacobian is not None:
        kernel = pointer(problem.jacobian, MATRIX_KERNEL, "jacobian")
    return make_space(
        SPACE,
        problem,
        own,
        rhs=pointer(problem.rhs, VECTOR_KERNEL, "rhs"),
        jacobian_kernel=kernel,
        entries=entries,
        rows=rows,
        stride=8 * n,
        cells=own["factors"].size,
        **fields_of(structure),
        **find_lapack(n, banded=isinstance(structure, Band))._asdict(),
    )


def _dense(problem: Problem) -> dict[str, NDArray[Any]]:
    n, mass = len(problem.initial_state), mass_matrix(problem)
    return {
        "mass": mass,
        "pseudo_inverse": mass if problem.mass_matrix is None else _pseudo_inverse(mass),
        "jacobian": np.zeros((n, n)),
        "factors": np.zeros((n, n)),
    }


def _pseudo_inverse(mass: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.ascontiguousarray(np.linalg.pinv(mass, rcond=len(mass) * np.finfo(np.float64).eps))


def _initial_vectors(problem: Problem, options: Options, rows: int) -> NDArray[np.float64]:
    n = len(problem.initial_state)
    rtol, atol = options.tolerances(n)
    v = np.zeros((rows, n))
    v[X] = problem.initial_state
    v[THRESHOLD] = np.maximum(atol / rtol, np.finfo(np.float64).tiny)
    v[RELATIVE] = rtol.min() / rtol
    return v
