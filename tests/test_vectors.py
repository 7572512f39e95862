"""Loops that are written to become vector instructions do, where they are compiled with all that they call."""

import re

import pytest
from lane_assembly import PACKED, SCALAR, fresh, needs_avx
from numba import from_dtype, types

from qddot.runner.inputs.reader import read_group
from qddot.runner.lanes import judge, series_step
from qddot.runner.machine.inner import OUTER
from qddot.runner.taylor.space import SPACE
from qddot.runner.taylor.step import largest, sizes

LANE_LOOPS = [judge.judge_steps, series_step.size_steps]


@needs_avx
@pytest.mark.parametrize("loop", LANE_LOOPS, ids=lambda loop: loop.py_func.__name__)
def test_a_loop_over_lanes_with_all_that_it_calls_becomes_vectors(loop):
    (signature,) = loop.overloads
    assembly = fresh(loop.py_func, signature)
    assert len(re.findall(PACKED, assembly)) > 10
    assert len(re.findall(SCALAR, assembly)) <= 4  # of what is the same for all lanes
    assert not re.search(r"\bcall", assembly)


@needs_avx
def test_inputs_with_sines_are_read_side_by_side():
    """There is one loop of vectors for the sines, and one for what does not fill a vector."""
    signature = types.void(types.int64, types.float64, types.float64, types.int64)
    assembly = fresh(read_group.py_func, signature, OUTER)
    assert len(re.findall(PACKED, assembly)) >= len(re.findall(SCALAR, assembly)) / 2 > 8


@needs_avx
@pytest.mark.parametrize(
    ("function", "kinds"),
    [
        (sizes, types.UniTuple(types.float64, 2)(from_dtype(SPACE), types.float64)),
        (largest, types.int64(types.Array(types.float64, 1, "C"), types.int64)),
    ],
    ids=["sizes", "largest"],
)
def test_the_largest_of_many_is_found_side_by_side(function, kinds):
    assembly = fresh(function.py_func, kinds, OUTER)
    assert re.search(r"vp(cmpgtq|maxs|maxu)\w*\s.*%[yz]mm", assembly)
