"""Where in a file something is wrong: the line that sets a key, for messages."""

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
    table: list[str] = []
    counts: dict[tuple[str, ...], int] = {}
    best: tuple[int, int] | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        said = line.strip()
        if said.startswith("["):
            table = _parts(said.strip("[").partition("]")[0])
            if said.startswith("[["):  # the items of an array are numbered
                counts[tuple(table)] = counts.get(tuple(table), -1) + 1
                table = [*table, str(counts[tuple(table)])]
            here = table
        elif "=" in said:
            here = table + _parts(said.partition("=")[0])
        else:
            continue
        if key[: len(here)] == here and (best is None or len(here) > best[0]):
            best = (len(here), number)
    return best[1] if best else None


def _parts(dotted: str) -> list[str]:
    """The parts of a dotted key, without their quotes."""
    return [part.strip().strip("\"'") for part in dotted.split(".")]
