"""`qddot plot`."""

from functools import partial

from qddot.command import STORE, Command, argument, call, path, several

COMMAND = Command(
    partial(call, "qddot.runner.commands.plot", "plot"),
    "Draw a batch: metrics over one axis, a map over two, trajectories of chosen runs.",
    (
        STORE,
        several("--metric", "METRIC", "A metric to draw; all by default. Repeat for more.", dest="metrics"),
        several("--over", "AXIS", "An axis of the sweep; twice for a map."),
        argument("--runs", help="Trajectories of these runs: 0,5,17, or best, or worst."),
        path("--into", "The picture: PNG, SVG or PDF."),
    ),
)
