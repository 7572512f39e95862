"""What is kept of a compiled kernel is code, not the text that it was made of, which takes long to take apart."""

from pathlib import Path

import numpy as np

import qddot
from qddot.codegen.generate import generate
from qddot.model import double_pendulum


def test_kernels_are_kept_without_their_text(tmp_path):
    model = qddot.load(generate(double_pendulum.system(), tmp_path))
    x, dx = np.array([0.3, -0.2, 0.1, 0.4]), np.empty(4)
    kernel = model.kernel("rhs")
    kernel(0.0, x, np.zeros(1), model.constants(model.parameter_values()), dx)
    kept = list(tmp_path.rglob("*rhs*.nbc")) or list(Path(kernel.function.stats.cache_path).rglob("*rhs*.nbc"))
    assert kept
    assert not any(b"# --- LINE" in file.read_bytes() for file in kept)
    again = qddot.load(tmp_path / "double_pendulum.py").kernel("rhs")
    found = np.empty(4)
    again(0.0, x, np.zeros(1), model.constants(model.parameter_values()), found)
    assert (found == dx).all()
