"""What a user waits for: whole commands in processes of their own."""

import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.timing import Timing, interleaved

ROOT = Path(__file__).parent.parent


def groups(quick: bool) -> dict[str, list[Timing]]:
    """Warm starts of the command line; the first of each, which may compile, is not counted."""
    with tempfile.TemporaryDirectory() as folder:
        commands = {
            "qddot --help": ("--help",),
            "qddot generate --check m113": ("generate", "m113", "--check"),
            "qddot generate --check, all models": ("generate", "--check"),
            "qddot run studies/one_shot.toml": ("run", "studies/one_shot.toml", "--into", folder),
            "the same without the figure": ("run", "studies/one_shot.toml", "--into", folder, "--no-figure"),
        }
        return {
            "Warm commands": interleaved(
                {name: lambda arguments=arguments: _qddot(*arguments) for name, arguments in commands.items()},
                2 if quick else 5,
            )
        }


def _qddot(*arguments: str) -> None:
    subprocess.run([sys.executable, "qddot.py", *arguments], cwd=ROOT, check=True, capture_output=True)
