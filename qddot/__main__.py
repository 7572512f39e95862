"""`python -m qddot`: the command line."""

from qddot.command_line import main

main()
