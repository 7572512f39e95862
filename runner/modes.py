"""Modes of vibration: the eigenvalues of a model's Jacobian at a state, read as a mechanic reads them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner import notebook
from qddot.runner.checks import finite, shown
from qddot.runner.equilibrium import rest
from qddot.runner.inputs.bind import bind
from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.inputs.signal import Signal
from qddot.runner.load import Model, Parameters, as_model
from qddot.runner.manifold import Manifold
from qddot.runner.scene.filmed_modes import FALLS, FilmedModes
from qddot.runner.sparse import LARGE, slowest, sparse_matrix
from qddot.runner.switching import sides

if TYPE_CHECKING:
    from qddot.runner.scene.animation import Animation


class ModesError(ValueError):
    """The equations cannot be linearized at the state; the message names what is not finite."""


#: Imaginary part relative to the magnitude below which an eigenvalue is real.
REAL = 1e-9
#: States of a model beyond which all modes are too many, and how many are found then.
MANY, SLOWEST = 1000, 20
#: Modes that are shown to choose from.
SHOWN = 12
#: The part of a model's states below which modes are few of many.
FEW = 0.1


@dataclass(frozen=True)
class Mode:
    """A conjugate pair of eigenvalues (oscillating) or a real one.

    natural_frequency |eigenvalue| in rad/s; damping_ratio -Re/|eigenvalue|, negative where the mode grows;
    damped_period 2 pi/|Im| in s, infinite for a real eigenvalue. participation: share of each coordinate (with its
    velocity) and each internal state, sum 1, from right and left eigenvectors, so that it does not depend on units
    (Perez-Arriaga, Verghese, Schweppe, IEEE Trans. Power App. Syst. PAS-101 (1982) 3117-3125).
    """

    eigenvalue: complex
    natural_frequency: float
    damping_ratio: float
    damped_period: float
    participation: Mapping[str, float] = field(hash=False)

    def __repr__(self) -> str:
        """Its period, frequency and damping, and who takes part."""
        period, frequency, damping = described(self)
        swings = f"damped period {period} s, " if self.oscillating else ""
        return f"<Mode: {swings}{frequency} Hz, damping ratio {damping}; {taking_part(self)}>"

    @property
    def oscillating(self) -> bool:
        """Whether the mode swings."""
        return np.isfinite(self.damped_period)

    @property
    def stable(self) -> bool:
        """Whether the mode dies away."""
        return self.eigenvalue.real < 0


class Modes(tuple[Mode, ...]):
    """Modes, slowest first; a table in a notebook and at a prompt."""

    _COLUMNS = ("damped period s", "frequency Hz", "damping ratio", "coordinates that take part")
    _filmed: FilmedModes | None = None

    def animate(self, k: int | None = None) -> "Animation":
        """Mode k, or the slowest dozen to choose from, as the model's scene about the state, to be played.

        How far a mode moves is chosen to be seen. Raises ValueError where there is no such mode, or no scene.
        """
        if self._filmed is None:
            raise ValueError("these modes know no model whose scene could be drawn; take what qddot.modes gives")
        if k is not None and (isinstance(k, bool) or not isinstance(k, int) or not 0 <= k < len(self)):
            raise ValueError(f"k is {shown(k)}, expected the number of a mode from 0 to {len(self) - 1}")
        chosen = range(len(self))[:SHOWN] if k is None else (k,)
        return self._filmed.animation({number: _motion(number, self[number]) for number in chosen})

    def _rows(self) -> list[tuple[str, ...]]:
        return [(*described(mode), taking_part(mode)) for mode in self]

    def __repr__(self) -> str:
        """A line for each mode under a heading."""
        rows = [self._COLUMNS, *self._rows()]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)

    def _repr_html_(self) -> str:
        """The same as a table, in a notebook."""
        return notebook.table("Modes", self._COLUMNS, self._rows())


def described(mode: Mode) -> tuple[str, str, str]:
    """Damped period in s ("-" where it does not swing), frequency in Hz and damping ratio as texts."""
    period = f"{mode.damped_period:.4g}" if mode.oscillating else "-"
    return period, f"{mode.natural_frequency / (2 * np.pi):.4g}", f"{mode.damping_ratio:.4g}"


def taking_part(mode: Mode) -> str:
    """The coordinates, three at most, that take part most in a mode, with their shares: `q_6 71%, q_7 24%`."""
    shares = sorted(mode.participation.items(), key=lambda item: -item[1])
    return ", ".join(f"{name} {share:.0%}" for name, share in shares[:3] if share > 0.05)


def modes(
    model: Model,
    parameters: Parameters = None,
    state: NDArray[np.float64] | None = None,
    inputs: Mapping[str, Signal | float] | None = None,
    t0: float = 0.0,
    most: int | None = None,
) -> Modes:
    """The modes at a state (n_states,), the equilibrium by default, with the inputs at t0; slowest first.

    most: so many at most; by default all, of a model of more than 1000 states the slowest 20. Where these are few of
    many they are found by a sparse solver. Of a model with constraints: those of motions that fulfil them.
    Raises EquilibriumError where there is no static state, ModesError where the equations cannot be linearized at it.
    """
    model, t0 = as_model(model), finite("t0", t0)
    c = model.constants(model.parameter_values(parameters))
    table = bind(model.tables, inputs, sides(model, c, t0, t0))
    x = rest(model, c, table, t0) if state is None else model.state(state, "state")
    u = np.zeros(max(1, len(table.first)))
    evaluate(table, reader_for(table), t0, t0, len(table.first), u)
    J = sparse_matrix(model.matrix("jacobian"), t0, x, u, c)
    if not np.isfinite(J.data).all():
        raise ModesError(_not_finite(model, J))
    most = _wanted(most, len(x))
    if most < FEW * len(x) and len(x) > LARGE and not model.tables.constraints:
        try:
            eigenvalues, right, shares = slowest(J, most)
        except ArithmeticError as error:
            raise ModesError(f"model {model.name}: the slowest {most} modes were not found: {error}") from error
    else:
        allowed = Manifold(model, c, t0, u).tangent(x) if model.tables.constraints else np.eye(len(x))
        eigenvalues, within = np.linalg.eig(allowed.T @ (J @ allowed))
        right = allowed @ within
        shares = np.abs(right * (np.linalg.pinv(within) @ allowed.T).T)
    n = model.tables.coordinates
    shares = np.concatenate([shares[:n] + shares[n : 2 * n], shares[2 * n :]]) / shares.sum(axis=0)
    names = (*model.coordinate_names, *model.state_names[2 * n :])
    modes_found = [_mode(value, shares[:, k], names) for k, value in enumerate(eigenvalues)]
    forward = [k for k, mode in enumerate(modes_found) if mode.eigenvalue.imag >= 0]
    chosen = sorted(forward, key=lambda k: modes_found[k].natural_frequency)[:most]
    result = Modes(modes_found[k] for k in chosen)
    result._filmed = FilmedModes(model, c, t0, x, u[: len(table.first)], right[:, chosen])
    return result


def _wanted(most: int | None, states: int) -> int:
    if most is None:
        return states if states <= MANY else SLOWEST
    if isinstance(most, bool) or not isinstance(most, int) or most < 1:
        raise ValueError(f"most = {most!r}, expected a number of modes, 1 or more")
    return most


def _not_finite(model: Model, J: Any) -> str:
    entries = J.tocoo()
    k = int(np.flatnonzero(~np.isfinite(entries.data))[0])
    row, column = (model.state_names[indices[k]] for indices in entries.coords)
    return (
        f"model {model.name}: the equations cannot be linearized: the derivative of the rate of {row} by {column} "
        f"is {entries.data[k]} at this state"
    )


def _motion(number: int, mode: Mode) -> tuple[str, float, bool]:
    """Name, period in s and whether it swings, as `FilmedModes` takes them."""
    rate = abs(mode.eigenvalue.real) or 1.0
    period = mode.damped_period if mode.oscillating else FALLS / rate
    called = f"{mode.damped_period:.3g} s" if mode.oscillating else f"no swing, {1 / rate:.3g} s"
    return f"{number + 1}: {called}, {taking_part(mode)}", period, mode.oscillating


def _mode(value: complex, shares: NDArray[np.float64], names: tuple[str, ...]) -> Mode:
    size = abs(value)
    real = abs(value.imag) <= REAL * size
    return Mode(
        eigenvalue=complex(value.real, 0.0) if real else complex(value),
        natural_frequency=float(size),
        damping_ratio=float(-value.real / size) if size else 0.0,
        damped_period=float(np.inf if real else 2 * np.pi / abs(value.imag)),
        participation=dict(zip(names, map(float, shares), strict=True)),
    )
