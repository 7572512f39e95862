"""A function of a generated module, compiled to be called by its address.

What numba makes so that Python can call a function, which unpacks five arrays, takes twice as long to compile as a
small kernel itself. So it is made once for all kernels of a signature: a function that calls what stands at an address.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

from numba import njit, types
from numba.core.dispatcher import Dispatcher
from numba.extending import typeof_impl

from qddot.cycles import cycles_left_alone
from qddot.runner import abi
from qddot.runner.machine.compiled import ARITHMETIC, compiled, keeping_code
from qddot.runner.machine.memory import BY_ADDRESS, LEAN, VIEW, first_item, floats
from qddot.runner.machine.pointers import calling, pointer
from qddot.runner.machine.straight import straight


@dataclass(frozen=True, eq=False)
class Kernel:
    """A compiled function of one signature of `abi`; Python and, by its address, compiled code call it."""

    function: Any
    signature: Any

    @property
    def py_func(self) -> Any:
        """The function that was compiled."""
        return self.function.py_func

    def get_compile_result(self, signature: Any) -> Any:
        """What numba made of it, which `pointer` asks for."""
        return self.function.get_compile_result(signature)

    @cached_property
    def _call(self) -> tuple[Callable[..., None], int]:
        return _caller(self.signature), pointer(self, self.signature, self.py_func.__name__)

    def __call__(self, *arguments: Any) -> None:
        """Call it with numbers and C-contiguous arrays of float64, of which it writes to the last."""
        call, address = self._call
        call(address, *arguments)


@typeof_impl.register(Kernel)
def _in_compiled_code(kernel: Kernel, context: Any) -> Any:
    """Jitted functions call it as the function that it is."""
    return types.Dispatcher(kernel.function)


def compiled_kernel(function: Any, signature: Any) -> Kernel:
    """A module's function compiled. Raises NumbaError where it does not compile."""
    with keeping_code(Path(function.py_func.__code__.co_filename)):
        made = njit(cache=True, **ARITHMETIC, **BY_ADDRESS)(straight(function.py_func, _within(function.py_func)))
    with cycles_left_alone():
        made.compile(signature)
    return Kernel(made, signature)


def _within(function: FunctionType) -> dict[str, Any]:
    """What global names of a kernel mean; functions of its own file that it calls are compiled within it."""
    file, space = function.__code__.co_filename, dict(function.__globals__)
    callers, found = [function], set[str]()
    while callers:
        for name in callers.pop().__code__.co_names:
            each = function.__globals__.get(name)
            if name in found or not isinstance(each, Dispatcher) or each.py_func.__code__.co_filename != file:
                continue
            called = each.py_func
            again = FunctionType(called.__code__, space, name, called.__defaults__, called.__closure__)
            space[name] = compiled(**LEAN)(again)
            found.add(name)
            callers.append(called)
    return space


_make_constants, _find_switching = calling(abi.SIGNATURES["constants"]), calling(abi.SIGNATURES["switching"])
_fill_vector = calling(abi.VECTOR_KERNEL)


def _make_constants_at(where, p, c):
    _make_constants(where, (_read(p), c))


def _find_switching_at(where, t, c, v):
    _find_switching(where, (t, _read(c), v))


def _fill_vector_at(where, t, x, u, c, v):
    _fill_vector(where, (t, _read(x), _read(u), _read(c), v))


@compiled(**VIEW)
def _read(array):
    """The same array as kernels take it, which do not write to it."""
    return floats(first_item(array), len(array))


#: By the number of arguments of a kernel: what calls it.
_BY_ARGUMENTS: dict[int, Any] = {2: _make_constants_at, 3: _find_switching_at, 5: _fill_vector_at}

#: Arrays that may be read-only; those that need not be are taken, too.
_READ_ONLY = types.Array(types.float64, 1, "C", readonly=True)


@cache
def _caller(signature: Any) -> Any:
    """What Python calls kernels of this signature by, compiled once for all."""
    *given, result = signature.args
    given = [_READ_ONLY if kind == abi.VECTOR else kind for kind in given]
    return compiled(types.void(types.int64, *given, result))(_BY_ARGUMENTS[len(signature.args)])
