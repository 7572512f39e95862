"""Lane kernels compiled so that LLVM turns their loop into vectors as wide as the machine has.

Two things must be said to LLVM that numba has no option for: that the arguments do not overlap (or every call would
compare their addresses first, and give up where there are many), and that 512 bits are wanted where they exist, which
it takes for slow on every processor that has them (measured here: 4.6 ns a run with 256 bits, 2.6 ns with 512).
"""

from typing import Any

from llvmlite import ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaError
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering

from runner import abi
from runner.compiled import compiled
from runner.load import LoadError, Model

#: Numba hands over where to put the result and an exception before the arguments.
_OWN_ARGUMENTS = 2


class _LaneLower(Lower):
    """Numba's lowering, with what LLVM is told about the function that comes of it."""

    def lower_normal_function(self, description: Any) -> None:
        """Lower, then mark the function and its pointers."""
        super().lower_normal_function(description)
        # Below `add`, which knows only the attributes that llvmlite lists.
        set.add(self.function.attributes, '"prefer-vector-width"="512"')
        for argument in self.function.args[_OWN_ARGUMENTS:]:
            if isinstance(argument.type, ir.PointerType):
                argument.add_attribute("noalias")
        for block in self.function.blocks:
            if isinstance(block.terminator, ir.Branch) and _is_before(block.terminator.operands[0], block):
                block.terminator.set_metadata("llvm.loop", self._whole_loop())

    def _whole_loop(self) -> Any:
        """What says that a short loop is to become vectors, not a row of scalars: a node that names itself."""
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
    """Numba's own pipeline with the lowering of lane kernels."""

    def define_pipelines(self) -> list[Any]:
        """The one pipeline."""
        pipeline = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes = [(_LaneLowering if each is NativeLowering else each, text) for each, text in pipeline.passes]
        pipeline.passes[:] = passes
        pipeline.finalize()
        return [pipeline]


def compile_for_lanes(function: Any) -> Any:
    """A jitted function of five pointers, compiled as a lane kernel."""
    options = {"error_model": "numpy", "_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return compiled(abi.LANE_KERNEL, pipeline_class=LaneCompiler, **options)(function.py_func)


def lane_rhs(model: Model) -> Any | None:
    """The compiled lane kernel of a model; None where it has none.

    Raises LoadError where it was generated for another number of lanes, or does not compile.
    """
    kernel = getattr(model.module, "lane_rhs", None)
    if kernel is None:
        return None
    lanes = getattr(model.module, "LANES", None)
    if lanes != abi.LANES or not isinstance(kernel, Dispatcher):
        raise LoadError(f"model {model.name}: lane_rhs is for {lanes} lanes, expected {abi.LANES}; generate it again")
    try:
        return compile_for_lanes(kernel)
    except NumbaError as error:
        raise LoadError(f"model {model.name}: kernel 'lane_rhs' does not compile:\n{error}") from None
