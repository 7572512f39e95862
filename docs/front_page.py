"""For `make docs`: README and CHANGELOG are pages of the site, and their links lead to its pages."""

import json
import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "docs"))
from notebooks import NOTEBOOKS, notebook  # noqa: E402 - stands beside this file

#: A link to a file of one of the rooms.
_SOURCE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+[\w/]+\.(?:py|toml|txt|csv)\)")


def on_files(files: Files, config: Any) -> Files:
    """Add the two pages that stand at the top of the repository, and notebooks of the pages that teach."""
    for page, source in (("index.md", "README.md"), ("changelog.md", "CHANGELOG.md")):
        files.append(File.generated(config, page, content=_for_site((ROOT / source).read_text())))
    for name in NOTEBOOKS:
        made = notebook((ROOT / "docs" / f"{name}.md").read_text())
        files.append(File.generated(config, f"{name}.ipynb", content=json.dumps(made, indent=1)))
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """The page with its links to the top of the repository; files of its rooms, which the site lacks, are no links."""
    markdown = markdown.replace("](../README.md", "](index.md").replace("](../CHANGELOG.md", "](changelog.md")
    name = Path(page.file.src_uri).stem
    if name in NOTEBOOKS:
        head, rest = markdown.split("\n", 1)
        markdown = f"{head}\n\n[This page as a notebook]({name}.ipynb)\n{rest}"
    return _SOURCE.sub(r"\1", markdown)


def _for_site(text: str) -> str:
    """A text of the repository's top, with links as the site has them; files that it lacks are no links."""
    text = text.replace("](docs/", "](").replace("](CHANGELOG.md", "](changelog.md")
    return re.sub(r"\[([^\]]+)\]\((?!http|[\w/]+\.(?:md|png))[^)]+\)", r"\1", text)
