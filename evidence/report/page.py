"""What was asked of the layout of the reports, and what was measured: rows of report.csv.

Writes the report of a finished run
folder again, takes the `recording.pdf` and `recording.html` of an import, and measures both: the
largest blank block of a page, what axe-core finds in Chromium, and how long the report takes.
"""

import shutil
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from pathlib import Path
from typing import Final

import evidence
from evidence import Row, none_may, option
from evidence.browser import LACKING, SERIOUS, findings, program
from evidence.page_blanks import blanks

_REPORT: Final = """
import resource, sys
from pathlib import Path
from gaitval.reporting.report import write_report
write_report(Path(sys.argv[1]))
print(resource.getrusage(resource.RUSAGE_SELF).ru_utime)
"""
MEASURES = {
    "report time, *": {
        "code": ("gaitval/reporting/*.py", "evidence/report/page.py:report_time,_REPORT,page"),
        "allowed": 30,
        "why": "one in a hundred of these statements: less than two reports differ (3 %)",
    },
    "empty area *": {
        "code": (
            "@page",
            "gaitval/reporting/recording_report.py",
            "evidence/page_blanks.py",
            "evidence/report/page.py:page",
        ),
        "data": ("gaitval/reporting/*.j2", "gaitval/reporting/*.css"),
    },
    "*": {
        "code": (
            "@page",
            "gaitval/reporting/recording_report.py",
            "evidence/browser.py",
            "evidence/report/page.py:violations,page",
        ),
        "data": ("gaitval/reporting/*.j2", "gaitval/reporting/*.css", "gaitval/reporting/*.js"),
    },
}
"""What the rows depend on; see evidence/stale.py."""


def violations(file: Path, chromium: str) -> int:
    """Serious and critical violations that axe-core finds on a page, in light and in dark."""
    from playwright.sync_api import sync_playwright

    found = 0
    with sync_playwright() as browsers:
        browser = browsers.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for width, scheme in ((360, "light"), (360, "dark"), (1600, "light")):
            page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
            page.set_default_timeout(300_000)
            page.goto(file.resolve().as_uri())
            for violation in findings(page):
                print(
                    f"{file.name}, {width} px, {scheme}: {violation['id']}, {violation['impact']}"
                )
                found += violation["impact"] in SERIOUS
            page.close()
        browser.close()
    return found


def report_time(run: Path) -> tuple[float, float]:
    """Wall-clock and processor seconds of a process that writes the report of a run."""
    begun = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-c", _REPORT, str(run)], check=True, capture_output=True, text=True
    )
    return time.monotonic() - begun, float(done.stdout)


@evidence.measurement(
    option("--run", type=Path, required=True, help="a finished run folder"),
    option("--recording", type=Path, required=True, help="an import's recording/"),
    option("--repeats", type=int, default=3, help="reports that are timed"),
)
def page(given: Namespace) -> list[Row]:
    """Blank blocks, what axe-core finds, and how long the report takes."""
    chromium = program()
    if chromium is None:
        raise SystemExit(LACKING)
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        shutil.copytree(given.run, run)
        times = [report_time(run) for _ in range(given.repeats)]
        print("wall-clock and processor seconds:", times)
        pages = [run / "report.html", given.recording / "recording.html"]
        empty = []
        for page in pages:
            found = blanks(page.with_suffix(".pdf"))
            print(page.name, [round(100 * blank) for blank in found])
            empty += found[:-1]  # the last page ends where the report ends
        wrong = sum(violations(page, chromium) for page in pages)
    seconds = min(processor for _, processor in times)
    return [
        none_may("axe-core violations, serious or critical", wrong, "", len(pages)),
        Row("empty area of PDF pages", 100 * max(empty), "%", "<=", 20, 30, len(empty)),
        Row("report time, HTML + PDF, processor", seconds, "s", "<=", 15, 30, len(times)),
    ]
