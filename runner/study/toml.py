"""TOML as it comes from people: of limited size and depth, so that no file takes long to refuse."""

import re
import tomllib
from pathlib import Path
from typing import Any

#: The longest file, in bytes: long curves belong into CSV files.
LONGEST_FILE = 2**18
#: Parts of a dotted key: more take tomllib quadratic time, and lead to tables that nothing can print.
MOST_PARTS = 16
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_PARTS}}}")


def text_of(path: Path) -> str:
    """The text of a TOML file. Raises OSError, and ValueError where it is too long or not UTF-8."""
    with path.open("rb") as file:
        data = file.read(LONGEST_FILE + 1)
    if len(data) > LONGEST_FILE:
        raise ValueError(f"longer than {LONGEST_FILE} bytes; put long curves into CSV files")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"not UTF-8 text ({error.reason} at byte {error.start}); save it as UTF-8") from None


def tables_of(text: str) -> dict[str, Any]:
    """The tables of a TOML text. Raises ValueError saying what is wrong and where."""
    if found := _LONG_KEY.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise ValueError(f"no valid TOML: a key of more than {MOST_PARTS} parts (at line {line})")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("no valid TOML: brackets are nested too deeply") from None
    except ValueError as error:  # beside tomllib's own, Python's for whole numbers of thousands of digits
        raise ValueError(f"no valid TOML: {error}") from None
