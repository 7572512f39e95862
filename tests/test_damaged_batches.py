"""A store of which something was damaged: it is named, never a result, and the same command computes it again."""

import copy
import json
import os
import random
import re
import shutil
import signal
import time
import warnings
from functools import cache

import numpy as np
import pytest
import zarr
from batch_server import Server
from batches import SMALLER, assert_equal, assert_equal_values, loaded, values, written

from qddot.runner.batch.damage import damage_of
from qddot.runner.batch.digests import of_values
from qddot.runner.batch.grid import open_batch
from qddot.runner.batch.job import read_job
from qddot.runner.batch.mending import mended
from qddot.runner.batch.results import Results
from qddot.runner.batch.run import run_batch
from qddot.runner.batch.store import Store, StoreError
from qddot.runner.commands.batch import batch as batch_command
from qddot.runner.commands.export import export
from qddot.runner.commands.plot import plot
from qddot.runner.commands.summary import summary

#: Of the test that kills and damages at random.
SEED, ROUNDS = 20261126, 8


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return written(tmp_path_factory.mktemp("study"), SMALLER)


@pytest.fixture(scope="module")
def whole(study, tmp_path_factory):
    return run_batch(study, tmp_path_factory.mktemp("whole") / "quick.zarr")


@pytest.fixture
def store(whole, tmp_path):
    """A copy, elsewhere."""
    return shutil.copytree(whole, tmp_path / "copy.zarr")


def flip(path, rng=None):
    """Turn a bit of one byte."""
    data = bytearray(path.read_bytes())
    data[rng.randrange(len(data)) if rng else len(data) // 2] ^= 1 << (rng.randrange(8) if rng else 3)
    path.write_bytes(data)


def cut(path, rng=None):
    data = path.read_bytes()
    path.write_bytes(data[: rng.randrange(len(data)) if rng else len(data) // 2])


def empty(path, rng=None):
    path.write_bytes(b"")


def delete(path, rng=None):
    path.unlink()


def braces(path, rng=None):
    path.write_text("{}")


def garbage(path, rng=None):
    path.write_bytes(bytes(range(256)))


MARKER, CHUNK = ".qddot/blocks/00000003.json", "z_s/c/3/0"
BLOCK = r"block 3 \(runs 12 to 15\)"
#: What is done to which file, and what is said of it.
CASES = {
    "chunk deleted": (delete, CHUNK, f"{BLOCK}: z_s;"),
    "byte of a chunk flipped": (flip, CHUNK, f"{BLOCK}: z_s;"),
    "chunk cut short": (cut, CHUNK, f"{BLOCK}: z_s;"),
    "chunk emptied": (empty, "travel/c/3", f"{BLOCK}: travel;"),
    "chunk of garbage": (garbage, "status/c/3", f"{BLOCK}: status;"),
    "marker {}": (braces, MARKER, f"{BLOCK}: its marker;"),
    "marker cut short": (cut, MARKER, f"{BLOCK}: its marker;"),
    "byte of a marker flipped": (flip, MARKER, f"{BLOCK}: its marker;"),
    "root of garbage": (garbage, "zarr.json", "zarr.json;"),
    "root {}": (braces, "zarr.json", "zarr.json;"),
    "root deleted": (delete, "zarr.json", "zarr.json;"),
    "array's metadata of garbage": (garbage, "travel/zarr.json", "travel/zarr.json;"),
    "array's metadata deleted": (delete, "z_s/zarr.json", "z_s/zarr.json;"),
    "axis deleted": (delete, "m_s/c/0", "m_s;"),
    "byte of an axis flipped": (flip, "m_s/c/0", "m_s;"),
    "axis' metadata cut short": (cut, "height/zarr.json", "height;"),
    "record of garbage": (garbage, ".qddot/store.json", r"\.qddot/store\.json;"),
    "record deleted": (delete, ".qddot/store.json", r"\.qddot/store\.json;"),
}


def asked(store, tmp_path, capsys):
    """What three ways to read a store say of damage, each as one line; and the status of those that are commands."""
    said, statuses = [], []
    for ask in (
        lambda: summary(store),
        lambda: export(store, tmp_path / "rows.csv"),
    ):
        try:
            statuses.append(ask())
            said.append(capsys.readouterr().err.strip())
        except StoreError as error:
            statuses.append(2)
            said.append(str(error))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            data = open_batch(store)
            said.append(data.attrs.get("damaged", ""))
            assert [str(each.message) for each in caught if each.category is UserWarning] == (
                [f"{store} is {said[-1]}"] if said[-1] else []
            )
        except StoreError as error:
            said.append(str(error))
    return said, statuses


@pytest.mark.parametrize("case", CASES)
def test_what_is_damaged_is_named_and_computed_again(case, study, whole, store, tmp_path, capsys):
    harm, name, message = CASES[case]
    harm(store / name)
    said, statuses = asked(store, tmp_path, capsys)
    assert statuses in ([1, 1], [2, 2])
    for line in said:
        assert re.search(f"{message} the `qddot batch` command that made it computes it again", line)
        assert "\n" not in line
    if statuses == [1, 1]:
        assert Results(store).partial == "partial: 12 of 16 runs"
        rows = (tmp_path / "rows.csv").read_text().splitlines()
        assert [row.split(",")[0] for row in rows if "not_run" in row] == ["12", "13", "14", "15"]
        found, right = open_batch_quietly(store), open_batch(whole)
        kept = np.arange(16) // 4 != 3
        assert np.isnan(found["z_s"].to_numpy().reshape(16, -1)[~kept]).all()
        np.testing.assert_array_equal(
            found["z_s"].to_numpy().reshape(16, -1)[kept], right["z_s"].to_numpy().reshape(16, -1)[kept]
        )
    run_batch(study, store)
    assert_same(store, whole)
    assert asked(store, tmp_path, capsys) == ([""] * 3, [0, 0])


def test_a_figure_of_what_is_left_says_so(store, tmp_path, capsys):
    flip(store / CHUNK)
    assert plot(store, [], [], None, tmp_path / "left.png") == 1
    said = capsys.readouterr()
    assert "left.png, partial: 12 of 16 runs" in said.out
    assert re.search(f"damaged: {BLOCK}: z_s;", said.err)
    garbage(store / "zarr.json")
    with pytest.raises(StoreError, match=r"is damaged: zarr\.json; the `qddot batch` command"):
        plot(store, [], [], None, tmp_path / "none.png")
    assert not (tmp_path / "none.png").exists()


def batch(study, store, fresh=False):
    return batch_command(study, store, [], None, None, fresh=fresh, keep_kernels=False, figure=False)


def open_batch_quietly(store):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return open_batch(store)


def digests(store):
    return {index: note["digests"] for index, note in Store(store).markers_read()[0].items()}


def files(store):
    return {str(each.relative_to(store)) for each in store.rglob("*") if each.name != "lock"}


@cache
def untouched(whole):
    """Values, digests and files of the store that nothing happened to."""
    return loaded(whole), digests(whole), files(whole)


def assert_same(store, whole):
    """Values, attributes and markers are those of the store that nothing happened to."""
    one, (other, wanted, there) = loaded(store), untouched(whole)
    assert_equal_values(one, other)
    assert one.identical(other)
    assert digests(store) == wanted
    assert len(wanted) == 4
    assert files(store) == there


def leaves(node, path=()):
    """Where the numbers, texts, switches and empty places of a JSON document are."""
    parts = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in parts:
        yield from leaves(value, (*path, key)) if isinstance(value, dict | list) else ((*path, key),)


def changed(value):
    return not value if isinstance(value, bool) else value + 1 if isinstance(value, int | float) else f"{value}~"


@pytest.mark.parametrize("of", ["travel/zarr.json", "z_s/zarr.json", "m_s/zarr.json", "zarr.json"])
def test_whatever_is_changed_in_the_metadata_is_mended(of, study, whole, store):
    """A leaf by itself, still as valid JSON: also what nobody reads but the library that opens the array."""
    rng, job, right = random.Random(SEED), read_job(study), json.loads((whole / of).read_text())
    found = list(leaves(right))
    of_packing = [path for path in found if "codecs" in path]
    for path in {*rng.sample(found, min(len(found), 4)), *rng.sample(of_packing, min(len(of_packing), 4))}:
        altered = copy.deepcopy(right)
        holder = altered
        for key in path[:-1]:
            holder = holder[key]
        holder[path[-1]] = changed(holder[path[-1]])
        (store / of).write_text(json.dumps(altered))
        mended(Store(store), job)
        if len(Store(store).finished()) < 4:
            run_batch(study, store)
        assert_same(store, whole)


def test_the_command_says_what_it_mends(study, store, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    flip(store / CHUNK)
    braces(store / "zarr.json")
    assert batch(study, store) == 0
    said = capsys.readouterr()
    assert f"note: {store} is damaged: zarr.json; block 3 (runs 12 to 15): z_s; mended\n" in said.err
    assert "4 runs in " in said.out
    assert summary(store) == 0


def test_markers_and_chunks_of_other_blocks_are_no_better(study, whole, store, tmp_path, capsys):
    shutil.copy(store / ".qddot/blocks/00000003.json", store / ".qddot/blocks/00000002.json")
    shutil.copy(store / "travel/c/3", store / "travel/c/1")
    shutil.copy(store / ".qddot/blocks/00000003.json", store / ".qddot/blocks/00000099.json")
    said, statuses = asked(store, tmp_path, capsys)
    assert statuses == [1, 1]
    assert "block 1 (runs 4 to 7): travel; block 2 (runs 8 to 11): its marker; its marker of no block" in said[0]
    assert Results(store).partial == "partial: 8 of 16 runs"
    run_batch(study, store)
    assert_same(store, whole)


def test_a_store_that_is_packed_otherwise_is_not_damaged(store, whole):
    found = values(whole)
    group = zarr.open_group(str(store), mode="r+", use_consolidated=False)
    for name in ("travel", "z_s", "m_s"):
        old = group[name]
        said = {"dimension_names": old.metadata.dimension_names, "attributes": dict(old.attrs), "overwrite": True}
        said |= {"shape": old.shape, "chunks": old.chunks, "dtype": old.dtype, "fill_value": old.fill_value}
        group.create_array(name, compressors=[zarr.codecs.GzipCodec(level=5)], **said)[:] = found[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(str(store))
    assert not damage_of(Store(store)).blocks
    assert_equal(store, whole)


def test_a_store_of_which_nothing_tells_of_which_batch_it_is_is_left_alone(study, whole, store):
    for name in ("zarr.json", ".qddot/store.json"):
        garbage(store / name)
    before = values(whole)["travel"]
    with pytest.raises(StoreError, match=r"zarr\.json and \.qddot/store\.json, so nothing tells .* with --fresh"):
        run_batch(study, store)
    assert (store / "travel" / "c" / "3").exists()
    assert batch(study, store, fresh=True) == 0
    np.testing.assert_array_equal(values(store)["travel"], before)


def test_a_store_of_an_older_layout_says_so(study, store):
    (store / ".qddot/store.json").unlink()
    root = json.loads((store / "zarr.json").read_text())
    root["attributes"]["qddot_layout"] = 1
    (store / "zarr.json").write_text(json.dumps(root))
    with pytest.raises(StoreError, match="has layout 1, this version of qddot reads and writes 2"):
        summary(store)
    with pytest.raises(StoreError, match="layout 1, this version of qddot writes 2"):
        run_batch(study, store)


def test_nan_is_nan_whatever_its_bits_and_nothing_else_is():
    other = np.array([np.nan, 1.0])
    other.view(np.uint64)[0] ^= 1
    assert of_values(np.array([np.nan, 1.0])) == of_values(other)
    assert of_values(np.array([0.0])) != of_values(np.array([-0.0]))
    assert of_values(np.zeros(2)) != of_values(np.zeros((1, 2)))
    assert of_values(np.zeros(2, dtype=np.int64)) != of_values(np.zeros(2))
    assert of_values(np.zeros(2, dtype=">f8")) == of_values(np.zeros(2))
    assert of_values(np.array(["a", "b"], dtype=object)) != of_values(np.array(["a", "c"], dtype=object))


HARMS = (flip, cut, empty, delete, braces, garbage)


def harmed(store, rng):
    """Damage one to three files of a store, whatever they are; not both that tell of which batch it is."""
    files = sorted(each for each in store.rglob("*") if each.is_file() and each.name != "lock" and each.stat().st_size)
    told = [store / "zarr.json", store / ".qddot" / "store.json"]
    files = [each for each in files if each != told[rng.randrange(2)]]
    done = []
    for path in rng.sample(files, min(len(files), rng.randint(1, 3))):
        harm = rng.choice(HARMS)
        harm(path, rng)
        done.append(f"{harm.__name__} {path.relative_to(store)}")
    return done


def test_killed_at_any_moment_and_damaged_anyhow_it_ends_up_as_if_nothing_had_been(study, whole, tmp_path, capsys):
    server, rng = Server(study), random.Random(SEED)
    print(f"seed {SEED}")
    durations, killed = [], 0
    for number in range(3):  # the machine may have been busy with one of them
        start = time.perf_counter()
        server.start(tmp_path / f"timed_{number}.zarr")
        assert server.status() == 0
        durations.append(time.perf_counter() - start)
    duration = min(durations)
    for number in range(ROUNDS):
        store, done = tmp_path / f"{number}.zarr", []
        for _ in range(rng.randint(1, 3)):
            pid = server.start(store)
            time.sleep(rng.uniform(0.2, 1.0) * duration)
            os.kill(pid, signal.SIGKILL)
            killed += server.status() == -signal.SIGKILL
            if store.exists():
                done.append(harmed(store, rng))
                print(number, done[-1])
                asked(store, tmp_path, capsys)
        server.start(store)
        assert server.status() == 0, done
        assert_same(store, whole)
        assert asked(store, tmp_path, capsys) == ([""] * 3, [0, 0])
    server.close()
    assert killed > ROUNDS // 2


def test_no_bit_of_a_store_can_turn_unnoticed_and_matter(whole, store):
    """Whatever is flipped: what is told is what was told before, or it is told that something is damaged."""
    rng, right = random.Random(SEED), values(whole)
    files = sorted(each.relative_to(whole) for each in whole.rglob("*") if each.is_file() and each.name != "lock")
    for name in files:
        flip(store / name, rng)
        try:
            results = Results(store)
            if not results.damaged:
                found = results.data.load()
                assert results.partial == ""
                for key, array in right.items():
                    assert np.array_equal(found[key], array, equal_nan=array.dtype.kind == "f"), (name, key)
        except StoreError as error:
            assert "is damaged: " in str(error)
        shutil.copy(whole / name, store / name)
