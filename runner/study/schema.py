"""What may stand in a study: the keys, their types and what they mean. A model's own names are checked by `run`."""

from typing import Literal

from pydantic import Field

from qddot.runner.study.base import Amount, Real, Table, Whole
from qddot.runner.study.batch_schema import MetricTable, OutputTable, SweepTable
from qddot.runner.study.input_kinds import InputKind
from qddot.runner.study.road_kinds import RoadKind


class AnyMethod(Table):
    """Options that every method takes; they are those of `runner.options.Options`."""

    output_times: tuple[Amount, ...] | None = None
    time_limit: Amount | None = None
    switching: str | None = None


class ConstantStep(AnyMethod):
    """Options of methods of constant step, and of the exact one, whose saved points they space."""

    step: Amount | None = None
    every: Whole | None = None


class VariableStep(AnyMethod):
    """Options of methods that choose their steps."""

    rtol: Real | None = None
    atol: Real | None = None
    max_step: Amount | None = None
    first_step: Amount | None = None
    max_steps: Whole | None = None
    refine: Whole | None = None
    controller: str | None = None
    max_order: Whole | None = None
    bdf: bool | None = None


class Integration(ConstantStep, VariableStep):
    """How to integrate: a method, and options that it takes.

    fixed, adaptive: options of whatever method is chosen, by `--set`, by a sweep or in Python, if it is one of constant
    step (or exact), or of variable step.
    """

    method: str = "rk4"
    fixed: ConstantStep = ConstantStep()
    adaptive: VariableStep = VariableStep()


class Figure(Table):
    """Panels from top to bottom, each a list of names; `from_start` shows the change since the start of the run."""

    panels: tuple[tuple[str, ...], ...] = ()
    from_start: tuple[str, ...] = ()


class EventTable(Table):
    """What is watched for: `of`, a state or an output, crosses a level; the key is its name in the results.

    terminal: the run ends there; a number n ends it at the n-th crossing in this direction.
    """

    of: str
    level: Amount = 0.0
    direction: Literal["rising", "falling", "both"] = "both"
    terminal: bool | Whole = False


class StudyTable(Table):
    """One run of one model, or a batch of them where it has a sweep.

    model: a name, or the path of a generated module, taken from the study's folder. span: start and end, s. initial:
    the states that are not 0, or the static equilibrium; equilibrium_guess: the coordinates that are not 0 where the
    search for it starts; assemble: where the states that [initial] of a model with constraints leaves out are sought,
    those that are not 0. road: what the inputs that have a position drive over. events: what is watched for beside the
    model's own. identified: a file that `qddot identify` wrote, whose values stand where the study gives none.
    sweep, metrics, outputs: of `qddot batch`.
    """

    model: str
    span: tuple[Amount, Amount] = Field(description='start and end, such as [0, 10] or ["0 s", "10 s"]')
    title: str = Field(default="", max_length=300)
    parameter_set: str | None = None
    identified: str | None = None
    parameters: dict[str, Amount] = Field(default_factory=dict)
    inputs: dict[str, InputKind] = Field(default_factory=dict)
    road: RoadKind | None = None
    initial: Literal["equilibrium"] | dict[str, Amount] = "equilibrium"
    equilibrium_guess: dict[str, Amount] = Field(default_factory=dict)
    assemble: dict[str, Amount] = Field(default_factory=dict)
    events: dict[str, EventTable] = Field(default_factory=dict)
    integration: Integration = Integration()
    figure: Figure = Figure()
    sweep: SweepTable = SweepTable()
    metrics: dict[str, MetricTable] = Field(default_factory=dict)
    outputs: OutputTable = OutputTable()
