"""`qddot summary`."""

from functools import partial

from qddot.command import STORE, Command, call

COMMAND = Command(
    partial(call, "qddot.runner.commands.summary", "summary"),
    "Sum a batch up: best, worst, quantiles, failures.",
    (STORE,),
)
