"""What README shows, for tests that type it."""

import re
from pathlib import Path

README = (Path(__file__).parent.parent / "README.md").read_text()


def block(name, language):
    """The text of the fenced block under the comment with this name."""
    return README.split(f"<!-- {name} -->")[1].split(f"```{language}\n")[1].split("```")[0]


def blocks():
    """The files README tells people to write: name -> text."""
    named = re.findall(r"<!-- (\w+\.(?:py|toml)) -->\n```(\w+)\n", README)
    return {name: block(name, language) for name, language in named}


def python_example():
    """The first example of the section on Python, as far as it goes without a right-hand side of one's own."""
    return README.split("## In Python")[1].split("```python\n")[1].split("```")[0].partition("gust = ")[0]
