"""The script of continuous integration: it brings a browser where it can, and tests without one where it cannot."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
STUB = '#!/bin/sh\necho "$(basename "$0") $*" >> "$LOG"\nexit {}\n'


def ran(folder, there=(), fails=()):
    """What the script calls, in a machine that has these commands; (status, calls, printed)."""
    places = folder / "bin"
    places.mkdir()
    for name in ("bash", "dirname", "basename", "sh"):
        (places / name).symlink_to(shutil.which(name))
    (places / "timeout").write_text('#!/bin/sh\nshift\nexec "$@"\n')
    for name in ("make", *there):
        (places / name).write_text(STUB.format(int(name in fails)))
    for path in places.iterdir():
        if not path.is_symlink():
            path.chmod(0o755)
    environment = {"PATH": str(places), "LOG": str(folder / "calls"), "CI": "true"}
    bash = shutil.which("bash")
    done = subprocess.run(
        [bash, ROOT / ".ci" / "run"], env=environment, capture_output=True, text=True, timeout=60, check=False
    )
    return done.returncode, (folder / "calls").read_text().splitlines(), done.stdout


@pytest.mark.skipif(os.name != "posix", reason="the script is of a Unix shell")
def test_the_browser_is_installed_from_the_systems_packages_before_the_tests(tmp_path):
    status, calls, _ = ran(tmp_path, there=["apt-get"])
    assert status == 0
    assert [call.split()[:2] for call in calls] == [["apt-get", "update"], ["apt-get", "install"], ["make", "test"]]
    assert " chromium" in calls[1]


@pytest.mark.parametrize(("there", "fails"), [((), ()), (("apt-get",), ("apt-get",))])
def test_without_a_network_or_packages_the_tests_run_and_a_line_says_what_is_missing(tmp_path, there, fails):
    status, calls, printed = ran(tmp_path, there, fails)
    assert status == 0 and calls[-1] == "make test"
    assert "Chromium is not here and was not installed: tests of pages are skipped" in printed


def test_a_browser_that_is_there_is_taken_and_failing_tests_fail_the_script(tmp_path):
    status, calls, _ = ran(tmp_path, there=["chromium", "apt-get"], fails=["make"])
    assert status == 1 and calls == ["make test"]
