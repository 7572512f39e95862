"""A process that runs batches in processes of its own, which a test may kill."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent

#: A process that has everything loaded. It forks one that runs the batch for each line it is sent, and after another
#: line tells how that ended: until then, the process has its number to itself.
SERVER = """
import os, sys
from pathlib import Path
import xarray, zarr
from qddot.runner.batch.block import warm_up
from qddot.runner.batch.job import read_job
from qddot.runner.batch.run import run_batch
warm_up(read_job(Path(sys.argv[1])))
print("ready", flush=True)
for line in sys.stdin:
    pid = os.fork()
    if not pid:
        run_batch(sys.argv[1], line.strip())
        os._exit(0)
    print(pid, flush=True)
    sys.stdin.readline()
    print(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), flush=True)
"""


class Server:
    def __init__(self, study):
        command = [sys.executable, "-c", SERVER, str(study)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        assert self._line() == "ready"

    def _line(self):
        return self.process.stdout.readline().strip()

    def start(self, store):
        self.process.stdin.write(f"{store}\n")
        self.process.stdin.flush()
        return int(self._line())

    def status(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return int(self._line())

    def close(self):
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()
