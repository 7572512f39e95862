"""What was compiled and is read from disk: quick to call, and still fit to become part of what is compiled now."""

from commands import command

#: Runs by two methods, then says whether it has loaded what numba compiles with.
RUNS = """
import sys, qddot
for method, options in (("rk4", {"step": 1e-3}), ("vern7", {})):
    qddot.simulate(qddot.load("quarter_car"), (0, 0.1), method=method, **options).extremes("z_s")
print("numba.np.arrayobj" in sys.modules)
"""

#: Compiles a function that calls a kernel; says how often the kernel came from disk, and whether results agree.
CALLS = """
import numpy as np, qddot
from numba import njit
model = qddot.load("double_pendulum")
rhs, c = model.module.rhs, model.constants(model.parameter_values())
@njit
def doubled(x, u, c, dx):
    rhs(0.0, x, u, c, dx)
    dx *= 2.0
x, u, found, expected = np.array([0.3, -0.4, 0.5, 0.6]), np.empty(0), np.empty(4), np.empty(4)
doubled(x, u, c, found)
rhs.py_func(0.0, x, u, c, expected)
print(sum(rhs.stats.cache_hits.values()), np.allclose(found, 2.0 * expected, rtol=1e-14, atol=1e-14))
"""


def test_a_process_that_compiles_nothing_does_not_load_what_numba_compiles_with():
    assert command(code=RUNS, afresh=True).returncode == 0
    assert command(code=RUNS, afresh=True).stdout == "False\n"


def test_a_kernel_read_from_disk_becomes_part_of_a_function_compiled_now(tmp_path):
    first, second = (command(code=CALLS, afresh=True, NUMBA_CACHE_DIR=tmp_path) for _ in range(2))
    assert first.stdout == "0 True\n", first.stderr
    assert second.stdout == "1 True\n", second.stderr
