"""Divisions by zero and other numbers that are none: every caller of a kernel says what they mean."""

from pathlib import Path

import pytest

import qddot

SAMPLE = Path("tests/sample_models/oscillator.py")


def test_a_module_whose_kernels_raise_at_a_division_by_zero_is_to_be_generated_again(tmp_path):
    path = tmp_path / "old.py"
    path.write_text(SAMPLE.read_text().replace(', error_model="numpy"', ""))
    with pytest.raises(qddot.LoadError, match=r"old\.py: kernel 'constants' raises at a division by zero.*again"):
        qddot.load(path)
