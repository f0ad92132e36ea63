"""Fixtures that every test may use, and what happens without the raw data."""

from __future__ import annotations

import gc
import os
import pickle
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from _pytest.assertion.rewrite import AssertionRewritingHook
from starting_order import place

# The libraries are imported where they are used: the process that only hands out the tests loads
# this file too, and no worker starts before it has.
if TYPE_CHECKING:
    from simulation_fixtures import DartPeer

    from gaitval.simulation.walker import WalkingTask

NO_DATA = "no raw data at"
"""How the reason of every skip for want of data begins."""


def data_folder() -> Path:
    """Where the raw data are looked for: `GAITVAL_DATA`, else `../shared/data`."""
    default = Path(__file__).resolve().parents[2] / "shared" / "data"
    return Path(os.environ.get("GAITVAL_DATA") or default)


def shared_folder(factory: pytest.TempPathFactory) -> Path:
    """The folder of this session of tests that all its workers have."""
    base = factory.getbasetemp()
    return base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base


def missing_data() -> str | None:
    """Why tests that read the raw data cannot run; None where they can."""
    folder = data_folder()
    if (folder / "wbds").is_dir():
        return None
    return f"{NO_DATA} {folder}: set GAITVAL_DATA to the folder that holds wbds/"


def pytest_addoption(parser: pytest.Parser) -> None:
    # An option and not a variable: it stands in the line that was run, and no shell keeps it.
    parser.addoption(
        "--require-data",
        action="store_true",
        help="fail where the raw data are missing, instead of skipping the tests that read them",
    )
    parser.addoption(
        "--site",
        metavar="FOLDER",
        help="the documentation site that `make docs` has just built, which else is built again",
    )


def pytest_configure(config: pytest.Config) -> None:
    # The whole package contains a plug-in of pytest, which would rewrite its assertions, too: there
    # are none, and each worker took a second to find that out.
    hook = config.pluginmanager.rewrite_hook
    if isinstance(hook, AssertionRewritingHook):  # with --assert=plain there is none
        hook._must_rewrite.discard("gaitval")
        hook._marked_for_rewrite_cache.clear()
    missing = missing_data()
    if missing and config.getoption("--require-data"):
        raise pytest.UsageError(f"--require-data: {missing}")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    skipped = [
        report
        for report in terminalreporter.getreports("skipped")
        if isinstance(report.longrepr, tuple) and NO_DATA in report.longrepr[2]
    ]
    if skipped:
        terminalreporter.write_line(
            f"Skipped for want of data: {len(skipped)} ({NO_DATA} {data_folder()}). "
            "To run them: GAITVAL_DATA=/folder/that/holds/wbds make test",
            yellow=True,
        )


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Nothing of what is loaded for all tests is garbage: looking for some again and again took a
    fifth of the time of loading it, in every worker."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The long files first, so that no worker is left alone with one at the end; within a file, and
    among the others, the order is the random one that the plug-in made before."""
    tests = Path(__file__).parent
    # Benchmarks are collected with this hook, too, where both are asked for.
    items.sort(key=lambda item: place(item.path, tests) if tests in item.path.parents else -1)


@pytest.fixture(scope="session", autouse=True)
def _server_of_workers() -> None:
    """The server that forks worker processes has the environment of its start for as long as the
    session lasts: it must not be that of a test which has changed it."""
    from gaitval.policy.workers import ready_to_start

    ready_to_start()


@pytest.fixture(scope="session", autouse=True)
def _pdf_alone_where_asked() -> Iterator[None]:
    """The PDF beside a page is an empty one, but in tests of the PDF (`whole_pdf`), in which a page
    of every kind is laid out, and in programs that tests start. Where GAITVAL_WHOLE_PAGES is set,
    every page of every test is laid out, which takes minutes."""
    from html_page import only_html, whole_pages

    with pytest.MonkeyPatch.context() as patch:
        if not whole_pages():
            only_html(patch)
        yield


@pytest.fixture(scope="module", autouse=True)
def _words_alone(request: pytest.FixtureRequest) -> Iterator[None]:
    """Without the slow tests, pages of whole commands come without figures: their tests read words
    and numbers, and those of `tests/reporting` look at the figures. With them, as in CI, everything
    is drawn, for a recording that lacks something may have no curve where a figure wants one; but
    it is painted only where GAITVAL_WHOLE_PAGES is set, since that is half of the time of an
    import."""
    from html_page import only_quick_tests, reads_words, unpainted, whole_pages, without_figures

    with pytest.MonkeyPatch.context() as patch:
        if reads_words(request.path):
            if only_quick_tests(request.config):
                without_figures(patch)
            if not whole_pages():  # some pages draw their figures themselves
                unpainted(patch)
        yield


@pytest.fixture(scope="module", autouse=True)
def _c3d_once(request: pytest.FixtureRequest) -> Iterator[None]:
    """Without the slow tests, equal C3D files are read once, but in tests of reading them. With
    them, as in CI, each is read each time."""
    from c3d_once import read_once
    from html_page import only_quick_tests

    with pytest.MonkeyPatch.context() as patch:
        if only_quick_tests(request.config) and request.path.parent.name != "mocap":
            read_once(patch)
        yield


@pytest.fixture(scope="module", autouse=True)
def _few_bands(request: pytest.FixtureRequest) -> Iterator[None]:
    """The bands of an import come of a few changes, but in tests that read them and in programs
    that tests start."""
    from few_bands import few_changes, reads_bands

    with pytest.MonkeyPatch.context() as patch:
        if not reads_bands(request.path, Path(__file__).parent):
            few_changes(patch)
        yield


@pytest.fixture(scope="module", autouse=True)
def _fitted_once(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[None]:
    """Equal references are fitted once, and equal moments shared to muscles, but in tests of these
    and in programs that tests start; and in tests of drafts, equal markers are matched once.
    """
    from fitted_once import fit_once, match_once, share_once

    with pytest.MonkeyPatch.context() as patch:
        if request.path.parent.name != "reference":
            fit_once(patch, shared_folder(tmp_path_factory) / "fitted")
        if request.path.parent.name != "muscles":
            share_once(patch)
        if request.path.parent.name == "markers":
            match_once(patch, shared_folder(tmp_path_factory) / "matched")
        yield


@pytest.fixture(scope="session")
def gait_data() -> Path:
    """Folder of the raw data (`wbds/`, `normative/`, …), which is not part of the project.

    Without it a test is skipped; `--require-data` has ended the session before.
    """
    missing = missing_data()
    if missing:
        pytest.skip(missing)
    return data_folder()


@pytest.fixture(scope="session")
def task(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WalkingTask]:
    """The walking task of subject 5 with the default configuration."""
    from simulation_fixtures import task_of_subject

    # Its reference takes three seconds: the first worker leaves it for the others of this session.
    base = tmp_path_factory.getbasetemp()
    left = shared_folder(tmp_path_factory) / "task.pickle"
    if left.exists():
        found = pickle.loads(left.read_bytes())
    else:
        found = task_of_subject("S05")
        own = base / "own.pickle"
        own.write_bytes(pickle.dumps(found))
        own.replace(left)
    before = pickle.dumps(found)
    yield found
    assert pickle.dumps(found) == before, "a test changed the walking task that all tests share"


@pytest.fixture(scope="session")
def peer(task: WalkingTask, tmp_path_factory: pytest.TempPathFactory) -> DartPeer:
    """DART's own reading of the task's URDF."""
    from simulation_fixtures import DartPeer

    return DartPeer(task.model, tmp_path_factory.mktemp("peer"))
