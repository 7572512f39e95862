"""The equations of a model as a document: symbols with units and meanings, and formulas made of signed terms.

It knows no layout and no script; `tex`, `page` and `terminal` write it down, what `notation` made of a model.
"""

from collections.abc import Mapping, Set
from dataclasses import dataclass

from qddot.codegen.cells import LEAST
from qddot.codegen.equations.entries import Entry, ParameterEntry
from qddot.codegen.equations.phrases import Formula, Indexed, Sum, alone


@dataclass(frozen=True, slots=True)
class Occurrence:
    """An event: what it is, what vanishes where it happens, and what states are behind it, made of those before it."""

    heading: str
    formulas: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class MassMatrix:
    """The entries (k, j) with k >= j that do not vanish by structure; kind as in `Equations.mass_matrix`.

    left_out: rows that are not here.
    """

    size: int
    kind: str
    entries: Mapping[tuple[int, int], Sum]
    left_out: int = 0

    @property
    def is_diagonal(self) -> bool:
        """Whether all entries are on the diagonal."""
        return all(k == j for k, j in self.entries)

    @property
    def multiple(self) -> Sum | None:
        """What stands on the diagonal of a large matrix that is a multiple of the identity."""
        alike = self.is_diagonal and self.size >= LEAST and len(set(self.entries.values())) == 1
        return self.entries[0, 0] if alike else None

    def entry(self, k: int, j: int) -> Sum:
        """Any entry of the symmetric matrix; an empty sum where it vanishes."""
        return self.entries.get((max(k, j), min(k, j)), Sum(()))

    @property
    def formulas(self) -> tuple[Formula, ...]:
        """The entries one by one, row by row."""
        return tuple(
            Formula(alone(Indexed("M", (k + 1, j + 1))), entry) for (k, j), entry in sorted(self.entries.items())
        )


@dataclass(frozen=True, slots=True)
class Document:
    """What a reader is told of a model.

    definitions: of the quantities, each one's rate behind it; energies: T, Pi, Phi; forces: Q of each coordinate that
    has one; motion: one per coordinate, in order, M qddot + gyroscopic terms + dPi/dq + dPhi/dqdot + G' lambda = Q;
    of large models only the first, and of M their rows, left_out more; subjects: what each is of, where cells of the
    model are alike all of them at once; state_motion: one per internal state, zdot = derivative; state_subjects: what
    each of these is of, where `states` has one line for many.
    multipliers: of the constraints, and constraints what vanishes, in the same order.
    is_generalized: Pi depends on velocities, so that L = T - Pi takes the place of T and Pi in Lagrange's equations.
    dotted: the words that may carry dots.
    """

    name: str
    title: str
    source: str
    coordinates: tuple[Entry, ...]
    states: tuple[Entry, ...]
    parameters: tuple[ParameterEntry, ...]
    parameter_sets: tuple[str, ...]
    inputs: tuple[Entry, ...]
    quantities: tuple[Entry, ...]
    tables: tuple[Entry, ...]
    outputs: tuple[Entry, ...]
    definitions: tuple[Formula, ...]
    energies: tuple[Formula, ...]
    forces: tuple[Formula, ...]
    multipliers: tuple[Entry, ...]
    constraints: tuple[Formula, ...]
    events: tuple[Occurrence, ...]
    subjects: tuple[Entry, ...]
    motion: tuple[Formula, ...]
    left_out: int
    state_subjects: tuple[Entry, ...]
    state_motion: tuple[Formula, ...]
    mass: MassMatrix
    output_definitions: tuple[Formula, ...]
    is_generalized: bool
    dotted: Set[str]

    @property
    def equations(self) -> tuple[tuple[Entry, Formula], ...]:
        """What each equation is of, with the equation: of the coordinates, then of the states."""
        entries, formulas = (*self.subjects, *self.state_subjects), (*self.motion, *self.state_motion)
        return tuple(zip(entries, formulas, strict=True))
