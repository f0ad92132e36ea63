"""Fixtures that every test may use, and what happens without the raw data."""

from __future__ import annotations

import os
import pickle
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from _pytest.assertion.rewrite import AssertionRewritingHook

# The libraries are imported where they are used: the process that only hands out the tests loads
# this file too, and no worker starts before it has.
if TYPE_CHECKING:
    from simulation_fixtures import DartPeer

    from gaitval.walk.simulation.walker import WalkingTask

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
        help="the documentation site that `make docs` has built, whose tests are else skipped",
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


@pytest.hookimpl(trylast=True)  # after those who shuffle
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with most slow tests first: a worker that gets one of them last is waited for."""
    slow = Counter(item.path for item in items if item.get_closest_marker("slow"))
    items.sort(key=lambda item: -slow[item.path])


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


@pytest.fixture(scope="session", autouse=True)
def _server_of_workers() -> None:
    """The server that forks worker processes has the environment of its start for as long as the
    session lasts: it must not be that of a test which has changed it."""
    from gaitval.policy.workers import ready_to_start

    ready_to_start()


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
    """Equal references are fitted once, but in tests of the fit and in programs that tests start:
    studies of the same few people and settings would else spend most of their time on it.
    """
    from fitted_once import fit_once

    with pytest.MonkeyPatch.context() as patch:
        if request.path.parent.name != "reference":
            fit_once(patch, shared_folder(tmp_path_factory) / "fitted")
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


@pytest.fixture(autouse=True)
def _safe_path_of_one_test() -> Iterator[None]:
    """A command that runs here tells its own processes where not to look (PYTHONSAFEPATH), and the
    tests after it start scripts of their own.
    """
    before = os.environ.get("PYTHONSAFEPATH")
    yield
    if before is None:
        os.environ.pop("PYTHONSAFEPATH", None)
