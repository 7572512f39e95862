"""Models drawn at random, of one to three coordinates, linear, curved or with kinks, with their inputs."""

import random
from dataclasses import dataclass
from typing import Any

import numpy as np
from sympy import Abs, Max, Piecewise, Rational, Symbol, cos, sin

import qddot
from qddot.model import Coordinate, Input, Output, Parameter, System

HALF = Rational(1, 2)
SPAN = (0.0, 1.0)
#: Models in all; of three, one is linear, one curved, one has kinks.
COUNT = 60
KINDS = ("linear", "curved", "kinked")
t = Symbol("t")


@dataclass(frozen=True)
class Drive:
    """An input as numbers: a sine (amplitude, frequency, phase) or a table (times, values)."""

    sine: tuple[float, float, float] | None = None
    table: tuple[tuple[float, ...], tuple[float, ...]] | None = None

    @property
    def signal(self) -> Any:
        """The input as qddot has it."""
        if self.sine is not None:
            return qddot.signal.sine(*self.sine)
        return qddot.signal.table(*self.table, "linear")

    @property
    def breaks(self) -> tuple[float, ...]:
        """Times within the run at which it has a corner."""
        return self.table[0][1:-1] if self.table is not None else ()

    def at(self, time: float) -> tuple[float, float]:
        """Value and rate, computed here, not by qddot."""
        if self.sine is not None:
            amplitude, frequency, phase = self.sine
            omega = 2 * np.pi * frequency
            return amplitude * np.sin(omega * time + phase), amplitude * omega * np.cos(omega * time + phase)
        times, values = map(np.array, self.table)
        i = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 2))
        slope = (values[i + 1] - values[i]) / (times[i + 1] - times[i])
        return values[i] + slope * (time - times[i]), slope


@dataclass(frozen=True)
class Case:
    """A model with all that a run of it wants."""

    number: int
    kind: str
    system: System
    drives: dict[str, Drive]
    initial: dict[str, float]

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return {str(parameter.symbol): parameter.default for parameter in self.system.parameters}


class _Draw:
    """Draws what a model is made of; parameters are added as they are needed."""

    def __init__(self, number: int) -> None:
        self.rng, self.kind = random.Random(f"model {number}"), KINDS[number % len(KINDS)]
        self.n = self.rng.choice([1, 1, 2, 2, 3])
        self.q = [Symbol(f"q_{i + 1}") for i in range(self.n)]
        self.v = [Symbol(f"qdot_{i + 1}") for i in range(self.n)]
        self.parameters: list[Parameter] = []
        self.drives: dict[str, Drive] = {}

    def number(self, low: float, high: float) -> float:
        return round(self.rng.uniform(low, high), 3)

    def parameter(self, letter: str, low: float, high: float, unit: str) -> Symbol:
        symbol = Symbol(f"{letter}_{len(self.parameters) + 1}")
        self.parameters.append(Parameter(symbol, self.number(low, high), unit, f"a number, {letter}"))
        return symbol

    def drive(self) -> Symbol:
        name = "wuy"[len(self.drives)]
        if self.rng.random() < 0.5:
            self.drives[name] = Drive(sine=(self.number(0.05, 0.3), self.number(0.5, 4.0), self.number(-1.5, 1.5)))
        else:
            times = (0.0, *sorted({self.number(0.05, 0.95) for _ in range(3)}), 1.0)
            self.drives[name] = Drive(table=(times, tuple(self.number(-0.3, 0.3) for _ in times)))
        return Symbol(name)

    def kinetic(self) -> Any:
        T: Any = sum(HALF * self.parameter("m", 1.0, 3.0, "kg") * v**2 for v in self.v)
        for i in range(self.n - 1):  # well below the masses, so that the mass matrix stays definite
            coupling = self.parameter("h", 0.1, 0.4, "kg") * self.v[i] * self.v[i + 1]
            T += coupling if self.kind == "linear" else coupling * cos(self.q[i] - self.q[i + 1])
        if self.kind == "curved" and self.rng.random() < 0.5:
            T += HALF * self.parameter("j", 0.1, 1.0, "kg/m^2") * self.q[0] ** 2 * self.v[0] ** 2
        return T

    def potential(self) -> Any:
        Pi: Any = sum(HALF * self.parameter("k", 5.0, 80.0, "N/m") * q**2 for q in self.q)
        for i in range(self.n - 1):
            Pi += HALF * self.parameter("k", 5.0, 40.0, "N/m") * (self.q[i] - self.q[i + 1]) ** 2
        if self.rng.random() < 0.5:
            Pi += HALF * self.parameter("k", 5.0, 60.0, "N/m") * (self.q[-1] - self.drive()) ** 2
        if self.kind == "curved":
            Pi += self.parameter("b", 10.0, 90.0, "N/m^3") * self.q[0] ** 4 / 4
            Pi -= self.parameter("g", 1.0, 9.0, "N m") * cos(self.q[-1])
        if self.kind == "kinked":
            Pi += HALF * self.parameter("s", 20.0, 200.0, "N/m") * Max(0, self.q[0] - self.number(-0.05, 0.1)) ** 2
            if self.rng.random() < 0.5:
                Pi += self.parameter("a", 5.0, 40.0, "N/m^2") * Abs(self.q[-1]) ** 3 / 3
        return Pi

    def dissipation(self) -> Any:
        Phi: Any = sum(HALF * self.parameter("c", 0.0, 3.0, "N s/m") * v**2 for v in self.v)
        if self.kind == "curved" and self.rng.random() < 0.5:
            Phi += self.parameter("d", 0.1, 1.0, "N s^3/m^3") * self.v[0] ** 4 / 4
        if self.kind == "kinked":
            c = self.parameter("c", 0.2, 2.0, "N s/m")
            Phi += HALF * c * Piecewise((self.v[-1] ** 2, self.v[-1] > 0), (3 * self.v[-1] ** 2, True))
        return Phi

    def forces(self) -> dict[Symbol, Any]:
        chosen = self.rng.choice(self.q)
        Q = self.parameter("f", 5.0, 30.0, "N/m") * self.drive()
        if self.kind != "linear" and self.rng.random() < 0.5:
            Q += self.parameter("e", 1.0, 5.0, "N") * sin(self.number(1.0, 9.0) * t)
        return {chosen: Q}


def case(number: int) -> Case:
    """The model of this number, always the same."""
    draw = _Draw(number)
    T, Pi, Phi, Q = draw.kinetic(), draw.potential(), draw.dissipation(), draw.forces()
    acceleration = Symbol("qddot_1")
    system = System(
        name=f"drawn_{number:03d}",
        title=f"Drawn model {number}, {draw.kind}",
        coordinates=[Coordinate(q, "m", f"coordinate {i + 1}") for i, q in enumerate(draw.q)],
        parameters=draw.parameters,
        inputs=[Input(Symbol(name), "m", f"input {name}") for name in draw.drives],
        kinetic_energy=T,
        potential_energy=Pi,
        dissipation=Phi,
        generalized_forces=Q,
        outputs=[Output(Symbol("acceleration"), acceleration, "m/s^2", "acceleration of the first")],
    )
    initial = {str(symbol): draw.number(-0.3, 0.3) for symbol in (*draw.q, *draw.v)}
    return Case(number, draw.kind, system, draw.drives, initial)
