"""Figures of how fast a study is, for `reports/evidence/cohort.csv`.

`study` runs `gaitval subject 5 --scratch` into FOLDER (a temporary one if not given), on a machine
that should be idle, and takes the time of the whole run, the samples a second of its first training
with all that surrounds it, and the largest memory of its processes together, shared pages counted
once.
To look at the memory makes the processes wait, so it is looked at every two seconds.
`new` does the same from the general policy, which has learned on this subject's angles among
others (`experiments/left_out.py` has people that it has not), and takes the time. Both write the
times of their stages into docs/speed.md.
"""

import argparse
import contextlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import evidence
from evidence import ROOT, option
from evidence.marked_table import with_table
from gaitval.artefacts import read_json
from gaitval.configuration import SAMPLES_FROM

PAGE = ROOT / "docs" / "speed.md"
LOOK = 2.0
"""s between two looks at the memory of a study."""
FOLDER = option("--out", type=Path, help="run folder, kept (default: a temporary one)")
MEASURES = {
    "*": {
        "code": ("@study", "@page", "evidence/cohort/speed.py:run,study,new,memory_of"),
        "allowed": 60,
        "why": "one in a hundred of these statements: one that took a whole stage twice would be "
        "seen by its test, and others move these figures less than two runs differ (2 %)",
    },
}
"""What the rows depend on; see evidence/stale.py."""


@contextlib.contextmanager
def chosen(arguments: argparse.Namespace) -> Iterator[Path]:
    """The folder of the run: that of --out, or one that goes at the end."""
    with tempfile.TemporaryDirectory() as temporary:
        yield arguments.out or Path(temporary) / "S05"


def memory_of(process: int) -> float:
    """GB of a process and all that descend from it (Linux), shared pages in equal shares."""
    total = 0.0
    try:
        for line in Path(f"/proc/{process}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                total = 1024.0 * float(line.split()[1]) / 1e9
        children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    except (FileNotFoundError, ProcessLookupError):  # it has ended
        return total
    return total + sum(memory_of(int(child)) for child in children)


class Measured(NamedTuple):
    """Of a study: s, GB, and how many limits there are and are kept."""

    seconds: float
    memory: float
    limits: int
    kept: int


def run(folder: Path, *options: str, memory: bool = False) -> Measured:
    """The main job of subject 5; its largest memory only if asked for."""
    command = [sys.executable, "-m", "gaitval", "subject", "5", "--out", str(folder), *options]
    began, largest = time.monotonic(), 0.0
    with subprocess.Popen(command, cwd=ROOT) as process:
        while memory and process.poll() is None:
            largest = max(largest, memory_of(process.pid))
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(LOOK)
    seconds = time.monotonic() - began
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}.")
    summary = read_json(folder / "metrics.json")["summary"]
    limits = summary["accepted"] + summary["refused"]
    return Measured(seconds, largest, limits, summary["accepted"])


def write_stages(name: str, folder: Path, found: Measured) -> None:
    """The table `name` of docs/speed.md: what each stage of a study took."""
    stages = read_json(folder / "provenance.json")["stages"]
    lines = ["| stage | s |", "|---|---|"]
    for each in sorted(stages, key=lambda each: str(stages[each]["started"])):
        beside = " (beside the training)" if each == "identify-1" else ""
        lines.append(f"| `{each}`{beside} | {stages[each]['seconds']:.1f} |")
    lines.append(f"| in all, with the start of the program | {found.seconds:.0f} |")
    if found.memory:
        lines.append(f"| largest memory of all its processes | {found.memory:.2f} GB |")
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_table(text, name, "\n".join(lines)), encoding="utf-8")


@evidence.measurement(FOLDER)
def study(arguments: argparse.Namespace) -> list[evidence.Row]:
    """The rows of a study from nothing; the limits that its walk keeps are in the name of the row,
    because a training from nothing may lose one (a push, most often).
    """
    with chosen(arguments) as folder:
        found = run(folder, "--scratch", memory=True)
        write_stages("stages-nothing", folder, found)
        stages = read_json(folder / "provenance.json")["stages"]
    rate = SAMPLES_FROM["scratch"] / stages["train-1"]["seconds"]
    what = f"from nothing to report, S05 ({found.kept} of {found.limits} limits kept)"
    minutes = found.seconds / 60
    return [
        evidence.Row("samples/s of a real training", rate, "1/s", ">=", 20e3, 14e3, 1),
        evidence.Row(what, minutes, "min", "<=", 4.0, 6.0, 1),
        evidence.Row("memory of a study", found.memory, "GB", "<=", 1.0, 1.5, 1),
    ]


@evidence.measurement(FOLDER)
def new(arguments: argparse.Namespace) -> list[evidence.Row]:
    """The row of a study from the general policy, as of somebody without a policy of their own."""
    with chosen(arguments) as folder:
        found = run(folder, "--start", str(ROOT / "reports" / "general"))
        if found.kept < found.limits:
            raise SystemExit(f"{folder}: {found.kept} of {found.limits} limits are kept.")
        write_stages("stages-new", folder, found)
    what = "new subject, general policy to report, every limit kept"
    return [evidence.Row(what, found.seconds, "s", "<=", 90.0, 150.0, 1)]
