"""Loading a generated model. Everything about it is checked at this wall, once; the loops check nothing."""

import contextlib
import hashlib
import importlib
import importlib.util
import pkgutil
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import numpy as np
from numba.core.errors import NumbaError
from numpy.typing import ArrayLike, NDArray

from qddot import generated
from qddot.runner import abi, notebook
from qddot.runner.checks import finite, finite_state, shown, unknown
from qddot.runner.machine.compiled import keeping_module
from qddot.runner.machine.kernel import Kernel, compiled_kernel
from qddot.runner.machine.recurrences import Recurrences, read_recurrences
from qddot.runner.matrices import PlacedKernel
from qddot.runner.read_tables import LoadError, read_tables
from qddot.runner.stale import fitting, kernel_digest
from qddot.runner.tables import Tables
from qddot.words import counted

__all__ = ["LoadError", "Model", "Parameters", "available", "load"]

_T = TypeVar("_T")

#: The name of a parameter set, values by name, or both; None for the defaults.
Parameters = str | Mapping[str, float] | tuple[str | None, Mapping[str, float]] | None


@dataclass(frozen=True, eq=False)
class Model:
    """A generated model: its tables and its kernels, which compile when first asked for.

    source: what `load` found it by, a name in `generated` or a path; digest: of its kernels. That is all that a
    pickled model carries: it is loaded again where it is unpickled, and must be the same there. A copy is the model.
    """

    tables: Tables
    module: ModuleType
    source: str = ""
    digest: str = ""

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickled, (self.name, self.source, self.digest)

    def __repr__(self) -> str:
        """Name, title and how much of everything there is."""
        what = {"coordinate": self.coordinate_names, "input": self.tables.free_inputs, "output": self.tables.outputs}
        what["parameter"] = self.tables.parameters
        sizes = ", ".join(counted(len(each), noun) for noun, each in what.items())
        return f"<Model {self.name}: {self.tables.title}; {sizes}>"

    def _repr_html_(self) -> str:
        """Title, equations of motion and parameters, in a notebook."""
        rows = [(each.name, f"{each.default:g}", each.unit, each.meaning) for each in self.tables.parameters]
        parameters = notebook.table(self.tables.title, ("parameter", "default", "unit", "meaning"), rows)
        return parameters + notebook.equations(Path(self.module.__file__ or ""))

    def __copy__(self) -> "Model":
        return self

    def __deepcopy__(self, known: dict[int, Any]) -> "Model":
        return self

    @property
    def name(self) -> str:
        """Name of the model."""
        return self.tables.name

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """Names of the coordinates, then of their velocities, then of the internal states."""
        return tuple(state.name for state in self.tables.states)

    @cached_property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return self.state_names[: self.tables.coordinates]

    @cached_property
    def _kernels(self) -> dict[str, Kernel]:
        """Those compiled so far."""
        return {}

    def kernel(self, name: str) -> Kernel:
        """The kernel of this name, compiled for the calling convention; a LoadError where it does not compile."""
        if name in self._kernels:
            return self._kernels[name]
        if name not in abi.SIGNATURES or not hasattr(self.module, name):
            raise LoadError(f"model {self.name}: {unknown('kernel', name, abi.SIGNATURES)}")
        try:
            made = compiled_kernel(getattr(self.module, name), abi.SIGNATURES[name])
        except NumbaError as error:
            raise LoadError(f"model {self.name}: kernel {name!r} does not compile:\n{error}") from None
        self._kernels[name] = made
        return made

    def matrix(self, name: str) -> PlacedKernel:
        """The kernel of this name that writes a matrix, with the places of what it writes; raises as `kernel` does."""
        return PlacedKernel(self.kernel(name), self.tables.patterns[name])

    @cached_property
    def series(self) -> Any:
        """The compiled Taylor series of the states, a `SeriesCode`; a LoadError where the model has no recurrences."""
        from qddot.runner.machine.series_code import series_code  # noqa: PLC0415 - most runs need none

        return self._made_of_recurrences(series_code)

    @cached_property
    def lane_series(self) -> Any:
        """`series` of as many runs as there are lanes."""
        from qddot.runner.machine.series_code import series_code  # noqa: PLC0415 - most runs need none

        return self._made_of_recurrences(partial(series_code, runs=abi.LANES))

    @cached_property
    def recurrences(self) -> Recurrences:
        """The recurrences of the states' Taylor series, read; a LoadError where the model has none."""
        return self._made_of_recurrences(read_recurrences)

    def _made_of_recurrences(self, make: Callable[..., _T]) -> _T:
        tables = self.tables
        if not tables.recurrence:
            missing = tables.without_recurrence
            reason = f"{missing} has no recurrence" if missing else "it has no table RECURRENCE; generate it again"
            raise LoadError(f"model {self.name} has no Taylor series: {reason}; choose another method, such as dop853")
        inputs = tuple(channel.name for channel in tables.inputs[: tables.rhs_inputs])
        try:
            return make(tables.recurrence, self.state_names, inputs, tables.constant_names)
        except ValueError as error:
            raise LoadError(f"model {self.name}: {error}; generate the model again") from None

    def parameter_values(self, parameters: Parameters = None) -> NDArray[np.float64]:
        """Parameters p (n_parameters,): the defaults, changed by a named set, by values, or by a set and then values.

        Raises ValueError for a set or parameter that does not exist and for a value that is no finite number.
        """
        parameter_set, overrides = _set_and_overrides(parameters)
        sets = self.tables.parameter_sets
        if parameter_set is not None and parameter_set not in sets:
            raise ValueError(f"model {self.name}: {unknown('parameter set', parameter_set, sets)}")
        values = {parameter.name: float(parameter.default) for parameter in self.tables.parameters}
        for changes in (sets[parameter_set] if parameter_set is not None else {}, overrides):
            for name, value in changes.items():
                if name not in values:
                    raise ValueError(f"model {self.name}: {unknown('parameter', name, values)}")
                values[name] = finite(f"model {self.name}: parameter {name}", value)
        return np.array(list(values.values()), dtype=np.float64)

    def constants(self, p: NDArray[np.float64]) -> NDArray[np.float64]:
        """Constants c (n_constants,) of the kernels for parameters p; a ValueError names one that is not finite."""
        names = self.tables.constant_names
        c = np.zeros(len(names))
        self.kernel("constants")(np.ascontiguousarray(p, dtype=np.float64), c)
        if not np.isfinite(c).all():
            name = names[int(np.argmin(np.isfinite(c)))]
            value = c[names.index(name)]
            raise ValueError(f"model {self.name}: constant {name} is {value}{self._zeros(p, name)}")
        return c

    def positions(self, p: NDArray[np.float64]) -> dict[str, float]:
        """Where the inputs that have a position act for parameters p: name -> m ahead of the model's origin."""
        names = self.tables.positioned
        places = np.full(len(names), np.nan)
        with np.errstate(all="ignore"), contextlib.suppress(ArithmeticError, ValueError):  # as Python's `math` has it
            if names:  # a few sums, once a run: compiling them would take longer than all runs together
                self.module.positions.py_func(np.asarray(p, dtype=np.float64), places)
        if not np.isfinite(places).all():
            name = names[int(np.argmin(np.isfinite(places)))]
            raise ValueError(f"model {self.name}: the position of {name} is not finite{self._zeros(p, name)}")
        return dict(zip(names, places.tolist(), strict=True))

    def state(self, values: Mapping[str, float] | ArrayLike, called: str = "initial") -> NDArray[np.float64]:
        """A state x (n_states,), from an array or by name (the others are 0), checked to be finite.

        called: what messages call it.
        """
        if isinstance(values, Mapping):
            x = np.zeros(len(self.state_names))
            for name, value in values.items():
                if name not in self.state_names:
                    raise ValueError(f"model {self.name}: {unknown('state', name, self.state_names)}")
                x[self.state_names.index(name)] = finite(f"model {self.name}: {called} {name}", value)
            return x
        return finite_state(f"model {self.name}", values, self.state_names, called)

    def _zeros(self, p: NDArray[np.float64], constant: str) -> str:
        """What is likely behind a constant that is not finite: parameters that are zero, those it names first."""
        zeros = [parameter.name for parameter, value in zip(self.tables.parameters, p, strict=True) if value == 0]
        named = [name for name in zeros if f"_{name}_" in f"_{constant}_"]
        return f"; zero: {', '.join(named or zeros)}" if zeros else "; a parameter is too large or too small"


def _set_and_overrides(parameters: Parameters) -> tuple[str | None, Mapping[str, float]]:
    if parameters is None or isinstance(parameters, str):
        return parameters, {}
    if isinstance(parameters, Mapping):
        return None, parameters
    if isinstance(parameters, tuple) and len(parameters) == 2:
        name, values = parameters
        if (name is None or isinstance(name, str)) and isinstance(values, Mapping):
            return name, values
    raise ValueError(f"parameters is {shown(parameters)}, expected a set's name, values by name, or (name, values)")


def available() -> tuple[str, ...]:
    """Names of the models in `generated`."""
    names = (module.name for module in pkgutil.iter_modules(generated.__path__))
    return tuple(sorted(name for name in names if not name.startswith("_")))


def load(name_or_path: str | Path) -> Model:
    """The model of this name in `generated`, or the generated module in this file.

    Warns, `StaleKernels`, where the model changed since. Raises LoadError where there is none (with the nearest name),
    where the module cannot be imported, or where its tables and kernels are not as they should be.
    """
    return load_for(Path(), name_or_path)


def load_for(study: Path, name_or_path: str | Path) -> Model:
    """As `load`; study: the folder beside which kernels are kept that a command had to generate, see `stale`."""
    if not isinstance(name_or_path, str | Path):
        raise LoadError(f"name_or_path is {shown(name_or_path)}, expected a model's name or the path of a module")
    path = _place(name_or_path)
    chosen = fitting(path, study)
    return load_as_it_stands(name_or_path if chosen == path else chosen)


def load_as_it_stands(name_or_path: str | Path) -> Model:
    """As `load`, whether or not the model changed since: what workers and pickled models ask for."""
    path = _place(name_or_path)
    by_path = _is_path(name_or_path)
    module = _module_at(path) if by_path else _generated_module(str(name_or_path))
    source = str(path.resolve()) if by_path else str(name_or_path)
    digest = _digest(module)
    known = _loaded.get((source, digest))
    if known is None or known.module is not module:
        known = _loaded[source, digest] = Model(read_tables(module), module, source, digest)
    return known


def _is_path(name_or_path: str | Path) -> bool:
    return isinstance(name_or_path, Path) or name_or_path.endswith(".py") or len(Path(name_or_path).parts) > 1


def _place(name_or_path: str | Path) -> Path:
    """The file of a generated module. Raises LoadError where there is none."""
    if not _is_path(name_or_path):
        if name_or_path not in available():
            raise LoadError(unknown("model", str(name_or_path), available()))
        return Path(generated.__file__).resolve().parent / f"{name_or_path}.py"
    path = Path(name_or_path)
    if not path.is_file():
        raise LoadError(f"no file {path}; models by name: {', '.join(available()) or 'none'}")
    return path


#: Models by source and digest, for those that are unpickled where they have been loaded before.
_loaded: dict[tuple[str, str], Model] = {}


def as_model(model: Any) -> Model:
    """The model itself; ValueError for anything else, saying how to get one."""
    if isinstance(model, Model):
        return model
    how = f"qddot.load({model!r})" if isinstance(model, str) else "what qddot.load gives"
    raise ValueError(f"model is {shown(model)}, expected a model: {how}")


def _digest(module: ModuleType) -> str:
    """The digest of this module's kernels: of its file when it was first loaded."""
    if "_qddot_digest" not in vars(module):
        module._qddot_digest = kernel_digest(Path(module.__file__ or ""))  # type: ignore[attr-defined]
    return str(module._qddot_digest)


def _unpickled(name: str, source: str, digest: str) -> Model:
    """The model that was pickled, loaded by its name or path; LoadError where it is another one here."""
    if (source, digest) in _loaded:
        return _loaded[source, digest]
    model = load_as_it_stands(Path(source) if Path(source).is_absolute() else source)
    if model.digest != digest:
        raise LoadError(
            f"model {name}: {model.module.__file__} is not the module that was pickled: its digest is "
            f"{model.digest[:12]}, expected {digest[:12]}; generate it again from the same model"
        )
    return model


def _generated_module(name: str) -> ModuleType:
    try:
        with keeping_module(Path(generated.__file__).parent / f"{name}.py"):
            return importlib.import_module(f"qddot.generated.{name}")
    except Exception as error:
        raise LoadError(f"model {name}: {type(error).__name__}: {error}; generate the model again") from error


def _module_at(path: Path) -> ModuleType:
    # Numba imports a cached kernel's module by name: the name must be known, the file's own, and the same next time.
    name = f"generated_{path.stem}_{hashlib.sha256(bytes(path.resolve())).hexdigest()[:12]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise LoadError(f"{path} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        with keeping_module(path):
            spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise LoadError(f"{path}: {type(error).__name__}: {error}; generate the model again") from error
    return module
