"""BEAM of the IVP test set: an elastic beam of 40 links, clamped at one end, pulled at the other until t = pi.

E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section IV.10, equations (10.29) to (10.34): x =
[theta, theta'], 80 states, from rest to t = 5. As v = the forces on the links without their coupling, the angular
accelerations are C v + D w where C w = D v + theta'^2, C tridiagonal of -cos, D of +-sin of the angles between links.
"""

import numpy as np
from numba import njit

N = 40
SPAN = (0.0, 5.0)


@njit(cache=True, error_model="numpy")
def _accelerations(t, x, a, room):
    """The angular accelerations a (N,) at x (2 N,), real or complex; room (5, N) of the same kind is filled.

    To make rooms in here takes longer to compile than all the rest.
    """
    v, w, alpha, s, k = room[0], room[1], room[2], room[3], room[4]
    for i in range(1, N):
        s[i], k[i] = np.sin(x[i] - x[i - 1]), np.cos(x[i] - x[i - 1])
    force = 1.5 * np.sin(t) ** 2 if t <= np.pi else 0.0
    for i in range(N):
        before = -x[0] if i == 0 else x[i - 1]
        after = x[N - 1] if i == N - 1 else x[i + 1]
        v[i] = N**4 * (before - 2.0 * x[i] + after) + N**2 * force * (np.cos(x[i]) + np.sin(x[i]))
    for i in range(N):
        alpha[i] = 1.0 if i == 0 else (3.0 if i == N - 1 else 2.0)
        a[i] = alpha[i] * v[i]
        w[i] = x[N + i] * x[N + i]
        if i > 0:
            w[i] -= s[i] * v[i - 1]
        if i < N - 1:
            w[i] += s[i + 1] * v[i + 1]
    for i in range(N - 2, -1, -1):
        q = -k[i + 1] / alpha[i + 1]
        w[i] -= w[i + 1] * q
        alpha[i] += k[i + 1] * q
    w[0] /= alpha[0]
    for i in range(1, N):
        w[i] = (w[i] + k[i] * w[i - 1]) / alpha[i]
    for i in range(N):
        if i > 0:
            a[i] -= k[i] * v[i - 1] + s[i] * w[i - 1]
        if i < N - 1:
            a[i] += s[i + 1] * w[i + 1] - k[i + 1] * v[i + 1]


@njit(cache=True, error_model="numpy")
def beam(t, x, u, c, dx):
    for i in range(N):
        dx[i] = x[N + i]
    _accelerations(t, x, dx[N:], np.empty((5, N)))


@njit(cache=True, error_model="numpy")
def beam_jacobian(t, x, u, c, J):
    """Exact, by complex steps."""
    shifted, a, room = x + 0j, np.zeros(N, dtype=np.complex128), np.empty((5, N), dtype=np.complex128)
    for j in range(2 * N):
        shifted[j] = x[j] + 1e-30j
        _accelerations(t, shifted, a, room)
        for i in range(N):
            J[i, j] = 1.0 if j == N + i else 0.0
            J[N + i, j] = a[i].imag * 1e30
        shifted[j] = x[j]
