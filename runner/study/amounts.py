"""The numbers of one study, with the place of each in messages."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from qddot.runner.study.base import Amount
from qddot.runner.study.read import StudyError, place
from qddot.runner.study.units import magnitude


@dataclass(frozen=True)
class Amounts:
    """Turns amounts of the study at `path` into numbers; a StudyError names file, line and key."""

    path: Path

    def __call__(self, key: str, value: Amount, unit: str) -> float:
        """The number in `unit`."""
        try:
            return magnitude(key, value, unit)
        except ValueError as error:
            raise StudyError(f"{place(self.path, key)}{str(error).removeprefix(key)}") from None

    def given(self, key: str, table: object, units: Mapping[str, str]) -> dict[str, float]:
        """The numbers of those fields of a table, field -> unit, that are not None."""
        values = {field: getattr(table, field) for field in units}
        return {
            field: self(f"{key}.{field}", value, units[field]) for field, value in values.items() if value is not None
        }

    def file(self, key: str, name: str) -> Path:
        """A file named in the study, taken from the study's folder."""
        file = self.path.parent / name
        if not file.is_file():
            raise StudyError(f"{place(self.path, key)}: there is no file {file}")
        return file

    def wrong(self, key: str, message: str) -> StudyError:
        """The error for a key."""
        return StudyError(f"{place(self.path, key)}: {message}")

    @contextmanager
    def at(self, key: str) -> Iterator[None]:
        """Lets a ValueError or OSError inside name the file and the key."""
        try:
            yield
        except StudyError:
            raise
        except (ValueError, OSError) as error:
            text = str(error)
            raise StudyError(text if text.startswith(str(self.path)) else f"{place(self.path, key)}: {text}") from error
