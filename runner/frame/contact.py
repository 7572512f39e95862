"""Impacts, and contacts that rest: what becomes of velocities at an instant, and which gaps are held from there on.

An impulse acts along the gap, through M and the constraints: the velocities behind it satisfy these, too. Bounces that
cannot be told any more end, and the gap is held at zero. That is so where one of these holds behind the impact:

- the gap parts more slowly than the tolerances tell, rtol of the hardest impact so far, and atol of the velocities;
- its next flight, at the acceleration with which it is pressed, is shorter than a constant step, or than what can be
  told of time; or it rises no higher than rounding of the gap.

Such an impact gives nothing back. Of the gaps that are closed then, those are held whose forces push: of all that would
be held, the one that pulls most is let go, and so on (the forces are unique where the contacts do not depend on each
other). A gap that is closed and not held may fall below zero by rounding, or, where it has just been let go, by what
atol tells of it, before it counts as closing.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.problem import Acting, Problem
from qddot.runner.tables import CONTACT, EVENT

Vector = NDArray[np.float64]

#: Spacings of floating-point numbers that are nothing: of time on each side of an instant, of lengths in a gap.
AT_ONCE = 64
_ROUNDING = AT_ONCE * float(np.finfo(np.float64).eps)
#: Families of methods that hold no contact: what they know of a model are its flights alone.
FLYING = ("exact", "taylor")
#: Sine of the smallest angle between independent constraints.
_DEPENDENT = 1e-10


@dataclass(frozen=True, eq=False)
class Instant:
    """The kernels of a problem's events at points: before an act, behind it, and where contacts would rest."""

    problem: Problem
    acting: Acting

    def values(self, t: float, x: Vector, signs: Vector | None = None) -> Vector:
        """Functions of the events and the values they give; of contacts forces where signs (n_events,) are above 0."""
        kernel = self.acting.kernel if signs is None else self.acting.resting().events
        values = np.zeros(self.acting.count)
        kernel(t, x, self.inputs(t, signs), self.problem.constants, values)
        return values

    def inputs(self, t: float, signs: Vector | None = None) -> Vector:
        """The inputs u (channels,) at a time, after a jump."""
        table = self.problem.inputs
        row = np.zeros(max(1, len(table.first)))
        if len(table.first):
            evaluate(table, self._reader, t, t, len(table.first), row)
        if signs is not None:
            row[self.acting.channels[self.acting.channels >= 0]] = signs[self.acting.channels >= 0]
        return row

    @cached_property
    def _reader(self) -> Vector:
        return reader_for(self.problem.inputs)

    def slope(self, t: float, x: Vector, signs: Vector | None = None) -> Vector:
        """The derivative of the state where nothing rests, or the contacts do whose signs are above 0."""
        rests = signs is not None and (signs > 0.0).any()
        slope, rhs = np.zeros(len(x)), self.acting.resting().rhs if rests else self.acting.rhs
        rhs(t, x, self.inputs(t, signs), self.problem.constants, slope)
        return slope

    def impact(self, k: int, values: Vector) -> tuple[float, float, Vector]:
        """Of an impact restitution, rate of the gap, and its slopes by the coordinates (n,)."""
        first, n = self.acting.first[k], len(self.acting.places[k])
        return float(values[first]), float(values[first + 1]), values[first + 2 : first + 2 + n]

    def thrown(self, t: float, x: Vector, slopes: Vector) -> Vector:
        """The change of velocities (n,) by an impulse of 1 along a gap with these slopes, on the constraints."""
        n = len(slopes)
        whole = self.acting.inertia(t, x, self.inputs(t), self.problem.constants)
        lower = np.tril(whole[:n, :n])
        return impulse(lower + np.tril(lower, -1).T, whole[n:, :n], slopes)


def impulse(M: Vector, G: Vector, slopes: Vector) -> Vector:
    """The solution v (n,) of M v + G' l = slopes, G v = 0, where M (n, n) alone, and G (m, n), may be singular.

    As `machine.constrained` does it, with M + G' alpha G in place of M, in arrays of NumPy.
    """
    if not np.isfinite(M).all():
        return np.full(len(slopes), np.nan)
    largest = float(np.max(np.diag(M)))
    inertia = np.where(np.diag(M) > 0.0, np.diag(M), largest)
    weights = np.sum(G**2 / inertia, axis=1)
    A = M + G.T @ (G / np.where(weights > 0.0, weights, 1.0)[:, None])
    scale = 1.0 / np.sqrt(np.diag(A))
    L = np.linalg.cholesky(A * scale[:, None] * scale)
    w = np.linalg.solve(L, scale * slopes)
    if not len(G):
        free: Vector = scale * np.linalg.solve(L.T, w)
        return free
    W = np.linalg.solve(L, scale[:, None] * G.T)
    sizes = np.linalg.norm(W, axis=0)
    Q, values, _ = np.linalg.svd(W / np.where(sizes > 0.0, sizes, 1.0), full_matrices=False)
    Q = Q[:, values > _DEPENDENT]
    left = w - Q @ (Q.T @ w)
    if np.linalg.norm(left) <= _DEPENDENT * np.linalg.norm(w):  # the constraints hold it all
        return np.zeros(len(slopes))
    found: Vector = scale * np.linalg.solve(L.T, left)
    return found


class Contacts:
    """Which impacts of a run touch, which of them rest, and what is needed to tell that."""

    def __init__(self, at: Instant, tolerances: tuple[Vector, Vector] | None, step: float | None) -> None:
        """tolerances: rtol and atol, each (n_states,), of a method that has them; step: a constant one."""
        count, nothing = len(at.acting.rows), np.zeros(len(at.problem.initial_state))
        self._at, self._step = at, step
        self._rtol, self._atol = tolerances or (nothing, nothing)
        self.signs = np.zeros(count)
        self._touching: set[int] = set()
        self._hardest, self._last = np.zeros(count), np.full(count, float(at.problem.t0))
        self._ended = np.full(count, np.nan)  # when bounces did last: what is hit again then is not thrown again

    @property
    def resting(self) -> frozenset[int]:
        """The contacts that rest."""
        return frozenset(np.flatnonzero(self.signs > 0.0).tolist())

    @cached_property
    def _able(self) -> tuple[int, ...]:
        """Those that can rest."""
        return tuple(k for k in self.impacts if self._at.acting.rows[k].kind == CONTACT)

    @cached_property
    def impacts(self) -> tuple[int, ...]:
        """The events that are impacts."""
        return tuple(k for k, row in enumerate(self._at.acting.rows) if row.kind != EVENT)

    def begin(self, t: float, x: Vector) -> list[int]:
        """Look at the start of a run; returns the impacts that happen there. ValueError where a gap is below zero."""
        values, found = self._at.values(t, x), []
        for k in self.impacts:
            _, rate, _ = self._at.impact(k, values)
            near, row = self.rounding(k, x, values, 0.0), self._at.acting.rows[k]
            if values[k] < -near:
                raise ValueError(
                    f"the gap of impact {row.name} ({row.meaning}) is {values[k]:.6g} at the start, expected zero or "
                    "more; start where it is open or just closed"
                )
            if values[k] <= near and rate < -self._slow(k, values):
                found.append(k)
            elif values[k] <= near and row.kind == CONTACT:
                self._touching.add(k)
        return found

    def rounding(self, k: int, x: Vector, values: Vector, near: float) -> float:
        """How much of a gap is nothing; near: a time that is."""
        _, rate, slopes = self._at.impact(k, values)
        return _ROUNDING * float(np.abs(slopes) @ np.abs(x[: len(slopes)])) + abs(rate) * near

    def strike(self, k: int, t: float, x: Vector, values: Vector, near: float) -> None:
        """Let an impact act on the state x (n_states,)."""
        restitution, rate, slopes = self._at.impact(k, values)
        places = list(self._at.acting.places[k])
        self._hardest[k] = max(self._hardest[k], -rate)
        if self._ended[k] == t or (k in self._able and self._is_last(k, t, x, values, near)):
            restitution, self._ended[k] = 0.0, t
            self._touching.add(k)
        self._last[k] = t
        thrown = self._at.thrown(t, x, slopes)
        yielding = float(slopes @ thrown)
        if yielding <= 0.0:
            row = self._at.acting.rows[k]
            raise ValueError(
                f"impact {row.name} ({row.meaning}) happens at t = {t:.9g} s between what constraints hold, so that "
                "nothing can give way; let one of the two move"
            )
        if self._closed(k, x, values, near):
            x[: len(slopes)] -= values[k] / yielding * thrown
        if -rate > self._slow(k, values):
            x[places] -= (1.0 + restitution) * rate / yielding * thrown

    def _is_last(self, k: int, t: float, x: Vector, values: Vector, near: float) -> bool:
        """Whether an impact is too weak for its next flight to be told."""
        restitution, rate, _ = self._at.impact(k, values)
        if restitution * abs(rate) <= self._slow(k, values):
            return True
        press = self._press(k, t, x, values, 1e-3 * (t - self._last[k])) if t - self._last[k] > near else 0.0
        if press <= 0.0:
            return False
        away = restitution * abs(rate)
        nothing = self.rounding(k, x, values, near) + 2.0 * abs(values[k])
        return 2.0 * away / press <= (self._step or near) or away**2 / (2.0 * press) <= nothing

    def _press(self, k: int, t: float, x: Vector, values: Vector, short: float) -> float:
        """The acceleration with which a gap closes where nothing holds it, from its rates a short time apart."""
        slope = self._at.slope(t, x, self.signs * (np.arange(len(self.signs)) != k))
        after = self._at.values(t + short, x + short * slope)
        return (self._at.impact(k, values)[1] - self._at.impact(k, after)[1]) / short

    def _slow(self, k: int, values: Vector) -> float:
        """How fast a gap may change to count as closed."""
        _, _, slopes = self._at.impact(k, values)
        places = list(self._at.acting.places[k])
        told = self._rtol[places].max() * self._hardest[k] + np.abs(slopes) @ self._atol[places]
        return float(max(told, _ROUNDING * self._hardest[k]))

    def pressed(self, x: Vector, values: Vector, near: float) -> list[int]:
        """Contacts that are closed, and close faster than what is nothing: what rests is pushed on."""
        found = []
        for k in self._able:
            _, rate, _ = self._at.impact(k, values)
            closed = self.signs[k] > 0.0 or values[k] <= self.rounding(k, x, values, near)
            if closed and rate < -self._slow(k, values):
                found.append(k)
        return found

    def settle(self, t: float, x: Vector, near: float, released: int = -1) -> None:
        """Hold the contacts that touch and push; released: one whose force has just come to zero."""
        values = self._at.values(t, x)
        closed = {k: self._closed(k, x, values, near) for k in self._able}
        self._touching = {k for k in self._touching | self.resting if closed[k] and self._stays(k, values)}
        candidates = self._touching - {released}
        self.signs = np.zeros(len(self.signs))
        while candidates:
            signs = np.zeros(len(self.signs))
            signs[list(candidates)] = 1.0
            forces = self._at.values(t, x, signs)
            weakest = min(candidates, key=lambda k: forces[k])
            if forces[weakest] > 0.0:
                self.signs = signs
                break
            candidates = candidates - {weakest}
        self._last[list(self._touching - candidates)] = t
        for k in {k for k in self._able if closed[k]} - candidates:
            nothing = self.rounding(k, x, values, near) + abs(values[k])
            if k in self._touching:  # it leaves as slowly as an error would
                _, _, slopes = self._at.impact(k, values)
                nothing = max(nothing, float(np.abs(slopes) @ self._atol[: len(slopes)]))
            self.signs[k] = -max(nothing, float(np.finfo(np.float64).tiny))

    def _closed(self, k: int, x: Vector, values: Vector, near: float) -> bool:
        """Whether a gap is zero but for rounding, or below: what is done to another may have moved it."""
        nothing = self.rounding(k, x, values, near) + max(0.0, -float(self.signs[k]))
        return bool(self.signs[k] > 0.0 or values[k] <= 2.0 * nothing)

    def _stays(self, k: int, values: Vector) -> bool:
        """Whether a gap that is closed does not open."""
        return self._at.impact(k, values)[1] <= self._slow(k, values)
