import numpy as np
import pytest

from runner.inputs.csv_table import table_from_csv


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
        ("t,force\n0,0\n1,0\n", {"value": "forces"}, "unknown column 'forces'; did you mean 'force'"),
        ("0,0\n1,0\n", {"value": "force"}, "no heading, so there is no column 'force'"),
        ("t,F,F\n0,0,0\n1,0,0\n", {"value": "F"}, "column 'F' occurs 2 times"),
        ("t [s],F [kN]\n0,0\n1,0\n", {"unit": "m"}, r"column 'F': \[kN\] cannot be turned into \[m\]"),
        ("t [s],F [foo]\n0,0\n1,0\n", {}, r"column 'F': unknown unit \[foo\]"),
        ("t [s],F [kN]\n0,0\n1,0\n", {"value_unit": "N"}, r"the heading says \[kN\], declared is \[N\]"),
        (b"t,F\n0,\xff\xfe\n", {}, "recoil.csv: not UTF-8 text"),
    ],
)
def test_bad_file_is_named_with_line_and_column(written, content, arguments, message):
    with pytest.raises(ValueError, match=message):
        table_from_csv(written(content), **arguments)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.csv"):
        table_from_csv(tmp_path / "none.csv")
