"""Processes beside the run; one draws: it imports matplotlib while the run compiles or integrates, and then draws."""

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from threading import Thread
from typing import IO, TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from qddot.runner.pictures.picture import Picture

#: Seconds that a process may take to leave.
_PATIENCE = 5.0


def start_process(module: str, environment: Mapping[str, str], **pipes: int) -> "subprocess.Popen[bytes]":
    """A process of this Python that calls `main` of a module; environment: what differs there."""
    code = f"import gc; gc.disable(); from {module} import main; main()"
    command = [sys.executable, "-P", "-c", code]  # -P: nothing that lies where the user stands
    return subprocess.Popen(command, env=os.environ | environment, **pipes)  # type: ignore[call-overload,no-any-return]


def end_process(process: "subprocess.Popen[bytes]") -> None:
    """End a process where it still runs; it removes what it has half written."""
    if process.poll() is not None:
        return
    process.terminate()
    try:
        process.communicate(timeout=_PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()


def leave_when_told() -> None:
    """Have SIGTERM end this process as an exception does."""
    signal.signal(signal.SIGTERM, _leave)


class Drawing:
    """Starts the process at once; `begin` hands it the picture, `finish` waits for the picture; leaving ends it."""

    def __init__(self) -> None:
        sparing = {"OPENBLAS_NUM_THREADS": "1"}  # threads that draw nothing take a core from the run
        self._process = start_process(__name__, sparing, stdin=subprocess.PIPE, stderr=subprocess.PIPE)

    def begin(self, picture: "Picture", path: Path) -> None:
        """Hand over the picture and the file to draw it into; not held up where matplotlib is not ready."""
        pipe, self._process.stdin = self._process.stdin, None
        self._sending = Thread(target=_send, args=(pipe, pickle.dumps((picture, path.absolute()))), daemon=True)
        self._sending.start()

    def finish(self) -> None:
        """Wait for the picture; OSError with the process's last words where it failed."""
        _, said = self._process.communicate()
        self._sending.join()
        if self._process.returncode:
            words = said.decode(errors="replace").strip().splitlines() or ["no reason given"]
            raise OSError(f"the figure could not be drawn: {words[-1]}")

    def __enter__(self) -> "Drawing":
        """Give itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process where it still waits or draws; it removes what it has half written."""
        end_process(self._process)


def main() -> None:
    """Import what drawing needs, wait for a picture and a path on the standard input, draw; end at once on SIGTERM."""
    leave_when_told()
    try:
        _draw()
    except (SystemExit, KeyboardInterrupt):
        os._exit(1)


def _leave(number: int, frame: object) -> NoReturn:
    raise SystemExit(128 + number)


def _draw() -> None:
    import numpy as np  # noqa: PLC0415 - of the drawing process alone

    from qddot.runner.pictures.figures import draw  # noqa: PLC0415 - matplotlib is slow to import
    from qddot.runner.pictures.picture import Curve, Panel, Picture  # noqa: PLC0415

    panel = Panel((Curve(np.arange(2.0), np.zeros(2), "first"),), "m")
    with (
        contextlib.suppress(OSError),
        tempfile.TemporaryDirectory() as folder,
    ):  # fonts and all that is made with a first figure
        draw(Picture("first", (panel,)), Path(folder) / "first.png")
    request = sys.stdin.buffer.read()
    if request:
        draw(*pickle.loads(request))
        os._exit(0)  # the picture is written; taking matplotlib down would keep the user waiting


def _send(pipe: IO[bytes], request: bytes) -> None:
    with contextlib.suppress(BrokenPipeError), pipe:  # `finish` tells what ended the process
        pipe.write(request)
