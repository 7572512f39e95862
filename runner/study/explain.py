"""What is wrong with the keys and types of a study, said in our words: file, line, key, found, expected."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from qddot.runner.checks import shown, unknown
from qddot.runner.study.annotations import bare, expected, is_row, is_table, is_union, keys_of, kinds_of, literals
from qddot.runner.study.places import place

#: The most mistakes of one file that are told, and the most errors of pydantic's that are looked at for them.
MOST_TOLD, MOST_LOOKED_AT = 20, 200
#: Constraints of fields, by pydantic's names of errors: what was expected.
_BOUNDS = {
    "greater_than": "a number greater than {gt}",
    "greater_than_equal": "a number of {ge} or more",
    "string_too_long": "at most {max_length}",
    "string_pattern_mismatch": "a text that matches {pattern}",
    "too_long": "at most {max_length}",
    "too_short": "at least {min_length}",
}


@dataclass(frozen=True)
class _Spot:
    """A mistake: its key, the innermost table on the way, what is expected at the key, and pydantic's error.

    row: what is expected of the value that holds it.
    """

    key: tuple[str, ...]
    table: Any
    expected: Any
    row: Any
    error: Mapping[str, Any]

    @property
    def found(self) -> str:
        """What stands there, as a message shows it."""
        given = self.error["input"]
        return str(given).lower() if isinstance(given, bool) else shown(given)  # true, false: in TOML's words


def explained(path: Path, text: str, error: ValidationError, root: type[BaseModel]) -> str:
    """One line for each key that is wrong in the file `path` with this text, whose tables are those of `root`."""
    spots: dict[tuple[str, ...], _Spot] = {}
    for each in error.errors(include_url=False)[:MOST_LOOKED_AT]:
        spot = _spot(each, root)
        spots.setdefault(spot.key, spot)
    above = {key[:n] for key in spots for n in range(len(key))}
    inner = [
        spot for key, spot in spots.items() if key not in above
    ]  # of a union's branches, the one that went furthest
    lines = [_line(path, text, spot) for spot in inner[:MOST_TOLD]]
    return "\n".join([*lines, *([f"{path}: and more"] if len(inner) > MOST_TOLD else [])])


def _line(path: Path, text: str, spot: _Spot) -> str:
    key = ".".join(spot.key)
    where = place(path, key, text) if key else str(path)
    return f"{where}{_SAY.get(spot.error['type'], _otherwise)(spot)}"


def _otherwise(spot: _Spot) -> str:
    bound, said = _BOUNDS.get(spot.error["type"]), spot.error.get("ctx", {})
    if bound is None or is_row(spot.expected):
        return f": found {spot.found}, expected {expected(spot.expected)}"
    given = spot.error["input"]
    found = f"{len(given)} characters" if spot.error["type"] == "string_too_long" else spot.found
    return f": found {said.get('actual_length', found)}, expected {bound.format(**said)}"


def _unknown_key(spot: _Spot) -> str:
    return f": {unknown('key', spot.key[-1], keys_of(spot.table))}"


def _missing(spot: _Spot) -> str:
    if spot.key[-1].isdecimal():
        return f": missing; found {spot.found}, expected {expected(spot.row)}"
    return f": missing; {' '.join((spot.table.__doc__ or '').split())}"


def _not_among(spot: _Spot) -> str:
    if not isinstance(spot.error["input"], str) or not literals(spot.expected):
        return _otherwise(spot)
    return f": {unknown(spot.key[-1], spot.error['input'], literals(spot.expected))}"


_SAY: Mapping[str, Callable[[_Spot], str]] = {
    "extra_forbidden": _unknown_key,
    "missing": _missing,
    "union_tag_not_found": lambda spot: f": missing kind; there are: {', '.join(kinds_of(spot.table))}",
    "union_tag_invalid": lambda spot: f".kind: {unknown('kind', spot.error['ctx']['tag'], kinds_of(spot.table))}",
    "value_error": lambda spot: f": {spot.error['ctx']['error']}",
    "literal_error": _not_among,
}


def _spot(error: Any, root: type[BaseModel]) -> _Spot:
    """The key that an error is about; pydantic's place names, beside keys, the branches of unions that it tried."""
    key: list[str] = []
    table: Any = root
    here: Any = root  # what is expected at the key
    row: Any = root
    for part in error["loc"]:
        plain = bare(here)
        if part in kinds_of(plain):
            here = kinds_of(plain)[part]
        elif is_union(plain):
            here = next((each for each in get_args(plain) if _is_branch(each, str(part))), here)
        elif (inner := _inner(plain, part)) is not plain:
            table = plain if is_table(plain) else table
            row, here = here, inner
            key.append(str(part))
    if is_table(bare(here)) or kinds_of(here):
        table = bare(here)
    return _Spot(tuple(key), table, here, row, error)


def _inner(plain: Any, part: str | int) -> Any:
    """What is expected at a key or place in a value of this type; the type itself where it holds no others."""
    if is_table(plain):
        return plain.model_fields.get(str(part))
    if get_origin(plain) is dict:
        return get_args(plain)[1]
    if get_origin(plain) is tuple and isinstance(part, int):
        return get_args(plain)[part if is_row(plain) else 0]
    return plain


def _is_branch(annotation: Any, name: str) -> bool:
    """Whether pydantic calls a branch of a union so, of those that hold other values: dict[str,...], tuple[...]."""
    origin = get_origin(bare(annotation))
    return origin in (dict, tuple) and name.startswith(f"{origin.__name__}[")
