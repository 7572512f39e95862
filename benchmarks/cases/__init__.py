"""Runs of mechanical models, each in every form that some tool wants, with a reference solution."""
