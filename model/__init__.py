"""The mechanics: what a model is (`system`, `check`), and one file per model, each with a `system()` function.

from qddot.model import Constraint, Contact, Coordinate, DryFriction, Event, Impact, Input, Output, Parameter
from qddot.model import Part, Prescribed, Quantity, Rolling, State, System, Table, from_sympy
from qddot.model import Arrow, Bar, Damper, Disc, Ground, Polygon, Spring, Wheel
"""

from qddot.model.constraints import Constraint, Rolling
from qddot.model.contact import Contact
from qddot.model.events import Event, Impact
from qddot.model.friction import DryFriction
from qddot.model.part import Part
from qddot.model.scene import Arrow, Bar, Damper, Disc, Ground, Polygon, Spring, Wheel
from qddot.model.sympy_mechanics import from_sympy
from qddot.model.system import Coordinate, Input, ModelError, Output, Parameter, Prescribed, Quantity, State, System, t
from qddot.model.table import Table

__all__ = [
    "Arrow",
    "Bar",
    "Constraint",
    "Contact",
    "Coordinate",
    "Damper",
    "Disc",
    "DryFriction",
    "Event",
    "Ground",
    "Impact",
    "Input",
    "ModelError",
    "Output",
    "Parameter",
    "Part",
    "Polygon",
    "Prescribed",
    "Quantity",
    "Rolling",
    "Spring",
    "State",
    "System",
    "Table",
    "Wheel",
    "from_sympy",
    "t",
]
