"""Where compiled code is kept between processes: a folder that nobody else can write to, or none.

Who can write into it can have the next process run what they like, so a folder with a name that can be foretold is
looked at before it is trusted.
"""

import atexit
import os
import shutil
import stat
import sys
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

#: The variable that names another folder, numba's own.
NAMED = "NUMBA_CACHE_DIR"
#: What others must not be allowed: to write in the user's own cache, anything at all in the temporary folder.
_WRITE, _ANYTHING = 0o022, 0o077


@cache
def code_folder(beside: Path) -> Path | None:
    """The first of these that can be written: the folder that NUMBA_CACHE_DIR names, `beside`, the user's cache, one
    of the user in the temporary folder, one of this process there. None where nothing can.

    Whatever makes later processes compile again is said, in one line on the standard error.
    """
    named = os.environ.get(NAMED)
    if named and _writable(Path(named)):
        return Path(named)
    refused = [f"{NAMED}={named} cannot be written"] if named else []
    if _writable(beside):
        _say(refused, f"compiled code is kept in {beside}")
        return beside
    temporary = _temporary()
    for folder, forbidden in ((_user_cache(), _WRITE), (temporary and temporary / f"qddot-{os.geteuid()}", _ANYTHING)):
        why = _unsafe(folder, forbidden) if folder else ""
        if why:
            refused.append(f"{folder} {why}")
        elif folder and _writable(folder):
            _say(refused, f"compiled code is kept in {folder}")
            return folder
    return _own(temporary, refused)


def _own(temporary: Path | None, refused: list[str]) -> Path | None:
    """A new folder of this process, removed when that ends."""
    if temporary is None:
        _say([*refused, "no folder for compiled code can be written"], "every process compiles anew")
        return None
    folder = Path(tempfile.mkdtemp(prefix="qddot-", dir=temporary))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    _say(refused or ["compiled code cannot be kept"], f"it goes to {folder} for this process alone")
    return folder


def _say(refused: list[str], instead: str) -> None:
    if refused:
        reasons = "; ".join(refused)
        print(f"note: {reasons}: {instead}; {NAMED} names another folder", file=sys.stderr)


def _user_cache() -> Path | None:
    """Where this user's programs keep what can be made again; None where that is not known."""
    with suppress(RuntimeError):  # nobody says where the home is
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "qddot"
    return None


def _temporary() -> Path | None:
    """The temporary folder; None where there is none but the working folder, which is the user's."""
    with suppress(OSError):
        folder = Path(tempfile.gettempdir())
        return None if folder == Path.cwd() else folder
    return None


def _unsafe(folder: Path, forbidden: int) -> str:
    """Why a folder must not be trusted; nothing where it can be, or cannot be made. Made for the user alone."""
    with suppress(OSError):
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(0o700)
    try:
        found = folder.lstat()
    except OSError:
        return ""
    if not stat.S_ISDIR(found.st_mode):
        return "is a link" if stat.S_ISLNK(found.st_mode) else "is no folder"
    if found.st_uid != os.geteuid():
        return f"belongs to another user ({found.st_uid})"
    if found.st_mode & forbidden:
        return f"is open to other users (mode {stat.S_IMODE(found.st_mode):o})"
    return ""


def _writable(folder: Path) -> bool:
    """Whether a folder, made where it is missing, takes a file."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True
