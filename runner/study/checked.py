"""A TOML file of one's own as checked tables, or an error that says where in the file and what is valid there."""

from pathlib import Path
from typing import Annotated, TypeVar

from pydantic import AfterValidator, ValidationError, ValidationInfo

from qddot.runner.files import named_code
from qddot.runner.study.base import Table
from qddot.runner.study.explain import explained
from qddot.runner.study.read import StudyError
from qddot.runner.study.toml import tables_of, text_of

Kind = TypeVar("Kind", bound=Table)


def read(path: str | Path, kind: type[Kind]) -> Kind:
    """The file's tables as this kind of `Table`.

    Raises StudyError listing everything that is wrong with its keys and types: file, line, key, found, expected.
    """
    path = Path(path)
    try:
        text = text_of(path)
        return kind.model_validate(tables_of(text), context={"folder": path.parent})
    except ValidationError as error:
        raise StudyError(explained(path, text, error, kind)) from None
    except (OSError, ValueError) as error:
        raise StudyError(f"{path}: {error}") from None


def _below(name: str, info: ValidationInfo) -> str:
    """The name; a study may run code, so it lies below the file's folder, see `named_code`."""
    if info.context:
        named_code(info.context["folder"], name)
    return name


#: The name of a study's file, taken from the folder of the file that names it.
StudyFile = Annotated[str, AfterValidator(_below)]
