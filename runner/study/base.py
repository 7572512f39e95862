"""What every table of a study is."""

from pydantic import BaseModel, ConfigDict


class Table(BaseModel):
    """A TOML table in which every key is known."""

    model_config = ConfigDict(extra="forbid", frozen=True)
