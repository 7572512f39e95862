"""Loops over lanes compiled so that LLVM turns them into vectors as wide as the machine has.

Three things must be said to LLVM that numba has no option for: that the arguments do not overlap (or every call would
compare their addresses first, and LLVM give up where there are many); that 512 bits are wanted where they exist, which
it takes for slow on every processor that has them (measured: 4.6 ns a run of the M113 with 256 bits, 2.6 ns with 512);
and that a loop of eight turns is not to be written out as scalars.
"""

from collections.abc import Callable
from types import FunctionType
from typing import Any

from llvmlite import ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.inner import trimmed
from qddot.runner.machine.memory import LEAN

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
        return [trimmed(pipeline)]


def lane_loop(signature: Any, calls: FunctionType | None = None) -> Callable[[Callable[..., Any]], Any]:
    """`compiled` for a function whose loop runs over lanes; arrays are pointers, and none overlaps another."""
    return compiled(signature, calls, pipeline_class=LaneCompiler, **LEAN)
