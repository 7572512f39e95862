"""Exponentials, logarithms and powers without branches and calls; see `elementary`."""

import math

from qddot.runner.machine.bits import bits_of, elementary, float_of, nearest, power_of_two, rounded


@elementary
def exp_parts(x, low):
    """Whole n and y with exp(x + low) = 2**n (1 + y), |y| < 0.42 (fdlibm, e_exp)."""
    n, k = nearest(x * 1.4426950408889634)
    high = x - k * 0.6931471803691238
    low = k * 1.9082149292705877e-10 - low
    r = high - low
    z = r * r
    c = r - z * (
        0.16666666666666602
        + z
        * (
            -0.0027777777777015593
            + z * (6.613756321437934e-05 + z * (-1.6533902205465252e-06 + z * 4.1381367970572385e-08))
        )
    )
    return n, high - (low - r * c / (2.0 - c))


@elementary
def exp_scaled(x, low, shift):
    """2**shift exp(x + low), low small."""
    x = 720.0 if x > 720.0 else x
    x = -760.0 if x < -760.0 else x
    n, y = exp_parts(x, low)
    n = n + shift
    half = n >> 1
    return (1.0 + y) * power_of_two(half) * power_of_two(n - half)


@elementary
def exp(x):
    """Exponential within 1 ulp, 2 ulp where the result is subnormal."""
    return exp_scaled(x, 0.0, 0)


@elementary
def expm1(x):
    """exp(x) - 1 for |x| <= 700."""
    n, y = exp_parts(x, 0.0)
    scale = power_of_two(n)
    return scale * y + (scale - 1.0)


@elementary
def tanh(x):
    """Hyperbolic tangent within 3 ulp."""
    size = abs(x)
    size = 22.0 if size > 22.0 else size
    t = expm1(2.0 * size)
    value = t / (t + 2.0)
    return -value if x < 0.0 else value


@elementary
def sinh(x):
    """Hyperbolic sine within 3 ulp."""
    size = abs(x)
    t = expm1(1.0 if size > 1.0 else size)
    e = exp_scaled(size, 0.0, -1)
    value = e - 0.25 / e if size > 1.0 else 0.5 * (t + t / (t + 1.0))
    return -value if x < 0.0 else value


@elementary
def cosh(x):
    """Hyperbolic cosine within 2 ulp."""
    e = exp_scaled(abs(x), 0.0, -1)
    return e + 0.25 / e


@elementary
def log_parts(x):
    """Exponent e and f with x = 2**e (1 + f), sqrt(1/2) <= 1 + f < sqrt(2), for x > 0."""
    small = x < 2.2250738585072014e-308
    bits = bits_of(x * 18014398509481984.0 if small else x)
    moved = bits + (4607182418800017408 - 4604544271217802189)
    e = float_of((moved >> 52) + 4841369599423283200) - 4503599627370496.0 - (1077.0 if small else 1023.0)
    return e, float_of((moved & 4503599627370495) + 4604544271217802189) - 1.0


@elementary
def log_series(z):
    """(log(1+s) - log(1-s))/s - 2 as a polynomial in z = s*s (fdlibm, e_log)."""
    return z * (
        0.6666666666666735
        + z
        * (
            0.3999999999940942
            + z
            * (
                0.2857142874366239
                + z
                * (0.22222198432149784 + z * (0.1818357216161805 + z * (0.15313837699209373 + z * 0.14798198605116586)))
            )
        )
    )


@elementary
def log(x):
    """Natural logarithm within 1 ulp."""
    e, f = log_parts(x)
    s = f / (2.0 + f)
    half = 0.5 * f * f
    tail = s * (half + log_series(s * s)) + e * 1.9082149292705877e-10
    value = e * 0.6931471803691238 - ((half - tail) - f)
    value = value if x < math.inf else x
    value = value if x > 0.0 else (-math.inf if x == 0.0 else math.nan)
    return value


@elementary
def head(x):
    """The leading 26 bits of x, so that products of heads are exact."""
    return float_of(bits_of(x) & -134217728)


@elementary
def product_rest(x, y, product):
    """x*y - product without rounding (Dekker)."""
    x_head = head(x)
    y_head = head(y)
    x_tail = x - x_head
    y_tail = y - y_head
    return (((x_head * y_head - product) + x_head * y_tail) + x_tail * y_head) + x_tail * y_tail


@elementary
def pow(x, y):
    """x**y within 2 ulp where |y log x| <= 10, within 40 ulp up to overflow; NaN for x < 0 and y no whole number."""
    size = abs(x)
    e, f = log_parts(size)
    base = 2.0 + f
    s = f / base
    product = s * base
    s_rest = ((f - product) - product_rest(s, base, product) - s * (f - (base - 2.0))) / base
    z = s * s
    cubic = s * log_series(z)
    log_high = e * 0.6931471803691238 + 2.0 * s
    log_low = ((e * 0.6931471803691238 - log_high) + 2.0 * s) + (e * 1.9082149292705877e-10 + (2.0 * s_rest + cubic))
    high = log_high + log_low
    low = (log_high - high) + log_low
    exponent = y * high
    rest = product_rest(y, high, exponent) + y * low
    value = exp_scaled(exponent, rest if abs(rest) < 1.0 else 0.0, 0)
    nearest = rounded(y) if abs(y) < 2251799813685248.0 else y
    odd = abs(nearest - 2.0 * rounded(0.5 * nearest)) == 1.0
    negative = -value if odd else value
    negative = negative if nearest == y else math.nan
    value = negative if x < 0.0 else value
    zero_or_infinite = math.inf if (size > 1.0) == (y > 0.0) else 0.0
    value = zero_or_infinite if (size == 0.0) | (size == math.inf) else value
    value = x if math.isnan(x) else value
    return 1.0 if y == 0.0 else value
