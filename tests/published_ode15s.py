"""A second ode15s, in plain NumPy after the published loop, for comparing the compiled one step by step.

Shampine & Reichelt, "The MATLAB ODE Suite", SIAM J. Sci. Comput. 18 (1997), sections 2 and 4. Backward differences are
columns of `dif`; nothing here is shared with the runner.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GAMMA = np.cumsum(1.0 / np.arange(1, 6))
KAPPA = np.array([-37 / 200, -1 / 9, -0.0823, -0.0415, 0.0])
U = np.array([[-1, -2, -3, -4, -5], [0, 1, 3, 6, 10], [0, 0, -1, -4, -10], [0, 0, 0, 1, 5], [0, 0, 0, 0, -1.0]])


@dataclass
class Reference:
    """Accepted times, states and orders, and what the run cost."""

    t: list[float] = field(default_factory=list)
    states: list[Array] = field(default_factory=list)
    orders: list[int] = field(default_factory=list)
    failed: int = 0
    evaluations: int = 0
    jacobians: int = 0
    factorizations: int = 0
    solves: int = 0


def rescaled(dif: Array, k: int, ratio: float) -> Array:
    """Backward differences of the first k orders for a step `ratio` times as long (section 2.1: D R U)."""
    i, j = np.mgrid[1 : k + 1, 1 : k + 1]
    dif[:, :k] = dif[:, :k] @ (np.cumprod((i - 1 - j * ratio) / i, axis=0) @ U[:k, :k])
    return dif


def ode15s(  # noqa: PLR0912  One loop on purpose: it is to be read beside the paper.
    f: Callable[[float, Array], Array],
    jacobian: Callable[[float, Array], Array],
    t0: float,
    t1: float,
    y0: Array,
    rtol: float,
    atol: float,
    *,
    bdf: bool = False,
    mass: Array | None = None,
) -> Reference:
    """Integrate mass y' = f(t, y) from t0 to t1 and keep every step; mass regular."""
    out = Reference()
    n = len(y0)
    m = np.eye(n) if mass is None else mass
    kappa = np.zeros(5) if bdf else KAPPA
    inv_ga = 1.0 / (GAMMA * (1.0 - kappa))
    erconst = kappa * GAMMA + 1.0 / np.arange(2, 7)
    threshold = atol / rtol
    hmax = 0.1 * (t1 - t0)
    t, y = t0, y0.copy()

    def call(time: float, state: Array) -> Array:
        out.evaluations += 1
        if out.evaluations > 20_000:
            raise RuntimeError(f"no end in sight at t = {time}")
        return f(time, state)

    def linearised(time: float, state: Array) -> Array:
        out.jacobians += 1
        return jacobian(time, state)

    def solver(h_inv_ga: float, dfdy: Array) -> Array:
        out.factorizations += 1
        return np.linalg.inv(m - h_inv_ga * dfdy)

    # First step: half of the tolerance for the error of backward Euler, h^2 y''/2.
    f0 = call(t, y)
    yp = np.linalg.solve(m, f0)
    dfdy = linearised(t, y)
    weight = np.maximum(np.abs(y), threshold)
    rate_of_h = 1.25 * np.max(np.abs(yp / weight)) / np.sqrt(rtol)
    hmin = 16 * np.spacing(abs(t))
    absh = min(hmax, t1 - t0)
    absh = max(1 / rate_of_h if absh * rate_of_h > 1 else absh, hmin)
    tdel = (t + min(np.sqrt(np.finfo(float).eps) * max(abs(t), abs(t + absh)), absh)) - t
    ypp = np.linalg.solve(m, (call(t + tdel, y) - f0) / tdel + dfdy @ yp)
    rate_of_h = 1.25 * np.sqrt(0.5 * np.max(np.abs(ypp / weight)) / rtol)
    absh = min(hmax, t1 - t0)
    absh = max(1 / rate_of_h if absh * rate_of_h > 1 else absh, hmin)

    k = last_k = 1
    last_absh = absh
    dif = np.zeros((n, 7))
    dif[:, 0] = absh * yp
    inverse = solver(absh * inv_ga[0], dfdy)
    current, have_rate, rate, same, at_hmin, done = True, False, 0.0, 0, False, False
    out.t.append(t), out.states.append(y.copy()), out.orders.append(1)

    while not done:
        hmin = 16 * np.spacing(abs(t))
        absh = min(hmax, max(hmin, absh))
        if absh == hmin:
            if at_hmin:
                absh = last_absh
            at_hmin = True
        else:
            at_hmin = False
        if 1.1 * absh >= abs(t1 - t):
            absh, done = abs(t1 - t), True
        if absh != last_absh or k != last_k:
            dif = rescaled(dif, k, absh / last_absh)
            same, have_rate = 0, False
            inverse = solver(absh * inv_ga[k - 1], dfdy)
        first_failure = True
        while True:
            converged = False
            while not converged:
                psi = dif[:, :k] @ (GAMMA[:k] * inv_ga[k - 1])
                tnew = t1 if done else t + absh
                predicted = y + dif[:, :k].sum(axis=1)
                ynew, difkp1 = predicted.copy(), np.zeros(n)
                invwt = 1.0 / np.maximum(np.maximum(np.abs(y), np.abs(ynew)), threshold)
                smallest = 100 * np.finfo(float).eps * np.max(np.abs(ynew * invwt))
                too_slow, last_norm = False, 0.0
                for iteration in range(1, 5):
                    delta = inverse @ (absh * inv_ga[k - 1] * call(tnew, ynew) - m @ (psi + difkp1))
                    out.solves += 1
                    norm = np.max(np.abs(delta * invwt))
                    difkp1 = difkp1 + delta
                    ynew = predicted + difkp1
                    if norm <= smallest:
                        converged = True
                        break
                    if iteration == 1:
                        if have_rate:
                            if norm * rate / (1 - rate) <= 0.05 * rtol:
                                converged = True
                                break
                        else:
                            rate = 0.0
                    elif norm > 0.9 * last_norm:
                        too_slow = True
                        break
                    else:
                        rate, have_rate = max(0.9 * rate, norm / last_norm), True
                        error = norm * rate / (1 - rate)
                        if error <= 0.5 * rtol:
                            converged = True
                            break
                        if iteration == 4 or 0.5 * rtol < error * rate ** (4 - iteration):
                            too_slow = True
                            break
                    last_norm = norm
                if too_slow:
                    out.failed += 1
                    if not current:
                        dfdy, current = linearised(t, y), True
                    else:
                        last_absh, absh, done = absh, max(0.3 * absh, hmin), False
                        dif = rescaled(dif, k, absh / last_absh)
                        same = 0
                    inverse = solver(absh * inv_ga[k - 1], dfdy)
                    have_rate = False
            err = np.max(np.abs(difkp1 * invwt)) * erconst[k - 1]
            if err <= rtol:
                break
            out.failed += 1
            last_absh = absh
            if first_failure:
                first_failure = False
                best = absh * max(0.1, 0.833 * (rtol / err) ** (1 / (k + 1)))
                if k > 1:
                    lower = np.max(np.abs((dif[:, k - 1] + difkp1) * invwt)) * erconst[k - 2]
                    lower_h = absh * max(0.1, 0.769 * (rtol / lower) ** (1 / k))
                    if lower_h > best:
                        best, k = min(absh, lower_h), k - 1
                absh = max(hmin, best)
            else:
                absh = max(hmin, 0.5 * absh)
            if absh < last_absh:
                done = False
            dif = rescaled(dif, k, absh / last_absh)
            same, have_rate = 0, False
            inverse = solver(absh * inv_ga[k - 1], dfdy)

        dif[:, k + 1] = difkp1 - dif[:, k]
        dif[:, k] = difkp1
        for j in range(k - 1, -1, -1):
            dif[:, j] += dif[:, j + 1]
        t, y = tnew, ynew
        out.t.append(t), out.states.append(y.copy()), out.orders.append(k)

        last_k, last_absh = k, absh
        same = min(same + 1, 7)
        if same >= k + 2:
            candidates = {k: (1.2, err)}
            if k > 1:
                candidates[k - 1] = (1.3, np.max(np.abs(dif[:, k - 1] * invwt)) * erconst[k - 2])
            if k < 5:
                candidates[k + 1] = (1.4, np.max(np.abs(dif[:, k + 1] * invwt)) * erconst[k])
            best, best_k = 0.0, k
            for order in (k, k - 1, k + 1):
                if order in candidates:
                    safety, error = candidates[order]
                    step = absh / max(safety * (error / rtol) ** (1 / (order + 1)), 0.1)
                    if step > best:
                        best, best_k = step, order
            if best > absh:
                absh, k = best, best_k
        current = False
    return out
