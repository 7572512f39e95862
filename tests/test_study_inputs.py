"""Guns and roads in studies: what a file says is what drives the model, and every slip is named."""

import re
import tempfile
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from study_files import assert_refused, slip, write

from qddot.runner.commands.show_study import show_study
from qddot.runner.inputs.drive import drive
from qddot.runner.inputs.iso8608 import CLASSES, random_road
from qddot.runner.inputs.recoil import measured_pulse_train
from qddot.runner.inputs.shapes import pulse_train
from qddot.runner.load import load
from qddot.runner.simulate import simulate
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.arguments import study_model, study_parameters
from qddot.runner.study.library import SHIPPED, entries
from qddot.runner.study.read import StudyError, read
from qddot.runner.study.ready import run_study
from qddot.runner.study.road import road_profile, road_signals
from qddot.runner.study.signals import study_signals

HEAD = """\
model = "m113"
parameter_set = "as_run_unloaded"
span = [0, 2]

[integration]
step = 1e-3

"""
SMOOTH = HEAD + '[inputs.F]\nkind = "table"\nt = [0, 1]\nvalues = [0, 1e3]\n'
GUN = HEAD + '[inputs.F]\nkind = "pulse_train"\n'
SHOT = GUN + "times = [1.0]\n"
ROAD = HEAD + '[road]\nspeed = "36 km/h"\n'
RANDOM = ROAD + 'kind = "iso8608"\nroughness = "D"\nseed = 3\n'
PLAIN = """\
model = "chain"
span = [0, 1]
[integration]
step = 1e-3
[road]
kind = "ramp"
height = 0.1
length = 1
speed = 1
"""


def signals(folder, text):
    path = write(folder, text)
    study = read(path)
    model = study_model(study, path)
    p = model.parameter_values(study_parameters(study, model, Amounts(path)))
    return study_signals(study, model, p, path)


def test_a_burst_is_its_shots(tmp_path):
    found = signals(
        tmp_path, GUN + 'count = 3\nrate_of_fire = 200\nstart = "500 ms"\npeak = "11.15 kN"\nduration = 0.1\n'
    )
    expected = pulse_train(times=[0.5, 0.8, 1.1], peak=11150.0, duration=0.1)
    np.testing.assert_allclose(found["F"].pieces, expected.pieces, rtol=1e-12, atol=1e-9)
    same = signals(tmp_path, GUN + 'count = 3\ninterval = "0.3 s"\nstart = 0.5\npeak = 11150\nduration = "100 ms"\n')
    np.testing.assert_allclose(same["F"].pieces, expected.pieces, rtol=1e-12, atol=1e-9)


def test_ammunition_gives_the_impulse(tmp_path):
    text = SHOT + 'peak = "11150 N"\nshell_mass = "725 g"\nmuzzle_velocity = "1385 m/s"\n'
    found = signals(tmp_path, text)["F"]
    expected = pulse_train(times=[1.0], peak=11150.0, impulse=0.725 * 1385)
    np.testing.assert_allclose(found.pieces, expected.pieces, rtol=1e-12, atol=1e-9)
    charged = signals(tmp_path, text + 'charge_mass = "0.3 kg"\ngas_velocity_factor = 1.5\n')["F"]
    expected = pulse_train(times=[1.0], peak=11150.0, impulse=(0.725 + 1.5 * 0.3) * 1385)
    np.testing.assert_allclose(charged.pieces, expected.pieces, rtol=1e-12, atol=1e-9)


def test_a_measured_curve_is_read_and_repeated(tmp_path):
    (tmp_path / "curve.csv").write_text("t [ms];F [kN]\n0;0\n40;9,5\n100;0\n")
    text = HEAD + '[inputs.F]\nkind = "measured_pulse_train"\nfile = "curve.csv"\ntimes = [0.5, 1.5]\n'
    expected = measured_pulse_train([0, 0.04, 0.1], [0, 9500, 0], times=[0.5, 1.5])
    np.testing.assert_allclose(signals(tmp_path, text)["F"].pieces, expected.pieces, rtol=1e-12, atol=1e-9)
    scaled = measured_pulse_train([0, 0.04, 0.1], [0, 9500, 0], times=[0.5, 1.5], impulse=605.0)
    np.testing.assert_allclose(signals(tmp_path, text + "impulse = 605\n")["F"].pieces, scaled.pieces, atol=1e-6)
    coarse = signals(tmp_path, text + 'resample = "20 ms"\n')["F"]
    assert len(coarse.pieces) == 13


def test_every_axle_reads_the_road_and_all_share_its_pieces(tmp_path):
    found = signals(tmp_path, RANDOM + 'start = "2 m"\nlength = "100 m"\n')
    model = load("m113")
    road = random_road("D", seed=3, length=100.0)
    expected = drive(model, road, 10.0, parameters="as_run_unloaded", start=2.0)
    assert list(found) == [f"z_{i}" for i in range(1, 6)]
    assert len({id(signal.pieces) for signal in found.values()}) == 1
    t = np.linspace(0, 2, 50)
    for name, signal in found.items():
        np.testing.assert_allclose(signal(t), expected[name](t), rtol=1e-12)


def test_a_profile_made_once_serves_many_speeds(tmp_path):
    path = write(tmp_path, RANDOM)
    study, amounts = read(path), Amounts(path)
    model = study_model(study, path)
    road, p = road_profile(study.road, amounts), model.parameter_values("as_run_unloaded")
    for speed in (5.0, 9.0):
        spec = study.road.model_copy(update={"speed": speed})
        found = road_signals(spec, model, p, (0.0, 2.0), amounts, road)
        assert {id(signal.pieces) for signal in found.values()} == {id(road.pieces)}
        assert {signal.rate for signal in found.values()} == {speed}


def test_the_geometry_of_the_study_places_the_axles(tmp_path):
    text = ROAD + 'kind = "step"\nheight = "5 cm"\nat = "8 m"\n[parameters]\nl_6 = "1.0 m"\n'
    found = signals(tmp_path, text)
    assert found["z_5"].breakpoint_times() == pytest.approx([(8 + 0.98 + 0.34) / 10])
    moved = signals(tmp_path, text + "[road.positions]\nz_5 = -3\n")
    assert moved["z_5"].breakpoint_times() == pytest.approx([1.1])
    assert moved["z_1"].breakpoint_times() == pytest.approx([(8 - 1.66) / 10])


def test_a_model_without_positions_is_given_them(tmp_path):
    text = PLAIN.replace("speed = 1", "speed = 1\npositions = { F = 0 }").replace('"chain"', '"cart_pole"')
    names = [channel.name for channel in load("cart_pole").tables.inputs]
    assert "F" in names
    assert list(signals(tmp_path, text)) == ["F"]


def test_roads_of_every_kind_have_their_heights(tmp_path):
    (tmp_path / "road.csv").write_text("x [m];z [cm]\n0;0\n1;5\n2;0\n")
    cases = {
        'kind = "sine"\namplitude = "5 cm"\nwavelength = "4 m"\n': (1.0, 0.05),
        'kind = "ramp"\nheight = "5 cm"\nlength = "2 m"\nat = 1\n': (2.0, 0.025),
        'kind = "step"\nheight = "5 cm"\nat = 1\n': (1.1, 0.05),
        'kind = "step"\nheight = "5 cm"\nat = 1\nlength = "20 cm"\n': (1.1, 0.025),
        'kind = "cosine_bump"\nheight = "5 cm"\nlength = "2 m"\n': (0.5, 0.025),
        'kind = "pothole"\ndepth = "5 cm"\nlength = "2 m"\nedge = "1 m"\n': (0.5, -0.025),
        'kind = "profile"\nfile = "road.csv"\n': (0.5, 0.025),
        'kind = "profile"\nx = [0, 1, 2]\nz = [0, "5 cm", 0]\n': (0.5, 0.025),
    }
    for text, (x, height) in cases.items():
        path = write(tmp_path, ROAD + text)
        assert road_profile(read(path).road, Amounts(path))(x) == pytest.approx(height), text


def test_a_speed_profile_is_driven(tmp_path):
    text = ROAD.replace('speed = "36 km/h"\n', "") + 'kind = "step"\nheight = 0.05\nat = "5 m"\n[road.speed_profile]\n'
    inline = signals(tmp_path, text + 't = [0, 2]\nv = [0, "72 km/h"]\n')
    assert inline["z_3"].breakpoint_times()[0] == pytest.approx(np.sqrt(2 * 4.66 / 10))
    (tmp_path / "speed.csv").write_text("t [s],v [km/h]\n0,0\n2,72\n")
    read_in = signals(tmp_path, text + 'file = "speed.csv"\n')
    np.testing.assert_allclose(read_in["z_3"].pieces, inline["z_3"].pieces, atol=1e-12)


def test_a_random_road_is_the_same_by_class_and_by_number(tmp_path):
    by_class = signals(tmp_path, RANDOM)["z_1"]
    by_number = signals(tmp_path, RANDOM.replace('"D"', '"1024e-6 m^3"'))["z_1"]
    np.testing.assert_allclose(by_class.pieces, by_number.pieces, rtol=1e-12, atol=1e-15)
    assert CLASSES["D"] == pytest.approx(1024e-6)


def test_the_rate_of_a_road_is_asked_for_by_the_model_that_reads_it(tmp_path):
    """A model with a damper in its tyre needs the road's rate: a step has none, a ramp has."""
    sample = Path("tests/sample_models/oscillator.py").resolve()
    (tmp_path / "oscillator.py").write_text(sample.read_text())
    text = 'model = "oscillator.py"\nspan = [0, 2]\n[integration]\nstep = 1e-3\n[road]\npositions = { z_1 = 0 }\n'
    text += 'speed = 2\nkind = "step"\nheight = 0.05\nat = 1\n'
    with pytest.raises(
        StudyError, match=r"input z_1 jumps at t = 0.5, but the model reads its rate zdot_1; give it a ramp"
    ):
        run_study(write(tmp_path, text))
    solution = run_study(write(tmp_path, text + 'length = "1 cm"\n'))
    assert solution["zdot_1"].max() == pytest.approx(2 * 0.05 / 0.01)


def test_entries_of_the_library_have_an_origin_for_every_number():
    found = entries(SHIPPED)
    assert {"gun_12_7mm", "gun_30mm", "frozen_plough"} <= set(found)
    for name, entry in found.items():
        numbers = set(entry) - {"title", "kind", "origin"}
        assert set(entry["origin"]) == numbers, name
        for text in entry["origin"].values():
            assert re.match(r"(paper|published|derived|assumed|typical)\b", text), text


def test_the_pulse_of_the_papers_shot_is_that_of_about_ten_rounds(tmp_path):
    """From the library's own numbers; bullet and gases of a round by hand, and that what is said of it is so."""
    fired = {}
    for name in ("gun_12_7mm", "round_12_7mm"):
        signal = signals(tmp_path, HEAD + f'[inputs.F]\nfrom = "{name}"\ntimes = [1.0]\n')["F"]
        t = np.linspace(0.9, 1.2, 30001)
        fired[name] = np.trapezoid(signal(t), t)
    bullet, gases = 0.0424 * 923, 1.75 * 0.0161 * 923
    assert fired["round_12_7mm"] == pytest.approx(bullet + gases, rel=1e-6)
    assert fired["gun_12_7mm"] == pytest.approx(605.0, rel=1e-6)
    entry = entries(SHIPPED)["gun_12_7mm"]
    said = re.search(r"([\d.]+) times that of round_12_7mm", entry["origin"]["impulse"])
    assert float(said[1]) == pytest.approx(605.0 / fired["round_12_7mm"], abs=0.05)
    assert "about ten rounds" in entry["title"]
    assert (round(bullet), round(bullet + gases)) == (39, 65)
    assert "39 N s of bullet and 65 N s with its gases" in (SHIPPED.parent / "paper" / "paper.toml").read_text()


def test_an_entry_is_taken_up_and_its_fields_overridden(tmp_path):
    text = HEAD + '[inputs.F]\nfrom = "gun_30mm"\ntimes = [1.0]\n'
    found = signals(tmp_path, text)["F"]
    expected = pulse_train(times=[1.0], peak=11150.0, impulse=0.725 * 1385)
    np.testing.assert_allclose(found.pieces, expected.pieces, rtol=1e-12, atol=1e-9)
    higher = signals(tmp_path, text + 'peak = "20 kN"\n')["F"]
    expected = pulse_train(times=[1.0], peak=2e4, impulse=0.725 * 1385)
    np.testing.assert_allclose(higher.pieces, expected.pieces, rtol=1e-12, atol=1e-9)
    other = signals(tmp_path, text + 'impulse = 900\nduration = "0.1 s"\nshape = "triangle"\n')["F"]
    expected = pulse_train("triangle", times=[1.0], impulse=900.0, duration=0.1)
    np.testing.assert_allclose(other.pieces, expected.pieces, rtol=1e-12, atol=1e-9)


def test_a_library_of_ones_own_stands_before_the_shipped_one(tmp_path):
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "mine.toml").write_text('[gun_30mm]\nkind = "pulse_train"\npeak = 5.0\nduration = 0.1\n')
    found = signals(tmp_path, HEAD + '[inputs.F]\nfrom = "gun_30mm"\ntimes = [1.0]\n')["F"]
    assert found(1.05) == pytest.approx(5.0)


BAD = {
    "no schedule": (GUN + "peak = 1\nduration = 1\n", "line 8: inputs.F: give either times, or count with interval"),
    "two schedules": (SHOT + "count = 2\n", "inputs.F: give either times, or count"),
    "start of times": (SHOT + "start = 1\n", "inputs.F: times say it all; leave out start"),
    "count without interval": (
        GUN + "count = 2\npeak = 1\nduration = 1\n",
        "2 shots need an interval or a rate_of_fire",
    ),
    "rate as rpm": (
        GUN + 'count = 2\nrate_of_fire = "200 rpm"\n',
        "line 11: inputs.F.rate_of_fire: '200 rpm' is no amount of 1/min: one counts angles",
    ),
    "angular frequency": (
        HEAD + '[inputs.F]\nkind = "sine"\namplitude = 1\nfrequency = "3 rad/s"\n',
        "line 11: inputs.F.frequency: '3 rad/s' is no amount of Hz",
    ),
    "two impulses": (
        SHOT + "impulse = 1\nshell_mass = 1\nmuzzle_velocity = 1\n",
        "line 11: inputs.F.impulse: the ammunition gives the impulse",
    ),
    "half of the ammunition": (SHOT + "peak = 1\nshell_mass = 1\n", "muzzle_velocity is missing"),
    "mass as a velocity": (
        SHOT + 'peak = 1\nshell_mass = "1 m/s"\nmuzzle_velocity = 1\n',
        "line 12: inputs.F.shell_mass: '1 m/s' is in m/s, expected kg or a multiple of it",
    ),
    "ammunition of a length": (
        slip(HEAD, "m113", "quarter_car").replace('parameter_set = "as_run_unloaded"\n', "")
        + '[inputs.z_r]\nkind = "pulse_train"\ntimes = [1]\nduration = 1\nshell_mass = 1\nmuzzle_velocity = 1\n',
        "line 11: inputs.z_r.shell_mass: ammunition gives N s, but the input is in m; give two of peak",
    ),
    "unknown shape": (SHOT + 'shape = "square"\n', "inputs.F.shape: unknown shape 'square'; there are: "),
    "unknown entry": (
        HEAD + '[inputs.F]\nfrom = "gun_30"\ntimes = [1]\n',
        "line 9: inputs.F.from: unknown library entry 'gun_30'; did you mean 'gun_30mm'?",
    ),
    "gun as a road": (HEAD + '[road]\nfrom = "gun_30mm"\n', "line 8: road.kind: unknown kind 'pulse_train'"),
    "no curve": (
        HEAD + '[inputs.F]\nkind = "measured_pulse_train"\ntimes = [1]\n',
        "inputs.F: give either file, or t and values",
    ),
    "curve out of order": (
        HEAD + '[inputs.F]\nkind = "measured_pulse_train"\ntimes = [1]\nt = [0, 2, 1]\nvalues = [0, 1, 0]\n',
        "inputs.F: sample 2: time 1.0 is before that of sample 1",
    ),
    "resampled without a file": (
        HEAD + '[inputs.F]\nkind = "measured_pulse_train"\ntimes = [1]\nt = [0, 1]\nvalues = [0, 1]\nresample = 0.1\n',
        "line 13: inputs.F.resample: only a file is resampled",
    ),
    "unknown kind of road": (ROAD + 'kind = "stepp"\n', "road.kind: unknown kind 'stepp'; did you mean 'step'?"),
    "no kind of road": (ROAD, "line 8: road: missing kind; there are: profile, sine, ramp, step, cosine_bump"),
    "unknown key of a road": (
        ROAD + 'kind = "step"\nheigth = 1\n',
        "line 11: road.heigth: unknown key 'heigth'; did you mean 'height'?",
    ),
    "missing height": (ROAD + 'kind = "step"\n', "line 8: road.height: missing; A step up by `height`"),
    "no speed": (
        slip(ROAD, "speed =", "start = 0 #") + 'kind = "step"\nheight = 1\n',
        "road: give either speed, such",
    ),
    "speed in m": (
        slip(ROAD, "km/h", "km") + 'kind = "step"\nheight = 1\n',
        "line 9: road.speed: '36 km' is in km, expected m/s or a multiple of it",
    ),
    "two speeds": (
        ROAD + 'kind = "step"\nheight = 1\nspeed_profile = { t = [0, 1], v = [0, 1] }\n',
        "road: give either speed, such",
    ),
    "speed out of order": (
        HEAD + '[road]\nkind = "step"\nheight = 1\nspeed_profile = { t = [0, 0], v = [0, 1] }\n',
        "road.speed_profile: sample 1: time 0.0 repeats",
    ),
    "speed of nothing": (
        HEAD + '[road]\nkind = "step"\nheight = 1\nspeed_profile = { t = [0, 1] }\n',
        "line 11: road.speed_profile: give either file, or t and v",
    ),
    "unknown axle": (
        ROAD + 'kind = "step"\nheight = 1\npositions = { z_9 = 0 }\n',
        "line 12: road.positions.z_9: unknown input 'z_9'; did you mean 'z_",
    ),
    "a model without a place for a road": (PLAIN, "road: model chain does not say which inputs read a road"),
    "an input twice": (
        ROAD + 'kind = "step"\nheight = 1\n[inputs.z_3]\nkind = "constant"\nvalue = 0\n',
        "line 12: inputs.z_3: z_3 already reads the road",
    ),
    "road too short": (
        RANDOM + 'length = "20 m"\n',
        "line 13: road.length: the run reads the road up to 21.66 m, but it ends at 20 m; make it longer",
    ),
    "road too short for a speed profile": (
        slip(RANDOM, 'speed = "36 km/h"', "speed_profile = { t = [0, 1], v = [0, 10] }") + "length = 15\n",
        "road.length: the run reads the road up to 16.66 m, but it ends at 15 m",
    ),
    "unknown class": (slip(RANDOM, '"D"', '"J"'), "line 11: road.roughness: 'J'"),
    "roughness of another unit": (
        slip(RANDOM, '"D"', '"1 m^2"'),
        "road.roughness: '1 m^2' is in m^2, expected m^3",
    ),
    "no seed": (slip(RANDOM, "seed = 3\n", ""), "road.seed: missing; A random road after ISO 8608"),
    "broken seed": (slip(RANDOM, "seed = 3", "seed = 0.5"), "line 12: road.seed: found 0.5, expected a whole number"),
    "negative seed": (slip(RANDOM, "seed = 3", "seed = -3"), "road: seed is -3, expected a whole number"),
    "edge too long": (
        ROAD + 'kind = "pothole"\ndepth = 0.1\nlength = 1\nedge = 2\n',
        "road: edge is 2.0, expected a length from 0 to half",
    ),
    "no profile": (ROAD + 'kind = "profile"\n', "road: give either file, or x and z"),
    "profile missing": (ROAD + 'kind = "profile"\nfile = "no.csv"\n', "line 11: road.file: there is no file"),
    "profile out of order": (
        ROAD + 'kind = "profile"\nx = [0, 2, 1]\nz = [0, 1, 0]\n',
        "road: sample 2: distance 1.0 is before that of sample 1, 2.0; distances must rise",
    ),
    "profile of unequal rows": (
        ROAD + 'kind = "profile"\nx = [0, 2, 1]\nz = [0, 1]\n',
        "road: a table needs two samples",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_gun_or_road_is_refused_with_its_place(tmp_path, case):
    text, message = BAD[case]
    assert_refused(run_study, write(tmp_path, text), message)


GIVEN = {
    "iso8608": {
        "roughness": '"C"',
        "seed": 1,
        "length": 50,
        "waviness": 2.0,
        "shortest": 0.5,
        "longest": 20,
        "fade": 1,
    },
    "sine": {"amplitude": 0.1, "wavelength": 3, "phase": 0, "mean": 0},
    "ramp": {"height": 0.1, "length": 1, "at": 0},
    "step": {"height": 0.1, "length": 0, "at": 0},
    "cosine_bump": {"height": 0.1, "length": 1, "at": 0},
    "pothole": {"depth": 0.1, "length": 1, "at": 0, "edge": 0.1},
    "profile": {"x": "[0, 1]", "z": "[0, 0.1]", "interpolation": '"linear"'},
    "pulse_train": {
        "count": 2,
        "interval": 1,
        "start": 0,
        "peak": 1,
        "duration": 0.1,
        "shape": '"triangle"',
        "rise": 0.2,
    },
}
ODD = ["nan", "inf", "0", "-1", "1e300", "1e-300", "1e400", "123456789012345678901", '""', '"x"', '"3"', '"5 kg"']
ODD += [
    "true",
    "[]",
    "{}",
    "[[1]]",
    '"nan m"',
    '"km/h"',
    '"1 +- 2 m"',
    '"1 m / 0"',
    '"9**9**9 m"',
    '"10**100000000"',
    "1979-05-27",
]


@given(st.data(), st.sampled_from(sorted(GIVEN)), st.sampled_from(ODD))
@settings(deadline=None, max_examples=150)
def test_an_odd_value_gives_signals_or_an_error_with_its_place(data, kind, odd):
    keys = GIVEN[kind] if kind == "pulse_train" else GIVEN[kind] | {"speed": 3, "start": 0}
    keys = keys | {data.draw(st.sampled_from(sorted(keys))): odd}
    table = "inputs.F" if kind == "pulse_train" else "road"
    text = HEAD + f'[{table}]\nkind = "{kind}"\n' + "".join(f"{key} = {value}\n" for key, value in keys.items())
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = signals(Path(folder), text)
        except StudyError as error:
            assert str(error).startswith(folder)
        else:
            for signal in found.values():
                assert np.isfinite(signal.pieces).all()


def test_bad_rows_of_a_road_file_are_named(tmp_path):
    text = ROAD + 'kind = "profile"\nfile = "road.csv"\n'
    for content, message in {
        "x,z\n0,0\n1,nan\n": "road.csv, line 3: value is nan, expected a finite number",
        "x,z\n0,0\n2,0\n1,0\n": "road.csv, line 4: distance 1.0 is before that of",
        "x [s],z\n0,0\n1,0\n": r"road.csv, column 'x': [s] cannot be turned into [m]",
        "x,z\n0\n1,0\n": "road.csv, line 2: no column 'z'",
    }.items():
        (tmp_path / "road.csv").write_text(content)
        assert_refused(run_study, write(tmp_path, text), message)


def test_a_broken_library_is_named(tmp_path):
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "mine.toml").write_text("[gun\n")
    with pytest.raises(ValueError, match=r"mine\.toml: no valid TOML"):
        signals(tmp_path, HEAD + '[inputs.F]\nfrom = "gun_30mm"\ntimes = [1.0]\n')


@pytest.fixture(scope="module")
def terrain():
    return run_study("studies/terrain_run.toml")


def test_the_terrain_run_is_what_the_paper_tells(terrain):
    """Section 4: at 20 km/h the hull moves a little less than the road, at 10 less, at 40 more."""
    hull, road = (np.ptp(terrain[name]) / 2 for name in ("heave", "z_1"))
    assert 0.8 < hull / road < 1.0
    model = load("m113")
    plough = tomllib.loads((SHIPPED / "roads.toml").read_text())["frozen_plough"]
    field = random_road(
        plough["roughness"], seed=plough["seed"], length=200.0, waviness=1.6, shortest=0.5, longest=12.0, fade=5.0
    )

    def amplitude(kmh, seconds):
        inputs = drive(model, field, kmh / 3.6, parameters="as_run_unloaded", start=-2.0)
        run = simulate(model, (0, seconds), step=5e-4, parameters="as_run_unloaded", inputs=inputs)
        return run, np.ptp(run["heave"]) / np.ptp(run["z_1"])

    quiet, at_20 = amplitude(20, 10)
    assert at_20 == pytest.approx(hull / road, rel=0.05)
    before = terrain.t < 4.999
    np.testing.assert_allclose(
        terrain["heave"][before], np.interp(terrain.t[before], quiet.t, quiet["heave"]), atol=1e-5
    )
    assert amplitude(10, 20)[1] < at_20 < 1.05 < amplitude(40, 10)[1]


def test_it_starts_at_rest_on_level_ground(terrain):
    first = terrain.t < 0.05
    assert np.abs(terrain["heave"][first] - terrain["heave"][0]).max() < 1e-9
    assert terrain["z_1"][0] == 0.0
    impulse = np.trapezoid(terrain["F"], terrain.t)
    assert impulse == pytest.approx(0.725 * 1385, rel=1e-3)


def test_a_study_is_shown(tmp_path, capsys):
    assert show_study(Path("studies/terrain_run.toml"), tmp_path) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "F N 0 1.115e+04 0 1004 2" in said
    assert "class F" in said
    assert (tmp_path / "terrain_run_inputs.png").stat().st_size > 20_000


def test_a_study_without_inputs_has_nothing_to_show(tmp_path):
    with pytest.raises(StudyError, match="the study has no inputs to show"):
        show_study(write(tmp_path, HEAD), tmp_path)


def test_a_table_is_smoothed_over_the_width_that_is_given(tmp_path):
    smooth = signals(tmp_path, SMOOTH + 'smooth = "200 ms"\n')["F"]
    # a kink between 0 and a line of 1e3/s becomes a parabola from -0.1 to 0.1 s
    np.testing.assert_allclose(smooth([-0.1, 0.0, 0.1, 0.5, 1.0, 1.1]), [0, 25, 100, 500, 975, 1000], atol=1e-9)
    np.testing.assert_allclose(smooth.derivative(smooth.breakpoints), [0, 1e3, 1e3, 0], atol=1e-9)
    curved = SMOOTH.replace("[0, 1]", "[0, 1, 2, 3]").replace("[0, 1e3]", "[0, 1e3, 0, 5e2]")
    with pytest.raises(StudyError, match=r"inputs\.F.*is of third degree: its mean is no piece of a signal"):
        signals(tmp_path, curved + 'interpolation = "cubic"\nsmooth = 0.2\n')
