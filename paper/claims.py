"""The paper's claims beside what is computed: every claim gets a verdict, and none is fitted away."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from qddot import StudyError, toml
from qddot.paper.schema import Claim, Paper, Verdict
from qddot.paper.studies import Studies

#: Verdict -> of one claim, and of several.
SAID: dict[Verdict, tuple[str, str]] = {
    "holds": ("holds", "hold"),
    "rests on an assumption": ("rests on an assumption", "rest on an assumption"),
    "differs": ("differs", "differ"),
}


def counted(verdict: Verdict, count: int) -> str:
    """`1 holds`, `9 hold`."""
    one, several = SAID[verdict]
    return f"{count} {one if count == 1 else several}"


@dataclass(frozen=True)
class Judged:
    """A claim with the number computed, in the claim's unit, and the verdict."""

    name: str
    claim: Claim
    computed: float
    verdict: Verdict

    @property
    def worse(self) -> bool:
        """Whether a claim that was met when last looked at is no longer met."""
        return self.verdict == "differs" and self.claim.expected != "differs"

    @property
    def difference(self) -> float | None:
        """Computed over the paper's value, minus 1; None where the paper names a bound."""
        return None if self.claim.value is None else self.computed / self.claim.value - 1.0


def read(path: Path) -> Paper:
    """Read settings and claims. Raises StudyError naming file, line and key."""
    return toml.read(path, Paper)


def judge(paper: Paper, studies: Studies, numbers: Mapping[str, float]) -> tuple[Judged, ...]:
    """Every claim, judged. numbers: what the sections computed, by name; StudyError for one that is missing."""
    found = []
    for name, claim in paper.claims.items():
        if claim.run is not None:
            computed = studies.number(claim.run)
        elif claim.number is not None and claim.number in numbers:
            computed = numbers[claim.number]
        else:
            raise StudyError(f"claim {name}: {toml.unknown('number', claim.number, numbers)}")
        found.append(Judged(name, claim, computed / claim.scale, verdict(claim, computed / claim.scale)))
    return tuple(found)


def verdict(claim: Claim, computed: float) -> Verdict:
    """What to say of a number in the claim's unit."""
    checks = [np.isfinite(computed)]
    if claim.value is not None:
        checks.append(abs(computed - claim.value) <= claim.tolerance * abs(claim.value))
    if claim.least is not None:
        checks.append(computed >= claim.least)
    if claim.most is not None:
        checks.append(computed <= claim.most)
    if not all(checks):
        return "differs"
    return "rests on an assumption" if claim.rests_on else "holds"
