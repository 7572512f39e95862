"""Equations of motion of the shipped models, written by hand, and numbers that count what is done with them.

Arithmetic of parameters is not counted, as it is done once a run; every other addition, multiplication, division and
sine or cosine counts one, and so do a comparison and the choice that it decides; a sign nothing.
"""

import math


class Counted:
    """A number; `tally` holds how many operations were done with it and all that came of it."""

    def __init__(self, value, tally):
        self.value, self.tally = value, tally

    def _done(self, value):
        self.tally[0] += 1
        return Counted(value, self.tally)

    def __add__(self, other):
        return self._done(self.value + _value(other))

    def __sub__(self, other):
        return self._done(self.value - _value(other))

    def __rsub__(self, other):
        return self._done(_value(other) - self.value)

    def __mul__(self, other):
        return self._done(self.value * _value(other))

    def __truediv__(self, other):
        return self._done(self.value / _value(other))

    def __rtruediv__(self, other):
        return self._done(_value(other) / self.value)

    def __neg__(self):
        return Counted(-self.value, self.tally)

    def __abs__(self):
        return self._chosen(abs(self.value))

    def between(self, least, greatest):
        """The value, or the bound that it is beyond."""
        return self._chosen(max(self.value, least))._chosen(min(max(self.value, least), greatest))

    def _chosen(self, value):
        return self._done(value)._done(value)

    __radd__, __rmul__ = __add__, __mul__


def _value(number):
    return number.value if isinstance(number, Counted) else number


def sin(x):
    return x._done(math.sin(x.value))


def cos(x):
    return x._done(math.cos(x.value))


def cart_pole(q, v, u, p):
    """Forces on the cart and moments about the hinge; the pole's moment of inertia about its end is m L^2/3."""
    (_, theta), (xdot, omega) = q, v
    M, a, J = p["m_c"] + p["m_p"], 0.5 * p["m_p"] * p["L"], p["m_p"] * p["L"] ** 2 / 3
    a_cos, a_sin = a * cos(theta), a * sin(theta)
    force = u["F"] - p["c_x"] * xdot + a_sin * (omega * omega)
    moment = p["g"] * a_sin - p["c_theta"] * omega
    alpha = (M * moment - a_cos * force) / (M * J - a_cos * a_cos)
    return (1 / M) * (force - a_cos * alpha), alpha


def chain(q, v, u, p):
    """Each spring and damper pulls at two masses."""
    q, v = [u["w"], *q], [u["wdot"], *v]
    pull = [p["k"] * (q[i + 1] - q[i]) + p["c"] * (v[i + 1] - v[i]) for i in range(10)]
    inverse = 1 / p["m"]
    return *(inverse * (pull[i + 1] - pull[i]) for i in range(9)), -inverse * pull[9]


def recoil_damper(q, v, u, p, z):
    """The damper of Spencer and others."""
    (x,), (xdot,), (y, h, voltage, integral) = q, v, z
    wanted = p["k_p"] * x + p["k_d"] * xdot + p["k_i"] * integral
    command = wanted.between(0.0, p["u_m"])
    alpha, c_0, c_1 = (p[name + "a"] + p[name + "b"] * voltage for name in ("alpha_", "c_0", "c_1"))
    ydot = (alpha * h + c_0 * xdot + p["k_0"] * (x - y)) / (c_0 + c_1)
    speed = xdot - ydot
    hdot = speed * (p["A"] - p["beta"] * (h * h)) - p["gamma"] * abs(speed) * abs(h) * h
    force = u["F"] - c_1 * ydot - (p["k_r"] + p["k_1"]) * x
    return (1 / p["m"]) * force, ydot, hdot, p["eta"] * (command - voltage), x


def double_pendulum(q, v, u, p):
    """The textbook's two equations, solved by Cramer's rule."""
    (a, b), (adot, bdot) = q, v
    k = p["m_2"] * p["l_1"] * p["l_2"]
    M11, M22 = (p["m_1"] + p["m_2"]) * p["l_1"] ** 2, p["m_2"] * p["l_2"] ** 2
    weight_1, weight_2 = p["g"] * (p["m_1"] + p["m_2"]) * p["l_1"], p["g"] * p["m_2"] * p["l_2"]
    between = b - a
    k_cos, k_sin = k * cos(between), k * sin(between)
    joint = p["c_2"] * (bdot - adot)
    first = k_sin * bdot * bdot - weight_1 * sin(a) - p["c_1"] * adot + joint
    second = -(k_sin * adot * adot) - weight_2 * sin(b) - joint
    beta = (M11 * second - k_cos * first) / (M11 * M22 - k_cos * k_cos)
    return (1 / M11) * (first - k_cos * beta), beta


def half_car(q, v, u, p):
    (z, theta, z_f, z_r), (zdot, thetadot, zdot_f, zdot_r) = q, v
    front = p["k_f"] * (z + p["a_f"] * theta - z_f) + p["c_f"] * (zdot + p["a_f"] * thetadot - zdot_f)
    rear = p["k_r"] * (z - p["a_r"] * theta - z_r) + p["c_r"] * (zdot - p["a_r"] * thetadot - zdot_r)
    return (
        -1 / p["m_b"] * (front + rear),
        1 / p["I_b"] * (p["a_r"] * rear - p["a_f"] * front),
        1 / p["m_f"] * (front - p["k_tf"] * (z_f - u["w_f"])),
        1 / p["m_r"] * (rear - p["k_tr"] * (z_r - u["w_r"])),
    )


def m113(q, v, u, p):
    """Five axles under a hull; the first and the last are damped."""
    hull, pitch = q[5:]
    arm = p["l_1"] - p["l_2"] - p["l_3"] - p["l_4"]
    places = [-p["l_3"] - p["l_4"] - arm, -p["l_4"] - arm, -arm, p["l_5"] - arm, p["l_5"] + p["l_6"] - arm]
    forces = [p[f"k_{i + 6}"] * (hull + places[i] * pitch - q[i]) for i in range(5)]
    for i, c in ((0, p["c_6"]), (4, p["c_10"])):
        forces[i] += c * (v[5] + places[i] * v[6] - v[i])
    axles = [1 / p[f"m_{i + 1}"] * (forces[i] - p[f"k_{i + 1}"] * (q[i] - u[f"z_{i + 1}"])) - p["g"] for i in range(5)]
    lift, moment = forces[0], places[0] * forces[0]
    for place, force in zip(places[1:], forces[1:], strict=True):
        lift, moment = lift + force, moment + place * force
    moment = moment + (p["l_10"] - p["l_9"]) * u["F"]
    return *axles, -1 / p["m_6"] * lift - p["g"], -1 / p["I_6"] * moment


def one_axle(q, v, u, p):
    return (-(p["k_2"] + p["k_7"]) / p["m_2"] * q[0] - p["g"],)


def pendulum(q, v, u, p):
    """Three links: sines and cosines once a link, differences of angles from products; M = L D L^T by hand."""
    m, g, c = p["m"] * p["L"] ** 2, p["m"] * p["L"] * p["g"], p["c"]
    s, k = [sin(a) for a in q], [cos(a) for a in q]
    M = {(i, j): (3 - i) * m * (s[i] * s[j] + k[i] * k[j]) for i, j in ((1, 0), (2, 0), (2, 1))}
    S = {(i, j): (3 - i) * m * (s[i] * k[j] - k[i] * s[j]) for i, j in ((1, 0), (2, 0), (2, 1))}
    a, b, d = (rate * rate for rate in v)
    first, second, third = c * v[0], c * (v[1] - v[0]), c * (v[2] - v[1])
    r1 = S[1, 0] * b + S[2, 0] * d - 3 * g * s[0] - first + second
    r2 = S[2, 1] * d - S[1, 0] * a - 2 * g * s[1] - second + third
    r3 = -(S[2, 0] * a) - S[2, 1] * b - g * s[2] - third
    inverse = 1 / (3 * m)
    l21, l31 = inverse * M[1, 0], inverse * M[2, 0]
    inverse_2 = 1 / (2 * m - l21 * M[1, 0])
    m32 = M[2, 1] - l21 * M[2, 0]
    l32 = m32 * inverse_2
    r2 = r2 - l21 * r1
    r3 = r3 - l31 * r1 - l32 * r2
    x3 = r3 / (m - l31 * M[2, 0] - l32 * m32)
    x2 = r2 * inverse_2 - l32 * x3
    return inverse * r1 - l21 * x2 - l31 * x3, x2, x3


def quarter_car(q, v, u, p):
    (body, wheel), (bodydot, wheeldot) = q, v
    force = p["k_s"] * (body - wheel) + p["c_s"] * (bodydot - wheeldot)
    return -1 / p["m_s"] * force, 1 / p["m_u"] * (force - p["k_t"] * (wheel - u["z_r"]))
