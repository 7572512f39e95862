"""What a study wants measured and kept, checked against its model."""

from pathlib import Path

from qddot.runner.checks import unknown
from qddot.runner.load import Model
from qddot.runner.metrics.measure import Request, quantity_of
from qddot.runner.observe import observable
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.batch_schema import MetricTable
from qddot.runner.study.schema import StudyTable
from qddot.runner.study.sweep import RESERVED, Sweep


def request_of(path: Path, name: str, table: MetricTable, model: Model) -> Request:
    """The metric in the model's units. Raises ValueError that begins with the key it is about."""
    said = table.model_dump(exclude={"better"})
    of = quantity_of(name, Request(table.kind, table.of))
    units = {quantity.name: quantity.unit for quantity in observable(model)}
    if of not in units:
        raise ValueError(f"metrics.{name}.of: {unknown('quantity', of, units)}")
    for key in ("after", "before", "level", "band", "static"):
        if said[key] is not None:
            unit = "s" if key in ("after", "before") else units[of]
            said[key] = Amounts(path)(f"metrics.{name}.{key}", said[key], unit)
    return Request(**said)


def check_outputs(study: StudyTable, sweep: Sweep, model: Model) -> None:
    """Whether quantities that are kept exist, and names in the results are different. Raises ValueError."""
    names = [quantity.name for quantity in observable(model)]
    for i, name in enumerate(study.outputs.keep):
        if name not in names:
            raise ValueError(f"outputs.keep.{i}: {unknown('quantity', name, names)}")
        if name in RESERVED:
            raise ValueError(f"outputs.keep.{i}: the results call something else {name!r}; rename it in the model")
        if name in study.outputs.keep[:i]:
            raise ValueError(f"outputs.keep.{i}: {name!r} stands twice")
    if study.outputs.every < 1:
        raise ValueError(f"outputs.every: {study.outputs.every}; expected a number of samples, at least 1")
    if study.outputs.model_fields_set & {"every", "keep"} == {"every"}:
        raise ValueError("outputs.every: nothing is kept of which it could be one sample in so many; leave it out")
    taken = {"axis": [axis.name for axis in sweep.axes], "kept quantity": list(study.outputs.keep)}
    for name in study.metrics:
        found = [kind for kind, each in taken.items() if name in each]
        if found or name in RESERVED or "/" in name or not name:
            raise ValueError(
                f"metrics.{name}: the results call {found[0] if found else 'something else'} so; rename it"
            )
    for name in taken["axis"]:
        if name in study.outputs.keep:
            raise ValueError(f"outputs.keep: an axis of the sweep is called {name!r}, too; give it another name")
    if not study.metrics and not study.outputs.keep:
        raise ValueError("metrics: there is nothing to measure; add [metrics], or [outputs] with keep")
