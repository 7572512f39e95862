"""Functions of angles, and angles from them, without branches and calls; see `elementary`."""

import math

from qddot.runner.machine.bits import elementary, rounded


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
