"""Files of a store as they reach the disk: whole, or not at all."""

import json
import os
import secrets
import shutil
from pathlib import Path
from typing import Any


def written_down(path: Path, content: Any) -> None:
    """Write JSON beside its place, have it reach the disk, and rename it."""
    aside = path.with_name(f"{path.name}.{secrets.token_hex(4)}.partial")
    try:
        with aside.open("w", encoding="utf-8") as file:
            json.dump(content, file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(aside, path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise
    synchronize(path.parent)


def synchronize(path: Path) -> None:
    """Have a file or a folder reach the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def tidy(path: Path) -> None:
    """Remove what a killed batch left half written."""
    for partial in path.rglob("*.partial"):
        cleared(partial)


def cleared(path: Path) -> None:
    """Remove a file, or a folder with all in it, or nothing where there is nothing."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
