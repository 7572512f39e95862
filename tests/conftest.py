"""Fixtures that several test files share."""

import contextlib
import gc
import importlib
from pathlib import Path

import pytest
from drivers import IMPORTS, MANY, TASKS, compile_a_share

#: To collect 190 files makes half a million objects, which stay: Python need not look through them again and again.
gc.disable()


def pytest_configure(config):
    """Give tests the fixtures of models, but where a process only hands out tests to others: these wait for it."""
    if hasattr(config, "workerinput") or config.getoption("dist", "no") == "no":
        config.pluginmanager.import_plugin("models")


@pytest.hookimpl(tryfirst=True)
def pytest_collection(session):
    """Processes that are to collect all files compile together what these compile as they are imported."""
    config = session.config
    if hasattr(config, "workerinput") and any(Path(each).is_dir() for each in config.args):
        compile_a_share(config._tmp_path_factory.getbasetemp().parent / "imports", IMPORTS)
        _read_from_the_other_end(config)


def _read_from_the_other_end(config):
    """Every other process imports the files backwards, so that each rewrites asserts of half of them, and compiles.

    Both would rewrite all at the same time otherwise; what one has written, the others find. What cannot be imported
    is told when it is collected.
    """
    if int(config.workerinput["workerid"].removeprefix("gw")) % 2:
        for path in sorted(Path(__file__).parent.glob("test_*.py"), reverse=True):
            with contextlib.suppress(Exception, pytest.skip.Exception):
                importlib.import_module(path.stem)


def pytest_collection_finish():
    """From here on Python looks for cycles again, seldom: what models and compilers leave behind is large and stays."""
    gc.freeze()
    gc.set_threshold(100_000, 20, 100)
    gc.enable()


def pytest_unconfigure():
    """The process ends: to look through all that it has made, as Python would, takes seconds."""
    gc.freeze()


#: Files that take longest, from half a minute of a processor down to ten seconds: begun first, so that the processes
#: of a session end together. Option `--no-loadscope-reorder` keeps this order.
LONGEST = (
    *("fuzz", "batch_killed", "differential", "damaged_batches", "docs", "package", "notebooks", "report"),
    *("trust_batches", "tables_of_two_arguments", "bicycle", "generate", "batch", "identify", "trust_places", "cells"),
    *("coupled_cells", "structured_jacobians", "taylor_lanes"),
    *("knots_of_tables", "benchmark_library", "paper", "derivation", "tables_of_states", "power_balance", "ndf"),
    *("repeating_equations", "events_of_all_methods", "trust_compare", "trust_beam", "trust_units", "typed", "walls"),
    *("elementary", "command_line", "dense_output", "elimination_order", "standard_problems", "places"),
)


def pytest_collection_modifyitems(config, items):
    """Longest files first; leave out what is marked long, unless a mark is asked for."""
    places = {f"test_{name}": place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: places.get(item.path.stem, len(LONGEST)))
    if not config.option.markexpr:
        config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker("long")])
        items[:] = [item for item in items if not item.get_closest_marker("long")]


@pytest.fixture(scope="session", autouse=True)
def drivers(request, tmp_path_factory, worker_id):
    """Drivers of all methods, compiled by the processes of a whole session together."""
    if worker_id != "master" and len({item.path for item in request.session.items}) >= MANY:
        compile_a_share(tmp_path_factory.getbasetemp().parent / "drivers", TASKS)


@pytest.fixture(scope="session")
def chromium():
    """A browser for all tests of a process; they are skipped where there is none."""
    from browsing import BROWSER

    if BROWSER is None:
        pytest.skip("no Chromium here: install the system's package `chromium` for tests of pages")
    from chromium import Chromium

    browser = Chromium()
    yield browser
    browser.close()
