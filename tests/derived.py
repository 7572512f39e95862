"""A model of a test's own, derived into a temporary folder, and its reference by automatic differentiation."""

import importlib.util

import casadi
import numpy as np
import sympy

from codegen.generate import artefacts, formatted
from model.system import t


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
        q = [coordinate.symbol for coordinate in system.coordinates]
        v = [coordinate.rate for coordinate in system.coordinates]
        self.inputs = [channel.symbol for channel in system.inputs]
        self.rates = [channel.rate for channel in system.inputs]
        self.channels = channels
        self.symbols = [t, *q, *v, *self.inputs, *self.rates, *(p.symbol for p in system.parameters)]
        self.twins = {symbol: casadi.SX.sym(symbol.name) for symbol in self.symbols}
        self.system = system
        pick = self._column
        T, potential, phi = map(self._translated, (system.kinetic_energy, system.potential_energy, system.dissipation))
        forces = casadi.vertcat(*(self._translated(system.force(c)) for c in system.coordinates))
        L, Q, V, U, R = T - potential, pick(q), pick(v), pick(self.inputs), pick(self.rates)
        momenta = casadi.gradient(L, V)
        M = casadi.jacobian(momenta, V)
        drift = casadi.jacobian(momenta, Q) @ V + casadi.jacobian(momenta, self.twins[t])
        if self.inputs:
            drift += casadi.jacobian(momenta, U) @ R
        a = casadi.solve(M, forces - casadi.gradient(phi, V) + casadi.gradient(L, Q) - drift)
        energy = T + potential
        change = casadi.jacobian(energy, Q) @ V + casadi.jacobian(energy, V) @ a
        change += casadi.jacobian(energy, self.twins[t])
        if self.inputs:
            change += casadi.jacobian(energy, U) @ R
        self.function = casadi.Function("f", list(self.twins.values()), [a, change, T, potential])

    def __call__(self, time, x, u, p):
        """Accelerations, d(T + Pi)/dt, T, Pi; u by the names of the generated channels, 0 where it has none."""
        given = dict(zip(self.channels, u, strict=True))
        inputs = [given.get(symbol.name, 0.0) for symbol in (*self.inputs, *self.rates)]
        a, change, T, potential = self.function(time, *x, *inputs, *p)
        return np.array(a).ravel(), float(change), float(T), float(potential)

    def _column(self, symbols):
        return casadi.vertcat(*(self.twins[symbol] for symbol in symbols)) if symbols else casadi.SX(0, 1)

    def _translated(self, expression):
        expression = self.system.written_out(expression)
        names = ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "sinh", "cosh", "atan2", "asin", "acos", "atan")
        functions = {name: getattr(casadi, name) for name in names} | {
            "Abs": casadi.fabs, "Max": casadi.fmax, "Min": casadi.fmin, "sign": casadi.sign,
            "Heaviside": lambda x, half=0.5: casadi.if_else(x > 0, 1, casadi.if_else(x < 0, 0, half)),
            "select": lambda cs, vs, default=0: _select(cs, vs),
        }  # fmt: skip
        return sympy.lambdify(self.symbols, _without_piecewise(expression), modules=[functions])(*self.twins.values())


def _select(conditions, values):
    result = casadi.SX(float("nan"))
    for condition, value in reversed(list(zip(conditions, values, strict=True))):
        result = casadi.if_else(condition, value, result)
    return result


def _without_piecewise(expression):
    """Piecewise by Heaviside steps, which CasADi can be given."""
    return expression.replace(
        lambda e: isinstance(e, sympy.Piecewise) and len(e.args) == 2,
        lambda e: e.args[1][0] + (e.args[0][0] - e.args[1][0]) * sympy.Heaviside(_margin(e.args[0][1]), 0),
    )


def _margin(condition):
    """What is positive where an inequality holds."""
    return condition.gts - condition.lts
