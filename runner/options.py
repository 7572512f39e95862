"""How a run is to be integrated: every option of every family of methods, checked when it is given.

The fields of `Options` are the one table of options: what each is by default, its unit, which methods take it, also in
many runs at once, and whether a study may give it. `TABLE` holds it by name; `takers` says which a method takes.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner.checks import MOST_WHOLE, flag, numbers, positive, shown, whole

#: Of the numerical differentiation formulas.
MOST_ORDER = 5
#: What is done about conditions in the state: located, or stepped over.
LOCATE, IGNORE = "locate", "ignore"
#: Points of one step.
MOST_REFINE = 1000
#: Families of methods.
EVERY_FAMILY = ("fixed", "adaptive", "stiff", "exact", "taylor", "auto")
SPACED, CONTROLLED = ("fixed", "exact"), ("adaptive", "stiff", "taylor", "auto")


@dataclass(frozen=True)
class Option:
    """What is known of an option: its default and its unit; takers: families of methods, or methods, that take it.

    many: those among them that take it in many runs at once, see `simulate_batch`. sampled: whether it says what to
    save and tell, which is the batch's own there. study: whether it may stand in a study.
    """

    name: str
    default: Any
    unit: str
    takers: tuple[str, ...]
    many: tuple[str, ...]
    sampled: bool
    study: bool


def _said(
    *takers: str,
    default: Any = None,
    unit: str = "",
    many: tuple[str, ...] = (),
    sampled: bool = False,
    study: bool = True,
) -> dict[str, Any]:
    """What the table says of an option; its field is None where it is not given."""
    return {"default": default, "unit": unit, "takers": takers, "many": many, "sampled": sampled, "study": study}


@dataclass(frozen=True, eq=False)
class Options:
    """Options of an integration: those that are given, None for others. `takers.fitted` makes them those of a method.

    step: step size in s (required of fixed-step methods); the spacing of saved points of the exact method.
    output_times: times (n,), in the order of the run, at which to save; start and end are always saved.
    every: save every so many grid steps instead; about 5000 points by default.
    progress: called with the fraction done, 0 to 1. time_limit: seconds of wall time.
    divergence_limit: a state of this magnitude counts as diverged, even though still finite; 1e100.
    rtol, atol: error tolerances of adaptive methods, each a scalar or one per state (n_states,); 1e-3 and 1e-6.
    max_step, first_step: in s. max_steps: accepted steps. refine: points saved per step by dense output.
    events: see `events`. controller: step-size controller of an adaptive method; the method's own by default.
    switching: "locate", conditions in the state are held on a side during a step, which ends where one leaves it; or
    "ignore". Adaptive methods locate by default, those of constant step ignore.
    max_order (5), bdf (False): of the numerical differentiation formulas (ode15s).
    Raises ValueError naming the option, what was found and what was expected.
    """

    step: float | None = field(default=None, metadata=_said(*SPACED, unit="s", many=("fixed",)))
    output_times: Any = field(default=None, metadata=_said(*EVERY_FAMILY, unit="s", sampled=True))
    every: int | None = field(default=None, metadata=_said(*SPACED, sampled=True))
    progress: Callable[[float], None] | None = field(
        default=None, metadata=_said(*EVERY_FAMILY, sampled=True, study=False)
    )
    time_limit: float | None = field(default=None, metadata=_said(*EVERY_FAMILY, unit="s"))
    divergence_limit: Any = field(
        default=None, metadata=_said(*EVERY_FAMILY, default=1e100, many=EVERY_FAMILY, study=False)
    )
    rtol: Any = field(default=None, metadata=_said(*CONTROLLED, default=1e-3, many=CONTROLLED))
    atol: Any = field(default=None, metadata=_said(*CONTROLLED, default=1e-6, many=CONTROLLED))
    max_step: float | None = field(default=None, metadata=_said(*CONTROLLED, unit="s", many=CONTROLLED))
    first_step: float | None = field(default=None, metadata=_said(*CONTROLLED, unit="s", many=CONTROLLED))
    max_steps: int | None = field(default=None, metadata=_said(*CONTROLLED, many=CONTROLLED))
    refine: int | None = field(default=None, metadata=_said(*CONTROLLED, sampled=True))
    events: Any = field(default=None, metadata=_said(*EVERY_FAMILY, default=(), study=False))
    controller: str | None = field(default=None, metadata=_said("adaptive", "rodas5p"))
    switching: str | None = field(default=None, metadata=_said("fixed", "adaptive", "stiff", "auto"))
    max_order: Any = field(default=None, metadata=_said("ode15s", default=MOST_ORDER))
    bdf: Any = field(default=None, metadata=_said("ode15s", default=False))

    def __repr__(self) -> str:
        """Those that are given."""
        given = ((each.name, getattr(self, each.name)) for each in fields(self))
        return f"Options({', '.join(f'{name}={value!r}' for name, value in given if value is not None)})"

    def __post_init__(self) -> None:
        """Check each value; arrays become read-only float64."""
        for name in ("divergence_limit", *(name for name in TIMES if name != "output_times")):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name))
        for name, most in (("every", MOST_WHOLE), ("max_steps", MOST_WHOLE), ("refine", MOST_REFINE)):
            if getattr(self, name) is not None:
                whole(name, getattr(self, name), most=most)
        if self.max_order is not None and not 1 <= whole("max_order", self.max_order) <= MOST_ORDER:
            raise ValueError(f"max_order is {self.max_order!r}, expected an order from 1 to {MOST_ORDER}")
        if self.bdf is not None:
            flag("bdf", self.bdf)
        if not (self.controller is None or isinstance(self.controller, str)):
            raise ValueError(f"controller is {shown(self.controller)}, expected the name of one")
        if self.switching is not None and self.switching not in (LOCATE, IGNORE):
            raise ValueError(f"switching is {shown(self.switching)}, expected {LOCATE!r} or {IGNORE!r}")
        if not (self.progress is None or callable(self.progress)):
            raise ValueError(f"progress is {shown(self.progress)}, expected a function of the fraction done")
        self._check_tolerances()
        self._check_saving()
        if self.events is not None:
            if isinstance(self.events, str | Mapping) or not isinstance(self.events, Iterable):
                raise ValueError(f"events is {shown(self.events)}, expected a list of events, see qddot.crossing")
            object.__setattr__(self, "events", tuple(self.events))

    def __reduce__(self) -> tuple[Any, ...]:
        """Unpickled options are checked again, and their arrays read-only."""
        return Options, tuple(getattr(self, each.name) for each in fields(self))

    @property
    def least_rtol(self) -> float:
        """The relative tolerance, the least where states have their own."""
        return float(np.min(self.rtol))

    @cached_property
    def tolerance_metadata(self) -> dict[str, str | float]:
        """The tolerances as a solution's metadata have them."""
        rtol = self.least_rtol if np.ndim(self.rtol) == 0 else ", ".join(f"{r:g}" for r in self.rtol)
        return {"rtol": rtol, "atol": ", ".join(f"{a:g}" for a in np.atleast_1d(self.atol))}

    def tolerances(self, n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The relative and absolute tolerances of n states, each (n,); ValueError naming one of another length."""
        found = []
        for name in ("rtol", "atol"):
            given = getattr(self, name)
            value = np.asarray(TABLE[name].default if given is None else given, dtype=np.float64)
            if value.ndim == 1 and len(value) != n:
                raise ValueError(f"{name} has {len(value)} entries, expected one number or one for each of {n} states")
            found.append(np.full(n, value))
        return found[0], found[1]

    def _check_saving(self) -> None:
        if self.output_times is not None:
            self._freeze("output_times", _rising_times(self.output_times))
            for name in ("every", "refine"):
                if getattr(self, name) is not None:
                    raise ValueError(f"output_times and {name} are both given; give the one that says what to save")

    def _check_tolerances(self) -> None:
        if self.rtol is not None:
            rtol = numbers("rtol", self.rtol, "a number between 0 and 1, or one for each state")
            if rtol.ndim > 1 or not rtol.size or not ((rtol > 0) & (rtol < 1)).all():
                raise ValueError(f"rtol is {shown(self.rtol)}, expected a number between 0 and 1, such as 1e-6")
            if rtol.ndim == 1:
                self._freeze("rtol", rtol)
        if self.atol is not None:
            atol = numbers("atol", self.atol, "a number >= 0 or one for each state")
            self._freeze("atol", atol)
            if not (np.isfinite(atol) & (atol >= 0)).all() or atol.ndim > 1 or not atol.size:
                raise ValueError(f"atol is {shown(self.atol)}, expected a number >= 0 or one for each state")

    def _freeze(self, name: str, array: NDArray[np.float64]) -> None:
        array.flags.writeable = False
        object.__setattr__(self, name, array)


#: Name -> option.
TABLE: Mapping[str, Option] = {each.name: Option(each.name, **each.metadata) for each in fields(Options)}
#: Options in s; and those that some methods take in many runs at once.
TIMES = tuple(name for name, option in TABLE.items() if option.unit == "s")
MANY = tuple(name for name, option in TABLE.items() if option.many)


def _rising_times(times: ArrayLike) -> NDArray[np.float64]:
    array = numbers("output_times", times, "one row of times")
    if array.ndim != 1 or array.size == 0:
        raise ValueError(f"output_times has shape {array.shape}, expected one row of times")
    if not np.isfinite(array).all():
        raise ValueError(f"output_times[{int(np.argmin(np.isfinite(array)))}] is not finite")
    way, turns = ("fall", np.diff(array) >= 0) if array[-1] < array[0] else ("rise", np.diff(array) <= 0)
    for i in np.flatnonzero(turns)[:1]:
        raise ValueError(f"output_times must {way}: [{i + 1}] = {array[i + 1]} follows [{i}] = {array[i]}")
    return array
