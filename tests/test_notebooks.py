"""The notebooks of the pages that teach run from their first cell to their last, and print what the pages show."""

import os
import re
import sys
from pathlib import Path

import pytest
from pages import PAGES, ROOT

sys.path.insert(0, str(ROOT / "docs"))
from notebooks import NOTEBOOKS, notebook

#: Seconds that a cell may take: some compile.
PATIENCE = 600
#: Pages that print nothing.
SILENT = ("python", "scenes")


def printed(cell):
    return "".join(each["text"] for each in cell["outputs"] if each.get("name") == "stdout")


#: What makes a kernel that ran a notebook as good as a new one, standing in a folder: nothing of the notebook is left.
AS_NEW = """\
import os, sys
for name in [name for name, module in sys.modules.items() if str(getattr(module, "__file__", "")).startswith({base!r})]:
    del sys.modules[name]
os.chdir({folder!r})
%reset -f
"""


@pytest.fixture(scope="module")
def kernel():
    """A kernel for all notebooks of a process: most of what a notebook takes is loading what it imports."""
    nbclient = pytest.importorskip("nbclient", reason="notebooks run with the extra `test`")
    import nbformat

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
        client = nbclient.NotebookClient(nbformat.v4.new_notebook(), timeout=PATIENCE, kernel_name="python3")
        client.execute(cleanup_kc=False)
        yield client
        client.nb = nbformat.v4.new_notebook()
        client.execute(cleanup_kc=True)


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_and_prints_what_its_page_shows(name, kernel, tmp_path):
    import nbformat

    (tmp_path / "studies").symlink_to(ROOT / "studies")
    made = nbformat.from_dict(notebook(PAGES[f"docs/{name}.md"]))
    nbformat.validate(made)
    shown = [printed(cell) for cell in made.cells if cell.cell_type == "code"]
    assert len(shown) >= 1 and (any(shown) or name in SILENT)
    begun = AS_NEW.format(base=str(tmp_path.parent), folder=str(tmp_path))
    kernel.nb = nbformat.from_dict({**made, "cells": [nbformat.v4.new_code_cell(begun), *made.cells]})
    kernel.execute(cleanup_kc=False)
    ran = [cell for cell in kernel.nb.cells[1:] if cell.cell_type == "code"]
    for cell, expected in zip(ran, shown, strict=True):
        assert not expected or printed(cell) == expected, cell.source


def test_nothing_of_a_page_is_lost_in_its_notebook_and_nothing_is_there_twice():
    for name in NOTEBOOKS:
        page, cells = PAGES[f"docs/{name}.md"], notebook(PAGES[f"docs/{name}.md"])["cells"]
        together = "\n".join(f"{cell['source']}\n{printed(cell) if 'outputs' in cell else ''}" for cell in cells)
        words = re.findall(r"\w+", re.sub(r"<!-- [\w.]+ -->|```\w*|\.md\b|\.html\b", " ", page))
        kept = re.findall(r"\w+", re.sub(r"%%writefile [\w.]+|%%bash|```\w*|\.md\b|\.html\b", " ", together))
        assert sorted(kept) == sorted(words), name
