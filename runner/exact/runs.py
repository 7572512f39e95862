"""The compiled half of `batch`: run after run through the same work space."""

from qddot.runner.exact.balance import begin
from qddot.runner.exact.linear import linearize
from qddot.runner.exact.propagate import NON_FINITE, RUNNING, leaving, propagate, start
from qddot.runner.inputs.instants import rounding
from qddot.runner.inputs.piece import COLUMNS, START, piece_at, piece_value
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats, integers, layout, matrix
from qddot.runner.machine.pointers import call_kernel

#: Fields of a batch: addresses and sizes of the arrays in `batch.propagate_batch`; outputs: a kernel.
RUNS = layout(
    "t0 t1 initial constants table rate offset order pieces first last times columns samples final status failed_at "
    "failed_state steps evaluations n_states all_channels n_constants n_samples n_columns n_pieces outputs "
    "n_model_outputs",
    "limit",
)
#: Rows of a thread's integers: first and last piece of each channel, and the one at hand for samples.
FIRST, LAST, SAMPLED = range(3)
#: Row operations after which a run looks up; there is nothing to look for but its end.
MOST = 1e12


@compiled(**LEAN)
def wanted_times(batch, s, run):
    """Write the times to save at: start, the samples within, end; and which of them are evenly spaced."""
    t0, t1 = floats(batch.t0, run + 1)[run], floats(batch.t1, run + 1)[run]
    times = floats(batch.times + 8 * run * batch.n_samples, batch.n_samples)
    near = rounding(max(abs(t0), abs(t1)))
    outputs = floats(s.outputs, batch.n_samples + 2)
    outputs[0] = t0
    size = 1
    for j in range(batch.n_samples):
        if outputs[size - 1] + rounding(times[j]) < times[j] < t1 - rounding(t1):
            outputs[size] = times[j]
            size += 1
    outputs[size] = t1
    s.n_outputs, s.first_even, s.last_even = size + 1, 0, size
    s.spacing = (t1 - t0) / size
    if size > 2:
        s.spacing = (outputs[size - 1] - outputs[1]) / (size - 2)
    for k in range(2, size):
        if abs(outputs[1] + (k - 1) * s.spacing - outputs[k]) > near:
            s.first_even = size
    if abs(outputs[1] - s.spacing - t0) > near:
        s.first_even = max(1, s.first_even)
    if abs(outputs[size - 1] + s.spacing - t1) > near:
        s.last_even = size - 1
    s.t, s.segment_end, s.t1, s.next_output = t0, t0, t1, 1


@compiled(**LEAN)
def set_inputs(batch, s, run, pieces_of):
    """Point the space at the inputs of a run."""
    channels = batch.all_channels
    table = integers(batch.table + 8 * run * channels, channels)
    cursor = integers(s.cursor, channels)
    for i in range(channels):
        pieces_of[FIRST, i] = integers(batch.first, table[i] + 1)[table[i]]
        pieces_of[LAST, i] = integers(batch.last, table[i] + 1)[table[i]]
        pieces_of[SAMPLED, i] = cursor[i] = pieces_of[FIRST, i]
    s.pieces, s.n_pieces, s.order = batch.pieces, batch.n_pieces, batch.order
    s.first = pieces_of.ctypes.data
    s.last = s.first + 8 * pieces_of.shape[1]
    s.rate, s.offset = batch.rate + 8 * run * channels, batch.offset + 8 * run * channels


@compiled(**LEAN)
def all_inputs(batch, s, cursor, t, u):
    """Write all channels at time t; at a jump, the limit from the right."""
    pieces, channels = matrix(s.pieces, s.n_pieces, COLUMNS), batch.all_channels
    first, last = integers(s.first, channels), integers(s.last, channels)
    for i in range(channels):
        rate, offset = floats(s.rate, channels)[i], floats(s.offset, channels)[i]
        k = cursor[i] = piece_at(s.pieces, first[i], last[i], cursor[i], rate, offset, t + rounding(t))
        u[i] = piece_value(pieces[k], rate * t + offset - pieces[k, START], integers(s.order, channels)[i], rate)


@compiled(**LEAN)
def write_samples(batch, s, run, cursor, u, y):
    """Write the samples of a run that it reached."""
    times = floats(batch.times + 8 * run * batch.n_samples, batch.n_samples)
    outputs, columns = floats(s.outputs, s.n_outputs), integers(batch.columns, batch.n_columns)
    samples = matrix(batch.samples + 8 * run * batch.n_samples * batch.n_columns, batch.n_samples, batch.n_columns)
    c = floats(batch.constants + 8 * run * batch.n_constants, batch.n_constants)
    k = 0
    for j in range(batch.n_samples):
        while k + 1 < s.next_output and outputs[k] < times[j] - rounding(times[j]):
            k += 1
        if abs(outputs[k] - times[j]) > rounding(times[j]):
            continue
        x = floats(s.saved + 8 * k * s.n, s.n)
        if batch.outputs != 0:
            all_inputs(batch, s, cursor, times[j], u)
            call_kernel(batch.outputs, times[j], x, u, c, y)
        for i in range(batch.n_columns):
            samples[j, i] = x[columns[i]] if columns[i] < s.n else y[columns[i] - s.n]


@compiled(**LEAN)
def finish(batch, s, run, status):
    """Write how a run ended, and its last good state."""
    last, final = floats(s.saved + 8 * (s.next_output - 1) * s.n, s.n), floats(batch.final + 8 * run * s.n, s.n)
    for i in range(s.n):
        final[i] = last[i]
    integers(batch.steps, run + 1)[run] = s.steps
    integers(batch.evaluations, run + 1)[run] = s.products
    if status == NON_FINITE:
        floats(batch.failed_at, run + 1)[run] = s.t
        integers(batch.failed_state, run + 1)[run] = s.failed_state
    integers(batch.status, run + 1)[run] = status


def propagate_runs(batch, s, A, B, pieces_of, u, y, first, end):
    """Propagate the runs from `first` to `end` - 1. A, B, pieces_of, u, y: room, see `batch`."""
    s.limit = batch.limit
    for run in range(first, end):
        c = floats(batch.constants + 8 * run * batch.n_constants, batch.n_constants)
        linearize(s, c, A, B)
        initial = floats(batch.initial + 8 * run * s.n, s.n)
        begin(s, A, B, initial)
        saved = floats(s.saved, s.n)
        for i in range(s.n):
            saved[i] = initial[i]
        set_inputs(batch, s, run, pieces_of)
        wanted_times(batch, s, run)
        start(s)
        s.steps, s.products, s.failed_state = 0, 0, leaving(s)
        status = NON_FINITE if s.failed_state >= 0 else RUNNING
        while status == RUNNING:
            status = propagate(s, MOST)
        finish(batch, s, run, status)
        write_samples(batch, s, run, pieces_of[SAMPLED], u, y)
