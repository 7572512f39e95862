"""The mechanics: what a model is (`system`, `check`), and one file per model, each with a `system()` function.

from qddot.model import Coordinate, Input, Output, Parameter, Quantity, State, System, Table
"""

from qddot.model.system import Coordinate, Input, ModelError, Output, Parameter, Quantity, State, System, t
from qddot.model.table import Table

__all__ = ["Coordinate", "Input", "ModelError", "Output", "Parameter", "Quantity", "State", "System", "Table", "t"]
