"""The records that compiled lane loops read: the batch, which threads share, and the pack of lanes of one thread."""

from typing import Any

import numpy as np
from numba import typeof
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.explicit.workspace import MOST_STAGES
from qddot.runner.machine.memory import address, layout, on_cache_line, record

LANES = abi.LANES

#: Fields of a batch. Of run r: t0, t1 (runs,), initial (runs, n), constants (runs, n_constants); of its channel i:
#: table, rate, offset (runs, channels), order, way (channels,). Tables: pieces (n_pieces, 8), of table k those from
#: first[k] to last[k]; buckets[k] of its guide, from guide[guide_first[k]] on; breaks from break_first[k] to
#: break_last[k] - 1. even, guided: the channels of that way, the first n_even and n_guided among the n_inputs that
#: stages read, the first all_even and all_guided among the n_watched that stages or samples read; hops: comparisons
#: after the guide. rhs, outputs: kernels; look_up, sample, settle, restart: functions of lanes. Samples: times (runs,
#: n_samples), columns (n_columns,): states, then n + output. next: the run that the next free lane takes. rtol, atol
#: (n,). Written: final (runs, n), samples (runs, n_samples, n_columns), status, failed_state, steps, failed_attempts,
#: evaluations, failed_at (runs,).
BATCH = layout(
    "runs n channels n_inputs n_watched n_constants n_outputs n_pieces rhs outputs look_up sample settle restart "
    "t0 t1 initial constants rtol atol table rate offset order way pieces first last buckets guide guide_first hops "
    "even n_even all_even guided n_guided all_guided "
    "break_first break_last breaks n_samples times samples columns n_columns needs_outputs "
    "next final status failed_state steps failed_attempts evaluations failed_at max_steps",
    "step limit max_step first_step",
)

#: Fields of a pack: addresses of rows of lanes (now: the states at T; new: after the step; stage: of a stage; slopes;
#: u; c; control and inputs: the rows named below), of integers per lane (run: -1 where idle; sample: the next one;
#: landing; counts), of scratch for one lane (x_lane, u_lane, y_lane), of weights of dense output, of cursors (LANES,
#: channels) and kinds (channels,); leader, alike: see `pieces.classify`; waved: channels whose series has a sine;
#: taken: steps; fresh: whether inputs (fixed steps) or slopes (adaptive) are to be taken anew. Taylor's method: slopes
#: is the memory of the series, now within it.
PACK = layout(
    "now new stage slopes u c control inputs run sample landing steps evaluations failed_attempts "
    "x_lane u_lane y_lane weights turns piece break_at lane_kind kind leader alike waved taken fresh"
)

#: Rows of `control`, one number a lane, which a lane reads by name (see `lane`). t: time of the state; h: length of the
#: step; at: time of a stage; side: where its inputs are looked up; low, high: from when to when the present pieces of
#: all inputs hold; zero: from when their sines count the time; target: where the step ends. Fixed steps: start, k,
#: step: the grid start + k*step; attention: a grid point beyond it wants a closer look; size: sum of squares of the
#: states; breakpoint: the next one; stop: that or the next sample. Adaptive steps: active: 1 where there is a run;
#: stop: the next breakpoint or the end; sample: time of the next sample; next, least: size of the next step, and the
#: least that advances the time; proposed: what the step was to be at first; tried: what is tried; lands: 1 where it
#: ends at the stop; failures in a row; error, error_2: of the step; last_error; good: 1 where the step is accepted;
#: fresh: 1 where the slope is to be taken anew; steps, failed: counts; longest: step; theta: where in its step, 0 to 1,
#: dense output is wanted. Taylor's method: the same, but theta in s, and arrival: where the step ends, or else t.
_CONTROL = """
    t h at side low high target start k step attention size
    active stop sample next least proposed tried lands failures error error_2 last_error
    good fresh steps failed longest theta breakpoint zero arrival
"""
CONTROL_NAMES = _CONTROL.split()
#: Rows that are handed over whole.
_WHOLE = ("at", "h", "size", "error", "good", "fresh", "theta", "next")
AT, H, SIZE, ERROR, GOOD, FRESH, THETA, NEXT = map(CONTROL_NAMES.index, _WHOLE)

#: Rows of each input channel: value(t) = c0 + s*(c1 + s*(c2 + s*c3)) + sine_part*sin(angle) +
#: cosine_part*cos(angle), where angle = frequency*(t - zero) and s = rate*t + offset - begin.
_WAVE = "rate offset begin c0 c1 c2 c3 frequency sine_part cosine_part"
INPUT_ROWS = len(_WAVE.split())
#: Rows of a channel that computes its piece (see `tables`). begin: the start of the second piece; per_length, length:
#: of a piece, or bucket of the guide; buckets: one more than there are; first: piece, or entry of the guide; last: the
#: last piece in bytes; place: the piece in bytes, an int64; since: the argument less the piece's start.
_TABLE = "rate offset begin per_length length buckets first last place since"
#: What a row of a channel is called -> its place.
CHANNEL_ROWS = {name: row for names in (_WAVE, _TABLE) for row, name in enumerate(names.split())}

BATCH_TYPE, PACK_TYPE = typeof(record(BATCH)), typeof(record(PACK))


def rows(count: int) -> NDArray[np.float64]:
    """A number of rows of lanes (count * LANES,) of zeros, on a cache line."""
    return on_cache_line(max(1, count) * LANES)


def make_pack(batch: np.void, slope_rows: int) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """A pack of idle lanes for a method that keeps so many rows of slopes, and the arrays it points into."""
    n, channels = int(batch["n"]), max(1, int(batch["channels"]))
    arrays: dict[str, NDArray[Any]] = {
        "now": rows(n),
        "new": rows(n),
        "stage": rows(n),
        "slopes": rows(slope_rows),
        "u": rows(channels),
        "c": rows(int(batch["n_constants"])),
        "control": rows(len(CONTROL_NAMES)),
        "inputs": rows(INPUT_ROWS * channels),
        "turns": rows(2 * channels),
        "weights": rows(MOST_STAGES),
        "x_lane": np.zeros(n),
        "u_lane": np.zeros(channels),
        "y_lane": np.zeros(max(1, int(batch["n_outputs"]))),
    }
    for name in ("run", "sample", "landing", "steps", "evaluations", "failed_attempts"):
        arrays[name] = np.full(LANES, -1 if name == "run" else 0, dtype=np.int64)
    for name in ("piece", "break_at", "lane_kind"):
        arrays[name] = np.zeros(LANES * channels, dtype=np.int64)
    for name in ("kind", "leader", "alike", "waved"):
        arrays[name] = np.zeros(channels, dtype=np.int64)
    return record(PACK, **{name: address(array) for name, array in arrays.items()}), arrays
