"""`qddot run --watch`: a run each time the study, its model or a file that it names changes, until Ctrl-C."""

import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from qddot import origin
from qddot.words import from_here

#: Seconds between looks at the files.
EVERY = 0.3

#: File -> when it was changed and how long it is; None where it is not there.
Stamps = dict[Path, tuple[int, int] | None]


def watch(study: Path, options: Sequence[str]) -> int:
    """Run a study by `qddot run` with these options, in a process of its own, now and whenever a file changes."""
    if not study.is_file():
        raise ValueError(f"{study}: there is no such file to watch")
    command = [sys.executable, "-P", "-m", "qddot", "run", str(study), *options]
    try:
        while True:
            seen = stamps(study)
            subprocess.run(command, check=False)
            print(f"watching {', '.join(from_here(file) for file in seen)}; Ctrl-C ends it", flush=True)
            for file in _changed(study, seen):
                print(f"\n{from_here(file)} changed", flush=True)
    except KeyboardInterrupt:
        print("\nno longer watching")
        return 0


def _changed(study: Path, seen: Stamps) -> list[Path]:
    """Wait until a file is another than it was seen to be and all of them stay as they are; which those are."""
    before = seen
    while True:
        time.sleep(EVERY)
        now = stamps(study)
        if now != seen and now == before and now[study.resolve()] is not None:
            return [file for file in now if now[file] != seen.get(file)] or [study]
        before = now


def stamps(study: Path) -> Stamps:
    """The files that a run of a study is made of, each as it is now: itself, its model's, and those that it names."""
    found: Stamps = {}
    for file in _files(study.resolve()):
        found[file] = None
        with suppress(OSError):
            known = file.stat()
            found[file] = known.st_mtime_ns, known.st_size
    return found


def _files(study: Path) -> Iterator[Path]:
    yield study
    tree: dict[str, Any] = {}
    with suppress(OSError, ValueError):  # half written, or wrong: the run says so
        tree = tomllib.loads(study.read_text("utf-8"))
    for text in _texts({key: value for key, value in tree.items() if key != "model"}):
        with suppress(OSError, ValueError):  # of a text that is no name of a file
            if (study.parent / text).is_file():
                yield (study.parent / text).resolve()
    with suppress(OSError, ValueError):
        yield from _model(str(tree.get("model", "")), study.parent)


def _model(name: str, folder: Path) -> Iterator[Path]:
    """A model's own file with what it imports from beside it, or those that a generated module was made of."""
    file = (folder / name).resolve()
    if not name.endswith(".py"):
        shipped = origin.model_file(name)
        if shipped is not None:
            yield from origin.sources(shipped)
    elif origin.is_model(file):
        yield from origin.sources(file)
    elif file.is_file():
        yield file
        yield from origin.read(file)


def _texts(value: Any) -> Iterator[str]:
    """Every text in a table."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            yield from _texts(each)
