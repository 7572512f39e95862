"""What a batch adds to a study: [sweep], what is varied; [metrics], what is measured; [outputs], what is kept."""

from typing import Any, Literal

from pydantic import Field

from qddot.runner.study.base import Amount, Real, Table, Whole


class AxisTable(Table):
    """One thing that is varied: its key and one way to give its values.

    key: dotted, "parameters.m_6", "inputs.F.peak", "inputs.F.times.1"; several keys get the same value. name: of the
    coordinate in the results. unit: of plain numbers. zip: axes with the same word advance together.
    offset, factor: what stands in the study is offset + factor * value, in the axis's unit.
    values: a list of anything that may stand there, with `labels` for the results; linspace, logspace: first, last and
    count; range: whole numbers from the first up to, without, the last. Sampled, one value a run: uniform, loguniform:
    low, high; normal: mean, standard deviation; integers: low, and high, which is left out.
    """

    key: str | tuple[str, ...]
    name: str | None = None
    unit: str | None = None
    zip: str | None = None
    offset: Amount = 0.0
    factor: Real = 1.0
    values: tuple[Any, ...] | None = None
    labels: tuple[str, ...] | None = None
    linspace: tuple[Amount, Amount, Whole] | None = None
    logspace: tuple[Amount, Amount, Whole] | None = None
    range: tuple[Whole, Whole] | None = None
    uniform: tuple[Amount, Amount] | None = None
    loguniform: tuple[Amount, Amount] | None = None
    normal: tuple[Amount, Amount] | None = None
    integers: tuple[Whole, Whole] | None = None


class SweepTable(Table):
    """The runs of a batch: all combinations of the axes; axes of one `zip` count as one, so do all sampled axes.

    samples, sampling, seed: how many points the sampled axes take, and how they are spread. block: runs computed and
    written together; chosen by the size of their outputs where it is not given.
    """

    axes: tuple[AxisTable, ...] = Field(default=(), max_length=1000)
    samples: Whole | None = None
    sampling: Literal["random", "latin_hypercube", "sobol", "halton"] = "random"
    seed: Whole = 0
    block: Whole | None = None


class MetricTable(Table):
    """One number a run: `kind` of the quantity `of`, see `qddot list metrics`.

    after, before: only this part of the run, s. change: of the quantity minus its value at the start of the run.
    level: of crossings and of the time below it. band: of the settling time, half its width. weighting: Wk, Wd or Wf of
    ISO 2631-1. static: tyre load at rest, the value at the start of the run by default. fraction: of the static value.
    better: whether the least or the greatest value is the best.
    """

    kind: str
    of: str | None = None
    after: Amount | None = None
    before: Amount | None = None
    change: bool = False
    level: Amount | None = None
    band: Amount | None = None
    weighting: Literal["Wk", "Wd", "Wf"] | None = None
    static: Amount | None = None
    fraction: Real | None = None
    better: Literal["less", "more"] = "less"


class OutputTable(Table):
    """What is sampled and kept: interval, s, of the uniform samples from which metrics are computed.

    keep: names of states, outputs and inputs whose trajectories are kept, one sample in `every`.
    """

    interval: Amount | None = None
    keep: tuple[str, ...] = ()
    every: Whole = 1
