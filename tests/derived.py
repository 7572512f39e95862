"""A model of a test's own, derived into a temporary folder, and its reference by automatic differentiation."""

import importlib.util

import casadi
import numpy as np
import sympy

from benchmarks.peers.casadi import Energies
from qddot.codegen.generate import artefacts, formatted


def generated_module(system, folder):
    """The generated module of a system, imported from a folder."""
    for name, text in formatted(artefacts(system, "test.py")).items():
        (folder / name).write_text(text)
    spec = importlib.util.spec_from_file_location(f"test_{system.name}", folder / f"{system.name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Reference:
    """Accelerations and power balance of a system by CasADi, from T, Pi, Phi and Q with the quantities written out.

    Inputs move with given rates, so that d/dt sees them.
    """

    def __init__(self, system, channels):
        self.inputs = [channel.symbol for channel in system.inputs]
        self.rates = [channel.rate for channel in system.inputs]
        self.channels = channels
        its = Energies(system, FUNCTIONS, _without_piecewise)
        a, energy = casadi.solve(*its.equations()), its.kinetic + its.potential
        change = casadi.jtimes(energy, its.q, its.v) + casadi.jtimes(energy, its.v, a) + casadi.jacobian(energy, its.t)
        if self.inputs:
            change += casadi.jtimes(energy, its.u, its.udot)
        self.function = casadi.Function("f", its.arguments, [a, change, its.kinetic, its.potential])

    def __call__(self, time, x, u, p):
        """Accelerations, d(T + Pi)/dt, T, Pi; u by the names of the generated channels, 0 where it has none."""
        given = dict(zip(self.channels, u, strict=True))
        inputs = [given.get(symbol.name, 0.0) for symbol in (*self.inputs, *self.rates)]
        a, change, T, potential = self.function(time, *x, *inputs, *p)
        return np.array(a).ravel(), float(change), float(T), float(potential)


def _select(conditions, values):
    result = casadi.SX(float("nan"))
    for condition, value in reversed(list(zip(conditions, values, strict=True))):
        result = casadi.if_else(condition, value, result)
    return result


NAMES = ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "sinh", "cosh", "atan2", "asin", "acos", "atan")
FUNCTIONS = {name: getattr(casadi, name) for name in NAMES} | {
    "Abs": casadi.fabs, "Max": casadi.fmax, "Min": casadi.fmin, "sign": casadi.sign,
    "Heaviside": lambda x, half=0.5: casadi.if_else(x > 0, 1, casadi.if_else(x < 0, 0, half)),
    "select": lambda cs, vs, default=0: _select(cs, vs),
}  # fmt: skip


def _without_piecewise(expression):
    """Piecewise by Heaviside steps, which CasADi can be given."""
    return expression.replace(
        lambda e: isinstance(e, sympy.Piecewise) and len(e.args) == 2,
        lambda e: e.args[1][0] + (e.args[0][0] - e.args[1][0]) * sympy.Heaviside(_margin(e.args[0][1]), 0),
    )


def _margin(condition):
    """What is positive where an inequality holds."""
    return condition.gts - condition.lts
