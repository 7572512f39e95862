"""What the command `equations` prints and writes: the derived equations for the terminal, as HTML, TeX and PDF."""

import shutil
from pathlib import Path

from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.page import html
from qddot.codegen.equations.terminal import text
from qddot.codegen.equations.tex import tex
from qddot.codegen.equations.typeset import TypesetError, pdf
from qddot.codegen.generate import write_atomically
from qddot.codegen.lagrange import derive
from qddot.codegen.sources import find
from qddot.words import from_here


def equations(names: tuple[str, ...], into: Path, quiet: bool) -> int:
    """Print equations; write them as HTML and TeX, and as PDF where LaTeX is installed."""
    width = min(shutil.get_terminal_size((100, 24)).columns, 120)
    missing: TypesetError | None = None
    for source, system in find(names).items():
        document = describe(derive(system), str(source))
        if not quiet:
            print(text(document, width))
        write_atomically(into / f"{system.name}.html", html(document))
        write_atomically(into / f"{system.name}.tex", tex(document))
        written = [into / f"{system.name}.html", into / f"{system.name}.tex"]
        if missing is None:
            try:
                written.append(pdf(into / f"{system.name}.tex", into))
            except TypesetError as error:
                missing = error
        for path in written:
            print(f"wrote {from_here(path)}")
    if missing is not None:
        print(f"no PDF: {missing}")
    return 0


def equations_page(name: str) -> str:
    """The equations of a model as a complete HTML page."""
    ((source, system),) = find((name,)).items()
    return html(describe(derive(system), str(source)))
