"""`Case`: runs of one model, the same for every tool."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.load import Model

Floats = NDArray[np.float64]
#: Computes final states (runs, 2n) of all runs of a case.
Run = Callable[[], Floats]


@dataclass(frozen=True, eq=False)
class Case:
    """Runs of one model of n coordinates from t = 0; what differs from run to run is an array.

    starts (runs, 2n): states [q, qdot]. constants (runs, n_constants): those of the generated kernels.
    given (runs, k): what else differs between runs and `equations` and `inputs` take.
    parts: (until (runs,) in s, peak in N), ...: a run restarts at each `until`; up to there the recoil has this peak.
    equations(t, q, v, peak, given, f): mass matrix, as rows, and n forces, in a tool's own expressions; f has its sin,
    cos and sqrt. Instead of a mass matrix None says that the forces are accelerations; a mechanism's rows are those
    of [M G'; G 0] for accelerations and multipliers.
    inputs: jitted (t, peak, given, u), which sets what the generated kernel `rhs` reads.
    one, many: the same as keywords of `qddot.prepare` and of `qddot.simulate_batch`.
    solution: final states (runs, 2n) to 1e-12 or better.
    atol: absolute tolerance over relative tolerance, about the size of small states.
    """

    model: Model
    starts: Floats
    constants: Floats
    given: Floats
    parts: tuple[tuple[Floats, float], ...]
    equations: Callable[..., tuple[list[list[Any]] | None, list[Any]]]
    inputs: Any
    one: Callable[["Case"], Mapping[str, Any]]
    many: Callable[["Case"], Mapping[str, Any]]
    solution: Callable[["Case"], Floats]
    atol: float

    def first(self, runs: int) -> "Case":
        """The first of these runs."""
        parts = tuple((until[:runs], peak) for until, peak in self.parts)
        starts, constants, given = (rows[:runs] for rows in (self.starts, self.constants, self.given))
        return replace(self, starts=starts, constants=constants, given=given, parts=parts)

    @property
    def runs(self) -> int:
        """How many."""
        return len(self.starts)

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return self.starts.shape[1] // 2

    @property
    def end(self) -> float:
        """When all runs end, in s."""
        return float(self.parts[-1][0][0])

    @cached_property
    def exact(self) -> Floats:
        """The reference for the final states (runs, 2n)."""
        return self.solution(self)

    def error(self, final: Floats) -> float:
        """Largest error of a final coordinate over the runs of `final`, relative to the largest displacement."""
        rows, n = min(len(final), self.runs), self.n
        displacement = np.abs(self.exact[:rows, :n] - self.starts[:rows, :n]).max()
        return float(np.abs(final[:rows, :n] - self.exact[:rows, :n]).max() / displacement)


def accelerations(case: Case, t: Any, x: Any, peak: Any, given: Any, f: Any, keep: Any = lambda e: e) -> list[Any]:
    """The n accelerations in a tool's own expressions of the states x (2n,); `keep` names an intermediate result."""
    n = case.n
    M, forces = case.equations(t, list(x[:n]), list(x[n : 2 * n]), peak, given, f)
    return forces if M is None else solved(M, forces, keep)[:n]


def solved(M: list[list[Any]], forces: list[Any], keep: Any = lambda e: e) -> list[Any]:
    """M^-1 forces for a symmetric positive definite M by M = L D L^T, written out in any arithmetic.

    So it is without pivots where a negative definite block stands last, as of [M G'; G 0] once M is taken out.
    """
    n = len(forces)
    L: list[list[Any]] = [[None] * n for _ in range(n)]
    D: list[Any] = []
    for j in range(n):
        scaled = [L[j][k] * D[k] for k in range(j)]
        D.append(keep(_less(M[j][j], ((L[j][k], scaled[k]) for k in range(j)))))
        for i in range(j + 1, n):
            L[i][j] = keep(_less(M[i][j], ((L[i][k], scaled[k]) for k in range(j))) / D[j])
    y: list[Any] = []
    for i in range(n):
        y.append(keep(_less(forces[i], ((L[i][k], y[k]) for k in range(i)))))
    a: list[Any] = [None] * n
    for i in reversed(range(n)):
        a[i] = keep(_less(y[i] / D[i], ((L[k][i], a[k]) for k in range(i + 1, n))))
    return a


def _less(value: Any, pairs: Any) -> Any:
    for left, right in pairs:
        value = value - left * right
    return value


def in_parts(case: Case, advance: Callable[[Floats, float, float, float], Floats]) -> Run:
    """The first run of a case; advance(x, t0, t1, peak) gives the state at t1 for a tool that does one part."""

    def run() -> Floats:
        x, t = case.starts[0], 0.0
        for until, peak in case.parts:
            x, t = advance(x, t, float(until[0]), peak), float(until[0])
        return np.array(x, dtype=np.float64)[None]

    return run
