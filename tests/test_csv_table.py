import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qddot.runner.inputs.csv_table import table_from_csv
from qddot.runner.inputs.tables import resampled


@pytest.fixture
def written(tmp_path):
    def write(content):
        path = tmp_path / "recoil.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.mark.parametrize(
    "content",
    [
        "t,F\n0,0\n0.5,2.5\n1,0\n",
        b"\xef\xbb\xbft,F\r\n0,0\r\n0.5,2.5\r\n1,0\r\n",
        "t;F\n0;0\n0,5;2,5\n1;0\n",
        "t\tF\n0\t0\n0,5\t2,5\n1\t0\n",
        "# measured on the range\nt, F\n\n0, 0\n0.5, 2.5\n1, 0",
        '"t","F"\n"0","0"\n"0.5","2.5"\n"1","0"\n',
        "0,0\n0.5,2.5\n1,0\n",
        "0;0\n5e-1;2,5E0\n1;0\n",
    ],
)
def test_spellings_of_one_table_read_alike(written, content):
    signal = table_from_csv(written(content))
    np.testing.assert_allclose(signal([0.25, 0.5, 0.75, 2.0]), [1.25, 2.5, 1.25, 0.0])


def test_columns_are_found_by_heading_and_turned_into_the_unit_wanted(written):
    path = written("shot; time [ms]; force (kN)\n1; 0; 0\n1; 500; 2,5\n1; 1000; 0\n")
    for unit in (None, "N"):
        assert table_from_csv(path, time="time", value="force", unit=unit)(0.5) == pytest.approx(2500.0)
    assert table_from_csv(path, time="time [ms]", value=2, unit="kN")(0.5) == pytest.approx(2.5)


def test_declared_units_are_turned_like_those_in_the_heading(written):
    path = written("0,0\n500,2.5\n1000,0\n")
    assert table_from_csv(path, time_unit="ms", value_unit="kN", unit="N")(0.5) == pytest.approx(2500.0)


def test_angles_become_radians(written):
    assert table_from_csv(written("t [s],angle [deg]\n0,180\n1,180\n"))(0.5) == pytest.approx(np.pi)


@pytest.mark.parametrize(
    ("content", "arguments", "message"),
    [
        ("", {}, "recoil.csv: the file has no rows"),
        ("t,F\n0,0\n", {}, "recoil.csv: 1 rows of numbers; a table needs two or more"),
        ("t,F\n0,0\n1,abc\n", {}, "recoil.csv, line 3, column 'F': 'abc' is not a number"),
        ("t,F\n0,0\n1\n", {}, "recoil.csv, line 3: no column 'F'; the line has 1 of 2 columns"),
        ("t,F\n0,0\n1,\n", {}, "recoil.csv, line 3, column 'F': '' is not a number"),
        ("# c\nt,F\n0,0\n\n1,nan\n", {}, "recoil.csv, line 5: value is nan, expected a finite number"),
        ("t,F\n0,0\n2,0\n1,0\n", {}, "recoil.csv, line 4: time 1.0 is before that of .*recoil.csv, line 3, 2.0"),
        ("t,F\n0,0\n1,0\n1,0\n", {}, "recoil.csv, line 4: time 1.0 repeats that of .*line 3"),
        ("t;F\n0;0\n1;1.234,5\n", {}, "line 3, column 'F': '1.234,5' is not a number"),
        ("t,F\n0,0\n1,1_000\n", {}, "'1_000' is not a number"),
        ("t,force\n0,0\n1,0\n", {"value": "forces"}, "unknown column 'forces'; did you mean force?"),
        ("0,0\n1,0\n", {"value": "force"}, "no heading, so there is no column 'force'"),
        ("t,F,F\n0,0,0\n1,0,0\n", {"value": "F"}, "column 'F' occurs 2 times"),
        ("t [s],F [kN]\n0,0\n1,0\n", {"unit": "m"}, r"column 'F': \[kN\] cannot be turned into \[m\]"),
        ("t [s],F [foo]\n0,0\n1,0\n", {}, r"column 'F': unknown unit \[foo\]"),
        ("t [s],F [kN]\n0,0\n1,0\n", {"value_unit": "N"}, r"the heading says \[kN\], declared is \[N\]"),
        (b"t,F\n0,\xff\xfe\n", {}, "recoil.csv: not UTF-8 text"),
        ("t,F\n0,0\n1,0\n".encode("utf-16"), {}, "recoil.csv: not UTF-8 text .*save it as UTF-8"),
        ("t,F\n0,0,0,0\n0,5,2,5\n", {}, "line 2: 4 columns where the heading has 2; .*decimal commas need ; or tabs"),
        ("t [m],F [kN]\n0,0\n1,0\n", {}, r"column 't': \[m\] cannot be turned into \[s\]"),
        ("t,F\nnan,0\n1,0\n", {}, "recoil.csv, line 2: time is nan, expected a finite number"),
        ("t,F\n0,inf\n1,0\n", {}, "recoil.csv, line 2: value is inf"),
        ("t F\n0 0\n1 0\n", {}, "line 2, column 't F': '0 0' is not a number"),
        ("t,F\n0,0\n1,0\n", {"value": 2}, "line 2: no column '2'; the line has 2 of 3 columns"),
        ("t,F\n0,0\n1,0\n", {"value": -1}, "column -1: columns are counted from 0"),
        ("t,F\n0,0\n1,0\n", {"resample": 0.0}, "resample is 0.0, expected a spacing greater than 0"),
        ("t,F\n0,0\n1,0\n", {"resample": 1e-12}, "resample is 1e-12: that is more than 10000000 samples"),
        ("t,F\n0,0\n2,0\n1,0\n", {"resample": 0.1}, "recoil.csv, line 4: time 1.0 is before that of"),
        (
            "x [m],z [mm]\n0,0\n0,1\n",
            {"argument": ("distance", "m")},
            "line 3: distance 0.0 repeats .*distances must rise",
        ),
    ],
)
def test_bad_file_is_named_with_line_and_column(written, content, arguments, message):
    with pytest.raises(ValueError, match=message):
        table_from_csv(written(content), **arguments)


@given(st.lists(st.tuples(st.floats(0.01, 1.0), st.floats(-1e3, 1e3)), min_size=2, max_size=30), st.floats(0.005, 3.0))
@settings(deadline=None)
def test_resampling_keeps_the_integral_and_the_range(steps, spacing):
    t, values = np.cumsum([step for step, _ in steps]), np.array([value for _, value in steps])
    even, means = resampled(t, values, spacing)
    assert (even[0], even[-1]) == (t[0], t[-1])
    assert np.diff(even).max() <= spacing * (1 + 1e-9)
    assert np.trapezoid(means, even) == pytest.approx(np.trapezoid(values, t), rel=1e-9, abs=1e-9)
    assert values.min() - 1e-6 <= means.min() <= means.max() <= values.max() + 1e-6


def test_a_file_is_resampled_only_when_asked(written):
    rows = "".join(f"{i / 1000},{np.sin(i / 100)}\n" for i in range(1001))
    assert len(table_from_csv(written(rows)).pieces) == 1002
    coarse = table_from_csv(written(rows), resample=0.01)
    assert len(coarse.pieces) == 102
    np.testing.assert_allclose(coarse([0.2, 0.5]), np.sin([2.0, 5.0]), atol=1e-3)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.csv"):
        table_from_csv(tmp_path / "none.csv")
