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


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_and_prints_what_its_page_shows(name, tmp_path, monkeypatch):
    nbclient = pytest.importorskip("nbclient", reason="notebooks run with the extra `test`")
    import nbformat

    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    (tmp_path / "studies").symlink_to(ROOT / "studies")
    made = nbformat.from_dict(notebook(PAGES[f"docs/{name}.md"]))
    nbformat.validate(made)
    shown = [printed(cell) for cell in made.cells if cell.cell_type == "code"]
    assert len(shown) >= 1 and (any(shown) or name in SILENT)
    settings = {"timeout": PATIENCE, "kernel_name": "python3", "resources": {"metadata": {"path": str(tmp_path)}}}
    nbclient.NotebookClient(made, **settings).execute()
    for cell, expected in zip((cell for cell in made.cells if cell.cell_type == "code"), shown, strict=True):
        assert not expected or printed(cell) == expected, cell.source


def test_nothing_of_a_page_is_lost_in_its_notebook_and_nothing_is_there_twice():
    for name in NOTEBOOKS:
        page, cells = PAGES[f"docs/{name}.md"], notebook(PAGES[f"docs/{name}.md"])["cells"]
        together = "\n".join(f"{cell['source']}\n{printed(cell) if 'outputs' in cell else ''}" for cell in cells)
        words = re.findall(r"\w+", re.sub(r"<!-- [\w.]+ -->|```\w*|\.md\b|\.html\b", " ", page))
        kept = re.findall(r"\w+", re.sub(r"%%writefile [\w.]+|%%bash|```\w*|\.md\b|\.html\b", " ", together))
        assert sorted(kept) == sorted(words), name
