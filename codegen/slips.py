"""What went wrong in a user's model file, in one line: file, line, what was written, the name that was meant."""

import linecache
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from signal import SIGTERM
from types import FrameType

from qddot.model.system import ModelError
from qddot.words import nearest


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Let whatever the file at `path` raises be a ModelError of one line."""
    try:
        yield
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from error
    except SyntaxError as error:
        raise ModelError(_syntax(path, error)) from error
    except (Exception, SystemExit) as error:
        if isinstance(error, SystemExit) and error.code == 128 + SIGTERM:  # the command itself was asked to end
            raise
        raise ModelError(_slip(path, error)) from error


def _syntax(path: Path, error: SyntaxError) -> str:
    """Of the file itself, or of one that it imports."""
    file = error.filename if error.filename and not _same(error.filename, path) else path
    column = f", column {error.offset}" if error.offset else ""
    return f"{file}, line {error.lineno}{column}: this is no Python: {error.msg}{_quoted((error.text or '').strip())}"


def _slip(path: Path, error: BaseException) -> str:
    frame, line = _place(path, error)
    where = f"{path}, line {line}" if line else f"{path}"
    text = linecache.getline(str(path), line).strip() if line else ""
    said = f"{type(error).__name__}: {' '.join(str(error).split())}" if str(error) else type(error).__name__
    return f"{where}: {said}{_quoted(text)}{_hint(error, frame, text)}"


def _place(path: Path, error: BaseException) -> tuple[FrameType | None, int]:
    """The innermost frame that runs code of the file, and its line; (None, 0) where none does."""
    trace, found, line = error.__traceback__, None, 0
    while trace is not None:
        if _same(trace.tb_frame.f_code.co_filename, path):
            found, line = trace.tb_frame, trace.tb_lineno
        trace = trace.tb_next
    return found, line


def _hint(error: BaseException, frame: FrameType | None, text: str) -> str:
    if isinstance(error, NameError) and frame is not None:
        return nearest(str(error.name), {*frame.f_locals, *frame.f_globals, *frame.f_builtins})
    if isinstance(error, AttributeError) and error.name is not None:
        return nearest(error.name, dir(error.obj))
    if isinstance(error, ImportError) and (missing := re.match(r"cannot import name '(\w+)'", str(error))):
        return nearest(missing[1], dir(sys.modules.get(error.name or "")))
    if isinstance(error, TypeError) and "^" in text:
        return "; write powers with **: x**4"
    return "; a model file gives a System and does not end the program" if isinstance(error, SystemExit) else ""


def _quoted(text: str) -> str:
    return f" in `{text if len(text) <= 100 else text[:97] + '...'}`" if text else ""


def _same(file: str, path: Path) -> bool:
    return Path(file).resolve() == path.resolve()
