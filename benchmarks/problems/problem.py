"""`Problem`: a standard initial value problem with a reference end point, and how exactly a solution meets it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from qddot.runner.inputs.signal import stack
from qddot.runner.methods import find_method
from qddot.runner.options import Options
from qddot.runner.problem import Problem as System
from qddot.runner.problem import Trajectory
from qddot.runner.takers import fitted

#: Decorator of the right-hand sides and Jacobians (calling convention of `runner.abi`), compiled at their first use.
kernel = njit(cache=True, error_model="numpy")

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Problem:
    """x' = rhs(t, x, u, c), or mass_matrix x' = rhs, over span from x0 (n,), with the reference state end (n,).

    rhs, jacobian: jitted functions of the calling convention; there are no inputs u. constants: c.
    scale: a number or (n,). Below this size a component counts absolutely: tolerances are atol = rtol * scale, and
    errors are relative to max(|end|, scale).
    citation: where the equations and `end` come from; says so where `end` is computed and not published.
    """

    name: str
    set: str
    rhs: Any
    span: tuple[float, float]
    x0: tuple[float, ...]
    end: tuple[float, ...]
    citation: str
    jacobian: Any = None
    scale: float | tuple[float, ...] = 1e-3
    constants: tuple[float, ...] = ()
    mass_matrix: Array | None = None

    def significant_digits(self, state: ArrayLike) -> float:
        """Significant correct digits of the final state (n,); not a number where the state is not finite.

        -log10 of the largest relative error, the `scd` of F. Mazzia, C. Magherini, Test Set for Initial Value Problem
        Solvers, release 2.4 (2008), section I.4. Components below `scale` count absolutely, as its `mescd` has them.
        An error of 1e-16 or less gives 16.
        """
        end = np.array(self.end)
        error = float(np.max(np.abs(np.asarray(state) - end) / np.maximum(np.abs(end), self.scale)))
        return -float(np.log10(max(error, 1e-16)))

    def system(self) -> System:
        """The same as an integrator takes it."""
        return System(
            rhs=self.rhs,
            t0=self.span[0],
            t1=self.span[1],
            initial_state=np.array(self.x0, dtype=np.float64),
            constants=np.array(self.constants, dtype=np.float64),
            inputs=stack([], []),
            n_inputs=0,
            state_names=tuple(f"x_{i + 1}" for i in range(len(self.x0))),
            jacobian=self.jacobian,
            mass_matrix=self.mass_matrix,
        )

    def solve(self, method: str, rtol: float, **options: Any) -> Trajectory:
        """Integrate by one of our methods; saves the start and the end only unless `options` say otherwise."""
        chosen = find_method(method)
        wanted: dict[str, Any] = {"output_times": self.span, "rtol": rtol, "atol": self.atol(rtol)} | options
        return chosen.integrate(self.system(), chosen, fitted(Options(**wanted), chosen))

    def atol(self, rtol: float) -> Array:
        """Absolute tolerances (n,)."""
        return rtol * np.broadcast_to(np.asarray(self.scale, dtype=np.float64), len(self.x0))

    def function(self) -> Callable[[float, Array], Array]:
        """f(t, x) as SciPy takes it, over the same compiled code."""
        rhs, u, c = self.rhs, np.zeros(1), np.array(self.constants, dtype=np.float64)

        def f(t: float, x: Array) -> Array:
            dx = np.empty(len(x))
            rhs(t, x, u, c, dx)
            return dx

        return f

    def jacobian_function(self) -> Callable[[float, Array], Array] | None:
        """jac(t, x) as SciPy takes it; None where there is no exact Jacobian."""
        if self.jacobian is None:
            return None
        jacobian, u, c = self.jacobian, np.zeros(1), np.array(self.constants, dtype=np.float64)

        def jac(t: float, x: Array) -> Array:
            J = np.empty((len(x), len(x)))
            jacobian(t, x, u, c, J)
            return J

        return jac
