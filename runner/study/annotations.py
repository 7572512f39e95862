"""Types of the keys of a study, read as people would say them."""

from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

_PLAIN = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
_AMOUNT = 'a number, or a text with a unit such as "2.5 kg"'


def bare(annotation: Any) -> Any:
    """The type of a field or an annotation, without metadata and without None."""
    if isinstance(annotation, FieldInfo):
        return bare(annotation.annotation)
    if get_origin(annotation) is Annotated:
        return bare(get_args(annotation)[0])
    if is_union(annotation):
        others = [each for each in get_args(annotation) if each is not type(None)]
        return bare(others[0]) if len(others) == 1 else Union[tuple(others)]  # noqa: UP007 - of any number of types
    return annotation


def is_union(annotation: Any) -> bool:
    """Whether one of several types is allowed."""
    return get_origin(annotation) in (Union, UnionType)


def is_table(annotation: Any) -> bool:
    """Whether it is a table with known keys."""
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def is_row(annotation: Any) -> bool:
    """Whether a list of so many items, and no other number, is expected."""
    inside = get_args(bare(annotation))
    return get_origin(bare(annotation)) is tuple and inside[-1] is not Ellipsis


def kinds_of(annotation: Any) -> dict[str, type[BaseModel]]:
    """Kind -> table of a union that `kind` discriminates; empty for anything else."""
    tables = [each for each in get_args(bare(annotation)) if is_table(each) and "kind" in each.model_fields]
    return {get_args(each.model_fields["kind"].annotation)[0]: each for each in tables} if len(tables) > 1 else {}


def literals(annotation: Any) -> tuple[str, ...]:
    """The texts of which one is expected; none where any other value may stand there."""
    return get_args(bare(annotation)) if get_origin(bare(annotation)) is Literal else ()


def keys_of(table: Any) -> list[str]:
    """The keys that are valid in a table."""
    fields = getattr(table, "model_fields", ())
    return [*fields, *(["from"] if "kind" in fields else [])]


def expected(annotation: Any) -> str:
    """What is allowed, in words: `a number, or a text with a unit such as "2.5 kg"`."""
    if isinstance(annotation, FieldInfo) and annotation.description:
        return annotation.description
    plain = bare(annotation)
    if is_union(plain) and not kinds_of(plain):
        amount = {bare(each) for each in get_args(plain)} == {float, str}
        return _AMOUNT if amount else ", or ".join(map(expected, get_args(plain)))
    return _PLAIN.get(plain) or _holding(plain)


def _holding(plain: Any) -> str:
    """The same for what holds other values."""
    origin, inside = get_origin(plain), get_args(plain)
    if origin is Literal:
        return " or ".join(f'"{each}"' for each in inside)
    if origin is dict:
        return f"a table, of each name {expected(inside[1])}"
    if origin is tuple and is_row(plain):
        words = list(map(expected, inside))
        return f"a list of {len(inside)}{', each ' if len(set(words)) == 1 else ': '}{'; '.join(dict.fromkeys(words))}"
    if origin is tuple:
        return f"a list, of each item {expected(inside[0])}"
    return "a value" if plain is Any else "a table"
