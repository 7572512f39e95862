"""Fitting named unknowns of studies to observations: `problem` reads, `fit` solves, `judge` says how sure it is."""
