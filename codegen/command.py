"""What the commands of the generator print and write; each gives the exit status."""

import shutil
from pathlib import Path

import model
from codegen.equations.notation import describe
from codegen.equations.page import html
from codegen.equations.terminal import text
from codegen.equations.tex import tex
from codegen.equations.typeset import TypesetError, pdf
from codegen.generate import apply, changes, write_atomically
from codegen.lagrange import derive
from codegen.sources import find

#: Where the shipped models' files are.
GENERATED = Path(model.__file__).parent.parent / "generated"


def generate(names: tuple[str, ...], into: Path | None, check: bool) -> int:
    """Write the files of models, or with `check` print how they differ and give 1 where they do."""
    systems = find(names)
    folder = into or GENERATED
    own = [source for source in systems if not source.startswith("model/")]
    if own and into is None:
        raise ValueError(f"{own[0]} is a model of your own: say where its files go, with --into FOLDER")
    found = changes(systems, folder, whole=not names and into is None)
    if check:
        for change in found:
            print(change.diff(), end="")
        print(f"{len(found)} files are stale; run `make generate`" if found else f"{folder} is what the models give")
        return 1 if found else 0
    apply(found)
    for change in found:
        print(f"{'removed' if change.after is None else 'wrote'} {_shown(change.path)}")
    untouched = 2 * len(systems) - sum(change.after is not None for change in found)
    if untouched:
        print(f"{untouched} files are as the models give them")
    return 0


def equations(names: tuple[str, ...], into: Path, quiet: bool) -> int:
    """Print equations; write them as HTML and TeX, and as PDF where LaTeX is installed."""
    width = min(shutil.get_terminal_size((100, 24)).columns, 120)
    missing: TypesetError | None = None
    for source, system in find(names).items():
        document = describe(derive(system), source)
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
            print(f"wrote {_shown(path)}")
    if missing is not None:
        print(f"no PDF: {missing}")
    return 0


def equations_page(name: str) -> str:
    """The equations of a model as a complete HTML page."""
    ((source, system),) = find((name,)).items()
    return html(describe(derive(system), source))


def _shown(path: Path) -> Path:
    """A path as a person would type it: from here where it lies below."""
    return path.relative_to(Path.cwd()) if path.is_absolute() and path.is_relative_to(Path.cwd()) else path
