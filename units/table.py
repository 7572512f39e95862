"""Names of units that need no library: the SI, what is used beside it, and names that mean several things."""

import math
from fractions import Fraction

PI = Fraction(math.pi)

#: Units that nothing is said about but themselves. A turn is an angle, 2 pi rad; a cycle is a count as well.
BASES = ("kg", "m", "s", "A", "K", "mol", "cd", "rad", "turn", "cycle")

#: Name -> how many of which unit; the SI and what is used beside it. Others, "lbf" or "newtons", pint knows.
TABLE: dict[str, tuple[Fraction, str]] = {
    **{name: (Fraction(1), name) for name in BASES},
    "g": (Fraction(1, 1000), "kg"),
    "t": (Fraction(1000), "kg"),
    "min": (Fraction(60), "s"),
    "h": (Fraction(3600), "s"),
    "d": (Fraction(86400), "s"),
    "l": (Fraction(1, 1000), "m^3"),
    "L": (Fraction(1, 1000), "m^3"),
    "Hz": (Fraction(1), "1/s"),
    "N": (Fraction(1), "kg m/s^2"),
    "Pa": (Fraction(1), "N/m^2"),
    "bar": (Fraction(100_000), "Pa"),
    "J": (Fraction(1), "N m"),
    "W": (Fraction(1), "J/s"),
    "V": (Fraction(1), "W/A"),
    "C": (Fraction(1), "A s"),
    "ohm": (Fraction(1), "V/A"),
    "Ω": (Fraction(1), "V/A"),
    "H": (Fraction(1), "V s/A"),
    "F": (Fraction(1), "C/V"),
    "Wb": (Fraction(1), "V s"),
    "T": (Fraction(1), "Wb/m^2"),
    "deg": (PI / 180, "rad"),
    "°": (PI / 180, "rad"),
    "mil": (PI / 3200, "rad"),  # gunnery's: 6400 of them are a turn; pint takes ten times as many
    "cycles": (Fraction(1), "cycle"),
    "rpm": (Fraction(1), "turn/min"),
    "rps": (Fraction(1), "turn/s"),
    "%": (Fraction(1, 100), "1"),
    "‰": (Fraction(1, 1000), "1"),
}
PREFIXES = {
    "n": Fraction(1, 10**9),
    "µ": Fraction(1, 10**6),
    "μ": Fraction(1, 10**6),
    "u": Fraction(1, 10**6),
    "m": Fraction(1, 1000),
    "c": Fraction(1, 100),
    "d": Fraction(1, 10),
    "da": Fraction(10),
    "h": Fraction(100),
    "k": Fraction(1000),
    "M": Fraction(10**6),
    "G": Fraction(10**9),
}
#: Units that take a prefix in our table: no such name means anything else to pint.
PREFIXED = ("m", "g", "s", "A", "K", "rad", "N", "Pa", "J", "W", "V", "Hz", "l", "L")
#: Degrees with a zero of their own: factor and zero in K.
TEMPERATURES = {
    "degC": (Fraction(1), Fraction(27315, 100)),
    "°C": (Fraction(1), Fraction(27315, 100)),
    "degF": (Fraction(5, 9), Fraction(45967, 180)),
    "°F": (Fraction(5, 9), Fraction(45967, 180)),
}

#: Names that mean several things, as pint calls them, and what to write instead.
SEVERAL = {
    "ton": "t (1000 kg), short_ton or long_ton",
    "force_ton": "tf (1000 kgf), short_ton_force or long_ton_force",
    "hundredweight": "short_hundredweight or long_hundredweight",
    "gallon": "US_liquid_gallon or imperial_gallon",
    "quart": "US_liquid_quart or imperial_quart",
    "pint": "US_pint or imperial_pint",
    "fluid_ounce": "US_fluid_ounce or imperial_fluid_ounce",
    "barrel": "oil_barrel or imperial_barrel",
    "number_meter": "N m for newton metres, number_meter for the metric number of a yarn",
}
