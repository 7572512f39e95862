"""What may stand in a study: the keys, their types and what they mean. A model's own names are checked by `run`."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from runner.study.units import Amount


class Table(BaseModel):
    """A TOML table in which every key is known."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class ConstantInput(Table):
    """The same value for ever."""

    kind: Literal["constant"]
    value: Amount


class SineInput(Table):
    """mean + amplitude*sin(2 pi frequency t + phase); frequency in Hz, phase in rad."""

    kind: Literal["sine"]
    amplitude: Amount
    frequency: Amount
    phase: Amount = 0.0
    mean: Amount = 0.0


class PulseInput(Table):
    """Equal pulses at given times: any two of peak, duration and impulse; rise is the part each ramp takes."""

    kind: Literal["pulse_train"]
    times: tuple[Amount, ...]
    shape: Literal["half_sine", "triangle", "trapezoid"] = "half_sine"
    peak: Amount | None = None
    duration: Amount | None = None
    impulse: Amount | None = None
    rise: float = 0.25


class TableInput(Table):
    """Samples: two columns of a CSV file, or t and values here; joined by lines or a cubic spline."""

    kind: Literal["table"]
    file: str | None = None
    time: str | int = 0
    value: str | int = 1
    time_unit: str | None = None
    value_unit: str | None = None
    t: tuple[float, ...] | None = None
    values: tuple[float, ...] | None = None
    interpolation: Literal["linear", "cubic"] = "linear"


InputTable = Annotated[ConstantInput | SineInput | PulseInput | TableInput, Field(discriminator="kind")]


class Integration(Table):
    """How to integrate; the options are those of `runner.options.Options`."""

    method: str = "rk4"
    step: Amount | None = None
    every: int | None = None
    output_times: tuple[Amount, ...] | None = None
    rtol: float | None = None
    atol: float | None = None
    max_step: Amount | None = None
    first_step: Amount | None = None
    max_steps: int | None = None
    refine: int | None = None
    controller: str | None = None
    max_order: int | None = None
    bdf: bool | None = None
    time_limit: Amount | None = None


class Figure(Table):
    """Panels from top to bottom, each a list of names; `from_start` shows the change since the start of the run."""

    panels: tuple[tuple[str, ...], ...] = ()
    from_start: tuple[str, ...] = ()


class Study(Table):
    """One run of one model.

    model: a name, or the path of a generated module, taken from the study's folder. span: start and end, s. initial:
    the states that are not 0, or the static equilibrium.
    """

    model: str
    span: tuple[Amount, Amount]
    title: str = ""
    parameter_set: str | None = None
    parameters: dict[str, Amount] = Field(default_factory=dict)
    inputs: dict[str, InputTable] = Field(default_factory=dict)
    initial: Literal["equilibrium"] | dict[str, Amount] = "equilibrium"
    integration: Integration = Integration()
    figure: Figure = Figure()
