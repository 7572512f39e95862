"""From LaTeX to PDF by pdflatex, where it is installed."""

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

_TIMEOUT = 120.0
_MOST_RUNS = 4


class TypesetError(RuntimeError):
    """There is no pdflatex, or it refused the document; the message says what to do."""


def pdf(tex_path: Path, into: Path) -> Path:
    """Typeset a LaTeX file and put the PDF, named like it, into a folder; an older one is replaced whole or not at all.

    Raises TypesetError with what to install where pdflatex is missing, and with LaTeX's first complaint where it fails.
    """
    program = shutil.which("pdflatex")
    if program is None:
        raise TypesetError(
            "pdflatex is not installed: install the packages texlive-latex-base and texlive-latex-recommended "
            "(or MacTeX, MiKTeX); the HTML page and the terminal rendering need no LaTeX"
        )
    if not tex_path.is_file():
        raise TypesetError(f"{tex_path} does not exist; `make generate` writes it")
    into.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="qddot-") as folder:
        work = Path(folder)
        shutil.copyfile(tex_path, work / "equations.tex")
        for _ in range(_MOST_RUNS):
            before = _auxiliary(work)
            _run(program, work, tex_path)
            if _auxiliary(work) == before:
                break
        return _placed(work / "equations.pdf", into / f"{tex_path.stem}.pdf")


def _auxiliary(work: Path) -> bytes:
    """What one run tells the next, the widths of long tables: two runs that agree are enough."""
    path = work / "equations.aux"
    return path.read_bytes() if path.is_file() else b""


def _run(program: str, work: Path, tex_path: Path) -> None:
    command = [program, "-no-shell-escape", "-interaction=nonstopmode", "-halt-on-error", "equations.tex"]
    environment = os.environ | {"openin_any": "p", "openout_any": "p"}
    try:
        done = subprocess.run(
            command,
            cwd=work,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise TypesetError(f"pdflatex did not finish {tex_path} within {_TIMEOUT:g} s") from None
    if done.returncode != 0:
        raise TypesetError(f"pdflatex failed on {tex_path}: {_complaint(done.stdout.decode('utf-8', 'replace'))}")


def _complaint(output: str) -> str:
    """The first line that begins with an exclamation mark, and the line of the document it names."""
    if found := re.search(r"^! .*", output, re.MULTILINE):
        place = re.search(r"^l\.\d+.*", output[found.end() :], re.MULTILINE)
        return found[0].removeprefix("! ") + (f" ({place[0].strip()})" if place else "")
    return (output.strip().splitlines() or ["it printed nothing"])[-1]


def _placed(written: Path, target: Path) -> Path:
    handle, aside = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    os.close(handle)
    try:
        shutil.copyfile(written, aside)
        os.chmod(aside, 0o644)
        os.replace(aside, target)
    except BaseException:
        os.unlink(aside)
        raise
    return target
