"""Loops that are written to become vector instructions do, where they are compiled with all that they call."""

import re

from lane_assembly import PACKED, SCALAR, fresh, needs_avx
from numba import types

from qddot.runner.inputs.reader import read_group
from qddot.runner.lanes import judge
from qddot.runner.machine.inner import OUTER
from qddot.runner.taylor.step import largest


@needs_avx
def test_a_loop_over_lanes_with_all_that_it_calls_becomes_vectors():
    (signature,) = judge.judge_steps.overloads
    assembly = fresh(judge.judge_steps.py_func, signature)
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
def test_the_largest_of_many_is_found_side_by_side():
    assembly = fresh(largest.py_func, types.int64(types.Array(types.float64, 1, "C"), types.int64), OUTER)
    assert re.search(r"vp(cmpgtq|maxs|maxu)\w*\s.*%[yz]mm", assembly)
