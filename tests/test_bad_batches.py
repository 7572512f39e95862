"""Batches that cannot be: each is refused before it starts, with its place and what is valid there."""

import pytest
from batches import STUDY, written
from study_files import assert_refused, slip

from qddot.runner.batch.run import run_batch
from qddot.runner.study.overrides import parsed

AXIS = 'linspace = ["200 kg", "400 kg", 9]'
SAMPLED = slip(STUDY, AXIS, 'uniform = ["200 kg", "400 kg"]')


def with_axis(text):
    return slip(STUDY, AXIS, text)


def with_metric(text):
    return STUDY + f"\n[metrics.it]\n{text}\n"


def with_sweep(text, study=STUDY):
    return slip(study, "block = 4", f"block = 4\n{text}")


BAD = {
    "no values": (with_axis(""), "line 16: sweep.axes.0.key: expected one of values, linspace, logspace"),
    "two ways": (
        with_axis(f"{AXIS}\nvalues = [1]"),
        "sweep.axes.0.key: expected one of values, linspace, logspace, range",
    ),
    "empty values": (with_axis("values = []"), "line 17: sweep.axes.0.values: there are none"),
    "no count": (with_axis("linspace = [1, 2]"), "line 17: sweep.axes.0.linspace.2: missing"),
    "count of zero": (with_axis("linspace = [1, 2, 0]"), "line 17: sweep.axes.0.linspace: a count of 0"),
    "half a count": (
        with_axis("linspace = [1, 2, 2.5]"),
        "line 17: sweep.axes.0.linspace.2: found 2.5, expected a whole number",
    ),
    "logarithm of zero": (
        with_axis("logspace = [0, 2, 3]"),
        "sweep.axes.0.logspace: from 0 to 2; expected two numbers",
    ),
    "range backwards": (with_axis("range = [5, 2]"), "sweep.axes.0.range: from 5 up to 2 there are 0 numbers"),
    "units that differ": (
        with_axis('linspace = ["200 kg", "4 m", 9]'),
        "sweep.axes.0.linspace: '4.0 m' is in m, expected kg or a multiple of it",
    ),
    "units that are unknown": (
        with_axis('linspace = ["200 kgg", "400 kgg", 9]'),
        "line 17: sweep.axes.0.linspace: '200 kgg' is no number with a unit: unknown unit 'kgg'; did you mean 'kg'?",
    ),
    "units of another kind": (
        with_axis('linspace = ["200 m", "400 m", 9]'),
        "parameters.m_s: '200.0 m' is in m, expected kg or a multiple of it (run 0 of the sweep: parameters.m_s",
    ),
    "not finite": (with_axis("values = [200, nan]"), "sweep.axes.0.values: nan; expected a finite number"),
    "a text as a number": (
        with_axis('linspace = ["few", "400 kg", 9]'),
        "sweep.axes.0.linspace: 'few' is no number with a unit: it begins with no number",
    ),
    "words for a number": (
        with_axis('values = ["light", "heavy"]'),
        "parameters.m_s: 'light' is no number with a unit",
    ),
    "unit of words": (
        with_axis('values = ["light"]\nunit = "kg"'),
        "sweep.axes.0.unit: 'kg' is given, but not all values",
    ),
    "labels of numbers": (with_axis(f'{AXIS}\nlabels = ["a"]'), "sweep.axes.0.labels: they name the items of `values`"),
    "too few labels": (with_axis('values = [200, 300]\nlabels = ["a"]'), "sweep.axes.0.labels: 1 for 2 values"),
    "unknown parameter": (
        slip(STUDY, "parameters.m_s", "parameters.m_z"),
        "unknown parameter 'm_z'; did you mean 'm_",
    ),
    "unknown input": (slip(STUDY, "inputs.z_r.peak", "inputs.z_q.peak"), "unknown table 'z_q'; did you mean 'z_r'"),
    "unknown setting": (
        slip(STUDY, "inputs.z_r.peak", "inputs.z_r.peek"),
        "inputs.z_r.peek: unknown key 'peek'; did you mean 'peak'?",
    ),
    "unknown option": (
        slip(STUDY, "parameters.m_s", "integration.stepp"),
        "unknown key 'stepp'; did you mean 'step'?",
    ),
    "an axis over the span": (slip(STUDY, "parameters.m_s", "span.1"), "sweep.axes.0.key: 'span.1' cannot be varied"),
    "an axis over the model": (slip(STUDY, '"parameters.m_s"', '"model"'), "'model' cannot be varied"),
    "an axis over metrics": (slip(STUDY, "parameters.m_s", "metrics.travel.kind"), "cannot be varied"),
    "no key": (slip(STUDY, 'key = "parameters.m_s"', ""), "sweep.axes.0.key: missing"),
    "a key with a hole": (slip(STUDY, "parameters.m_s", "parameters..m_s"), "cannot be varied"),
    "a list of no keys": (slip(STUDY, '"parameters.m_s"', "[]"), "sweep.axes.0.key: expected a dotted key"),
    "one key twice": (slip(STUDY, "inputs.z_r.peak", "parameters.m_s"), "'parameters.m_s' is set by axis 0 already"),
    "a key within another": (slip(STUDY, "parameters.m_s", "inputs.z_r"), "is set by axis 0 already ('inputs.z_r')"),
    "two axes of a name": (with_axis(f'{AXIS}\nname = "height"'), "sweep.axes.1.name: 'height' stands twice"),
    "a name of the results": (with_axis(f'{AXIS}\nname = "status"'), "'status' has another meaning in the results"),
    "a name with a blank": (with_axis(f'{AXIS}\nname = "my mass"'), "'my mass' has blanks or slashes in it"),
    "a zip that does not fit": (
        slip(STUDY, "[[sweep.axes]]", '[[sweep.axes]]\nzip = "a"'),
        "sweep.axes.1.zip: height has 4 values, but m_s, which advances with it, has 9",
    ),
    "unknown key of an axis": (with_axis("lispace = [1, 2, 3]"), "unknown key 'lispace'; did you mean 'linspace'?"),
    "samples without a sampled axis": (with_sweep("samples = 10"), "sweep.samples: no axis is sampled"),
    "a sampled axis without samples": (SAMPLED, "sweep.samples: missing"),
    "no samples": (with_sweep("samples = 0", SAMPLED), "sweep.samples: 0; expected a number from 1"),
    "a seed without a sampled axis": (with_sweep("seed = 3"), "sweep.seed: no axis is sampled; leave it out"),
    "one of so many of nothing": (
        slip(STUDY, 'keep = ["z_s"]\n', ""),
        "outputs.every: nothing is kept of which it could be one sample in so many",
    ),
    "points of a single run": (
        slip(STUDY, "step = 1e-3", "step = 1e-3\noutput_times = [0.1]"),
        "integration.output_times: a batch samples its runs evenly; leave it out, and give outputs.interval",
    ),
    "a method in the middle that takes no step": (
        with_axis('values = ["rk4", "dop853", "heun"]').replace("parameters.m_s", "integration.method"),
        "integration.step: method dop853 takes none; it takes output_times, time_limit, rtol, atol",
    ),
    "unknown sampling": (
        with_sweep('sampling = "lhs"'),
        "sweep.sampling: unknown sampling 'lhs'; there are: random, latin_hypercube, sobol, halton",
    ),
    "seed below zero": (with_sweep("samples = 5\nseed = -1", SAMPLED), "sweep.seed: -1; expected 0 or more"),
    "ends the wrong way round": (
        with_sweep("samples = 5", with_axis("uniform = [4, 2]")),
        "sweep.axes.0.uniform: from 4 to 2; expected the lower end first",
    ),
    "no deviation": (with_sweep("samples = 5", with_axis("normal = [4, 0]")), "a standard deviation of 0"),
    "sampled and zipped": (
        with_sweep("samples = 5", slip(SAMPLED, "uniform", 'zip = "a"\nuniform')),
        "sweep.axes.0.zip: sampled axes advance together anyway",
    ),
    "offset of a list": (
        with_axis("values = [[1], [2]]\noffset = 2"),
        "sweep.axes.0.offset: the values are no numbers",
    ),
    "factor of zero": (
        with_axis(f"{AXIS}\nfactor = 0"),
        "sweep.axes.0.factor: 0.0; expected a finite number other than 0",
    ),
    "too many runs": (
        slip(STUDY, AXIS, "range = [0, 9999999]").replace("values = [", "range = [0, 9999] #"),
        "sweep: 99989990001 runs; at most 100000000 work",
    ),
    "block of nothing": (slip(STUDY, "block = 4", "block = 0"), "line 25: sweep.block: 0; expected a number of runs"),
    "unknown metric": (
        with_metric('kind = "maximum"\nof = "z_s"'),
        "metrics.it.kind: unknown metric 'maximum'; did you",
    ),
    "metric of nothing": (with_metric('kind = "max"'), "metrics.it.of: missing; the state, output or input"),
    "metric of the unknown": (
        with_metric('kind = "max"\nof = "z_z"'),
        "metrics.it.of: unknown quantity 'z_z'; did you mean",
    ),
    "metric without a kind": (with_metric('of = "z_s"'), "metrics.it.kind: missing"),
    "metric in another unit": (
        with_metric('kind = "crossings"\nof = "z_s"\nlevel = "2 kg"'),
        "metrics.it.level: '2 kg' is in kg, expected m or a multiple of it",
    ),
    "metric after the end": (
        with_metric('kind = "max"\nof = "z_s"\nafter = 2'),
        "metrics.it.after: 2 s is outside the run",
    ),
    "metric without its number": (
        with_metric('kind = "settling_time"\nof = "z_s"'),
        "metrics.it: settling_time needs band",
    ),
    "metric with another's number": (
        with_metric('kind = "rms"\nof = "z_s"\nlevel = 1'),
        "metrics.it.level: rms takes none",
    ),
    "unknown weighting": (
        with_metric('kind = "vdv"\nof = "z_s"\nweighting = "Wz"'),
        "metrics.it.weighting: unknown weighting 'Wz'; did you mean 'Wk'? There are: Wk, Wd, Wf",
    ),
    "weighting of a displacement": (
        with_metric('kind = "vdv"\nof = "z_s"\nweighting = "Wk"'),
        "metrics.it.of: z_s is in m; weightings are of accelerations",
    ),
    "metric called as an axis": (
        slip(STUDY, "metrics.travel", "metrics.height"),
        "the results call axis so; rename it",
    ),
    "metric called as a trajectory": (
        slip(STUDY, "metrics.travel", "metrics.z_s"),
        "the results call kept quantity so",
    ),
    "interval that does not divide": (
        slip(STUDY, 'interval = "1 ms"', 'interval = "0.3 s"'),
        "outputs.interval: 0.3 s does not divide the span of 0.5 s; 0.25 s does",
    ),
    "interval of nothing": (
        slip(STUDY, 'interval = "1 ms"', "interval = 0"),
        "outputs.interval: 0 s; expected a time",
    ),
    "interval in metres": (
        slip(STUDY, 'interval = "1 ms"', 'interval = "1 mm"'),
        "outputs.interval: '1 mm' is in mm",
    ),
    "keeping the unknown": (
        slip(STUDY, 'keep = ["z_s"]', 'keep = ["z_t"]'),
        "outputs.keep.0: unknown quantity 'z_t'",
    ),
    "keeping twice": (slip(STUDY, 'keep = ["z_s"]', 'keep = ["z_s", "z_s"]'), "outputs.keep.1: 'z_s' stands twice"),
    "every nothing": (slip(STUDY, "every = 5", "every = 0"), "outputs.every: 0; expected a number of samples"),
    "nothing to measure": (
        STUDY.split("[metrics")[0] + '[outputs]\ninterval = "1 ms"\n',
        "metrics: there is nothing to measure; add [metrics], or [outputs] with keep",
    ),
    "backwards": (slip(STUDY, "[0, 0.5]", "[0.5, 0]"), "span: from 0.5 to 0 s; expected a start before the end"),
    "unknown model": (
        slip(STUDY, '"quarter_car"', '"quartercar"'),
        "line 2: model: unknown model 'quartercar'; did you mean",
    ),
    "no step": (slip(STUDY, "step = 1e-3", ""), "give step="),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_batch_is_refused_with_its_place(tmp_path, case):
    text, message = BAD[case]
    assert_refused(lambda path: run_batch(path, tmp_path / "no.zarr"), written(tmp_path, text), message)
    assert not (tmp_path / "no.zarr").exists()


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("parameters.m_q=1", "parameters.m_q: unknown parameter 'm_q'; did you mean 'm_u'"),
        ("inputs.z_q.peak=1", "--set inputs.z_q.peak: unknown table 'z_q'"),
        ("parameters.m_u=41 m", "parameters.m_u: '41 m' is in m, expected kg"),
        ("sweep.block=none", "sweep.block: found 'none', expected a whole number"),
    ],
)
def test_a_bad_setting_is_refused(tmp_path, setting, message):
    changes = parsed([setting])
    assert_refused(lambda path: run_batch(path, tmp_path / "no.zarr", changes=changes), written(tmp_path), message)
