"""The one calling convention between generated kernels and the drivers that call them.

Symbols: x = [q, qdot] is the state, u the inputs (and the input rates a model needs), c the constants that
`constants` made of the parameters p once per run. Every kernel writes all of its last argument and allocates nothing.

    constants(p, c)                 p (n_parameters,)  c (n_constants,)
    rhs(t, x, u, c, dx)             dx (n_states,)            dx = [qdot, qddot]
    jacobian(t, x, u, c, J)         J (n_states, n_states)    J[i, j] = d dx[i] / d x[j]
    mass(t, x, u, c, M)             M (n_coordinates, n_coordinates)
    energy(t, x, u, c, E)           E (4,)  kinetic, potential, dissipated power, power put in
    outputs(t, x, u, c, y)          y (n_outputs,)
    positions(p, x)                 x (n_positions,) of the inputs in POSITION, m ahead of the model's origin
    linear(c, A, B)                 A (n_states, n_states)  B (n_states, n_inputs + 1): dx = A x + B [u, 1]

The text of `rhs` is compiled in several forms: for arrays, as above; for the state of a stage (`machine.stage`); as
LANE_KERNEL for LANES runs at once, entry i of run l at [i * LANES + l], the arguments pointers that do not overlap
(`lanes.kernel`). Kernels therefore read and write their arguments item by item.

Kernels index without bounds checks; `load` checks shapes and dtypes once, at the wall.
"""

from numba import types

SCALAR = types.float64
VECTOR = types.Array(types.float64, 1, "C")
MATRIX = types.Array(types.float64, 2, "C")

VECTOR_KERNEL = types.void(SCALAR, VECTOR, VECTOR, VECTOR, VECTOR)
MATRIX_KERNEL = types.void(SCALAR, VECTOR, VECTOR, VECTOR, MATRIX)

SIGNATURES = {
    "constants": types.void(VECTOR, VECTOR),
    "rhs": VECTOR_KERNEL,
    "jacobian": MATRIX_KERNEL,
    "mass": MATRIX_KERNEL,
    "energy": VECTOR_KERNEL,
    "outputs": VECTOR_KERNEL,
    "positions": types.void(VECTOR, VECTOR),
    "linear": types.void(VECTOR, MATRIX, MATRIX),
}

#: Runs that a lane kernel advances: the doubles in a register of 512 bits. Rows of lanes stand on cache lines.
LANES = 8
POINTER = types.CPointer(types.float64)
LANE_KERNEL = types.void(POINTER, POINTER, POINTER, POINTER, POINTER)
