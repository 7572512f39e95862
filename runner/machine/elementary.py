"""Elementary functions that a loop over lanes can hold: no branches, no calls, so that LLVM turns them into vectors.

They stand in for those of `math`, by the same names, where a kernel is compiled for lanes (see `kernel`). fdlibm: Sun
Microsystems, Freely Distributable LIBM (1993), K. C. Ng. Errors in units in the last place (ulp) are what
tests/test_elementary.py measures against mpmath. Zeros have no sign here.
"""

import math
from collections.abc import Callable
from typing import Any

from numba import types

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, intrinsic


def elementary(function: Callable[..., Any]) -> Any:
    """A jitted function that becomes part of the loop that calls it."""
    return compiled(forceinline=True, **LEAN)(function)


@intrinsic
def bits_of(typing_context: Any, value: Any) -> Any:
    """The bits of a float64 as an int64."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], context.get_value_type(types.int64))

    return types.int64(types.float64), emit


@intrinsic
def float_of(typing_context: Any, bits: Any) -> Any:
    """The float64 of these bits."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], context.get_value_type(types.float64))

    return types.float64(types.int64), emit


@elementary
def rounded(x):
    """The nearest whole number, |x| < 2**51."""
    return (x + 6755399441055744.0) - 6755399441055744.0


@elementary
def quarters(x):
    """Quarter turns k of x, as -2 to 2, and x - k pi/2 as high + low; pi/2 in parts of 33 bits (Cody and Waite).

    The low part is at most half a unit in the last place of the high one, as `sine_part` and `cosine_part` expect.
    """
    k = rounded(x * 0.6366197723675814)
    first = x - k * 1.5707963267341256
    second = k * 6.077100506303966e-11
    most = first - second
    rest = ((first - most) - second) - k * 2.0222662487959506e-21
    high = most + rest
    return k - 4.0 * rounded(0.25 * k), high, (most - high) + rest


@elementary
def sine_part(x, low):
    """Sine of x + low, |x| <= pi/4 (fdlibm, k_sin)."""
    z = x * x
    tail = 0.00833333333332249 + z * (
        -0.0001984126982985795 + z * (2.7557313707070068e-06 + z * (-2.5050760253406863e-08 + z * 1.58969099521155e-10))
    )
    return x - ((z * (0.5 * low - z * x * tail) - low) + z * x * 0.16666666666666632)


@elementary
def cosine_part(x, low):
    """Cosine of x + low, |x| <= pi/4 (fdlibm, k_cos)."""
    z = x * x
    tail = 0.0416666666666666 + z * (
        -0.001388888888887411
        + z
        * (
            2.480158728947673e-05
            + z * (-2.7557314351390663e-07 + z * (2.087572321298175e-09 + z * -1.1359647557788195e-11))
        )
    )
    half = 0.5 * z
    near = 1.0 - half
    return near + (((1.0 - near) - half) + (z * z * tail - x * low))


@elementary
def sin(x):
    """Sine within 1 ulp for |x| <= 1e6."""
    turn, high, low = quarters(x)
    sine = sine_part(high, low)
    cosine = cosine_part(high, low)
    value = cosine if abs(turn) == 1.0 else sine
    return -value if abs(turn - 0.5) > 1.0 else value


@elementary
def cos(x):
    """Cosine within 1 ulp for |x| <= 1e6."""
    turn, high, low = quarters(x)
    sine = sine_part(high, low)
    cosine = cosine_part(high, low)
    value = sine if abs(turn) == 1.0 else cosine
    return -value if abs(turn + 0.5) > 1.0 else value


@elementary
def tan(x):
    """Tangent within 3 ulp for |x| <= 1e6."""
    return sin(x) / cos(x)


@elementary
def power_of_two(n):
    """2**n for whole n from -1022 to 1023, given as int64."""
    return float_of((n + 1023) << 52)


@elementary
def exp_parts(x, low):
    """Whole n and y with exp(x + low) = 2**n (1 + y), |y| < 0.42 (fdlibm, e_exp)."""
    shifted = x * 1.4426950408889634 + 6755399441055744.0
    k = shifted - 6755399441055744.0
    n = bits_of(shifted) - bits_of(6755399441055744.0)
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


@elementary
def atan2(y, x):
    """Angle of (x, y) within 2 ulp; not both infinite (S. L. Moshier, Cephes, atan.c)."""
    across = abs(x)
    up = abs(y)
    steep = up > across
    less = across if steep else up
    more = up if steep else across
    more = 1.0 if more == 0.0 else more
    near_diagonal = less > 0.66 * more
    q = (less - more if near_diagonal else less) / (less + more if near_diagonal else more)
    z = q * q
    above = -64.85021904942025 + z * (
        -122.88666844901361 + z * (-75.00855792314705 + z * (-16.157537187333652 + z * -0.8750608600031904))
    )
    below = 194.5506571482614 + z * (
        485.3903996359137 + z * (432.88106049129027 + z * (165.02700983169885 + z * (24.858464901423062 + z)))
    )
    angle = q + (q * (z * above / below) + (3.061616997868383e-17 if near_diagonal else 0.0))
    angle = 0.7853981633974483 + angle if near_diagonal else angle
    angle = 1.5707963267948966 - (angle - 6.123233995736766e-17) if steep else angle
    angle = 3.141592653589793 - (angle - 1.2246467991473532e-16) if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@elementary
def atan(x):
    """Inverse tangent within 2 ulp."""
    return atan2(x, 1.0)


@elementary
def asin(x):
    """Inverse sine within 3 ulp."""
    return atan2(x, math.sqrt((1.0 - x) * (1.0 + x)))


@elementary
def acos(x):
    """Inverse cosine within 3 ulp."""
    return atan2(math.sqrt((1.0 - x) * (1.0 + x)), x)


#: What stands for `math` in lanes: the functions above, and what are instructions or numbers already.
FORMS: dict[str, Any] = {
    **{function.__name__: function for function in (sin, cos, tan, exp, log, pow, tanh, sinh, cosh)},
    **{function.__name__: function for function in (atan, atan2, asin, acos)},
    **{name: getattr(math, name) for name in ("sqrt", "pi", "e", "nan", "inf")},
}
