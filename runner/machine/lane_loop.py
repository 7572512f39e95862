"""Loops over lanes compiled so that LLVM turns them into vectors as wide as the machine has.

Four things must be said to LLVM that numba has no option for: that the arguments do not overlap (or every call would
compare their addresses first, and LLVM give up where there are many); that 512 bits are wanted where they exist, which
it takes for slow on every processor that has them (measured: 4.6 ns a run of the M113 with 256 bits, 2.6 ns with 512);
that a loop of eight turns is not to be written out as scalars; and that a long loop is looked through to its end.
"""

from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any

from llvmlite import binding, ir
from numba.core import codegen

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.inner import compiling_into
from qddot.runner.machine.memory import LEAN

#: Beyond so many loads and stores LLVM takes all of a loop's for overlapping, and makes no vectors of it: 250 where
#: nothing is said, fewer than the kernel of a chain of 70 masses has. With all looked at, one of 300 masses takes a
#: tenth longer to compile, and its runs a third of the time.
_MOST_ACCESSES = 1_000_000
#: Editions of LLVM that are known to have an option for that; at one that it does not know, LLVM ends the process.
_WITH_OPTION = range(20, 23)

#: Numba hands over where to put the result and an exception before the arguments.
_OWN_ARGUMENTS = 2


def _mark(function: Any) -> None:
    """Tell LLVM about a function, its pointers and its loop."""
    # Inlined, it would lose its width; the set below `add` also takes attributes that llvmlite does not list.
    set.update(function.attributes, ("noinline", '"prefer-vector-width"="512"'))
    for argument in function.args[_OWN_ARGUMENTS:]:
        if isinstance(argument.type, ir.PointerType):
            argument.add_attribute("noalias")
    for block in function.blocks:
        if isinstance(block.terminator, ir.Branch) and _is_before(block.terminator.operands[0], block):
            block.terminator.set_metadata("llvm.loop", _not_unrolled(function.module))


def _not_unrolled(module: Any) -> Any:
    """Metadata of a loop: a node that names itself, as LLVM wants it."""
    hint = module.add_metadata([ir.MetaDataString(module, "llvm.loop.unroll.disable")])
    node = module.add_metadata([hint])
    node.operands = (node, hint)
    return node


def _is_before(block: Any, other: Any) -> bool:
    blocks = other.function.blocks
    return blocks.index(block) <= blocks.index(other)


@cache
def _look_through_long_loops() -> None:
    if binding.llvm_version_info[0] in _WITH_OPTION:
        binding.set_option("qddot", f"-alias-set-saturation-threshold={_MOST_ACCESSES}")


#: Into code that is optimised with all that it calls.
LaneCompiler = compiling_into(codegen.JITCodeLibrary, _mark)


def lane_loop(signature: Any, calls: FunctionType | None = None) -> Callable[[Callable[..., Any]], Any]:
    """`compiled` for a function whose loop runs over lanes; arrays are pointers, and none overlaps another."""
    _look_through_long_loops()
    return compiled(signature, calls, pipeline_class=LaneCompiler, **LEAN)
