"""How a symbol's name is read: qdot_6 as q with a dot and the index 6, tyre_force_1 as words with an index."""

import re
from collections.abc import Iterable, Iterator, Set
from dataclasses import dataclass
from functools import lru_cache

#: Greek letters by name; the capitals are those that differ from Latin ones.
GREEK = {
    **{"alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "zeta": "ζ", "eta": "η", "theta": "θ"},
    **{"iota": "ι", "kappa": "κ", "lamda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "pi": "π", "rho": "ρ", "sigma": "σ"},
    **{"tau": "τ", "upsilon": "υ", "phi": "φ", "chi": "χ", "psi": "ψ", "omega": "ω"},
    **{"Gamma": "Γ", "Delta": "Δ", "Theta": "Θ", "Lambda": "Λ", "Xi": "Ξ", "Pi": "Π", "Sigma": "Σ", "Upsilon": "Υ"},
    **{"Phi": "Φ", "Psi": "Ψ", "Omega": "Ω"},
}

#: What stands for names that Python keeps for itself.
_SHORT = {"lam": "lamda"}

#: An index that is not the number itself: i-1.
_COUNTED = re.compile(r"[ijkmn][+-]\d+\Z")

_NUMBERED = re.compile(rf"([A-Za-z]|{'|'.join(GREEK)})(\d+)\Z")


@dataclass(frozen=True, slots=True)
class Spelling:
    """letter: one letter, the name of a Greek one, or words; dots: time derivatives; indices: what stands below."""

    letter: str
    dots: int
    indices: tuple[str, ...]

    @property
    def is_words(self) -> bool:
        """Whether it is to be set upright, as words."""
        return len(self.letter) > 1 and self.letter not in GREEK


def spelling(name: str, declared: Set[str] = frozenset()) -> Spelling:
    """Read a name. `declared` names may carry dots though they are words: heavedot, where heave is declared."""
    base, *rest = (part for part in name.split("_") if part)
    stem, dots = _undotted(base, _stems(frozenset(declared)) if "dot" in base else frozenset())
    stem = _SHORT.get(stem, stem)
    if numbered := _NUMBERED.match(stem):
        return Spelling(numbered[1], dots, (numbered[2], *rest))
    words = [stem]
    if not _is_letter(stem):
        while rest and not rest[0].isdigit() and len(rest[0]) > 1 and not is_counted(rest[0]):
            words.append(rest.pop(0))
    return Spelling(" ".join(words), dots, tuple(rest))


def is_counted(index: str) -> bool:
    """Whether an index is that of what repeats, and a number added to it or taken away."""
    return bool(_COUNTED.match(index))


def alike(names: Iterable[str], declared: Set[str] = frozenset()) -> Iterator[tuple[str, str]]:
    """Pairs of different names that are read, and so typeset, alike: x1 and x_1."""
    seen: dict[Spelling, str] = {}
    for name in names:
        earlier = seen.setdefault(spelling(name, declared), name)
        if earlier != name:
            yield earlier, name


@lru_cache(maxsize=2)
def _stems(declared: frozenset[str]) -> frozenset[str]:
    return frozenset(name.partition("_")[0] for name in declared)


def _undotted(base: str, declared: Set[str]) -> tuple[str, int]:
    """Split qddot into q and 2; a word that merely ends in dot stays whole."""
    for dots in (1, 2, 3):
        ending = "d" * (dots - 1) + "dot"
        stem = base.removesuffix(ending)
        if stem and stem != base and (_is_letter(stem) or stem in declared or _NUMBERED.match(stem)):
            return stem, dots
    return base, 0


def _is_letter(word: str) -> bool:
    return len(word) == 1 or word in GREEK
