"""A study file as a checked `Study`, or an error that says where in the file and what is valid there."""

import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from runner.checks import unknown
from runner.study.identified import with_identified
from runner.study.library import completed
from runner.study.overrides import Tree, changed
from runner.study.schema import Study

#: What is expected of a person who gives another file.
EXPECTED = "expected a study, a TOML file; `qddot list studies` names some"
#: What files hold that are taken for studies, by the ending.
_OTHERS = {
    ".py": "is Python; `qddot generate FILE --into FOLDER` makes kernels of a model, and a study names them by `model`",
    ".nc": "holds the results of a run; xarray.open_dataset opens it",
    ".zarr": "is the store of a batch; `qddot summary`, `plot` and `export` read it",
    ".csv": "is a table; a study names it in an input, `file = ...`",
    ".txt": "is a text; `qddot compare` reads equations",
    ".ipynb": "is a notebook",
}


class StudyError(ValueError):
    """A study that cannot be run; the message names the file, the line and the key."""


def read(path: Path, changes: Mapping[str, Any] | None = None) -> Study:
    """Read and check a study file, with these values by dotted key in place of the file's.

    Raises StudyError listing everything that is wrong with its keys and types.
    """
    text, tree = read_tree(path, changes)
    return check(path, text, tree)


def read_tree(path: Path, changes: Mapping[str, Any] | None = None) -> tuple[str, Tree]:
    """The text of a study file and its tables, changed but not checked. Raises StudyError where it is no TOML."""
    if found := what_it_holds(path):
        raise StudyError(f"{path} {found}; {EXPECTED}")
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise StudyError(f"{path}: there is no such file{_nearest_file(path)}") from None
    except IsADirectoryError:
        raise StudyError(f"{path} is a folder; {EXPECTED}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(f"{path}: {error}") from None
    try:
        tree = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{path}: no valid TOML: {error}") from None
    try:
        tree = with_identified(tree, path)
    except ValueError as error:
        raise StudyError(f"{place(path, 'identified', text)}: {error}") from None
    try:
        return text, changed(tree, changes or {})
    except ValueError as error:
        raise StudyError(f"{path}: --set {error}") from None


def check(path: Path, text: str, tree: Tree) -> Study:
    """The study in these tables, what it takes from the library filled in; `path` and its `text` are for messages."""
    try:
        return Study.model_validate(completed(tree, path))
    except KeyError as error:
        key, message = error.args
        raise StudyError(f"{place(path, key, text)}: {message}") from None
    except ValidationError as error:
        lines = (_describe(path, text, each) for each in error.errors())
        raise StudyError("\n".join(dict.fromkeys(lines))) from None


def place(path: Path, key: str, text: str | None = None) -> str:
    """`file, line 12: inputs.F.duration`, the line left out where the key has none of its own."""
    text = path.read_text("utf-8-sig") if text is None else text
    line = _line(text, key.split("."))
    return f"{path}{f', line {line}' if line else ''}: {key}"


def _describe(path: Path, text: str, error: Any) -> str:
    table, key = _walk(error["loc"])
    where = place(path, ".".join(key), text) if key else str(path)
    kinds = _kinds(table)
    if error["type"] == "extra_forbidden":
        return f"{where}: {unknown('key', key[-1], _keys(table))}"
    if error["type"] == "missing":
        return f"{where}: missing" if key[-1].isdecimal() else f"{where}: missing; {_meaning(table)}"
    if error["type"] == "union_tag_not_found":
        return f"{where}: missing kind; there are: {', '.join(kinds)}"
    if error["type"] == "union_tag_invalid":
        return f"{where}.kind: {unknown('kind', error['ctx']['tag'], kinds)}"
    return f"{where}: {error['msg'][0].lower() + error['msg'][1:]}, found {error['input']!r}"


def _meaning(table: Any) -> str:
    return " ".join((table.__doc__ or "").split())


def _walk(loc: Iterable[str | int]) -> tuple[Any, list[str]]:
    """The innermost table, or union of tables, on the way to a place, and the place's key without pydantic's own words.

    Pydantic's places name, after a table of several kinds, the kind; after a value of several types, the type.
    """
    table: Any = Study
    key: list[str] = []
    for part in map(str, loc):
        kinds = _kinds(table)
        if part in kinds:
            table = kinds[part]
        elif isinstance(table, type) and issubclass(table, BaseModel):
            key.append(part)
            inner = _inner(table.model_fields[part].annotation) if part in table.model_fields else None
            table = inner or table
        elif get_origin(table) is dict:
            key.append(part)
            table = get_args(table)[1]
        elif get_origin(table) is tuple and part.isdecimal():
            key.append(part)
            table = get_args(table)[0]
    return table, key


def _inner(annotation: Any) -> Any:
    """What an annotation holds that has keys: a table, a union or row of tables, a dictionary, or numbered items."""
    if get_origin(annotation) in (dict, tuple) or _kinds(annotation):
        return annotation
    for each in get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,):
        is_table = isinstance(each, type) and issubclass(each, BaseModel)
        if is_table or get_origin(each) in (dict, tuple) or _kinds(each):
            return each
    return None


def _kinds(annotation: Any) -> dict[str, type[BaseModel]]:
    """Kind -> table of a union that `kind` discriminates; empty for anything else."""
    union = get_args(annotation)[0] if get_args(annotation) and hasattr(annotation, "__metadata__") else annotation
    tables = [each for each in get_args(union) if isinstance(each, type) and issubclass(each, BaseModel)]
    if len(tables) < 2:
        return {}
    return {get_args(each.model_fields["kind"].annotation)[0]: each for each in tables}


def _keys(table: Any) -> list[str]:
    """The keys that are valid in a table."""
    extra = ["from"] if "kind" in getattr(table, "model_fields", ()) else []
    return [*getattr(table, "model_fields", ()), *extra]


def _line(text: str, key: list[str]) -> int | None:
    """The line that sets a key, or the header of the table that lacks it."""
    table: list[str] = []
    counts: dict[tuple[str, ...], int] = {}
    best: tuple[int, int] | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        if header := re.match(r"\s*(\[+)\s*([^\]]+?)\s*\]+", line):
            table = [part.strip().strip("\"'") for part in header[2].split(".")]
            if header[1] == "[[":  # the items of an array are numbered
                counts[tuple(table)] = counts.get(tuple(table), -1) + 1
                table = [*table, str(counts[tuple(table)])]
            here = table
        elif assignment := re.match(r"\s*([A-Za-z0-9_.\"' -]+?)\s*=", line):
            here = table + [part.strip().strip("\"'") for part in assignment[1].split(".")]
        else:
            continue
        if key[: len(here)] == here and (best is None or len(here) > best[0]):
            best = (len(here), number)
    return best[1] if best else None


def what_it_holds(path: Path) -> str:
    """What a file that cannot be a study is, by its ending: "is Python; ..."; empty for any other."""
    return _OTHERS.get(path.suffix.lower(), "")


def _nearest_file(path: Path) -> str:
    if not path.parent.is_dir():
        return f", and no folder {path.parent}"
    others = sorted(each.name for each in path.parent.glob("*.toml"))
    return f"; {unknown('study', path.name, others)}" if others else ""
