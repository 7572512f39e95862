"""A quick batch, and what tests compare of stores."""

import numpy as np
import xarray
from study_files import write

STUDY = """\
title = "A quick batch"
model = "quarter_car"
span = [0, 0.5]

[integration]
method = "rk4"
step = 1e-3

[inputs.z_r]
kind = "pulse_train"
times = [0.05]
peak = 0.02
duration = 0.1

[[sweep.axes]]
key = "parameters.m_s"
linspace = ["200 kg", "400 kg", 9]

[[sweep.axes]]
name = "height"
key = "inputs.z_r.peak"
values = ["1 cm", "2 cm", "3 cm", "4 cm"]

[sweep]
block = 4

[metrics.travel]
kind = "peak_to_peak"
of = "z_s"

[metrics.dissipated]
kind = "energy_dissipated"

[outputs]
interval = "1 ms"
keep = ["z_s"]
every = 5
"""

#: The same of sixteen runs, in four blocks.
SMALLER = STUDY.replace('"400 kg", 9]', '"400 kg", 4]')


def written(folder, text=STUDY, name="quick"):
    return write(folder, text, f"{name}.toml")


def loaded(path):
    """All that a store holds, read at once."""
    with xarray.open_zarr(path, chunks=None) as data:
        return data.load()


def arrays(data):
    """Every variable of a store that is `loaded`, by name."""
    return {str(name): variable.to_numpy() for name, variable in data.variables.items()}


def values(path):
    """Every variable of a store by name, loaded."""
    return arrays(loaded(path))


def assert_equal(one, other):
    """The stores hold the same values, to the last bit."""
    assert_equal_values(loaded(one), loaded(other))


def assert_equal_values(one, other):
    """The same for stores that are `loaded`."""
    first, second = arrays(one), arrays(other)
    assert first.keys() == second.keys()
    for name, array in first.items():
        same = array == second[name] if array.dtype.kind not in "fc" else array.tobytes() == second[name].tobytes()
        assert np.all(same), name
