"""Kernels and equations of the shipped models, written by `qddot generate` and never edited."""
