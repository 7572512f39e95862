"""qddot: from T, Π, Φ and Q in SymPy to a compiled simulation.

    import qddot
    model = qddot.load("m113")
    shot = qddot.signal.pulse_train(times=[1.0], duration=0.1, impulse=605.0)
    solution = qddot.simulate(model, (0, 10), method="rk4", step=1e-4, parameters="as_run_unloaded", inputs={"F": shot})
    solution["q_6"], solution.t, solution.statistics

Contents
    models     model: what a model file is written with (System, Coordinate, Parameter, ...), in `qddot.model`
               generate: a System -> kernels and equations; load -> Model
    inputs     signal: constant, sine, table, pulse_train, measured_pulse_train, ... -> Signal
               road: step, ramp, sine, cosine_bump, pothole, iso8608 -> Signal; drive: a road under every axle
    one run    simulate -> Solution; prepare -> Simulation, run as often as wanted; solve: any compiled right-hand side
               Options: of an integration; crossing -> Event
               methods: all integration methods by name
    many runs  simulate_batch -> Batch; per_run: an input that differs from run to run
    analysis   equilibrium, modes; assemble: a state that fulfils the constraints of a model
               reading: a number of a run, such as its greatest value; metric: the same numbers as of a batch
    studies    read_study -> Study, run as it stands or with some of it exchanged; run_study, run_batch, open_batch
               toml: TOML files of one's own, read as strictly as studies
    results    report: a progress bar, tables, an HTML page, PDF; drawing: figures
    failures   ModelError, LoadError, StudyError, StoreError: given wrongly; IntegrationError, EquilibriumError,
               AssemblyError, ModesError

Everything is imported when it is first used, so that `qddot --help` costs nothing.
"""

import sys
import warnings
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from qddot import drawing, report, road, signal, toml
    from qddot.codegen.generate import generate
    from qddot.model.system import ModelError
    from qddot.runner.assembly import AssemblyError, assemble
    from qddot.runner.batch.grid import open_batch
    from qddot.runner.batch.run import run_batch
    from qddot.runner.batch.store import StoreError
    from qddot.runner.equilibrium import EquilibriumError, equilibrium
    from qddot.runner.frame.events import Event
    from qddot.runner.inputs.drive import drive
    from qddot.runner.inputs.signal import Signal
    from qddot.runner.lanes.batch import Batch, simulate_batch
    from qddot.runner.lanes.signals import per_run
    from qddot.runner.load import LoadError, Model, load
    from qddot.runner.methods import methods
    from qddot.runner.metrics.of_run import metric
    from qddot.runner.metrics.reading import reading
    from qddot.runner.modes import ModesError, modes
    from qddot.runner.options import Options
    from qddot.runner.simulate import IntegrationError, Simulation, crossing, prepare, simulate
    from qddot.runner.solution import Solution
    from qddot.runner.solve import solve
    from qddot.runner.study.read import StudyError
    from qddot.runner.study.ready import Study, read_study, run_study

    __version__: str

__all__ = [
    "AssemblyError",
    "Batch",
    "EquilibriumError",
    "Event",
    "IntegrationError",
    "LoadError",
    "Model",
    "ModelError",
    "ModesError",
    "Options",
    "Signal",
    "Simulation",
    "Solution",
    "StoreError",
    "Study",
    "StudyError",
    "assemble",
    "crossing",
    "drawing",
    "drive",
    "equilibrium",
    "generate",
    "load",
    "methods",
    "metric",
    "modes",
    "open_batch",
    "per_run",
    "prepare",
    "read_study",
    "reading",
    "report",
    "road",
    "run_batch",
    "run_study",
    "signal",
    "simulate",
    "simulate_batch",
    "solve",
    "toml",
]

#: The module of each public name: what the imports above say to a type checker.
_HOMES = {
    "AssemblyError": "qddot.runner.assembly",
    "Batch": "qddot.runner.lanes.batch",
    "EquilibriumError": "qddot.runner.equilibrium",
    "Event": "qddot.runner.frame.events",
    "IntegrationError": "qddot.runner.simulate",
    "LoadError": "qddot.runner.load",
    "Model": "qddot.runner.load",
    "ModelError": "qddot.model.system",
    "ModesError": "qddot.runner.modes",
    "Options": "qddot.runner.options",
    "Signal": "qddot.runner.inputs.signal",
    "Simulation": "qddot.runner.simulate",
    "Solution": "qddot.runner.solution",
    "StoreError": "qddot.runner.batch.store",
    "Study": "qddot.runner.study.ready",
    "StudyError": "qddot.runner.study.read",
    "assemble": "qddot.runner.assembly",
    "crossing": "qddot.runner.simulate",
    "drive": "qddot.runner.inputs.drive",
    "equilibrium": "qddot.runner.equilibrium",
    "generate": "qddot.codegen.generate",
    "load": "qddot.runner.load",
    "methods": "qddot.runner.methods",
    "metric": "qddot.runner.metrics.of_run",
    "modes": "qddot.runner.modes",
    "open_batch": "qddot.runner.batch.grid",
    "per_run": "qddot.runner.lanes.signals",
    "prepare": "qddot.runner.simulate",
    "read_study": "qddot.runner.study.ready",
    "reading": "qddot.runner.metrics.reading",
    "run_batch": "qddot.runner.batch.run",
    "run_study": "qddot.runner.study.ready",
    "simulate": "qddot.runner.simulate",
    "simulate_batch": "qddot.runner.lanes.batch",
    "solve": "qddot.runner.solve",
}
#: Modules of public names.
NAMESPACES = ("drawing", "report", "road", "signal", "toml")
#: Names of version 0.1, which go with version 0.3.
_MOVED = {
    "constant": "signal.constant",
    "cosine_bump": "road.cosine_bump",
    "measured_pulse_train": "signal.measured_pulse_train",
    "pothole": "road.pothole",
    "pulse_train": "signal.pulse_train",
    "ramp": "road.ramp",
    "random_road": "road.iso8608",
    "recoil_impulse": "signal.recoil_impulse",
    "shot_times": "signal.shot_times",
    "sine": "signal.sine",
    "step": "road.step",
    "table": "signal.table",
    "table_from_csv": "signal.table_from_csv",
    "wave": "road.sine",
}


if not TYPE_CHECKING:  # or every name would be one

    def __getattr__(name: str) -> Any:
        """A public name, imported from the room it lives in; then it is an attribute like any other."""
        if name in _HOMES:
            value = getattr(_room(_HOMES[name]), name)
        elif name in NAMESPACES:
            value = _room(f"qddot.{name}")
        elif name == "__version__":
            from importlib.metadata import version

            value = version("qddot")
        elif name in _MOVED:
            return _moved(name)
        else:
            raise AttributeError(_unknown(name), name=name, obj=sys.modules[__name__])
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    """The public names, as an editor or a prompt offers them."""
    return [*__all__, "__all__", "__doc__", "__file__", "__name__", "__path__", "__version__"]


def _room(name: str) -> Any:
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        from qddot.extras import missing

        raise missing(error) from error


def _moved(name: str) -> Any:
    room, new = _MOVED[name].split(".")
    warnings.warn(f"qddot.{name} is qddot.{room}.{new} now; the old name goes with version 0.3", DeprecationWarning, 3)
    return getattr(import_module(f"qddot.{room}"), new)


def _unknown(name: str) -> str:
    from qddot.words import nearest

    hint = "" if name.startswith("_") else nearest(name, [*__all__, *_MOVED])
    return f"module 'qddot' has no attribute {name!r}{hint}"
