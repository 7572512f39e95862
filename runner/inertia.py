"""Whether a model's mass matrix can be inverted at a state; what to say where it cannot."""

import numpy as np
from numpy.typing import NDArray

from qddot.runner.load import Model
from qddot.runner.manifold import Manifold

Vector = NDArray[np.float64]

#: Reciprocal condition, rows and columns scaled alike, below which a mass matrix is singular.
SINGULAR = 1e-12
#: Components of the null vector relative to the largest that are named.
NAMED = 0.1


def singular_mass(model: Model, t: float, x: Vector, u: Vector, c: Vector) -> str:
    """Why accelerations do not exist at t, x (n_states,): what is singular about the mass matrix; "" where nothing is.

    u: inputs, c: constants, of the calling convention.
    """
    names = model.coordinate_names
    M = model.matrix("mass")(t, x, u, c)
    if model.tables.constraints:  # M + G' G is singular where a motion that they allow has no inertia
        G = Manifold(model, c, t, u).at(x).G
        M += (G / (np.linalg.norm(G, axis=1, keepdims=True) + np.finfo(np.float64).tiny)).T @ G
    if not np.isfinite(M).all():
        row = int(np.argmin(np.isfinite(M).all(axis=1)))
        return f"the mass matrix is not finite in the row of {names[row]}"
    size = np.sqrt(np.abs(np.diag(M)))
    scale = np.where(size > 0.0, size, 1.0)
    _, values, V = np.linalg.svd(M / np.outer(scale, scale))
    rank = int(np.count_nonzero(values > SINGULAR * max(values[0], np.finfo(np.float64).tiny)))
    if rank == len(names):
        return ""
    null = np.abs(V[-1] / scale)
    moving = ", ".join(names[i] for i in np.flatnonzero(null > NAMED * null.max()))
    return f"the mass matrix is singular (rank {rank} of {len(names)}): no inertia resists {moving}"
