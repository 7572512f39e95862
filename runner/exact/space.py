"""What the compiled propagation works on: one record of numbers and addresses, and the arrays behind it.

Vectors are rows, so a state moves by x <- x + x Y with Y = exp(h A)^T - 1: matrices are kept transposed. A matrix of
n columns lies in panels of BLOCK columns, rows contiguous, zeros beyond column n: `weighted_sum` takes a row of a panel
at once. All of it is in balanced coordinates x / scale, the scale made of powers of two, which rounds nothing.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from qddot.runner.abi import VECTOR_KERNEL
from qddot.runner.exact.ladder import LEVELS, Y
from qddot.runner.inputs.signal import AMPLITUDE, InputTable
from qddot.runner.machine.memory import BLOCK, address, layout, writable
from qddot.runner.machine.pointers import pointer
from qddot.runner.matrices import PlacedKernel

#: A polynomial input piece has this many coefficients.
POWERS = 4
#: What is known of the inputs by address.
INPUTS = ("pieces", "first", "last", "rate", "offset", "order")

#: Addresses within the work space: A, B (channels + 1 rows) in panels; scale; the state x; the Taylor terms y, y_next;
#: zeros; entries (entry_room,), what a kernel writes of A or B. Of the current forcing: values (POWERS, channels + 1),
#: g (POWERS vectors), omega, sine and cosine (a vector for each frequency). The drivers p, p_next and their scales
#: beta; the matrices of `ladder`, matrix_bytes each.
#: n states in `panels` panels, `channels` inputs that drive them; q drivers, no more than q_max. turns, driver_turns:
#: how far the ladder is computed; delta: length of its first rung; grid_level: the rung of `spacing`. pieces, first,
#: last, rate, offset, order: of the input table; cursor: the piece of each channel. rhs, jacobian, input_jacobian:
#: kernels; A_places, B_places: where the A_entries, B_entries values of the last two stand in A (n, n) and in B
#: (n, channels + 1). outputs: `n_outputs` wanted times from the start to the end of the run, saved: the states there;
#: next_output: the first not reached; those from first_even to last_even are `spacing` apart. Of the segment: grid: see
#: `propagate`; driving: whether the drivers are its own, from the time `origin` on; degree, frequencies: of its
#: forcing; segment_end. steps, products, exponentials: counts. nu: 1-norm of A; t: of x; limit: a state beyond it has
#: diverged.
SPACE = layout(
    "A B scale x y y_next zeros entries values g omega sine cosine p p_next beta matrices "
    "n panels channels q_max matrix_bytes turns driver_turns grid_level "
    "pieces n_pieces first last rate offset order cursor "
    "entry_room rhs jacobian input_jacobian A_places A_entries B_places B_entries "
    "outputs n_outputs saved next_output first_even last_even grid driving degree frequencies q "
    "steps products exponentials failed_state",
    "spacing nu delta origin t segment_end t1 limit",
)


class Arrays(NamedTuple):
    """The arrays that a space points into; kept alive as long as the space is used."""

    work: NDArray[np.float64]
    cursor: NDArray[np.int64]
    outputs: NDArray[np.float64]
    saved: NDArray[np.float64]
    A_places: NDArray[np.int64]
    B_places: NDArray[np.int64]
    inputs: tuple[NDArray[Any], ...]


class Linear(NamedTuple):
    """The kernels of a linear model: its right-hand side and the derivatives of that by states and inputs."""

    rhs: Any
    jacobian: PlacedKernel
    input_jacobian: PlacedKernel


def space_for(
    linear: Linear, inputs: InputTable, channels: int, outputs: NDArray[np.float64]
) -> tuple[np.void, Arrays]:
    """A space for a linear model, the first `channels` inputs and wanted times (m,) from the start on."""
    _, A, B = linear
    n, room = A.pattern.shape[0], max(A.pattern.entries, B.pattern.entries)
    sines = channels if inputs.pieces[:, AMPLITUDE].any() else 0
    q_max = POWERS + 2 * sines
    matrix = _matrix(n, q_max)
    offsets, length = _places(n, channels, sines, room)
    arrays = Arrays(
        work=np.zeros(length),
        cursor=inputs.first.copy(),
        outputs=outputs,
        saved=np.empty((len(outputs), n)),
        A_places=A.pattern.places(),
        B_places=B.pattern.places(channels + 1),
        inputs=tuple(writable(getattr(inputs, name)) for name in INPUTS),
    )
    fields = np.zeros(len(SPACE.names or ()), dtype=np.int64)
    fields[: len(offsets)] = offsets + -(-arrays.work.ctypes.data // CACHE_LINE) * CACHE_LINE
    s = fields.view(SPACE)[0]
    s["q_max"], s["matrix_bytes"] = q_max, 8 * matrix
    s["n"], s["panels"], s["channels"], s["n_outputs"] = n, -(-n // BLOCK), channels, len(outputs)
    s["n_pieces"] = len(inputs.pieces)
    s["entry_room"], s["A_entries"], s["B_entries"] = room, A.pattern.entries, B.pattern.entries
    for name, kernel in (("rhs", linear.rhs), ("jacobian", A.kernel), ("input_jacobian", B.kernel)):
        s[name] = pointer(kernel, VECTOR_KERNEL, name)
    for name in ("cursor", "outputs", "saved", "A_places", "B_places"):
        s[name] = address(getattr(arrays, name))
    for name, array in zip(INPUTS, arrays.inputs, strict=True):
        s[name] = address(array)
    return s, arrays


#: Everything in the work space starts at one, in bytes: vectors across two of them cost double.
CACHE_LINE = 64
#: Numbers on a cache line.
ON_A_LINE = CACHE_LINE // 8


def _matrix(n: int, q_max: int) -> int:
    """Numbers in a matrix: n columns of n + q_max rows, and the block J."""
    width, q_width = (-(-size // BLOCK) * BLOCK for size in (n, q_max))
    return width * (n + q_max) + q_width * q_max


@cache
def _places(n: int, channels: int, sines: int, room: int) -> tuple[NDArray[np.int64], int]:
    """Offsets of the first fields of SPACE in bytes, and the length of the work space in numbers."""
    q_max = POWERS + 2 * sines
    width, q_width = (-(-size // BLOCK) * BLOCK for size in (n, q_max))
    matrix = _matrix(n, q_max)
    lengths = {
        "A": width * n,
        "B": width * (channels + 1),
        **dict.fromkeys(("scale", "x", "y", "y_next"), width),
        "zeros": max(width, channels),
        "entries": room,
        "values": POWERS * (channels + 1),
        "g": POWERS * width,
        "omega": sines,
        **dict.fromkeys(("sine", "cosine"), sines * width),
        **dict.fromkeys(("p", "p_next", "beta"), q_width),
        "matrices": matrix * int(Y + LEVELS + 1),
    }
    numbers = np.array([-(-length // ON_A_LINE) * ON_A_LINE for length in lengths.values()], dtype=np.int64)
    return 8 * (np.cumsum(numbers) - numbers), int(numbers.sum()) + ON_A_LINE
