"""A study file as a checked `Study`, or an error that says where in the file and what is valid there."""

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from runner.checks import unknown
from runner.study.schema import ConstantInput, PulseInput, SineInput, Study, TableInput

_KINDS: dict[str, type[BaseModel]] = {
    "constant": ConstantInput,
    "sine": SineInput,
    "pulse_train": PulseInput,
    "table": TableInput,
}


class StudyError(ValueError):
    """A study that cannot be run; the message names the file, the line and the key."""


def read(path: Path) -> Study:
    """Read and check a study file. Raises StudyError listing everything that is wrong with its keys and types."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise StudyError(f"{path}: there is no such file{_nearest_file(path)}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(f"{path}: {error}") from None
    try:
        return Study.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{path}: no valid TOML: {error}") from None
    except ValidationError as error:
        raise StudyError("\n".join(_describe(path, text, each) for each in error.errors())) from None


def place(path: Path, key: str, text: str | None = None) -> str:
    """`file, line 12: inputs.F.duration`, the line left out where the key has none of its own."""
    text = path.read_text("utf-8-sig") if text is None else text
    line = _line(text, key.split("."))
    return f"{path}{f', line {line}' if line else ''}: {key}"


def _describe(path: Path, text: str, error: Any) -> str:
    named = [str(part) for part in error["loc"]]
    loc = [part for part in named if part not in _KINDS and not part.startswith(("dict[", "literal["))]
    where = place(path, ".".join(loc), text) if loc else str(path)
    if error["type"] == "extra_forbidden":
        return f"{where}: {unknown('key', loc[-1], _valid_keys(error['loc'][:-1]))}"
    if error["type"] == "missing":
        return f"{where}: missing; {_meaning(error['loc'])}"
    if error["type"] == "union_tag_not_found":
        return f"{where}: missing kind; there are: {', '.join(_KINDS)}"
    if error["type"] == "union_tag_invalid":
        return f"{where}.kind: {unknown('kind', error['ctx']['tag'], _KINDS)}"
    return f"{where}: {error['msg'][0].lower() + error['msg'][1:]}, found {error['input']!r}"


def _valid_keys(loc: Iterable[str | int]) -> list[str]:
    """The keys that are valid in the table at this place."""
    return list(_table_at(loc).model_fields)


def _meaning(loc: tuple[str | int, ...]) -> str:
    table = _table_at(loc[:-1])
    return " ".join((table.__doc__ or "").split())


def _table_at(loc: Iterable[str | int]) -> type[BaseModel]:
    table: type[BaseModel] = Study
    for part in loc:
        if part in _KINDS:
            table = _KINDS[str(part)]
        elif str(part) in table.model_fields:
            kind = table.model_fields[str(part)].annotation
            table = kind if isinstance(kind, type) and issubclass(kind, BaseModel) else table
    return table


def _line(text: str, key: list[str]) -> int | None:
    """The line that sets a key, or the header of the table that lacks it."""
    table: list[str] = []
    best: tuple[int, int] | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        if header := re.match(r"\s*\[+\s*([^\]]+?)\s*\]+", line):
            table = [part.strip().strip("\"'") for part in header[1].split(".")]
            here = table
        elif assignment := re.match(r"\s*([A-Za-z0-9_.\"' -]+?)\s*=", line):
            here = table + [part.strip().strip("\"'") for part in assignment[1].split(".")]
        else:
            continue
        if key[: len(here)] == here and (best is None or len(here) > best[0]):
            best = (len(here), number)
    return best[1] if best else None


def _nearest_file(path: Path) -> str:
    if not path.parent.is_dir():
        return f", and no folder {path.parent}"
    others = sorted(each.name for each in path.parent.glob("*.toml"))
    return f"; {unknown('study', path.name, others)}" if others else ""
