"""Running a study: its words become signals, numbers and options of `simulate`."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from runner.checks import unknown
from runner.inputs.csv_table import table_from_csv
from runner.inputs.shapes import constant, pulse_train, sine
from runner.inputs.signal import Signal
from runner.inputs.tables import table
from runner.load import Model, load
from runner.simulate import simulate
from runner.solution import Solution
from runner.study.read import StudyError, place, read
from runner.study.schema import ConstantInput, PulseInput, SineInput, Study, TableInput
from runner.study.units import Amount, magnitude

Progress = Callable[[float], None]

#: Unit of each option of an integration that has one.
_TIMES = ("step", "max_step", "first_step", "time_limit")


def run_study(path: str | Path, progress: Progress | None = None, on_failure: str = "raise") -> Solution:
    """Run a study file.

    Raises StudyError for anything in the file that cannot be, and IntegrationError where the run fails on its way,
    unless on_failure is "return".
    """
    return run(read(Path(path)), Path(path), progress, on_failure)


def run(study: Study, path: Path, progress: Progress | None, on_failure: str) -> Solution:
    """Run a study that was read; `path` is the file it comes from, for messages and for the files it names."""
    reader = _Reader(path, _model(study, path))
    try:
        return simulate(
            reader.model,
            (reader.amount("span", study.span[0], "s"), reader.amount("span", study.span[1], "s")),
            parameters=(study.parameter_set, reader.parameters(study.parameters)),
            inputs={name: reader.signal(name, spec) for name, spec in study.inputs.items()},
            initial=None if study.initial == "equilibrium" else reader.initial(study.initial),
            on_failure=on_failure,
            progress=progress,
            **reader.options(study),
        )
    except StudyError:
        raise
    except ValueError as error:
        text = str(error)
        raise StudyError(text if text.startswith(str(path)) else f"{path}: {text}") from error


def _model(study: Study, path: Path) -> Model:
    """A generated module named by a path is looked for beside the study."""
    own = study.model.endswith(".py") or "/" in study.model
    try:
        return load(path.parent / study.model if own else study.model)
    except ValueError as error:
        raise StudyError(f"{place(path, 'model')}: {error}") from error


class _Reader:
    """Turns the values of one study into those of one model, naming the place of each in errors."""

    def __init__(self, path: Path, model: Model) -> None:
        self.path = path
        self.model = model

    def amount(self, key: str, value: Amount, unit: str) -> float:
        return magnitude(place(self.path, key), value, unit)

    def parameters(self, values: Mapping[str, Amount]) -> dict[str, float]:
        units = {parameter.name: parameter.unit for parameter in self.model.tables.parameters}
        return self._named("parameters", "parameter", values, units)

    def initial(self, values: Mapping[str, Amount]) -> dict[str, float]:
        units = {state.name: state.unit for state in self.model.tables.states}
        return self._named("initial", "state", values, units)

    def _named(self, table: str, kind: str, values: Mapping[str, Amount], units: Mapping[str, str]) -> dict[str, float]:
        for name in values:
            if name not in units:
                raise StudyError(f"{place(self.path, f'{table}.{name}')}: {unknown(kind, name, units)}")
        return {name: self.amount(f"{table}.{name}", value, units[name]) for name, value in values.items()}

    def options(self, study: Study) -> dict[str, Any]:
        options = study.integration.model_dump(exclude_none=True)
        for name in _TIMES:
            if name in options:
                options[name] = self.amount(f"integration.{name}", options[name], "s")
        if "output_times" in options:
            options["output_times"] = [self.amount("integration.output_times", t, "s") for t in options["output_times"]]
        return options

    def signal(self, name: str, spec: ConstantInput | SineInput | PulseInput | TableInput) -> Signal:
        units = {channel.name: channel.unit for channel in self.model.tables.inputs if not channel.rate_of}
        key = f"inputs.{name}"
        if name not in units:
            raise StudyError(f"{place(self.path, key)}: {unknown('input', name, units)}")
        build = {"constant": self._constant, "sine": self._sine, "pulse_train": self._pulses, "table": self._table}
        try:
            return build[spec.kind](key, spec, units[name])
        except StudyError:
            raise
        except (ValueError, OSError) as error:
            text = str(error)
            raise StudyError(text if text.startswith(str(self.path)) else f"{place(self.path, key)}: {text}") from error

    def _constant(self, key: str, spec: Any, unit: str) -> Signal:
        return constant(self.amount(f"{key}.value", spec.value, unit))

    def _sine(self, key: str, spec: Any, unit: str) -> Signal:
        units = {"amplitude": unit, "frequency": "Hz", "phase": "rad", "mean": unit}
        return sine(**{field: self.amount(f"{key}.{field}", getattr(spec, field), u) for field, u in units.items()})

    def _pulses(self, key: str, spec: Any, unit: str) -> Signal:
        times = [self.amount(f"{key}.times", t, "s") for t in spec.times]
        units = {"peak": unit, "duration": "s", "impulse": f"{unit} * s"}
        given = {field: u for field, u in units.items() if getattr(spec, field) is not None}
        sizes = {field: self.amount(f"{key}.{field}", getattr(spec, field), u) for field, u in given.items()}
        return pulse_train(spec.shape, times=times, rise=spec.rise, **sizes)

    def _table(self, key: str, spec: Any, unit: str) -> Signal:
        inline = spec.t is not None and spec.values is not None
        if inline == (spec.file is not None):
            raise StudyError(f"{place(self.path, key)}: give either file, or t and values")
        if inline:
            return table(spec.t, spec.values, spec.interpolation)
        file = self.path.parent / spec.file
        if not file.is_file():
            raise StudyError(f"{place(self.path, f'{key}.file')}: there is no file {file}")
        columns = {field: getattr(spec, field) for field in ("time", "value", "time_unit", "value_unit")}
        return table_from_csv(file, kind=spec.interpolation, unit=unit, **columns)
