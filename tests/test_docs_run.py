"""What the tutorial tells people to type beside its notebook works: see test_notebooks."""

import shlex

from commands import command
from pages import blocks_of


def _command(line, folder):
    done = command(*shlex.split(line)[1:], cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_tutorials_studies_run(tmp_path):
    for block in blocks_of("docs/tutorial.md"):
        if block.file:
            (tmp_path / block.file).write_text(block.text)
    _command("qddot generate swing.py --into kernels", tmp_path)
    assert "wrote results/push.png" in _command("qddot run push.toml", tmp_path)
    changed = _command('qddot run push.toml --no-figure --set parameters.L="1.1m" --set inputs.F.peak=60', tmp_path)
    assert "wrote results/push" in changed
    assert "1000 of 1000 runs, 0 failed" in _command("qddot batch absorber.toml", tmp_path)
    assert "wrote results/absorber_row=300.nc" in _command("qddot run absorber.toml --row 300 --no-figure", tmp_path)
    assert "wrote " in _command("qddot plot results/absorber.zarr", tmp_path)
