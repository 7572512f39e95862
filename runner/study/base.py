"""What every table of a study is, and the numbers in it."""

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict
from pydantic_core import PydanticCustomError


class Table(BaseModel):
    """A TOML table in which every key is known."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def _no_truth(value: Any) -> Any:
    """The value; pydantic would take true for 1 and "5" for 5."""
    if isinstance(value, bool | str):
        raise PydanticCustomError("no_number", "expected a number")
    return value


Real = Annotated[float, BeforeValidator(_no_truth)]
Whole = Annotated[int, BeforeValidator(_no_truth)]
#: A number in the unit that is expected there, or a text such as "65 kN/m".
Amount = Real | str
