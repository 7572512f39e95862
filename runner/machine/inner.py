"""Inner functions, which only other compiled ones call: machine code is made of them once, within the outermost.

Numba optimises each function with all that it calls, makes machine code of it, and does both anew in each of its
callers: of a driver of a hundred functions, five or ten calls deep, that is most of the time that compiling takes. An
inner function is typed and lowered, and left as it is; an outer one, compiled for Python or for its address, is linked
with the inner ones below it, each of them once, and optimised as a whole.
"""

from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any

from numba.core import codegen
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.errors import NumbaError

from qddot.cycles import cycles_left_alone
from qddot.runner.machine.lowering import lowered
from qddot.runner.machine.text import StrayError


class _Quiet:
    """Stands where numba sets the environment of machine code, of which there is none here."""

    @staticmethod
    def set_env(name: str, environment: Any) -> None:
        """Nothing to set: what allocates nothing and raises nothing needs no environment."""


class _Library(codegen.JITCodeLibrary):  # type: ignore[misc]
    """Code that is optimised as a whole, when all is there: what function by function would find, that finds too."""

    def _optimize_functions(self, module: Any) -> None:
        """Only say to LLVM how data lie."""
        module.data_layout = self._codegen._data_layout


class _Inner(_Library):
    """The code of an inner function, neither optimised nor made machine code of: that is left to the outermost."""

    _together = None

    @property
    def codegen(self) -> Any:
        """What numba asks for an environment."""
        return _Quiet

    def finalize(self) -> None:
        """Leave it at what was lowered."""
        self._raise_if_finalized()
        for library in self._linking_libraries:
            self._reload_init.update(library._reload_init)
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Null, which numba takes for a function that Python cannot call."""
        self._ensure_finalized()
        return 0

    def alone(self) -> Any:
        """The module of what was lowered, without what it calls."""
        return super()._get_module_for_linking()

    def _get_module_for_linking(self) -> Any:
        """It and all below it, for callers that know nothing of inner functions, such as a generated kernel."""
        if self._together is None:
            self._together = self.alone().clone()
            _link(self._together, _below(self))
        return self._together


class _Outer(_Library):
    """Code for Python, or to be called by its address, with all inner functions below it."""

    def finalize(self) -> None:
        """Link all of them once."""
        below = _below(self)
        for library in below:
            self._reload_init.update(library._reload_init)
        _link(self._final_module, below)
        self._linking_libraries = []
        super().finalize()

    def _optimize_final_module(self) -> None:
        """Optimise once: numba does so cheaply before, to find counts of references, of which there are none."""
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)


def _link(module: Any, below: list[Any]) -> None:
    """Add to a module what it calls: callers first, since LLVM's linker takes nothing that is not called yet."""
    for library in reversed(below):
        found = library.alone() if isinstance(library, _Inner) else library._get_module_for_linking()
        module.link_in(found, preserve=True)


def _below(library: Any) -> list[Any]:
    """The libraries that one calls, and those that inner ones among them call; each after all that it calls."""
    found: dict[Any, None] = {}

    def visit(caller: Any) -> None:
        for each in caller._linking_libraries:
            if each not in found:
                if isinstance(each, _Inner):
                    visit(each)
                found[each] = None

    visit(library)
    return list(found)


@cache
def _import_array_functions() -> None:
    """Import what numba imports before it compiles its first function, without its probe for a BLAS.

    The probe imports scipy.linalg, which takes long. SciPy is a dependency of ours: the answer is known.
    """
    linalg: Any = import_module("numba.np.linalg")
    probe = linalg.ensure_blas
    linalg.ensure_blas = lambda: None
    try:
        import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = probe


def compiling_into(kind: type, mark: Callable[[Any], None] | None = None) -> type[CompilerBase]:
    """A compiler that puts code into a library of this kind, from the text of functions; by numba where that goes not.

    mark: tells LLVM more about a function that is compiled from its text.
    """

    class Compiling(CompilerBase):  # type: ignore[misc]
        """Numba's compiler, into a library of this kind."""

        def __init__(self, *arguments: Any) -> None:
            _import_array_functions()
            super().__init__(*arguments)

        def compile_extra(self, function: Any) -> Any:
            with cycles_left_alone():
                self.state.library = self._new_library(function)
                try:
                    return lowered(function, self.state, mark)
                except (StrayError, NumbaError, NotImplementedError):  # numba says better what is amiss, if anything is
                    self.state.library = self._new_library(function)
                    return super().compile_extra(function)

        def _new_library(self, function: Any) -> Any:
            library = kind(self.state.targetctx.codegen(), function.__qualname__)
            library.enable_object_caching()
            return library

        def define_pipelines(self) -> list[Any]:
            """The one pipeline."""
            return [DefaultPassBuilder.define_nopython_pipeline(self.state)]

    return Compiling


INNER, OUTER = compiling_into(_Inner), compiling_into(_Outer)
