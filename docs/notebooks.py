"""Notebooks made of the pages that teach: the same texts and examples, as cells that run, with what pages show."""

import re
from collections.abc import Iterator
from typing import Any

#: The pages that are notebooks, too.
NOTEBOOKS = ("tutorial", "parts", "analysis", "from_matlab", "from_sympy", "python", "events", "scenes")
_FENCED = re.compile(r"(?:<!-- (?P<file>[\w.]+) -->\n)?^```(?P<language>\w*)\n(?P<text>.*?)^```$\n?", re.M | re.S)
_COMMAND = re.compile(r"^\$ (.*)\n((?:[^$].*\n)*)", re.M)
#: Links to other pages of the site, beside which the notebook stands.
_PAGE = re.compile(r"\]\((\w[\w/]*)\.md")


def notebook(page: str) -> dict[str, Any]:
    """A page in Markdown as a notebook (nbformat 4.5); what it shows as printed stands as output of the cell before.

    A file to write is a cell with `%%writefile`, commands one with `%%bash`.
    """
    cells: list[dict[str, Any]] = []
    for kind, text in _parts(page):
        if kind == "output":
            cells[-1]["outputs"] = _printed(text)
        elif kind == "markdown":
            cells += [_cell(len(cells), "markdown", text.strip())] if text.strip() else []
        elif kind == "console":
            shown = _COMMAND.findall(text)
            cells.append(_code(len(cells), "\n".join(["%%bash", *(command for command, _ in shown)])))
            cells[-1]["outputs"] = _printed("".join(printed for _, printed in shown))
        else:
            cells.append(_code(len(cells), text.rstrip("\n")))
    language = {"name": "python", "version": "3"}
    spec = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return {
        "nbformat": 4,
        "nbformat_minor": 5,
        "metadata": {"kernelspec": spec, "language_info": language},
        "cells": cells,
    }


def _parts(page: str) -> Iterator[tuple[str, str]]:
    """(kind, text) of the parts of a page, in order: markdown, code, console, output of the code before."""
    end, before = 0, ""
    for found in _FENCED.finditer(page):
        between = _PAGE.sub(r"](\1.html", page[end : found.start()])
        yield "markdown", between
        end = found.end()
        if found["file"]:
            kind, text = "code", f"%%writefile {found['file']}\n{found['text']}"
        elif found["language"] == "python":
            kind, text = "code", found["text"]
        elif found["language"] == "console":
            kind, text = "console", found["text"]
        elif found["language"] == "text" and before == "code" and not between.strip():
            kind, text = "output", found["text"]
        else:
            kind, text = "markdown", found[0]
        yield kind, text
        before = kind
    yield "markdown", _PAGE.sub(r"](\1.html", page[end:])


def _cell(place: int, kind: str, source: str) -> dict[str, Any]:
    return {"cell_type": kind, "id": f"cell-{place}", "metadata": {}, "source": source}


def _code(place: int, source: str) -> dict[str, Any]:
    return {**_cell(place, "code", source), "execution_count": None, "outputs": []}


def _printed(text: str) -> list[dict[str, Any]]:
    return [{"output_type": "stream", "name": "stdout", "text": text}] if text else []
