"""Short steps: the Taylor series of x itself, for which nothing has to be prepared.

With x(t + h r) = sum of y_k r^k and the forcing h f = sum of phi_k r^k, y_(k+1) = (h A y_k + phi_k) / (k + 1).
"""

import numpy as np

from qddot.runner.exact.forcing import highest_frequency
from qddot.runner.exact.ladder import ROW
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BLOCK, LEAN, floats
from qddot.runner.machine.sums import weighted_sum

#: THETA[m]: the largest norm of h A at which the series of degree m has a backward error of 2^-53 (Al-Mohy, Higham,
#: SIAM J. Sci. Comput. 33 (2011) 488-511, equation 3.6); steps are cut to the last, which amplifies rounding little.
THETA = np.array(
    (
        0.0,
        2.2e-16,
        2.5e-8,
        1.3e-5,
        3.3e-4,
        2.4e-3,
        9.0e-3,
        2.38e-2,
        4.99e-2,
        8.95e-2,
        0.144,
        0.214,
        0.299,
        0.399,
        0.513,
        0.641,
        0.780,
        0.930,
        1.09,
        1.26,
        1.43,
        1.62,
        1.81,
        2.01,
        2.21,
    )
)
LONGEST = 2.21


@compiled(**LEAN)
def degree_for(theta):
    """The least degree for a norm of theta."""
    m = 4
    while m < len(THETA) - 1 and THETA[m] < theta:
        m += 1
    return m


@compiled(**LEAN)
def largest_rate(s):
    """What limits a step: the norm of A or the highest frequency."""
    return max(s.nu, highest_frequency(s))


@compiled(**LEAN)
def taylor_step(s, h):
    """Move x by h, the forcing being that at the start of the step."""
    m = degree_for(h * largest_rate(s)) + s.degree + (2 if s.frequencies > 0 else 0)
    width = BLOCK * s.panels
    x, y, y_next, power = floats(s.x, width), s.x, s.y, h
    rotation = floats(s.p_next, s.frequencies)
    for f in range(s.frequencies):
        rotation[f] = h
    for k in range(m):
        base = s.zeros
        if k <= s.degree or s.frequencies > 0:
            base = y_next
            write_forcing(s, k, h, power)
            power *= h
        for b in range(s.panels):
            weighted_sum(base + ROW * b, h / (k + 1), y, s.n, s.A + ROW * s.n * b, y_next + ROW * b)
        term = floats(y_next, width)
        y, y_next = y_next, (s.y_next if y_next == s.y else s.y)
        for i in range(width):
            x[i] += term[i]
    s.products += m


@compiled(**LEAN)
def write_forcing(s, k, h, power):
    """Write phi_k / (k + 1)."""
    width = BLOCK * s.panels
    target = floats(s.y if k % 2 == 0 else s.y_next, width)
    g = floats(s.g + 8 * width * min(k, s.degree), width)
    factor = power / (k + 1) if k <= s.degree else 0.0
    for i in range(width):
        target[i] = factor * g[i]
    rotation, omega = floats(s.p_next, s.frequencies), floats(s.omega, s.frequencies)
    for f in range(s.frequencies):
        wave = floats((s.cosine if k % 2 == 0 else s.sine) + 8 * width * f, width)
        factor = rotation[f] / (k + 1) * (1.0 if k % 4 < 2 else -1.0)
        for i in range(width):
            target[i] += factor * wave[i]
        rotation[f] *= omega[f] * h / (k + 1)
