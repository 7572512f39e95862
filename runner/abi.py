"""The one calling convention between generated kernels and the drivers that call them.

Symbols: x = [q, qdot, z] is the state, coordinates, their rates and internal states; u the inputs (and the first and
second rates of them that a model needs), c the parameters p and behind them the constants that `constants` made of
these once per run. Every kernel writes all of its last argument and allocates nothing.

    constants(p, c)                 p (n_parameters,)  c (n_constants,)
    rhs(t, x, u, c, dx)             dx (n_states,)            dx = [qdot, qddot, zdot]
    jacobian(t, x, u, c, v)         v: entries of d dx / d x  (n_states, n_states)
    input_jacobian(t, x, u, c, v)   v: entries of d dx / d u  (n_states, RHS_INPUTS)
    mass(t, x, u, c, v)             v: entries of M           (COORDINATES, COORDINATES), lower triangle
    energy(t, x, u, c, E)           E (4,)  kinetic, potential, dissipated power, power put in
    outputs(t, x, u, c, y)          y (n_outputs,)
    events(t, x, u, c, v)           v: functions of the events, then the values that they give to states; of an impact
                                    its restitution, the rate of its gap, and the slopes of that by the coordinates
    resting_rhs, resting_jacobian, resting_constraints, resting_events
                                    the same where gaps of contacts are held at zero, constraints behind those on
                                    positions; their functions of events are the forces that hold them
    scene(t, x, u, c, v)            v: numbers of the shapes in SCENE, one behind the other
    constraints(t, x, u, c, v)      v: entries of R (n + m, n + 2) for n coordinates and m constraints: lower triangle
                                    of M, below it G, and beside that the residuals of positions and of velocities
    tangent(t, x, u, c, v)          v: entries of the derivative by x of the residuals of positions, and then of those
                                    of velocities (m_positions + m, n_states)
    switching(t, c, v)              v (n, 3) of the conditions in t and parameters alone, rows of INPUT whose input is
                                    "t": what changes sign there, its slope in t, and how it bends: 0 not, -1 or the sum
                                    of the squares of the angular frequencies in it
    modes(t, x, u, c, v)            v (n_modes,) of the conditions in the state, rows of INPUT whose input is "x": what
                                    changes sign there
    approach(t, x, u, c, v)         v: entries of how fast that moves (n_modes, n_states + 2): derivatives by x, the
                                    rest of d/dt, and how far it is held where it slides, 1 where that is not given;
                                    empty rows where nothing can slide, see `frame.slide`
    positions(p, x)                 x (n_positions,) of the inputs in POSITION, m ahead of the model's origin

A matrix is written as a dense run of its entries, row by row; the module says once where they stand, in a table of the
kernel's name: of each row the columns, JACOBIAN = ((1,), (0, 1)). Other entries are zero. `matrices` puts them there.
A model is LINEAR where both Jacobians are constant during a run: dx = J x + B u + rhs(0, 0, 0, c).

The text of `rhs` is compiled in several forms: for arrays, as above; for the state of a stage (`machine.stage`); and
for LANES runs at once, entry i of run l at [i * LANES + l], the arguments pointers that do not overlap
(`lanes.kernel`). There it may advance states along the slopes that it finds, too: (t, x, u, c, dx, base, target, h, w)
with target = base + w h dx. Kernels therefore read and write their arguments item by item.

u is the place of all that is given from outside while a step lasts: inputs; for each condition in t and parameters
alone its side, 1 where its switching function is positive, else 0, a signal that steps where `runner.switching` finds
its roots; for each contact that can rest 1 while it does, else 0, or less where its gap, being closed, has to fall so
far below zero before it closes (see `frame.contact`); first rates; second rates; and last the modes of conditions in
the state. What changes sign at such a condition stands in a kernel as s + mode > 0: free where the mode is 0, as it is
unless somebody sets it, and held on a side where it is infinite, see `frame.hold`. RHS_INPUTS counts no modes.

Kernels index without bounds checks; `load` checks shapes and dtypes once, at the wall.
"""

from numba import types

SCALAR = types.float64
VECTOR = types.Array(types.float64, 1, "C")
MATRIX = types.Array(types.float64, 2, "C")

VECTOR_KERNEL = types.void(SCALAR, VECTOR, VECTOR, VECTOR, VECTOR)
#: Of a Jacobian that somebody wrote by hand for `solve`: it fills J (n, n).
MATRIX_KERNEL = types.void(SCALAR, VECTOR, VECTOR, VECTOR, MATRIX)

#: Kernels of models with contacts that can rest; those that write the entries of a matrix; of models with constraints.
RESTING = ("resting_rhs", "resting_jacobian", "resting_constraints", "resting_events")
MATRICES = ("jacobian", "input_jacobian", "mass", "constraints", "tangent", "approach", *RESTING[1:3])
CONSTRAINED = ("constraints", "tangent")

SIGNATURES = {
    "constants": types.void(VECTOR, VECTOR),
    "rhs": VECTOR_KERNEL,
    "jacobian": VECTOR_KERNEL,
    "input_jacobian": VECTOR_KERNEL,
    "mass": VECTOR_KERNEL,
    "energy": VECTOR_KERNEL,
    "outputs": VECTOR_KERNEL,
    "events": VECTOR_KERNEL,
    "scene": VECTOR_KERNEL,
    "constraints": VECTOR_KERNEL,
    "tangent": VECTOR_KERNEL,
    **dict.fromkeys(RESTING, VECTOR_KERNEL),
    "switching": types.void(SCALAR, VECTOR, VECTOR),
    "modes": VECTOR_KERNEL,
    "approach": VECTOR_KERNEL,
    "positions": types.void(VECTOR, VECTOR),
}
#: The edition of this convention, which a module says that it follows.
EDITION = 2

#: Runs that a lane kernel advances: the doubles in a register of 512 bits. Rows of lanes stand on cache lines.
LANES = 8
POINTER = types.CPointer(types.float64)
#: The forms of a right-hand side in lanes.
LANE_KERNELS = {
    "rhs": types.void(POINTER, POINTER, POINTER, POINTER, POINTER),
    "advance": types.void(*[POINTER] * 8, types.float64),
}
