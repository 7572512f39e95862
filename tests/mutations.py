"""Slips, and worse, in texts and files: what a fuzz test makes of right ones."""

import random
import re

#: What may stand where a value was expected.
VALUES = (
    *("nan", "inf", "-inf", "0", "-0.0", "-1", "1", "2.5", "1e-300", "1e300", "1e400", "true", "false", "9" * 400),
    *('""', '" "', "[]", "{}", "[[]]", "[1]", "[1, 2, 3]", "[[1, 2], [3]]", "{ a = 1 }", "1979-05-27", "07:32:00"),
    *('"0 m"', '"1 s"', '"1e999 s"', '"-3 kg"', '"NaN m"', '"5 furlong"', '"1,5 s"', '"2 ms ms"', '"1 s^99999999"'),
    *('"((((1 m"', '"1 m/"', '"none"', '"../x"', '"/"', '"a.py"', '"\\u0000"', '"💥"', '"%s %n"', '"[red]"', "'''x'''"),
    *('"' + "x" * 3000 + '"', "[" * 60 + "]" * 60, "[" + "1," * 3000 + "]", "0x10", "1_000", "+1", ".5", "1.", "None"),
    *('"1 ' + "m*" * 200 + 'm"', '"' + "(" * 300 + 'm"', '"equilibrium"', '"half_sine"', '"linear"', "[0, 1e-9]"),
)
#: What may stand where a key or a word was expected.
WORDS = (
    "",
    "x",
    "peak",
    "times",
    "step",
    "file",
    "kind",
    "from",
    "span",
    "a b",
    '"a.b"',
    "é",
    "m_6",
    "every",
    "of",
    "[",
)
_VALUE = re.compile(r"(?<==)[^=\n#]+")
_ITEM = re.compile(r'"[^"\n]*"|[-+]?\d[\d.e+-]*')
_KEY = re.compile(r"^[ \t]*[\w.\"-]+(?=[ \t]*=)|(?<=\[)[\w.]+(?=\])", re.MULTILINE)
_WORD = re.compile(r"[\w.]+|[^\w\s]")


def _replaced(pattern: re.Pattern[str], text: str, by: str, rng: random.Random) -> str:
    places = list(pattern.finditer(text))
    if not places:
        return text + by
    start, end = rng.choice(places).span()
    return text[:start] + by + text[end:]


def value(text: str, rng: random.Random) -> str:
    """Another value at a key."""
    return _replaced(_VALUE, text, f" {rng.choice(VALUES)} ", rng)


def item(text: str, rng: random.Random) -> str:
    """Another number or text, anywhere."""
    return _replaced(_ITEM, text, rng.choice(VALUES), rng)


def key(text: str, rng: random.Random) -> str:
    """Another key, a misspelt one, or one from elsewhere in the text."""
    others = [found.group().strip() for found in _KEY.finditer(text)] or ["a"]
    other = rng.choice([rng.choice(WORDS), rng.choice(others), _misspelt(rng.choice(others), rng)])
    return _replaced(_KEY, text, other, rng)


def word(text: str, rng: random.Random) -> str:
    """A word or a sign that is left out, doubled, misspelt, or another from the text."""
    places = list(_WORD.finditer(text))
    if not places:
        return text
    place, other = rng.choice(places), rng.choice(places).group()
    new = rng.choice(["", place.group() * 2, _misspelt(place.group(), rng), other, f"{place.group()} {other}"])
    return text[: place.start()] + new + text[place.end() :]


def line(text: str, rng: random.Random) -> str:
    """A line that is left out, doubled, or moved."""
    lines = text.split("\n")
    taken = lines.pop(rng.randrange(len(lines)))
    for _ in range(rng.choice([0, 1, 2])):
        lines.insert(rng.randint(0, len(lines)), taken)
    return "\n".join(lines)


def cut(text: str, rng: random.Random) -> str:
    """A text that ends too early."""
    return text[: rng.randrange(len(text) + 1)]


def sign(text: str, rng: random.Random) -> str:
    """One sign more, less or other."""
    at = rng.randrange(len(text) + 1)
    return (
        text[:at]
        + rng.choice(["", *"[]{}()=\"'.,#\n\t\0\\-+*/^_ 0é\u2212\ufeff\U0001f4a5"])
        + text[at + rng.randint(0, 1) :]
    )


def _misspelt(name: str, rng: random.Random) -> str:
    at = rng.randrange(len(name) + 1)
    return name[:at] + rng.choice("aeiou_x1") + name[at + rng.randint(0, 1) :]


OF_TOML = (value, value, value, item, item, key, key, word, line, cut, sign)
OF_TEXT = (word, word, word, item, line, cut, sign)


def mutated(text: str, rng: random.Random, ways=OF_TOML) -> str:
    """The text with one to three slips."""
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        text = rng.choice(ways)(text, rng)
    return text


def garbled(data: bytes, rng: random.Random) -> bytes:
    """The bytes of a file with some of them turned, cut off, or other ones in their place."""
    way = rng.randrange(4)
    if way == 0 or not data:
        return rng.choice([b"", b"{}", b"[]", b"null", bytes(range(256))])
    if way == 1:
        return data[: rng.randrange(len(data))]
    turned = bytearray(data)
    for _ in range(rng.choice([1, 1, 8])):
        turned[rng.randrange(len(turned))] ^= 1 << rng.randrange(8)
    return bytes(turned)
