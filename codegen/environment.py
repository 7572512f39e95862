"""The one way templates are read: strict, quiet about blocks, and with delimiters that suit what is written."""

from functools import cache
from pathlib import Path
from typing import Any, Literal

from jinja2 import Environment, FileSystemLoader, StrictUndefined

TEMPLATES = Path(__file__).parent / "templates"

# Braces belong to LaTeX, so its templates use commands: \VAR{name}, \BLOCK{for ...}, \#{a comment}.
_LATEX: dict[str, Any] = {
    "block_start_string": r"\BLOCK{",
    "block_end_string": "}",
    "variable_start_string": r"\VAR{",
    "variable_end_string": "}",
    "comment_start_string": r"\#{",
    "comment_end_string": "}",
}


@cache
def environment(kind: Literal["python", "latex", "html"]) -> Environment:
    """Give the environment that loads `codegen/templates` for one kind of text.

    An undefined name raises jinja2.UndefinedError. Values are escaped in "html" only.
    """
    made = Environment(
        loader=FileSystemLoader(TEMPLATES),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=kind == "html",
        **(_LATEX if kind == "latex" else {}),
    )
    made.filters["literal"] = repr
    made.filters["tuple"] = tuple
    made.filters["docstring"] = lambda text: text.replace("\\", "\\\\").replace('"', '\\"')
    return made
