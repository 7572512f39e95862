"""Where in a file something is wrong: the line that sets a key, for messages."""

from functools import lru_cache
from pathlib import Path

from qddot.runner.study.toml import text_of

#: The longest key that a message shows whole.
LONGEST_KEY = 200


def place(path: Path, key: str, text: str | None = None) -> str:
    """`file, line 12: inputs.F.duration`, the line left out where the key has none of its own."""
    line = _line(text_of(path) if text is None else text, key.split("."))
    return f"{path}{f', line {line}' if line else ''}: {key if len(key) <= LONGEST_KEY else f'{key[:LONGEST_KEY]}…'}"


def _line(text: str, key: list[str]) -> int | None:
    """The line that sets a key, or the header of the table that lacks it."""
    best: tuple[int, int] | None = None
    for number, here in _lines_that_set(text):
        if here[0] == key[0] and key[: len(here)] == here and (best is None or len(here) > best[0]):
            best = (len(here), number)
    return best[1] if best else None


@lru_cache(maxsize=1)
def _lines_that_set(text: str) -> list[tuple[int, list[str]]]:
    """Lines that set a key, or begin a table, with its parts: once for all mistakes of a file."""
    table: list[str] = []
    counts: dict[tuple[str, ...], int] = {}
    found: list[tuple[int, list[str]]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        said = line.strip()
        if said.startswith("["):
            table = _parts(said.strip("[").partition("]")[0])
            if said.startswith("[["):  # the items of an array are numbered
                counts[tuple(table)] = counts.get(tuple(table), -1) + 1
                table = [*table, str(counts[tuple(table)])]
            found.append((number, table))
        elif "=" in said:
            found.append((number, table + _parts(said.partition("=")[0])))
    return found


def _parts(dotted: str) -> list[str]:
    """The parts of a dotted key, without their quotes."""
    return [part.strip().strip("\"'") for part in dotted.split(".")]
