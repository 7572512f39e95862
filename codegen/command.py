"""What the command `generate` prints and writes."""

from pathlib import Path
from typing import TYPE_CHECKING

from qddot import origin
from qddot.codegen.checked import is_known, remember, seal
from qddot.words import be, counted, from_here

if TYPE_CHECKING:
    from qddot.codegen.generate import Change

#: Where shipped models' files go: a folder where the user stands.
FOLDER = Path("generated")
#: The package's own, which holds nothing but what the shipped models give.
GENERATED = origin.room("qddot.generated")


def generate(names: tuple[str, ...], into: Path | None, check: bool, diff: bool) -> int:
    """Write the files of models; or with `check` say which differ, with `diff` how, and give 1 where one does."""
    if diff and not check:
        raise ValueError("--diff says how files differ, which --check looks for: give both, or neither")
    folder = into or FOLDER
    whole = not names and folder.resolve() == GENERATED.resolve()
    if not check:
        return _write(names, into, whole)
    sealed = seal(names, folder, whole)
    if sealed is not None and is_known(names, folder, sealed):
        return _judge([], folder, diff)
    verdict = _judge(_changes(names, into, whole)[0], folder, diff)
    if sealed is not None and verdict == 0:
        remember(names, folder, sealed)
    return verdict


def _write(names: tuple[str, ...], into: Path | None, whole: bool) -> int:
    from qddot.codegen.generate import apply  # noqa: PLC0415 - see `_changes`

    found, systems = _changes(names, into, whole)
    apply(found)
    for change in found:
        print(f"{'removed' if change.after is None else 'wrote'} {from_here(change.path)}")
    untouched = 2 * systems - sum(change.after is not None for change in found)
    if untouched:
        print(f"{counted(untouched, 'file')} {be(untouched)} as the models give {'it' if untouched == 1 else 'them'}")
    return 0


def _changes(names: tuple[str, ...], into: Path | None, whole: bool) -> "tuple[list[Change], int]":
    """What has to change, and of how many models."""
    from qddot.codegen.generate import changes  # noqa: PLC0415 - SymPy is imported where something is derived
    from qddot.codegen.sources import find  # noqa: PLC0415

    systems = find(names)
    own = [source for source in systems if source.own]
    if own and into is None:
        raise ValueError(f"{own[0]} is a model of your own: say where its files go, with --into FOLDER")
    return changes(systems, into or FOLDER, whole=whole), len(systems)


def _judge(found: "list[Change]", folder: Path, diff: bool) -> int:
    """Print which files are stale, the verdict first, and behind the differences once more."""
    if not found:
        print(f"{from_here(folder)} is what the models give")
        return 0
    them = "it" if len(found) == 1 else "them"
    verdict = f"{counted(len(found), 'file')} {be(len(found))} stale; --diff shows how; without --check, "
    verdict += f"the same command writes {them}"
    print(verdict)
    for change in found:
        print(f"  {change.kind:9}{from_here(change.path)}")
    if diff:
        for change in found:
            print(change.diff(), end="")
        print(verdict)
    return 1
