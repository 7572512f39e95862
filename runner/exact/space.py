"""What the compiled propagation works on: one record of numbers and addresses, and the arrays behind it.

Vectors are rows, so a state moves by x <- x + x Y with Y = exp(h A)^T - 1: matrices are kept transposed. A matrix of
n columns lies in panels of BLOCK columns, rows contiguous, zeros beyond column n: `weighted_sum` takes a row of a panel
at once. All of it is in balanced coordinates x / scale, the scale made of powers of two, which rounds nothing.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from runner.inputs.signal import InputTable
from runner.memory import BLOCK, layout

#: A polynomial input piece has this many coefficients.
POWERS = 4

#: n states in `panels` panels, `channels` inputs; at most q_max functions drive the states.
#: Addresses: A, B (channels + 1 rows) in panels, scale, cursor, x, the Taylor terms y and y_next, zeros; of the current
#: forcing: values (POWERS, channels + 1), g (POWERS vectors), omega, sine and cosine (a vector per frequency), drivers
#: p and p_next with their scale beta; the matrices M, M_2, M_3, M_4, Y and room for one more.
#: pieces, first, last, rate, offset, order: of the input table.
#: outputs: `n_outputs` wanted times from the start to the end of the run, saved: the states there; next_output: the
#: first not reached; those from first_even to last_even are `spacing` apart. grid: see `advance`.
#: degree, frequencies, q: of the current forcing. steps, products, exponentials: counts for the statistics.
#: nu: 1-norm of A; t: of x; segment_end: until when no input changes its piece; near: times this close are the same.
SPACE = layout(
    "n panels channels q_max A B scale cursor x y y_next zeros values g omega sine cosine p p_next beta "
    "pieces n_pieces first last rate offset order M M_2 M_3 M_4 Y room "
    "outputs n_outputs saved next_output first_even last_even grid degree frequencies q "
    "steps products exponentials failed_state",
    "spacing nu t segment_end t1 near limit",
)


class Arrays(NamedTuple):
    """The arrays that a space points into; kept alive as long as the space is used."""

    work: NDArray[np.float64]
    cursor: NDArray[np.int64]
    outputs: NDArray[np.float64]
    saved: NDArray[np.float64]


def space_for(
    n: int, inputs: InputTable, channels: int, outputs: NDArray[np.float64], numbers: dict[str, float]
) -> tuple[np.void, Arrays]:
    """A space for n states, the first `channels` inputs, wanted times (m,) from the start on, and further fields."""
    sines = int((inputs.pieces[:, 5] != 0.0).any()) * channels
    q_max = POWERS + 2 * sines
    panels = -(-n // BLOCK)
    width = panels * BLOCK
    q_width = -(-q_max // BLOCK) * BLOCK
    matrix = width * (n + q_max) + q_width * q_max
    lengths = {
        "A": width * n,
        "B": width * (channels + 1),
        **dict.fromkeys(("scale", "x", "y", "y_next", "zeros"), width),
        "values": POWERS * (channels + 1),
        "g": POWERS * width,
        "omega": max(1, sines),
        **dict.fromkeys(("sine", "cosine"), max(1, sines) * width),
        **dict.fromkeys(("p", "p_next", "beta"), q_width),
        **dict.fromkeys(("M", "M_2", "M_3", "M_4", "Y", "room"), matrix),
    }
    arrays = Arrays(
        work=np.zeros(sum(lengths.values()) + 8),
        cursor=inputs.first.copy() if channels else np.zeros(1, dtype=np.int64),
        outputs=outputs,
        saved=np.empty((len(outputs), n)),
    )
    places = _places(arrays, lengths)
    counts = {"n": n, "panels": panels, "channels": channels, "q_max": q_max, "n_outputs": len(outputs)}
    return _record(places | counts | numbers), arrays


def _places(arrays: Arrays, lengths: dict[str, int]) -> dict[str, int]:
    """Addresses by field; the work space starts at a cache line."""
    place = -(-arrays.work.ctypes.data // 64) * 64
    places = {name: getattr(arrays, name).ctypes.data for name in ("cursor", "outputs", "saved")}
    for name, length in lengths.items():
        places[name] = place
        place += 8 * length
    return places


def _record(values: dict[str, Any]) -> np.void:
    return np.array([tuple(values.get(name, 0) for name in SPACE.names or ())], dtype=SPACE)[0]
