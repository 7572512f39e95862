"""The mechanics: what a model is (`system`, `check`), and one file per model, each with a `system()` function."""
