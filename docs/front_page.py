"""For `make docs`: README and CHANGELOG are pages of the site, and their links lead to its pages."""

import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parent.parent
#: A link to a file of one of the rooms.
_SOURCE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+[\w/]+\.(?:py|toml|txt|csv)\)")


def on_files(files: Files, config: Any) -> Files:
    """Add the two pages that stand at the top of the repository."""
    for page, source in (("index.md", "README.md"), ("changelog.md", "CHANGELOG.md")):
        files.append(File.generated(config, page, content=_for_site((ROOT / source).read_text())))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """The page with its links to the top of the repository; files of its rooms, which the site lacks, are no links."""
    markdown = markdown.replace("](../README.md", "](index.md").replace("](../CHANGELOG.md", "](changelog.md")
    return _SOURCE.sub(r"\1", markdown)


def _for_site(text: str) -> str:
    """A text of the repository's top, with links as the site has them; files that it lacks are no links."""
    text = text.replace("](docs/", "](").replace("](CHANGELOG.md", "](changelog.md")
    return re.sub(r"\[([^\]]+)\]\((?!http|[\w/]+\.(?:md|png))[^)]+\)", r"\1", text)
