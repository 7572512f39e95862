"""The loop in C that `make bench` measures ours against ends where ours does."""

import re
import shutil

import pytest

from benchmarks import c_loop


@pytest.mark.skipif(shutil.which("gcc") is None, reason="there is no gcc")
def test_the_loop_in_c_ends_where_ours_does(tmp_path):
    steps = 1000
    case = c_loop.ride(c_loop.qddot.load("m113"), 0.0, end=steps * c_loop.STEP)
    ours = c_loop.ours.one(case, "rk4", step=c_loop.STEP, every=steps)(0.0)()
    assert c_loop._in_c(tmp_path, case, steps)() == pytest.approx(ours, rel=1e-9, abs=1e-12)


def test_each_name_of_a_kernel_is_declared_once():
    text = c_loop._statements(c_loop.m113.rhs.py_func)
    names = re.findall(r"^    double (\w+) = .+;$", text, re.MULTILINE)
    assert len(names) == len(set(names)) > 50
    assert all(re.match(r"    (double \w+|\w+\[\d+\]) = ", line) for line in text.splitlines())
