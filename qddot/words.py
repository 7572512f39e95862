"""Words of messages that every room needs: a noun that is counted, and the name that was meant."""

from collections.abc import Iterable
from pathlib import Path


def counted(number: int, noun: str) -> str:
    """A number and its noun: 1 step, 2 steps; a noun of several words has its head in front: 2 runs of a study."""
    head, _, rest = noun.partition(" ")
    return f"{number} {head if number == 1 else _plural(head)} {rest}".rstrip()


def _plural(noun: str) -> str:
    if noun.endswith("is"):  # axis
        return f"{noun[:-2]}es"
    if noun.endswith("y") and noun[-2:-1] not in "aeiou":
        return f"{noun[:-1]}ies"
    return f"{noun}es" if noun.endswith(("s", "x", "ch", "sh")) else f"{noun}s"


def be(number: int) -> str:
    """The verb that goes with a number: 1 is, 2 are."""
    return "is" if number == 1 else "are"


def nearest(name: str, known: Iterable[str]) -> str:
    """The hint at a known name, `; did you mean run?`, or nothing where none is like it."""
    from difflib import get_close_matches

    close = get_close_matches(name, sorted(known), n=1)
    return f"; did you mean {close[0]}?" if close else ""


def from_here(path: Path) -> str:
    """A path as a person would type it: from where they stand, if it lies below."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_absolute() and path.is_relative_to(here) else path)
