"""What the README and the pages of docs/ show, for tests that type it."""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent
#: Path from the root -> text.
PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text() for path in [ROOT / "README.md", *ROOT.glob("docs/**/*.md")]
}
#: All of them, one after the other.
TEXT = "\n".join(PAGES.values())


def block(name, language=""):
    """The text of the fenced block under the comment with this name."""
    return TEXT.split(f"<!-- {name} -->\n")[1].split(f"```{language}\n")[1].split("```")[0]


def blocks():
    """The files that the pages tell people to write: name -> text."""
    named = re.findall(r"<!-- (\w+\.(?:py|toml)) -->\n```(\w+)\n", TEXT)
    return {name: block(name, language) for name, language in named}


def python_example():
    """The first example in Python, as far as it goes without a right-hand side of one's own."""
    return PAGES["docs/python.md"].split("```python\n")[1].split("```")[0].partition("gust = ")[0]


@dataclass(frozen=True)
class Block:
    """A fenced block: the file that it is to be written into, if any; its language and its text."""

    file: str
    language: str
    text: str


def blocks_of(page):
    """The fenced blocks of a page, in order."""
    fenced = re.findall(r"(?:<!-- ([\w.]+) -->\n)?^```(\w*)\n(.*?)^```$", PAGES[page], re.MULTILINE | re.DOTALL)
    return [Block(*found) for found in fenced]
