"""The grammar of amounts: a number and a unit, a product of names with whole powers. Nothing is evaluated.

- amount: number [unit], such as "605 N s", "65 kN/m", "-2.5e3 m/s^2", "200 /min", "0.5";
- unit: ["1"] product, so that "1/s" and "1" are some, too;
- product: factor {("*" | "·" | "/" | blank) factor}, taken from left to right: "N s/m", "m/s/s";
- factor: (name | "(" product ")") [power], a power being "^2", "**2", "^-1", "^(-1)", "²" or "⁻¹".
"""

import re

#: The longest text that is read, the largest power, the most names in a unit: far beyond any that means something.
LONGEST, LARGEST_POWER, MOST_FACTORS = 120, 12, 16

Factors = tuple[tuple[str, int], ...]

_BLANKS = " \t\u00a0\u2009\u202f"
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_GROUPS = re.compile(rf"([-+]?[0-9]{{1,3}})((?:[{_BLANKS}'_][0-9]{{3}})+)(?![0-9])")
_ONE = re.compile(rf"1[{_BLANKS}]*(?=[*/·⋅])")
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_TOKEN = re.compile(
    rf"(?P<blank>[{_BLANKS}]+)"
    r"|(?P<name>°[A-Za-z]*|[%‰]|(?![⁰¹²³⁴⁵⁶⁷⁸⁹])[^\W\d_][^\W⁰¹²³⁴⁵⁶⁷⁸⁹]*)"
    r"|(?:\^|\*\*)(?P<power>[-+]?[0-9]{1,3}(?![0-9.])|\([-+]?[0-9]{1,3}\))"
    r"|(?P<raised>⁻?[⁰¹²³⁴⁵⁶⁷⁸⁹]{1,3})"
    r"|(?P<sign>[*/·⋅()])"
)


def quoted(text: str) -> str:
    """The text as messages show it: in quotes, and short."""
    return repr(text if len(text) <= 60 else f"{text[:60]}…")


def split(text: str) -> tuple[float, str]:
    """The number of an amount, and the rest of it, which should be a unit and is not looked at; or nothing.

    Raises ValueError saying what is wrong.
    """
    if len(text) > LONGEST:
        raise ValueError(f"it is {len(text)} characters long, at most {LONGEST} work")
    text = text.strip(_BLANKS)
    number = _NUMBER.match(text)
    if number is None:
        raise ValueError(_no_number(text))
    rest = text[number.end() :].lstrip(_BLANKS)
    if rest.startswith(("*", "·", "⋅")) and not rest.startswith("**"):
        rest = rest[1:].lstrip(_BLANKS) or rest
    if _misread(rest):
        raise ValueError(_two_numbers(text, number[0]))
    return float(number[0]), rest


def factors(unit: str) -> Factors:
    """Names and powers of the product that a unit is; "1" is the empty one. Raises ValueError saying what is wrong."""
    if len(unit) > LONGEST:
        raise ValueError(f"its unit is {len(unit)} characters long, at most {LONGEST} work")
    unit = unit.strip(_BLANKS)
    if unit == "1":
        return ()
    one = _ONE.match(unit)
    found, end = _product(unit, one.end() if one else 0, "", wanted=not one)
    assert end == len(unit)  # what is no token was refused
    if len(found) > MOST_FACTORS:
        raise ValueError(f"its unit has {len(found)} factors, at most {MOST_FACTORS} work")
    for name, power in found:
        if abs(power) > LARGEST_POWER:
            raise ValueError(f"its unit has {name} to the power {power}, at most {LARGEST_POWER} works")
    return tuple(found)


def _product(unit: str, at: int, closing: str, wanted: bool) -> tuple[list[tuple[str, int]], int]:
    """The factors from a place up to the closing bracket or the end, and where they end.

    wanted: whether a factor must come before the end, or a sign.
    """
    found: list[tuple[str, int]] = []
    last = slice(0, 0)  # the factors that a power would raise
    sign = 1
    while at < len(unit):
        token = _TOKEN.match(unit, at)
        if token is None:
            raise ValueError(_unexpected(unit, at))
        at, start = token.end(), token.start()
        if token["power"] or token["raised"]:
            if last.start == last.stop:
                raise ValueError(f"nothing stands before the power {token[0]}")
            power = int((token["power"] or token["raised"].translate(_RAISED)).strip("()"))
            found[last] = [(name, power * each) for name, each in found[last]]
            last = slice(0, 0)
        elif token["name"] or token["sign"] == "(":
            inner = [(token["name"], 1)]
            if token["sign"]:
                one = _ONE.match(unit, at)
                inner, at = _product(unit, one.end() if one else at, ")", wanted=not one)
            last = slice(len(found), len(found) + len(inner))
            found += [(name, sign * power) for name, power in inner]
            sign, wanted = 1, False
        elif token["sign"] == ")":
            if closing != ")" or wanted:
                raise ValueError(_unexpected(unit, start))
            return found, at
        elif token["sign"]:
            if wanted and not (token["sign"] == "/" and start == 0):
                raise ValueError(_unexpected(unit, start))
            sign, wanted = -1 if token["sign"] == "/" else 1, True
            last = slice(0, 0)
    if wanted or closing:
        raise ValueError(f"its unit {quoted(unit)} ends too early" + (": a bracket is open" if closing else ""))
    return found, at


def _misread(rest: str) -> bool:
    """Whether what follows a number goes on as a number, or as nothing that a unit begins with."""
    if rest[:1] in "0123456789":
        return rest != "" and not re.match(rf"1[{_BLANKS}]*/", rest)
    return rest[:1] in ",'_.-+^" or rest.startswith("**")


def _no_number(text: str) -> str:
    if re.match(r"[-+]?,[0-9]", text):
        return _two_numbers(text, "")
    if text.startswith("−"):
        return f'it begins with a typographer\'s minus sign; write "-{text[1:].lstrip(_BLANKS)}"'
    return "it begins with no number"


def _two_numbers(text: str, number: str) -> str:
    """What to say of `12,5 N`, `10 000 N`, `2 3 m` and their like."""
    groups = _GROUPS.match(text)
    comma = re.match(r"[-+]?[0-9]*,[0-9]+(?![0-9.,])", text)
    if comma and "," not in text[comma.end() :]:
        thousands = re.fullmatch(r"[-+]?[1-9][0-9]{0,2},[0-9]{3}", comma[0])
        whole = f' or "{text.replace(",", "")}"' if thousands else ""
        return f'it has a comma; write "{text.replace(",", ".")}"{whole}'
    if "," in text:
        return "it has a comma; write a decimal point, and nothing between thousands"
    if groups:
        whole = re.sub(rf"[{_BLANKS}'_]", "", groups[0])
        return f'it has something between its digits; write "{whole}{text[groups.end() :]}"'
    if re.match(rf"{_NUMBER.pattern}[{_BLANKS}]+[0-9]", text):
        return "it has two numbers one behind the other"
    rest = text[text.index(number) + len(number) :].lstrip(_BLANKS)
    return f"{rest[:2].strip()!r} after the number {number} is no unit"


def _unexpected(unit: str, at: int) -> str:
    if unit[at] == "," or unit[at].isdigit() or unit[at] == ".":
        return f"{unit[at]!r} in its unit {quoted(unit)}: a unit holds no numbers but whole powers, such as m/s^2"
    if unit.startswith(("^", "**"), at):
        return f"a power in its unit {quoted(unit)} is no whole number; write m/s^2 or s^-1"
    if unit[at] in "-−" and at and unit[at - 1].isalpha():
        return f"{unit[at]!r} in its unit {quoted(unit)}; write N m for a product, s^-1 for a power"
    return f"{unit[at]!r} in its unit {quoted(unit)} is not understood"
