"""Runs generated models: loading, inputs, integrators, solutions, studies, figures."""
