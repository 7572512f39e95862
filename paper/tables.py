"""Tables of the reproduced paper, and the claims as data."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from rich.table import Table

from qddot.paper.claims import Judged, counted
from qddot.paper.cost import Cost
from qddot.paper.driving import Driving
from qddot.paper.reproduce import Reproduction
from qddot.report import plain_table

_COLOURS = {"holds": "green", "rests on an assumption": "yellow", "differs": "red"}


def claims_table(claims: Sequence[Judged]) -> Table:
    """Where, what the paper says, its number, ours, the difference, the verdict."""
    table = Table(title="Claims", title_justify="left", box=None, header_style="bold", pad_edge=False)
    for head in ("where", "the paper", "says", "computed", "difference", "verdict"):
        numbers = head in ("says", "computed", "difference")
        table.add_column(head, justify="right" if numbers else "left", overflow="fold", no_wrap=numbers)
    for each in claims:
        colour = _COLOURS[each.verdict]
        row = (
            each.claim.where,
            each.claim.says,
            said(each),
            _number(each.computed, each.claim.unit),
            _difference(each),
        )
        table.add_row(*row, f"[{colour}]{each.verdict}[/{colour}]")
    return table


def said(each: Judged) -> str:
    """The number or the bounds that the paper gives, with the unit."""
    claim = each.claim
    if claim.value is not None:
        return _number(claim.value, claim.unit)
    bounds = (("≥", claim.least), ("≤", claim.most))
    return " ".join(f"{sign} {_number(bound, claim.unit)}" for sign, bound in bounds if bound is not None)


def _number(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".strip()


def claims_page(claims: Sequence[Judged], parameter_set: str | None) -> str:
    """The claims as a table in Markdown; for another parameter set than the paper's, beside the paper's verdicts."""
    heads = ["claim", "where", "the paper", "computed", "verdict"]
    if parameter_set is not None:
        heads[3:] = [f"with `{parameter_set}`", "verdict", "with the paper's"]
    lines = [" | ".join(heads), "|".join("---" for _ in heads)]
    for each in claims:
        cells = [f"`{each.name}`", each.claim.where, said(each), _number(each.computed, each.claim.unit), each.verdict]
        lines.append(" | ".join(cells if parameter_set is None else [*cells, each.claim.expected]))
    return "".join(f"|{line}|\n" if k == 1 else f"| {line} |\n" for k, line in enumerate(lines))


def _difference(each: Judged) -> str:
    difference = each.difference
    if difference is None:
        return ""
    return f"{100 * difference:+.1f} %" if abs(difference) < 2 else f"{difference + 1:.3g} times"


def cheapest_table(cost: Cost) -> Table:
    """The cheapest setting of each method, and the paper's settings."""
    heads = ("error", "steps", "evaluations", "time\nms")
    table = plain_table(f"Cost of {100 * cost.limit:g} % (section 3.2)", "method", "setting", *heads, numbers=4)
    for row in (*cost.cheapest, *cost.paper):
        numbers = (f"{100 * row.error:.2g} %", str(row.steps), str(row.evaluations), f"{1e3 * row.seconds:.3g}")
        name = row.name if row.name == row.method else f"{row.name} (paper)"
        table.add_row(name, row.setting, *numbers)
    return table


def speeds_table(driving: Driving) -> Table:
    """Hull over road at the paper's speeds: quantiles over the roads, and what shots add."""
    counts = sorted(driving.speeds[0].ratios)
    heads = ("5 %", "median", "95 %", "roads where\nhull < road", *(f"{n} shots\nadd" for n in counts if n))
    title = f"Hull's amplitude over the road's on {len(driving.permissible)} roads (section 4)"
    table = plain_table(title, "speed", *heads, numbers=len(heads))
    for each in driving.speeds:
        quantiles = (f"{value:.3g}" for value in np.quantile(each.ratios[0], [0.05, 0.5, 0.95]))
        added = (f"{100 * each.added(n):+.2g} %" for n in counts if n)
        table.add_row(f"{each.speed:g} km/h", *quantiles, f"{np.mean(each.ratios[0] <= 1.0):.0%}", *added)
    return table


def notes(found: Reproduction) -> Iterator[str]:
    """What the tables do not say: quantiles of the speed, bursts, assumptions, the count of verdicts."""
    low, median, high = np.quantile(found.driving.permissible, [0.05, 0.5, 0.95])
    yield f"permissible speed: median {median:.3g} km/h, 5 to 95 % of the roads {low:.3g} to {high:.3g} km/h"
    for burst in found.firing.bursts:
        unit = found.firing.units[burst.quantity]
        for kind, times, swing in (("best", burst.best, burst.best_swing), ("worst", burst.worst, burst.worst_swing)):
            shown = ", ".join(f"{time:.3g}" for time in np.diff(times))
            yield f"{kind} burst of {len(times)} for {burst.quantity}: intervals {shown} s, swing {swing:.3g} {unit}"
    (best, after), (worst, later) = found.phase.place(worst=False), found.phase.place(worst=True)
    least, most = f"{best:.3g} s and {after:.3g} s later", f"{worst:.3g} s and {later:.3g} s later"
    yield f"on rough ground two shots disturb least at {least}, most at {most}"
    for name in sorted({name for each in found.claims for name in each.claim.rests_on}):
        yield f"assumption {name}: {found.paper.assumptions[name]}"
    counts = Counter(each.verdict for each in found.claims)
    yield ", ".join(counted(verdict, count) for verdict, count in counts.items())
    if found.studies.parameter_set is not None:
        return  # the verdicts of the last look are those of the paper's own vehicle
    for each in found.claims:
        if each.worse:
            yield f"[red]worse than when last looked at ({each.claim.expected}):[/red] {each.name}"
        elif each.verdict != each.claim.expected:
            yield f"better than when last looked at ({each.claim.expected}): {each.name}; say so in expected"


def records(claims: Sequence[Judged]) -> list[dict[str, Any]]:
    """The claims as data."""
    return [
        {
            "name": each.name,
            **each.claim.model_dump(include={"where", "says", "value", "least", "most", "unit", "rests_on", "remark"}),
            "computed": each.computed,
            "verdict": each.verdict,
            "expected": each.claim.expected,
        }
        for each in claims
    ]
