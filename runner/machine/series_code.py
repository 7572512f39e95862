"""Machine code of the Taylor series of models: compiled once for a table and a machine, and kept.

`series(memory, order)` writes the coefficients of all states; `step` says how far they carry, and `polynomial` sums
them at a time from where the series stands, see `series_step`. In lanes time is a row, and what a register holds of it
is done part by part.
"""

import contextlib
import hashlib
import json
import os
import tempfile
from dataclasses import dataclass, fields
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from llvmlite import ir
from numpy.typing import NDArray

from qddot.runner.machine.compiled import cache_directory
from qddot.runner.machine.constrained_inverse import let_series_invert
from qddot.runner.machine.packing import Packing, live_nodes, pack
from qddot.runner.machine.recurrences import Recurrences, read_recurrences
from qddot.runner.machine.series import Emitter
from qddot.runner.machine.series_memory import Memory, memory_for
from qddot.runner.machine.series_step import emit_polynomial, emit_step, kinds_of_step
from qddot.runner.machine.series_sums import SUMS
from qddot.runner.machine.vector_code import INTEGER, SCALAR, VectorCode

#: Vectors of sums over lower orders that stay in registers; up to so few, what they take of the order before may too.
_AT_ONCE, _FEW = 14, 4
#: Doubles of the widest register; of these there are 32 in place of 16.
_WIDEST = 8
#: Doubles of a vector of nodes, and the fewest sums over lower orders for which it is as wide: with fewer of them,
#: putting nodes side by side costs more than it saves. So many other nodes save as much as a sum.
_WIDTHS, _NODES_OF_A_SUM = ((8, 24), (2, 0)), 10
_POINTER, _NOTHING = SCALAR.as_pointer(), ir.VoidType()


@dataclass(frozen=True, eq=False)
class SeriesCode:
    """The compiled functions at their addresses, and the memory they take, for one run or for a row of them.

    sums: how many over lower orders an order takes. engine: keeps the code alive.
    """

    series: int
    step: int
    polynomial: int
    memory: Memory
    table: Recurrences
    sums: int
    engine: Any

    def fill_factors(self, memory: NDArray[np.float64], constants: NDArray[np.float64]) -> None:
        """Write the factors of a run alone that depend on parameters for these constants."""
        places, numbers, names = self._factors
        memory[places] = numbers * np.append(constants, 1.0)[names].prod(axis=1)

    @cached_property
    def _factors(self) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
        """Their places and numbers (n,), and the constants that they are multiplied by (n, most); the last is 1."""
        factors = self.memory.factors
        names = np.full((len(factors), max((len(each) for _, _, each in factors), default=0)), -1)
        for row, (_, _, each) in zip(names, factors, strict=True):
            row[: len(each)] = each
        return np.array([p for p, _, _ in factors], dtype=np.int64), np.array([x for _, x, _ in factors]), names


@dataclass(frozen=True)
class Shape:
    """What a vector holds: `width` nodes, or in lanes one node of `lanes` runs out of a row.

    sums, few, at_once: see `Emitter`.
    """

    width: int
    sums: int
    few: int
    lanes: int = 1
    row: int = 1
    at_once: int = _AT_ONCE


@cache
def series_code(
    text: str, states: tuple[str, ...], inputs: tuple[str, ...], constants: tuple[str, ...], runs: int = 1
) -> SeriesCode:
    """The code of the table in this text, from where it is kept or compiled. Raises RecurrenceError.

    runs: 1, or in lanes LANES.
    """
    table = read_recurrences(text, states, inputs, constants)
    live = live_nodes(table)
    sums = sum(len(SUMS.get(node.rule, ())) for name, node in table.nodes.items() if name in live)
    shape = _shape(sums + len(live) // _NODES_OF_A_SUM, runs)
    file = _file(repr((text, states, inputs, constants, shape)))
    found = _read(file)
    if found is None:
        packing = pack(table, shape.width)
        memory = memory_for(packing, shape.row)
        found = memory, _compiled(packing, memory, shape)
        _write(file, *found)
    memory, code = found
    if table.multipliers:
        let_series_invert()
    engine = _engine(code)
    series, step, polynomial = map(engine.get_function_address, ("series", "step", "polynomial"))
    return SeriesCode(series, step, polynomial, memory, table, sums, engine)


def _machine() -> Any:
    """A target machine for this processor; an engine takes it over, so that each has its own."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_default_triple()
    features = llvm.get_host_cpu_features().flatten()
    return target.create_target_machine(cpu=llvm.get_host_cpu_name(), features=features, opt=3, jit=True)


def _shape(saved: int, runs: int) -> Shape:
    """saved: sums over lower orders, and what counts as them."""
    register = _register()
    few = register * (_FEW if register < _WIDEST else 2 * _FEW)
    if runs == 1:
        width = next(width for width, least in _WIDTHS if saved >= least)
        return Shape(width, max(width, register), few)
    return Shape(1, register, few, register, runs)


def _register() -> int:
    """Doubles of a register of vectors."""
    features = llvm.get_host_cpu_features()
    return _WIDEST if features.get("avx512f") else 4 if features.get("avx") else 2


def _compiled(packing: Packing, memory: Memory, shape: Shape) -> bytes:
    """The object code of a packing; the memory is laid out on the way."""
    module = ir.Module("series")
    series = _function(module, "series", [_POINTER, INTEGER], shape)
    code = VectorCode(ir.IRBuilder(series.append_basic_block()), shape.width, shape.lanes)
    Emitter(packing, code, memory, shape.sums, shape.at_once, shape.few).emit()
    memory.take(shape.row)  # see `_function`
    result, kinds = kinds_of_step(shape.row)
    step = _function(module, "step", kinds, shape, result)
    states = len(packing.table.states)
    emit_step(step, memory, states, shape.width, shape.lanes)
    time = SCALAR if shape.row == 1 else _POINTER
    polynomial = _function(module, "polynomial", [_POINTER, INTEGER, time, _POINTER], shape)
    emit_polynomial(polynomial, memory, states, shape.width, shape.lanes)
    machine = _machine()
    parsed = llvm.parse_assembly(str(module))
    parsed.triple, parsed.data_layout = machine.triple, str(machine.target_data)
    parsed.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.loop_unrolling = options.slp_vectorization = options.loop_vectorization = False
    llvm_passes = llvm.create_pass_builder(machine, options)
    llvm_passes.getModulePassManager().run(parsed, llvm_passes)
    return bytes(machine.emit_object(parsed))


def _function(module: ir.Module, name: str, kinds: list[Any], shape: Shape, result: Any = _NOTHING) -> ir.Function:
    """A function to be written; where a row has parts, that of one of them, which one of this name calls for each.

    A part knows the rows from its own first lane on; what is its own alone it writes anew, where the last part did.
    """
    parts = shape.row // shape.lanes
    function = ir.Function(module, ir.FunctionType(result, kinds), name if parts == 1 else f"{name}_of_part")
    function.attributes.add("nounwind")
    function.args[0].add_attribute("noalias")
    if parts > 1:
        whole = ir.Function(module, function.function_type, name)
        builder = ir.IRBuilder(whole.append_basic_block())
        for part in range(parts):
            first = INTEGER(part * shape.lanes)
            pointers = (isinstance(x.type, ir.PointerType) for x in whole.args)
            given = zip(whole.args, pointers, strict=True)
            builder.call(function, [builder.gep(x, [first]) if shifted else x for x, shifted in given])
        builder.ret_void()
    return function


def _engine(code: bytes) -> Any:
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


def _file(what: str) -> Path | None:
    """Where the code of a table is kept: in the folder of this source's drivers, by the machine it is made for."""
    folder = cache_directory()
    if folder is None:
        return None
    parts = (what, llvm.llvm_version_info, llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten())
    return folder / f"series-{hashlib.sha256(repr(parts).encode()).hexdigest()[:24]}.code"


def _read(file: Path | None) -> tuple[Memory, bytes] | None:
    """Memory and object code of a file; None where there is none, or it is not whole."""
    try:
        head, _, code = file.read_bytes().partition(b"\n") if file else (b"", b"", b"")
        values = json.loads(head)
        if hashlib.sha256(code).hexdigest() != values.pop("digest"):
            return None
        factors = [(place, number, tuple(names)) for place, number, names in values.pop("factors")]
        return Memory(factors=factors, **values), code
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _write(file: Path | None, memory: Memory, code: bytes) -> None:
    """Keep it where the disk takes it: aside, then renamed."""
    if file is None:
        return
    values = {each.name: getattr(memory, each.name) for each in fields(memory) if not each.name.startswith("_")}
    head = json.dumps(values | {"digest": hashlib.sha256(code).hexdigest()}).encode()
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, aside = tempfile.mkstemp(prefix=".series-", dir=file.parent)
        with os.fdopen(handle, "wb") as opened:
            opened.write(head + b"\n" + code)
        os.replace(aside, file)
