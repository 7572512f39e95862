"""From a model to text: derivation (`lagrange`), lowering (`lower`, `kernel`, `rules`) and rendering (`render`)."""
