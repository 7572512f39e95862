"""Random expressions in the symbols of a model: read, shortened, written and cut, they keep their value."""

import pytest
import symengine as se
from displayed import at, derived, random_point
from hypothesis import given, settings
from hypothesis import strategies as st
from latex_reader import LatexReader

from qddot.codegen.equations.latex_script import LatexScript
from qddot.codegen.equations.layout import lines
from qddot.codegen.equations.legible import legible
from qddot.codegen.equations.order import Order
from qddot.codegen.equations.reading import Reader
from qddot.codegen.equations.typesetter import Typesetter

PENDULUM = derived("double_pendulum")
LEAVES = [se.Symbol(name) for name in ("m_1", "l_1", "g", "theta_1", "theta_2", "thetadot_1", "thetadot_2", "t")]
ANGLES = [se.Symbol("theta_1"), se.Symbol("theta_2")]


def expressions() -> st.SearchStrategy:
    leaves = st.one_of(
        st.sampled_from(LEAVES),
        st.integers(1, 4).map(se.Integer),
        st.sampled_from([se.Rational(1, 2), se.Rational(-2, 3), se.RealDouble(0.25)]),
        st.sampled_from([f(x) for f in (se.sin, se.cos) for x in ANGLES]),
    )

    def grown(inner):
        pairs = st.tuples(inner, inner)
        return st.one_of(
            pairs.map(lambda p: p[0] + p[1]),
            pairs.map(lambda p: p[0] - p[1]),
            pairs.map(lambda p: p[0] * p[1]),
            pairs.map(lambda p: p[0] / (1 + p[1] ** 2)),
            inner.map(lambda x: x**2),
            inner.map(lambda x: se.sqrt(1 + x**2)),
            inner.map(se.sin),
            inner.map(lambda x: se.exp(-se.cos(x))),
        )

    return st.recursive(leaves, grown, max_leaves=12)


@settings(deadline=None)
@given(expressions(), st.booleans(), st.integers(0, 10))
def test_whatever_is_read_is_written_with_the_same_value(expression, turn, seed):
    point = random_point(PENDULUM, seed)
    total = Reader(Order(PENDULUM), turn=turn).sum(expression)
    script = LatexScript()
    reader = LatexReader({script.name(str(symbol)).text: value for symbol, value in point.items()})
    boxes = Typesetter(script).terms(total)
    assert reader.value("".join(box.text for box in boxes)) == pytest.approx(at(expression, point), rel=1e-9, abs=1e-9)
    cut = [box.text for line in lines(boxes, 6.0, 1.0) for box in line]
    assert reader.value(" ".join(cut)) == pytest.approx(at(expression, point), rel=1e-9, abs=1e-9)


@settings(deadline=None)
@given(expressions(), st.integers(0, 10))
def test_the_legible_form_has_the_same_value(expression, seed):
    point = random_point(PENDULUM, seed)
    value = at(legible(expression, Order(PENDULUM).fixed), point)
    assert value == pytest.approx(at(expression, point), rel=1e-9, abs=1e-9)
