"""The kinds of roads in a study, `[road]`: keys, types, meaning. Every input that has a position reads the road.

Those that are a formula stand in `inputs.roads`, and nowhere else.
"""

from typing import TYPE_CHECKING, Annotated, Any, Literal, Union

from pydantic import Field

from qddot.runner.inputs import roads
from qddot.runner.inputs.formulas import formulas
from qddot.runner.study.base import Amount, Real, Table, Whole
from qddot.runner.study.formula_kinds import tables_of


class SpeedProfile(Table):
    """Speed over time: t and v here, or two columns of a CSV file; straight lines between, the ends hold outside."""

    t: tuple[Amount, ...] | None = None
    v: tuple[Amount, ...] | None = None
    file: str | None = None
    time: str | Whole = 0
    speed: str | Whole = 1
    time_unit: str | None = None
    speed_unit: str | None = None


class Road(Table):
    """How a road is driven on: at a speed or a speed_profile, from `start`, where the model's origin is at t = 0.

    positions: m ahead of the model's origin, for inputs of which the model itself does not say it.
    """

    speed: Amount | None = None
    speed_profile: SpeedProfile | None = None
    start: Amount = 0.0
    positions: dict[str, Amount] = Field(default_factory=dict)


class ProfileRoad(Road):
    """A measured profile: distance and height from two columns of a CSV file, or x and z here; level at both ends."""

    kind: Literal["profile"]
    file: str | None = None
    distance: str | Whole = 0
    height: str | Whole = 1
    distance_unit: str | None = None
    height_unit: str | None = None
    resample: Amount | None = None
    x: tuple[Amount, ...] | None = None
    z: tuple[Amount, ...] | None = None
    interpolation: Literal["linear", "cubic"] = "linear"


class RandomRoad(Road):
    """A random road after ISO 8608: roughness is a class "A" to "H" or Gd(n0) in m^3, waviness the exponent.

    shortest and longest are its wavelengths; it grows from level ground over the distance `fade`.
    """

    kind: Literal["iso8608"]
    roughness: Amount
    seed: Whole
    length: Amount = 200.0
    waviness: Real = 2.0
    shortest: Amount | None = None
    longest: Amount | None = None
    fade: Amount = 0.0


#: The kinds that are a formula, by name.
FORMULAS = formulas(roads)

if TYPE_CHECKING:
    RoadKind = Any
else:
    RoadKind = Annotated[Union[ProfileRoad, *tables_of(FORMULAS, Road), RandomRoad], Field(discriminator="kind")]
