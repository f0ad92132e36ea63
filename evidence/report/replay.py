"""Measures the replay of a report: size of the page, time to the first frame, frames per second.

In headless Chromium with software graphics on two processors, from the file, without a network;
each first frame in a browser that was just started, which compiles everything anew. Medians over
`ROUNDS` go to reports/evidence/report.csv. A busy machine measures its other work: unless more than
`IDLE` of it is idle, it refuses. With --anyway it goes on, its browser before all other
work, which needs the right to do so (root); the command in the rows says so.
"""

import os
import statistics
import sys
import time
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import evidence
from evidence import Row, option
from evidence.browser import FLAGS, program

ROUNDS = 7
SECONDS = 4.0
"""Of one measurement of frames per second."""
SETTLING = 5000
"""ms, in which the replay finds how many pixels the machine has time for."""
IDLE = 0.8
PROCESSORS = 2
PRIORITY = -18
WINDOW = {"width": 1280, "height": 800}
FIRST = "performance.getEntriesByName('replay-first-frame')[0]?.startTime ?? 0"
DRAWN = "[+document.getElementById('replay').dataset.frames, performance.now()]"
PIXELS = "(({width, clientWidth}) => width / clientWidth)(document.querySelector('canvas'))"
IN_SIGHT = "document.querySelector('.replay-stage').scrollIntoView({block: 'center'})"
REPORT = option("--report", type=Path, required=True, help="report.html of a finished run")
ANYWAY = option("--anyway", action="store_true", help="measure on a busy machine, before others")
MEASURES = {
    "*": {
        "code": ("gaitval/reporting/replay.py", "gaitval/reporting/page.py"),
        "data": ("gaitval/reporting/*.js", "gaitval/reporting/vendor/*"),
    },
}
"""What the rows depend on; see evidence/stale.py."""


def idle_share(seconds: float = 2.0) -> float:
    """Fraction of this machine's processor time that nobody uses."""

    def times() -> list[int]:
        return [int(each) for each in Path("/proc/stat").read_text().splitlines()[0].split()[1:]]

    before = times()
    time.sleep(seconds)
    spent = [after - earlier for after, earlier in zip(times(), before, strict=True)]
    return (spent[3] + spent[4]) / sum(spent)


def family(process: int) -> set[int]:
    """A process and all that descend from it."""
    parents = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            parents[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
    found = {process}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return found


def go_before_others() -> None:
    """Raise the priority of every thread of the browser, which this process has started; threads
    that begin later inherit it.
    """
    for process in family(os.getpid()) - {os.getpid()}:
        for thread in Path(f"/proc/{process}/task").glob("*"):
            with suppress(ProcessLookupError):
                os.setpriority(os.PRIO_PROCESS, int(thread.name), PRIORITY)


@contextmanager
def opened(playwright: Any, path: Path, first: bool) -> Iterator[Any]:
    """The page in a browser of its own, when it has drawn its first frame."""
    browser = playwright.chromium.launch(executable_path=program(), args=list(FLAGS))
    page = browser.new_context(viewport=WINDOW, offline=True).new_page()
    if first:
        go_before_others()
    page.goto(path.as_uri())
    while not page.evaluate(FIRST):
        page.wait_for_timeout(20)
    yield page
    browser.close()


def frames_per_second(page: Any, first: bool) -> float:
    """Of the walk that plays, in sight."""
    page.evaluate(IN_SIGHT)
    if first:
        go_before_others()
    page.wait_for_timeout(SETTLING)
    frames, start = page.evaluate(DRAWN)
    page.wait_for_timeout(1000 * SECONDS)
    later, end = page.evaluate(DRAWN)
    return 1000.0 * (later - frames) / (end - start)


@evidence.measurement(REPORT, ANYWAY)
def replay(arguments: Namespace) -> list[Row]:
    """Size of the page, first frame and frames per second of a report's replay in Chromium."""
    from playwright.sync_api import sync_playwright

    path = arguments.report.resolve()
    idle = idle_share()
    print(f"{idle:.0%} of this machine is idle")
    if idle < IDLE and not arguments.anyway:
        sys.exit("It is busy with other work, so it would measure that. Wait, or give --anyway.")
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:PROCESSORS])
    firsts, rates = [], []
    with sync_playwright() as playwright:
        for _ in range(ROUNDS):
            with opened(playwright, path, arguments.anyway) as page:
                firsts.append(page.evaluate(FIRST) / 1000.0)
                rates.append(frames_per_second(page, arguments.anyway))
                pixels = page.evaluate(PIXELS)
                print(
                    f"first frame {firsts[-1]:.2f} s, {rates[-1]:.1f} frames/s, "
                    f"{pixels:.2f} pixels a CSS pixel along an edge",
                    flush=True,
                )
    size = path.stat().st_size / 1e6
    return [
        Row("replay: size of the page", size, "MB", "<=", 6, 8, 1),
        Row(
            "replay: first frame in Chromium, 2 processors, software graphics",
            statistics.median(firsts),
            "s",
            "<=",
            1.5,
            3,
            ROUNDS,
        ),
        Row(
            "replay: frames per second in Chromium, 2 processors, software graphics",
            statistics.median(rates),
            "1/s",
            ">=",
            30,
            15,
            ROUNDS,
        ),
    ]
