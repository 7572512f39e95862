"""What the command `generate` prints and writes."""

from pathlib import Path

import model
from codegen.generate import apply, changes
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
        print(f"{'removed' if change.after is None else 'wrote'} {shown(change.path)}")
    untouched = 2 * len(systems) - sum(change.after is not None for change in found)
    if untouched:
        print(f"{untouched} files are as the models give them")
    return 0


def shown(path: Path) -> Path:
    """A path as a person would type it: from here where it lies below."""
    return path.relative_to(Path.cwd()) if path.is_absolute() and path.is_relative_to(Path.cwd()) else path
