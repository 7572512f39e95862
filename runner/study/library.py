"""Guns and roads that several studies share: entries of `library/*.toml`, taken up by `from = "NAME"`.

An entry is a table of the keys of an input or a road, with a title, and with an `origin` table that says of each number
where it comes from: "paper: ...", "derived: ...", "assumed: ..." or another source.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from qddot.runner.checks import unknown
from qddot.runner.study.toml import tables_of, text_of

#: The studies that come with qddot, and the entries.
STUDIES = Path(__file__).parent.parent.parent / "studies"
SHIPPED = STUDIES / "library"
#: Keys of which two say how large a pulse is: two in the study replace those of the entry.
_SIZES = ("peak", "duration", "impulse", "shell_mass")
_AMMUNITION = ("muzzle_velocity", "charge_mass", "gas_velocity_factor")

Entry = Mapping[str, Any]


def folders(study: Path) -> tuple[Path, ...]:
    """Where the entries of a study are looked for, first to last: a folder `library` beside it, then ours."""
    own = study.parent / "library"
    return (SHIPPED,) if own.resolve() == SHIPPED.resolve() else (own, SHIPPED)


def entries(*places: Path) -> dict[str, Entry]:
    """Every entry by name; of two with one name the first stands. Raises ValueError for a file that is no TOML."""
    found: dict[str, Entry] = {}
    for file in (file for place in places for file in sorted(place.glob("*.toml"))):
        tables = _tables(file, file.stat().st_mtime_ns)
        found = {name: table for name, table in tables.items() if isinstance(table, dict)} | found
    return found


@lru_cache
def _tables(file: Path, changed: int) -> dict[str, Any]:
    """The tables of a file; remembered until it changes, for a sweep reads them for each run."""
    try:
        return tables_of(text_of(file))
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from None


def completed(
    data: Mapping[str, Any], study: Path, library: Callable[[], Mapping[str, Entry]] | None = None
) -> dict[str, Any]:
    """A study's raw tables with `from` replaced by the keys of the entry; the study's own keys win.

    library: gives the entries in place of those that stand in the study's folders now. Raises KeyError (key, message)
    for an entry that does not exist.
    """
    done, known = dict(data), library or (lambda: entries(*folders(study)))
    if isinstance(data.get("inputs"), dict):
        done["inputs"] = {name: _filled(f"inputs.{name}", table, known) for name, table in data["inputs"].items()}
    if "road" in data:
        done["road"] = _filled("road", data["road"], known)
    return done


def _filled(key: str, table: Any, library: Callable[[], Mapping[str, Entry]]) -> Any:
    if not isinstance(table, dict) or "from" not in table:
        return table
    known, name = library(), table["from"]
    if not isinstance(name, str) or name not in known:
        raise KeyError(f"{key}.from", unknown("library entry", name, known))
    entry = {key: value for key, value in known[name].items() if key not in ("title", "origin")}
    own = {key: value for key, value in table.items() if key != "from"}
    if len([size for size in _SIZES if size in own]) > 1:
        entry = {key: value for key, value in entry.items() if key not in (*_SIZES, *_AMMUNITION)}
    return entry | own
