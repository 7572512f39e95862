"""`qddot compare`: what it prints."""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path

from qddot.codegen.compare.difference import compare
from qddot.codegen.compare.report import latex, records, summary, text
from qddot.codegen.compare.sheet import read
from qddot.codegen.compare.tree import CompareError
from qddot.codegen.compare.wording import accounts
from qddot.codegen.equations.notation import with_dots
from qddot.codegen.lagrange import derive
from qddot.codegen.sources import Source, find
from qddot.model.system import ModelError, System


def run(path: Path, name: str | None, form: str) -> int:
    """Print the comparison as text, latex or json; 1 where an equation differs."""
    sheet = read(path)
    chosen = name or sheet.model
    if chosen is None:
        raise CompareError(f"{path}: says no model; begin it with `model NAME`, or give --model NAME")
    ((source, system),) = _model(path, name, chosen).items()
    equations = derive(system)
    found = accounts(sheet, equations, compare(sheet, equations))
    dotted = with_dots(equations)
    if form == "json":
        said = {"file": str(path), "model": str(source), "summary": summary(found), "equations": records(found, dotted)}
        print(json.dumps(said, indent=1, ensure_ascii=False))
    elif form == "latex":
        print(latex(found, f"{path.name} against {source}", dotted), end="")
    else:
        print(f"{path} against what {source} gives\n")
        print(text(found, dotted, min(shutil.get_terminal_size((100, 24)).columns, 120)), end="")
    return 0 if all(each.equal for each in found) else 1


def _model(path: Path, given: str | None, chosen: str) -> Mapping[Source, System]:
    """The model by its source; CompareError names the file where that is what asked for it."""
    try:
        return find((chosen,))
    except ModelError as error:
        raise error if given else CompareError(f"{path}: {error}") from None
