"""Values that `qddot identify` found, taken up by a study: `identified = "FILE"`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from qddot.runner.study.toml import tables_of, text_of


def with_identified(tree: Mapping[str, Any], study: Path) -> dict[str, Any]:
    """A study's tables with the identified values where the study itself gives none.

    The file is looked for beside the study. Raises ValueError where it cannot be read.
    """
    done = dict(tree)
    if not isinstance(tree.get("identified"), str):
        return done
    file = study.parent / tree["identified"]
    try:
        values = tables_of(text_of(file))["values"]
    except FileNotFoundError:
        raise ValueError(f"there is no file {file}; `qddot identify` writes such files") from None
    except (OSError, ValueError) as error:
        raise ValueError(f"{file}: {error}") from None
    except KeyError:
        raise ValueError(f"{file} has no table [values]; expected a file that `qddot identify` wrote") from None
    for key, value in values.items():
        _give(done, key.split("."), value)
    return done


def _give(tree: dict[str, Any], key: list[str], value: Any) -> None:
    """Set the value at this key where there is none; tables on the way are copied or made."""
    *tables, last = key
    for name in tables:
        inner = tree.get(name, {})
        if not isinstance(inner, dict):
            return  # the study's own mistake, told where its tables are checked
        tree[name] = dict(inner)
        tree = tree[name]
    tree.setdefault(last, value)
