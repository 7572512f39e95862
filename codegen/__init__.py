"""From a model to text: derivation (`lagrange`), lowering (`lower`, `rules`), code (`render`) and `equations`."""
