"""ode23 and ode45 once more, in plain Python, from the publication alone: the second opinion that `runner` is held to.

L. F. Shampine, M. W. Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18 (1997) 1-22. Coefficients are those of
SciPy, so that not even they are shared.
"""

import numpy as np
from scipy.integrate import RK23, RK45

SCHEMES = {"ode23": (RK23, 1 / 3, 0.5), "ode45": (RK45, 1 / 5, 0.1)}


def solve(name, f, t0, t1, y0, rtol=1e-3, atol=1e-6, max_step=None):
    """Steps as lists (t, h, y) after each, and the number of failed attempts."""
    scheme, power, first_factor = SCHEMES[name]
    A, B, C, E = scheme.A, scheme.B, scheme.C, -scheme.E
    threshold = atol / rtol
    hmax = min(t1 - t0, max_step or 0.1 * (t1 - t0))
    t, y = t0, np.array(y0, dtype=float)
    f0 = f(t, y)
    absh = min(hmax, t1 - t0)
    rh = np.abs(f0 / np.maximum(np.abs(y), threshold)).max() / (0.8 * rtol**power)
    if absh * rh > 1:
        absh = 1 / rh
    absh = max(absh, 16 * np.spacing(t))
    ts, hs, ys, failures, done = [], [], [], 0, False
    while not done:
        hmin = 16 * np.spacing(abs(t))
        absh = min(hmax, max(hmin, absh))
        h = absh
        if 1.1 * absh >= abs(t1 - t):
            h = t1 - t
            absh = abs(h)
            done = True
        no_failure = True
        while True:
            K = [f0]
            for i in range(1, len(C)):
                K.append(f(t + C[i] * h, y + h * sum(A[i][j] * K[j] for j in range(i))))
            t_new = t1 if done else t + h
            y_new = y + h * sum(b * k for b, k in zip(B, K, strict=True))
            K.append(f(t_new, y_new))
            estimate = sum(e * k for e, k in zip(E, K, strict=True))
            error = absh * np.abs(estimate / np.maximum(np.maximum(np.abs(y), np.abs(y_new)), threshold)).max()
            if error <= rtol:
                break
            failures += 1
            if absh <= hmin:
                raise ArithmeticError("step too small")
            if no_failure:
                no_failure = False
                absh = max(hmin, absh * max(first_factor, 0.8 * (rtol / error) ** power))
            else:
                absh = max(hmin, 0.5 * absh)
            h, done = absh, False
        ts.append(t_new)
        hs.append(t_new - t)
        ys.append(y_new)
        if no_failure:
            temp = 1.25 * (error / rtol) ** power
            absh = absh / temp if temp > 0.2 else 5 * absh
        t, y, f0 = t_new, y_new, K[-1]
    return np.array(ts), np.array(hs), np.array(ys), failures
