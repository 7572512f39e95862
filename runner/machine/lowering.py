"""Functions compiled from their text: numba's result, without its analysis of what Python makes of them.

Numba follows Python's instructions, one by one, through a dozen passes until it knows all types. Those of a driver are
few, and known as they are read: numbers, records, arrays at addresses, tuples, other compiled functions.
"""

import ast
import builtins
import contextlib
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.bytecode import FunctionIdentity
from numba.core.compiler import compile_result
from numba.core.funcdesc import PythonFunctionDescriptor
from numba.core.lowering import Environment

from qddot.runner.machine.assignments import Kinds, WiderError
from qddot.runner.machine.structured import Structured
from qddot.runner.machine.text import StrayError, parsed
from qddot.runner.machine.values import RAISES, Typed

#: Where a function bears what gives its instructions as a straight line, see `straight`.
STRAIGHT = "__straight__"


def lowered(function: FunctionType, state: Any, mark: Callable[[Any], None] | None = None) -> Any:
    """What numba's compiler gives for a function, with the state it has when it begins; its library is filled.

    mark: tells LLVM more about the function. StrayError where the function holds what there are no instructions for.
    """
    identity: Any = FunctionIdentity.from_function(function)
    if (line := vars(function).get(STRAIGHT)) is not None:
        with contextlib.suppress(StrayError):
            return _result(state, *_emitted(state, identity, types.none, line(), mark))
    node, names = parsed(function.__code__), _names(function)
    if len(node.args.args) != len(state.args) or node.args.vararg or node.args.kwonlyargs:
        raise StrayError("arguments")
    returns = any(isinstance(each, ast.Return) and each.value is not None for each in ast.walk(node))
    kinds = Kinds(state.return_type if state.return_type is not None or returns else types.none)

    def emit(context: Any, builder: Any, arguments: Mapping[str, Typed]) -> None:
        Structured(context, builder, names, arguments, node, kinds).emit()

    while True:
        try:
            return _result(state, *_emitted(state, identity, kinds.result, emit, mark))
        except WiderError:
            if state.return_type is not None and kinds.result != state.return_type:
                raise StrayError(f"{function.__name__} returns {kinds.result}") from None


def _names(function: FunctionType) -> Mapping[str, Any]:
    """What the names of a function mean that are not its own."""
    around = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
    return {**vars(builtins), **function.__globals__, **{name: cell.cell_contents for name, cell in around.items()}}


def _description(identity: Any, state: Any, result: Any) -> Any:
    """Numba's description of a function of these types; one whose result is not known yet has none."""
    flags = state.flags
    return PythonFunctionDescriptor(
        native=True,
        modname=identity.modname,
        qualname=identity.func_qualname,
        unique_name=identity.unique_name,
        doc="",
        typemap={},
        restype=types.none if result is None else result,
        calltypes={},
        args=tuple(identity.arg_names),
        kws=(),
        mangler=state.targetctx.mangler,
        argtypes=tuple(state.args),
        inline=flags.forceinline or flags.inline.is_always_inline,
        noalias=flags.noalias,
        abi_tags=[flags.get_mangle_string()],
        uid=identity.unique_id,
    )


def _emitted(state: Any, identity: Any, result: Any, emit: Callable[..., None], mark: Any) -> Any:
    """A function's description, its module, its environment and what a wrapper for Python needs."""
    description = _description(identity, state, result)
    environment = Environment.from_fndesc(description)
    context = state.targetctx.subtarget(environment=environment, fndesc=description)
    module = state.library.create_ir_module(description.unique_name)
    context.declare_env_global(module, context.get_env_name(description))
    function = context.declare_function(module, description)
    entry, body = (function.append_basic_block(name) for name in ("entry", "body"))
    # The first block is for what stands on the stack alone. What stands there elsewhere, LLVM takes and gives back in
    # every turn of a loop that this function becomes part of, and makes no vectors of it.
    builder = ir.IRBuilder(entry)
    builder.branch(body)
    builder.position_at_end(body)
    helper = context.call_conv.init_call_helper(builder)
    given = context.call_conv.decode_arguments(builder, description.argtypes, function)
    arguments = dict(zip(identity.arg_names, zip(state.args, given, strict=True), strict=True))
    with context.push_code_library(state.library):
        emit(context, builder, arguments)
        if mark is not None:
            mark(function)
        context.post_lowering(module, state.library)
    state.metadata[RAISES] = any(_raises(block.terminator) for block in function.blocks)
    return description, module, environment, helper


def _raises(end: Any) -> bool:
    """Whether a block returns what is not success."""
    return isinstance(end, ir.Ret) and not (isinstance(end.operands[0], ir.Constant) and end.operands[0].constant == 0)


def _result(state: Any, description: Any, module: Any, environment: Any, helper: Any) -> Any:
    """What numba's last pass gives, of all that."""
    context, library, flags = state.targetctx, state.library, state.flags
    library.add_ir_module(module)
    with context.push_code_library(library):
        if not flags.no_cpython_wrapper:
            context.create_cpython_wrapper(library, description, environment, helper, release_gil=flags.release_gil)
    call = context.get_executable(library, description, environment)
    context.insert_user_function(call, description, [library])
    return compile_result(
        typing_context=state.typingctx,
        target_context=context,
        entry_point=call,
        typing_error=None,
        type_annotation="",
        library=library,
        call_helper=helper,
        signature=description.restype(*state.args),
        objectmode=False,
        lifted=(),
        fndesc=description,
        environment=environment,
        metadata=state.metadata,
        reload_init=[*state.reload_init, *library._reload_init],
    )
