"""Compiled functions on disk: numba's cache, of which only what is called is taken apart.

To each function numba keeps its machine code and, for functions that it may become part of, its code before that. Where
it is read back, two thirds of the time go into the latter, which hardly any process needs: here it waits until it does.
"""

import contextlib
import pickle
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

from llvmlite import binding
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserProvidedCacheLocator
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import compile_result
from numba.core.runtime import _nrt_python  # type: ignore[attr-defined]

from qddot.runner.machine.compiling import waiting_for_code

#: Stands in the keys of what is kept in this form: versions of qddot that keep another do not see it.
_FORM = "names, machine code, bitcode"
#: Seconds between two looks for what another process compiles.
_LOOK = 0.01


class _Locator(UserProvidedCacheLocator):
    """Where a function of the runner is kept within the folder of its source: the same place in every copy of that."""

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """The rooms that lead to a file, instead of numba's digest of where it lies."""
        file, runner = Path(py_file).absolute(), Path(__file__).absolute().parent.parent
        if not file.is_relative_to(runner):
            return str(super().get_suitable_cache_subpath(py_file))
        return "_".join(("runner", *file.relative_to(runner).parent.parts))


class _Library(JITCodeLibrary):  # type: ignore[misc]
    """Machine code read from disk."""

    def __init__(self, codegen: Any, name: str, names: frozenset[str], machine_code: bytes, bitcode: bytes) -> None:
        super().__init__(codegen, name)
        self._bitcode = bitcode
        self.enable_object_caching()
        self._set_compiled_object(machine_code)
        self._finalize_final_module()
        codegen._engine._defined_symbols |= names

    def _get_module_for_linking(self) -> Any:
        """What becomes part of other functions, read now that one of them is compiled."""
        if self._shared_module is None:
            self._shared_module = binding.parse_bitcode(self._bitcode)
        return self._shared_module


class _Kept(CompileResultCacheImpl):
    _locator_classes = [_Locator, *CompileResultCacheImpl._locator_classes]  # noqa: RUF012 - as numba has it

    def reduce(self, result: Any) -> Any:
        """What numba keeps, and the names that are defined in it."""
        module = result.library._get_module_for_linking()
        found = (each for group in (module.functions, module.global_variables) for each in group)
        return frozenset(each.name for each in found if not each.is_declaration), result._reduce()

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """As numba's own, with a `_Library`."""
        names, ((name, _, code), description, environment, signature, objectmode, lifted, note, inits, envs) = payload
        for init in inits:
            init()
        library = _Library(target_context.codegen(), name, names, *code)
        call = target_context.get_executable(library, description, environment)
        for each in envs:
            library.codegen.set_env(each.env_name, each)
        return compile_result(
            target_context=target_context,
            typing_context=target_context.typing_context,
            library=library,
            environment=environment,
            entry_point=call,
            fndesc=description,
            type_annotation=note,
            signature=signature,
            objectmode=objectmode,
            lifted=lifted,
            typing_error=None,
            call_helper=None,
            reload_init=inits,
            referenced_envs=envs,
        )


class Cache(FunctionCache):
    """Numba's cache of a function, without which the program goes on: a disk may be full, a file cut short."""

    _impl_class = _Kept
    #: Whether another process still compiles, and the functions that it does.
    _elsewhere: tuple[Callable[[], bool], frozenset[Any]] = (lambda: False, frozenset())

    @classmethod
    @contextlib.contextmanager
    def elsewhere(cls, running: Callable[[], bool], functions: Iterable[Any]) -> Iterator[None]:
        """Within the block another process compiles these functions: while it runs, they are waited for."""
        before, cls._elsewhere = cls._elsewhere, (running, frozenset(functions))
        try:
            yield
        finally:
            cls._elsewhere = before

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        return (*super()._index_key(sig, codegen), _FORM)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What is there, None where it cannot be read; waits for what another process compiles, see `elsewhere`."""
        found, (running, functions) = self._found(sig, target_context), self._elsewhere
        if found is None and self._py_func in functions:
            with waiting_for_code():
                while found is None and running():
                    time.sleep(_LOOK)
                    found = self._found(sig, target_context)
        return found

    def _found(self, sig: Any, target_context: Any) -> Any:
        """What is there, None where it cannot be read.

        Numba would import first, and look through, all that it could compile with.
        """
        try:
            _show_linker_arrays()
            return self._load_overload(sig, target_context)
        except OSError:
            return None
        except (EOFError, ImportError, pickle.UnpicklingError):  # ImportError: copied here from another folder
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled, where the disk takes it, without numba's notes of types beside each line of text.

        To take a kernel's text apart into lines takes numba a quarter of the time that compiling it does.
        """
        try:
            super().save_overload(sig, data._replace(type_annotation=""))
        except OSError as error:
            _tell(f"note: compiled code is not kept in {self.cache_path}: {error.strerror or error}")


@cache
def _show_linker_arrays() -> None:
    """Let LLVM find numba's functions for arrays, which machine code for Python calls; `rtsys` does, and compiles."""
    for name, address in _nrt_python.c_helpers.items():
        binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


@cache
def _tell(text: str) -> None:
    """Say something once."""
    print(text, file=sys.stderr)
