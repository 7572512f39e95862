"""The kinds of inputs in a study, `[inputs.NAME]`: keys, types, meaning.

Those that are a formula, and the shapes of pulses, stand in `inputs.shapes`, and nowhere else.
"""

from typing import TYPE_CHECKING, Annotated, Any, Literal, Union

from pydantic import Field

from qddot.runner.inputs import shapes
from qddot.runner.inputs.formulas import formulas
from qddot.runner.study.base import Amount, Real, Table, Whole
from qddot.runner.study.formula_kinds import tables_of


class Input(Table):
    """What an input is over time."""


class Pulses(Table):
    """When pulses come, and how large they are.

    Either times, or count with interval or rate_of_fire (rounds per minute) from start. Any two of peak, duration and
    impulse; shell_mass and muzzle_velocity, with charge_mass where it is known, stand for the impulse.
    """

    times: tuple[Amount, ...] | None = None
    count: Whole | None = None
    interval: Amount | None = None
    rate_of_fire: Amount | None = None
    start: Amount = 0.0
    peak: Amount | None = None
    duration: Amount | None = None
    impulse: Amount | None = None
    shell_mass: Amount | None = None
    muzzle_velocity: Amount | None = None
    charge_mass: Amount | None = None
    gas_velocity_factor: Real | None = None


class PulseInput(Pulses):
    """Equal pulses of a shape: any two of peak, duration and impulse; rise is the part each ramp of a trapezoid takes.

    Either times, or count with interval or rate_of_fire (rounds per minute) from start. shell_mass and muzzle_velocity,
    with charge_mass where it is known, stand for the impulse.
    """

    kind: Literal["pulse_train"]
    shape: Literal[*shapes.SHAPES] = "half_sine"  # type: ignore[valid-type]
    rise: Real = 0.25


class Samples(Table):
    """Where samples stand: two columns of a CSV file, with their units; resample is a spacing, none by default."""

    file: str | None = None
    time: str | Whole = 0
    value: str | Whole = 1
    time_unit: str | None = None
    value_unit: str | None = None
    resample: Amount | None = None
    interpolation: Literal["linear", "cubic"] = "linear"


class TableInput(Samples):
    """Samples: two columns of a CSV file, or t and values here; joined by lines or a cubic spline.

    smooth: a width; lines are read as their mean over it, which has no kinks, as a prescribed motion wants it.
    """

    kind: Literal["table"]
    t: tuple[Real, ...] | None = None
    values: tuple[Real, ...] | None = None
    smooth: Amount | None = None


class MeasuredPulseInput(Pulses, Samples):
    """A measured pulse, from a CSV file or from t and values here, repeated at the times of the shots.

    At most two of peak, duration and impulse stretch it; without, it stays as measured. The rest as of a pulse train.
    """

    kind: Literal["measured_pulse_train"]
    t: tuple[Real, ...] | None = None
    values: tuple[Real, ...] | None = None


#: The kinds that are a formula, by name.
FORMULAS = formulas(shapes)

if TYPE_CHECKING:
    InputKind = Any
else:
    InputKind = Annotated[
        Union[*tables_of(FORMULAS, Input), PulseInput, TableInput, MeasuredPulseInput], Field(discriminator="kind")
    ]
