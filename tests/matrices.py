"""Matrices put together from what kernels write, without the compiled code of the runner that does so."""

from types import ModuleType
from typing import Any

import numpy as np

from qddot.runner.load import Model, Parameters
from qddot.runner.ranges import expanded, placed


def linear_matrices(model: Model, parameters: Parameters = None) -> tuple[np.ndarray, np.ndarray]:
    """A (n, n) and B (n, all inputs + 1) of a linear model, x' = A x + B [u, 1]."""
    c, n, inputs = model.constants(model.parameter_values(parameters)), len(model.state_names), len(model.tables.inputs)
    at_zero = (0.0, np.zeros(n), np.zeros(max(1, inputs)), c)
    B = np.zeros((n, inputs + 1))
    B[:, : model.tables.rhs_inputs] = model.matrix("input_jacobian")(*at_zero)
    offset = np.zeros(n)
    model.kernel("rhs")(*at_zero, offset)
    B[:, -1] = offset
    return model.matrix("jacobian")(*at_zero), B


def matrix(module: ModuleType, name: str, *point: Any) -> np.ndarray:
    """The matrix that a generated module's kernel gives at a point, without the compiler."""
    n, q = len(expanded(module.STATE)), module.COORDINATES
    shape = {"jacobian": (n, n), "input_jacobian": (n, module.RHS_INPUTS), "mass": (q, q)}[name]
    places = [(i, j) for i, columns in enumerate(placed(getattr(module, name.upper()))) for j in columns]
    values, found = np.full(len(places), np.nan), np.zeros(shape)
    getattr(module, name).py_func(*point, values)
    for (i, j), value in zip(places, values, strict=True):
        found[i, j] = value
        if name == "mass":
            found[j, i] = value
    return found
