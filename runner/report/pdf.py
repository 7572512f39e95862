"""A page as PDF, printed by a browser where one is installed."""

import shutil
import subprocess
import tempfile
from pathlib import Path

from qddot.runner.files import written_aside

#: Browsers that print without a window, the first of which is taken.
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "microsoft-edge")
#: Seconds that a browser may take, and virtual milliseconds that it gives the page's plots.
_TIMEOUT, _SETTLE = 120.0, 10_000


def browser() -> str | None:
    """The browser that would print, None where there is none."""
    return next(filter(None, map(shutil.which, BROWSERS)), None)


def print_page(program: str, page: Path, into: Path) -> Path:
    """Print an HTML page into a PDF; an older one is replaced whole or not at all. Raises OSError where that fails."""
    with tempfile.TemporaryDirectory(prefix="qddot-") as profile, written_aside(into) as aside:
        command = [
            program,
            "--headless",
            "--disable-gpu",
            "--no-sandbox",
            "--no-pdf-header-footer",
            "--window-size=1000,1400",
        ]
        command += [f"--user-data-dir={profile}", f"--virtual-time-budget={_SETTLE}", f"--print-to-pdf={aside}"]
        try:
            done = subprocess.run(
                [*command, page.absolute().as_uri()], capture_output=True, timeout=_TIMEOUT, check=False
            )
        except subprocess.TimeoutExpired:
            raise OSError(f"{program} did not print {page} within {_TIMEOUT:g} s") from None
        if done.returncode or not Path(aside).read_bytes().startswith(b"%PDF"):
            words = done.stderr.decode(errors="replace").strip().splitlines() or ["no reason given"]
            raise OSError(f"{program} did not print {page}: {words[-1]}")
    return into
