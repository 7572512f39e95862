"""Files that appear whole or not at all."""

import errno
import hashlib
import os
import re
import secrets
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

#: The longest name that is made of what was asked for.
_LONGEST = 120


@contextmanager
def written_aside(path: str | Path) -> Iterator[Path]:
    """A path beside `path` to write to: renamed to `path` when the block ends, removed when it raises.

    The folder is made where it is missing. Raises OSError naming `path` where it cannot be written.
    """
    path = Path(path)
    ready(path)
    aside = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        yield aside
        os.replace(aside, path)
    except OSError as error:
        about = error.filename in (None, str(aside), aside)
        if error.errno is None or not about:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        aside.unlink(missing_ok=True)


def ready(path: Path) -> None:
    """See that a file can be written, before what goes into it is computed; its folder is made where it is missing.

    Raises OSError naming what stands in the way.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder; expected the name of a file", str(path))
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "is no ordinary file, and is not replaced", str(path))
    folder_ready(path.parent)


def folder_ready(folder: Path) -> None:
    """Make a folder, where it is missing, and see that files can be written into it. Raises OSError as `ready`."""
    for each in (folder, *folder.parents):
        if each.exists() and not each.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, "is a file; expected a folder", str(each))
    folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, "no file can be written into this folder", str(folder))


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Have one process at a time make and remove what stands in a folder, where its file system has locks."""
    import fcntl  # noqa: PLC0415 - of POSIX systems; a lock ends with the process, however it ends

    handle = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def keep_newest(folder: Path, pattern: str, most: int) -> None:
    """Remove all but the newest so many of the folders in `folder` whose names fit the pattern."""
    ages: list[tuple[float, Path]] = []
    for path in folder.glob(pattern):
        with suppress(FileNotFoundError):  # another process may be tidying too
            ages.append((path.stat().st_mtime, path))
    for _, old in sorted(ages)[:-most]:
        shutil.rmtree(old, ignore_errors=True)


def named(stem: str, **tags: Sequence[object]) -> str:
    """The name of a file for what was asked for, other for anything else: `map_metric=ride_over=stiffness+damping`.

    Tags without words are left out, and so are blanks; what a file system may not like is replaced, and a digest tells
    such names apart.
    """
    words = {tag: ["".join(str(word).split()) for word in given] for tag, given in tags.items() if given}
    plain = {tag: [re.sub(r"[^\w.=-]", "-", word) for word in given] for tag, given in words.items()}
    name = "_".join((stem, *(f"{tag}={'+'.join(given)}" for tag, given in plain.items())))
    if plain == words and len(name) <= _LONGEST:
        return name
    return f"{name[:_LONGEST]}_{hashlib.sha256(repr(words).encode()).hexdigest()[:8]}"


def named_code(folder: Path, name: str) -> Path:
    """The path of what may run code, a generated module or a study, as a file in `folder` names it.

    Raises ValueError for an absolute path, one with `..` in it, and one that leads out of the folder by a symbolic
    link: who reads a folder has read all the code that its files can run.
    """
    path = Path(name)
    if path.is_absolute() or ".." in path.parts or not (folder / path).resolve().is_relative_to(folder.resolve()):
        raise ValueError(
            f"{name!r} does not lie below {folder.resolve()}: a file names code below its own folder only, by a "
            "relative path without .. and without links that lead out of it; put it there, or call from Python"
        )
    return folder / path


def store_of(study: Path) -> Path:
    """Where the batch of a study goes if nothing is said."""
    return Path("results") / f"{study.stem}.zarr"
