"""The claims on the page of the paper: folded, and filtered by their verdict."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from qddot.paper.claims import SAID, counted
from qddot.report import Section

_HERE = Path(__file__).parent
#: Verdict -> the class of its colour.
_CLASSES = {"holds": "holds", "rests on an assumption": "rests", "differs": "differs"}


def claims_section(claims: Sequence[Mapping[str, Any]], assumptions: Mapping[str, str]) -> Section:
    """The section. claims: as `qddot paper` writes them."""
    counts = {verdict: sum(each["verdict"] == verdict for each in claims) for verdict in SAID}
    buttons = [("", f"All {len(claims)}"), *((verdict, counted(verdict, n)) for verdict, n in counts.items() if n)]
    said = "".join(f"<li><b>{escape(name)}</b>: {escape(text)}</li>" for name, text in assumptions.items())
    content = (
        '<div class="verdicts" role="group" aria-label="Claims that are shown">'
        + "".join(
            f'<button type="button" data-verdict="{verdict}" aria-pressed="{str(not verdict).lower()}">{words}</button>'
            for verdict, words in buttons
        )
        + "</div>\n"
        + "".join(_claim(each, assumptions) for each in claims)
        + f"<h3>Assumptions</h3><ul>{said}</ul>"
    )
    style, script = ((_HERE / name).read_text("utf-8") for name in ("claims.css", "claims.js"))
    return Section("Claims of the paper", content, style, script)


def _claim(each: Mapping[str, Any], assumptions: Mapping[str, str]) -> str:
    rests = "; ".join(f"{name}, {assumptions[name]}" if name in assumptions else name for name in each["rests_on"])
    rows = [("in the paper", _stated(each)), ("computed", f"{each['computed']:.4g} {each['unit']}".strip())]
    if each["value"]:
        rows.append(("difference", f"{100 * (each['computed'] / each['value'] - 1):+.2g} %"))
    rows += [("rests on", rests), ("remark", each["remark"])]
    told = "".join(f"<dt>{name}</dt><dd>{escape(text)}</dd>" for name, text in rows if text)
    verdict = each["verdict"]
    return (
        f'<details class="claim" data-is="{verdict}"><summary><span class="{_CLASSES[verdict]}">{verdict}</span> '
        f"– {escape(each['where'])}: {escape(each['says'])}</summary><dl>{told}</dl></details>\n"
    )


def _stated(each: Mapping[str, Any]) -> str:
    if each["value"] is not None:
        return f"{each['value']:g} {each['unit']}".strip()
    bounds = (("≥", each["least"]), ("≤", each["most"]))
    return " and ".join(f"{sign} {value:g} {each['unit']}".strip() for sign, value in bounds if value is not None)
