"""Loops over lanes compiled so that LLVM turns them into vectors as wide as the machine has.

Three things must be said to LLVM that numba has no option for: that the arguments do not overlap (or every call would
compare their addresses first, and LLVM give up where there are many); that 512 bits are wanted where they exist, which
it takes for slow on every processor that has them (measured: 4.6 ns a run of the M113 with 256 bits, 2.6 ns with 512);
and that a loop of eight turns is not to be written out as scalars.
"""

import math
from collections.abc import Callable
from functools import cache
from types import FunctionType, ModuleType
from typing import Any

from llvmlite import ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.errors import NumbaError
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering

from qddot.runner import abi
from qddot.runner.compiled import compiled
from qddot.runner.lanes.elementary import FORMS, elementary
from qddot.runner.lanes.row import row
from qddot.runner.load import LoadError, Model
from qddot.runner.memory import LEAN

#: Numba hands over where to put the result and an exception before the arguments.
_OWN_ARGUMENTS = 2


class _LaneLower(Lower):
    """Numba's lowering, with what LLVM is told about the function that comes of it."""

    def lower_normal_function(self, description: Any) -> None:
        """Lower, then mark the function, its pointers and its loop."""
        super().lower_normal_function(description)
        # Inlined, it would lose its width; the set below `add` also takes attributes that llvmlite does not list.
        set.update(self.function.attributes, ("noinline", '"prefer-vector-width"="512"'))
        for argument in self.function.args[_OWN_ARGUMENTS:]:
            if isinstance(argument.type, ir.PointerType):
                argument.add_attribute("noalias")
        for block in self.function.blocks:
            if isinstance(block.terminator, ir.Branch) and _is_before(block.terminator.operands[0], block):
                block.terminator.set_metadata("llvm.loop", self._not_unrolled())

    def _not_unrolled(self) -> Any:
        """Metadata of a loop: a node that names itself, as LLVM wants it."""
        hint = self.module.add_metadata([ir.MetaDataString(self.module, "llvm.loop.unroll.disable")])
        node = self.module.add_metadata([hint])
        node.operands = (node, hint)
        return node


def _is_before(block: Any, other: Any) -> bool:
    blocks = other.function.blocks
    return blocks.index(block) <= blocks.index(other)


@register_pass(mutates_CFG=True, analysis_only=False)
class _LaneLowering(NativeLowering):
    _name = "qddot_lane_lowering"

    @property
    def lowering_class(self) -> Any:
        return _LaneLower


class LaneCompiler(CompilerBase):
    """Numba's own pipeline with this lowering."""

    def define_pipelines(self) -> list[Any]:
        """The one pipeline."""
        pipeline = DefaultPassBuilder.define_nopython_pipeline(self.state)
        pipeline.passes[:] = [
            (_LaneLowering if each is NativeLowering else each, text) for each, text in pipeline.passes
        ]
        pipeline.finalize()
        return [pipeline]


def lane_loop(signature: Any, calls: FunctionType | None = None) -> Callable[[Callable[..., Any]], Any]:
    """`compiled` for a function whose loop runs over lanes; arrays are pointers, and none overlaps another."""
    return compiled(signature, calls, pipeline_class=LaneCompiler, **LEAN)


def lane_rhs(model: Model) -> Any | None:
    """The right-hand side of a model compiled for lanes (see `abi`); None where it calls a function without vectors.

    Raises LoadError where it does not compile.
    """
    try:
        return _compiled_kernel(model.module.rhs.py_func)
    except NumbaError as error:
        raise LoadError(f"model {model.name}: kernel 'rhs' does not compile for lanes:\n{error}") from None


@cache
def _compiled_kernel(rhs: FunctionType) -> Any | None:
    """The text of `rhs` once more: items of its arguments stand LANES apart, and `math` is that of lanes."""
    if not set(rhs.__code__.co_names) & set(vars(math)) <= FORMS.keys():
        return None
    in_lanes = ModuleType("math", "What stands for `math` in lanes.")
    vars(in_lanes).update(FORMS)
    one = elementary(FunctionType(rhs.__code__, {**rhs.__globals__, "math": in_lanes}, rhs.__name__))
    names = {**globals(), "one": one}
    loop = FunctionType(_over_lanes.__code__, names, f"lane_{rhs.__name__}")
    return lane_loop(abi.LANE_KERNEL, rhs)(loop)


def _over_lanes(times, state, inputs, constants, derivative):
    """State derivatives [qdot, qddot] of LANES runs; `one` is the right-hand side of one."""
    for lane in range(abi.LANES):
        one(times[lane], row(state, lane), row(inputs, lane), row(constants, lane), row(derivative, lane))  # noqa: F821
