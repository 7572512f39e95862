"""Metrics: one number of a run, from uniform samples of one of its quantities. `table` names them all."""
