"""RK4 over the M113's generated right-hand side, beside the same loop written by hand in C and compiled with -O3."""

import ast
import ctypes
import inspect
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import qddot
from benchmarks import ours
from benchmarks.cases.case import Case, Floats, Run
from benchmarks.cases.m113 import ride
from benchmarks.operations import of_rk4_step
from benchmarks.timing import Table, Timing, dgemm_peak, interleaved
from qddot.generated import m113

STEP, STEPS = 1e-4, 1_000_000

LOOP = """
#include <math.h>
#include <string.h>

static inline void rhs(double t, const double *restrict state, const double *restrict inputs,
                       const double *restrict constants, double *restrict derivative)
{
%s
}

static void look_up(double t, double *u)
{
    double s = t - 0.5;
    u[5] = s > 0.0 && s < 0.1 ? 605.0 * M_PI / 0.2 * sin(M_PI * s / 0.1) : 0.0;
}

void march(double *x, const double *c, double h, long steps)
{
    double u[11] = {0}, k1[14], k2[14], k3[14], k4[14], y[14];
    for (long n = 0; n < steps; ++n) {
        double t = n * h;
        look_up(t, u);
        rhs(t, x, u, c, k1);
        for (int i = 0; i < 14; ++i) y[i] = x[i] + 0.5 * h * k1[i];
        look_up(t + 0.5 * h, u);
        rhs(t + 0.5 * h, y, u, c, k2);
        for (int i = 0; i < 14; ++i) y[i] = x[i] + 0.5 * h * k2[i];
        rhs(t + 0.5 * h, y, u, c, k3);
        for (int i = 0; i < 14; ++i) y[i] = x[i] + h * k3[i];
        look_up(t + h, u);
        rhs(t + h, y, u, c, k4);
        for (int i = 0; i < 14; ++i) x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    }
}
"""


def groups(quick: bool) -> Iterator[Table]:
    """A million steps of the standing vehicle with one shot; a hundred thousand where `quick`."""
    steps = STEPS // 10 if quick else STEPS
    case = ride(qddot.load("m113"), 0.0, end=steps * STEP)
    runs: dict[str, Run] = {"qddot rk4": ours.one(case, "rk4", step=STEP, every=steps)(0.0)}
    title = f"M113, RK4, {steps:,} steps, one run"
    if shutil.which("gcc") is None:
        yield Table(title, (*interleaved(runs, 3), Timing("C, gcc -O3", note="there is no gcc")))
        return
    with tempfile.TemporaryDirectory() as folder:
        runs = {"C, gcc -O3 -march=native": _in_c(Path(folder), case, steps)} | runs
        first, second = (run() for run in runs.values())
        rows = interleaved(runs, 15)
    work, peak = of_rk4_step("m113") * steps, dgemm_peak(1)
    rows = [replace(row, share=work / row.least / peak) for row in rows]
    yield Table(title, (replace(rows[0], note=f"end states {np.abs(first - second).max():.0e} apart"), rows[1]))


def _in_c(folder: Path, case: Case, steps: int) -> Run:
    source, library = folder / "loop.c", folder / "loop.so"
    source.write_text(LOOP % _statements(m113.rhs.py_func), "utf-8")
    flags = ["-O3", "-march=native", "-shared", "-fPIC"]
    subprocess.run(["gcc", *flags, "-o", str(library), str(source), "-lm"], check=True)
    march = ctypes.CDLL(str(library)).march
    pointer = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
    march.argtypes, march.restype = [pointer, pointer, ctypes.c_double, ctypes.c_long], None

    def run() -> Floats:
        x = case.starts[0].copy()
        march(x, case.constants[0], STEP, steps)
        return x[None]

    return run


def _statements(kernel: Callable[..., None]) -> str:
    """The assignments of a generated kernel as C: their arithmetic is written the same way there."""
    function = ast.parse(inspect.getsource(kernel)).body[0]
    assert isinstance(function, ast.FunctionDef)
    lines = []
    for statement in function.body:
        if not isinstance(statement, ast.Assign):
            continue
        target, value = statement.targets[0], statement.value
        pairs = [(target, value)]
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            pairs = list(zip(target.elts, value.elts, strict=True))
        for one, its in pairs:
            kind = "double " if isinstance(one, ast.Name) else ""
            lines.append(f"    {kind}{ast.unparse(one)} = {ast.unparse(its)};")
    return "\n".join(lines)
