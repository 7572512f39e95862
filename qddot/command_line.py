"""The command line: reads the arguments, calls the command's function, and turns what went wrong into one message."""

import argparse
import atexit
import gc
import os
import signal
import sys
from collections.abc import Iterable, Sequence
from typing import Any, NoReturn

from qddot.commands import COMMANDS
from qddot.extras import missing, of_an_extra
from qddot.words import nearest

ABOUT = "Lagrange's equations from T, Π and Φ to compiled simulations."


def parser(chosen: Iterable[str] = COMMANDS) -> argparse.ArgumentParser:
    """The parser of all commands, or of these."""
    made = argparse.ArgumentParser(prog="qddot", description=ABOUT, allow_abbrev=False)
    made.add_argument(
        "--version", action=_Version, nargs=0, default=argparse.SUPPRESS, help="Print the version, and exit."
    )
    commands = made.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name in chosen:
        command = COMMANDS[name]
        own = commands.add_parser(name, help=command.help, description=command.help, allow_abbrev=False)
        for names, settings in command.arguments:
            own.add_argument(*names, **settings)
    return made


class _Version(argparse.Action):
    """Prints the version, which is looked up when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        import qddot

        print(f"qddot {qddot.__version__}")
        parser.exit()


def _arguments(words: Sequence[str]) -> dict[str, Any]:
    """What is given, by name; exits with 2 and one message, the nearest name in it, where there is no such thing."""
    reader = parser(words[:1] if words[0] in COMMANDS else COMMANDS)  # a command is not kept waiting by others
    options = ("-h", "--help", "--version")
    if words[0] not in (*COMMANDS, *options):
        kind, known = ("option", options) if words[0].startswith("-") else ("command", tuple(COMMANDS))
        hint = nearest(words[0], known) or "; `qddot --help` lists them all"
        reader.error(f"there is no {kind} {words[0]!r}{hint}")
    given, rest = reader.parse_known_args(words)
    if rest:
        own = {name for each in COMMANDS[given.command].arguments for name in each.names if name.startswith("-")}
        extra = next((word for word in rest if word.startswith("-")), None)
        if extra is None:
            reader.error(f"{given.command} takes no further {rest[0]!r}; see `qddot {given.command} --help`")
        option = extra.partition("=")[0]
        hint = nearest(option, own) or f"; see `qddot {given.command} --help`"
        reader.error(f"{given.command} has no option {option!r}{hint}")
    return vars(given)


def _start_quickly() -> None:
    """Spare a command what it does not need: looking for garbage, a BLAS's threads, and a search for plugins."""
    gc.set_threshold(200_000)
    atexit.register(gc.freeze)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")


def _said(error: ValueError | OSError) -> str:
    """What an error says; of the operating system's the file, and what is the matter with it."""
    if isinstance(error, OSError) and error.filename and error.strerror:
        return f"{error.filename}: {error.strerror[0].lower()}{error.strerror[1:]}"
    return str(error)


def _terminated(number: int, frame: object) -> NoReturn:
    """End on SIGTERM as on Ctrl-C: what is half written is removed on the way out."""
    print("terminated", file=sys.stderr)
    raise SystemExit(128 + number)


def main() -> None:
    """Run the command line; what a person gave wrongly ends in one message, never in a traceback."""
    _start_quickly()
    given = _arguments(sys.argv[1:] or ["--help"])
    signal.signal(signal.SIGTERM, _terminated)
    try:
        status = COMMANDS[given.pop("command")].function(**given)
        sys.stdout.flush()
    except BrokenPipeError:  # who read the output has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = 1
    except ModuleNotFoundError as error:
        if not of_an_extra(error):
            raise
        print(f"error: {missing(error)}", file=sys.stderr)
        status = 2
    except (ValueError, OSError) as error:
        print(f"error: {_said(error)}", file=sys.stderr)
        status = 2
    except MemoryError as error:
        print(f"error: out of memory{f': {error}' if str(error) else ''}", file=sys.stderr)
        status = 2
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        status = 130
    raise SystemExit(status)
