"""An option that a method does not take is refused by name, wherever it is given; a study may hold those of several."""

import numpy as np
import pytest
from study_files import assert_refused, slip, write

import qddot
from qddot.runner.commands.show_study import show_study
from qddot.runner.methods import METHODS
from qddot.runner.options import TABLE
from qddot.runner.study.overrides import parsed
from qddot.runner.takers import taken

#: A value for each option, as it may be given.
VALUES = {
    "step": 1e-3,
    "output_times": [0.05],
    "every": 2,
    "progress": lambda part: None,
    "time_limit": 60.0,
    "divergence_limit": 1e50,
    "rtol": 1e-4,
    "atol": 1e-7,
    "max_step": 0.01,
    "first_step": 1e-4,
    "max_steps": 100_000,
    "refine": 2,
    "events": (),
    "controller": "pi",
    "max_order": 3,
    "bdf": True,
    "switching": "locate",
}
#: What the methods are documented to take, beside what all of them do.
ALL = {"output_times", "progress", "time_limit", "divergence_limit", "events"}
STEPS = {"step", "every"}
CONTROL = {"rtol", "atol", "max_step", "first_step", "max_steps", "refine"}
ADAPTIVE = ("ode23", "ode45", "tsit5", "dop853", "vern7", "rodas5p")
TAKEN = {
    **{name: ALL | STEPS | {"switching"} for name in ("euler", "heun", "midpoint", "rk4")},
    "exact": ALL | STEPS,
    **{name: ALL | CONTROL | {"controller", "switching"} for name in ADAPTIVE},
    "ode15s": ALL | CONTROL | {"max_order", "bdf", "switching"},
    "taylor": ALL | CONTROL,
    "auto": ALL | CONTROL | {"switching"},
}

STUDY = """\
model = "quarter_car"
span = [0, 0.1]

[integration]
method = "rk4"
step = "1 ms"

[initial]
z_s = "1 cm"
"""
SEVERAL = slip(
    STUDY,
    'step = "1 ms"\n',
    '\n[integration.fixed]\nstep = "1 ms"\nevery = 10\n\n[integration.adaptive]\nrtol = 1e-9\natol = 1e-12\n',
)


@pytest.fixture(scope="module")
def model():
    return qddot.load("quarter_car")


def test_every_option_and_every_method_is_tried():
    assert set(VALUES) == set(TABLE)
    assert set(TAKEN) == set(METHODS)


@pytest.mark.parametrize("method", METHODS)
def test_an_option_is_taken_or_refused_by_name_and_never_ignored(model, method):
    step = 1e-3 if METHODS[method].family == "fixed" else None
    for name, value in VALUES.items():
        given = {"initial": {"z_s": 0.01}, "method": method, "step": step, name: value}
        if name in TAKEN[method]:
            qddot.prepare(model, (0, 0.1), **given)
            continue
        message = f"^{name}: method {method} takes none; it takes .*; leave it out"
        with pytest.raises(ValueError, match=message) as refused:
            qddot.prepare(model, (0, 0.1), **given)
        others = str(refused.value).partition("or choose ")[2].split(", ")
        assert set(others) == {each for each, takes in TAKEN.items() if name in takes}
        own = str(refused.value).partition("it takes ")[2].partition("; ")[0].split(", ")
        assert set(own) == TAKEN[method]


@pytest.mark.parametrize("name", VALUES)
def test_none_is_not_given(model, name):
    for method in ("rk4", "dop853"):
        given = {"step": 1e-3} if method == "rk4" and name != "step" else {}
        qddot.prepare(model, (0, 0.1), initial={"z_s": 0.01}, method=method, **{name: None} | given)


def test_a_right_hand_side_of_ones_own_is_no_exception():
    def rhs(t, x, u, c, dx):
        dx[0] = -x[0]

    with pytest.raises(ValueError, match="rtol: method rk4 takes none"):
        qddot.solve(rhs, (0, 1), [1.0], step=0.1, rtol=1e-6)
    with pytest.raises(ValueError, match="method dop853 uses no jacobian; leave it out, or choose ode15s, rodas5p"):
        qddot.solve(rhs, (0, 1), [1.0], method="dop853", jacobian=rhs)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"rtol": 1e-6, "step": 1e-3}, "rtol: method rk4 takes none; it takes step, divergence_limit; leave it out or"),
        ({"method": "tsit5", "step": 1e-3}, "step: method tsit5 takes none; it takes divergence_limit, rtol, atol"),
        ({"method": "exact", "step": 1e-3}, "step: method exact takes none; .* leave it out or give output_times or"),
        ({"method": "exact", "max_steps": 3}, "max_steps: method exact takes none; it takes divergence_limit; leave"),
        ({"step": 1e-3, "refine": 3}, "unknown option 'refine'"),
        ({"step": 1e-3, "names": ["z_s"]}, "names are those of what is stored at output_times, which are not given"),
        ({"method": "ode15s", "threads": 3}, "threads is 3, but these runs go one by one: method ode15s does not run"),
    ],
)
def test_many_runs_refuse_it_too(model, given, message):
    with pytest.raises(ValueError, match=message):
        qddot.simulate_batch(model, (0, 0.1), runs=2, initial={"z_s": 0.01}, **given)


@pytest.mark.parametrize(
    ("text", "settings", "message"),
    [
        (
            STUDY,
            ["integration.rtol=1e-6"],
            "integration.rtol: method rk4 takes none; it takes step, output_times,",
        ),
        (STUDY, ["integration.rtol=1e-6"], "leave it out or put it under [integration.adaptive] or choose "),
        (
            STUDY,
            ["integration.method=tsit5"],
            "line 6: integration.step: method tsit5 takes none; it takes output",
        ),
        (STUDY, ["integration.method=tsit5"], "leave it out or put it under [integration.fixed] or choose euler,"),
        (SEVERAL, ["integration.bdf=false"], "integration.bdf: method rk4 takes none"),
        (
            SEVERAL,
            ["integration.method=tsit5", "integration.adaptive.bdf=true"],
            "adaptive.bdf: method tsit5 takes",
        ),
        (
            SEVERAL,
            ["integration.step=2e-3"],
            "line 8: integration.fixed.step: integration.step is given, too; give",
        ),
        (SEVERAL, ["integration.fixed.rtol=1e-3"], "integration.fixed.rtol: unknown key 'rtol'"),
        (SEVERAL, ["integration.adaptive.step=1e-3"], "integration.adaptive.step: unknown key 'step'"),
        (SEVERAL, ["integration.fixed.step=1 m"], "integration.fixed.step: '1 m' is in m, expected s"),
        (SEVERAL, ["integration.method=rk5"], "line 5: integration.method: unknown method 'rk5'; did you mean 'rk4'?"),
        (SEVERAL, ["integration.fast.step=1e-3"], "--set integration.fast.step: unknown table 'fast'"),
    ],
)
def test_a_study_refuses_it_with_its_place(tmp_path, text, settings, message):
    assert_refused(lambda path: qddot.read_study(path, parsed(settings)), write(tmp_path, text), message)


def test_a_study_of_several_methods_gives_each_its_own(tmp_path):
    study = qddot.read_study(write(tmp_path, SEVERAL))
    assert len(study.run().t) == 11
    assert study.run(method="heun").metadata["step"] == 1e-3
    precise = study.run(method="dop853")
    assert (precise.metadata["rtol"], precise.metadata["atol"]) == (1e-9, "1e-12")
    changed = study.changed({"integration.method": "ode15s"})
    assert changed.run().metadata["rtol"] == 1e-9
    np.testing.assert_allclose(study.run(method="exact")["z_s"][-1], precise["z_s"][-1], rtol=1e-8)
    at = study.run(method="rk4", output_times=[0.03, 0.05])  # in place of `every`
    np.testing.assert_allclose(at.t, [0.0, 0.03, 0.05, 0.1], atol=1e-15)


def test_a_study_without_those_tables_takes_them_from_the_command_line(tmp_path):
    text = slip(STUDY, 'step = "1 ms"\n', "")
    settings = parsed(["integration.fixed.step=2 ms", "integration.adaptive.rtol=1e-7"])
    assert qddot.read_study(write(tmp_path, text), settings).run().metadata["step"] == 2e-3


def test_show_tells_how_a_study_integrates_and_refuses_what_a_run_would(tmp_path, capsys):
    text = SEVERAL + '\n[inputs.z_r]\nkind = "constant"\nvalue = 0.0\n'
    path = write(tmp_path, text)
    assert show_study(path, tmp_path) == 0
    said = capsys.readouterr().out
    assert "integration: rk4\n" in said
    assert "methods of constant step, and exact: step = '1 ms', every = 10\n" in said
    assert "methods of variable step: rtol = 1e-09, atol = 1e-12\n" in said
    path.write_text(slip(text, 'method = "rk4"', 'method = "tsit5"\nstep = 3'))
    assert_refused(lambda path: show_study(path, tmp_path), path, "integration.step: method tsit5 takes none")


def test_what_a_method_takes_in_many_runs_it_takes_in_one():
    for method in METHODS.values():
        assert set(taken(method, many=True)) <= set(taken(method))
