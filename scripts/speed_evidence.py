"""Figures of how fast a study is, for `reports/evidence/cohort.csv`.

    python scripts/speed_evidence.py physics
    python scripts/speed_evidence.py study [FOLDER]
    python scripts/speed_evidence.py new [FOLDER]

`physics` runs `benchmarks/test_physics_step.py` and takes the ratio of its goal: MuJoCo's C step
over a step of one of eight walkers side by side, least times in the same run on one core. `study`
runs `gaitval subject 5 --scratch` into FOLDER (a temporary one if not given), on a machine that
should be idle, and takes the time of the whole run, the samples a second of its first training with
all that surrounds it, and the largest memory of its processes together, shared pages counted once.
To look at the memory makes the processes wait, so it is looked at every two seconds.
`new` does the same from the general policy, which has learned on this subject's angles among
others (`scripts/left_out.py` has people that it has not), and takes the time. Both write the times
of their stages into docs/speed.md.
"""

import argparse
import contextlib
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import evidence
from marked_table import with_table

from gaitval.artefacts import read_json
from gaitval.configuration import SAMPLES_FROM

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "speed.md"
COMMAND = "python scripts/speed_evidence.py"
LOOK = 2.0
"""s between two looks at the memory of a study."""
MEASURES = {
    "physics, *": {"code": ("@physics", "scripts/speed_evidence.py:physics")},
    "*": {
        "code": ("@study", "@page", "scripts/speed_evidence.py:run,study,new,memory_of"),
        "allowed": 60,
        "why": "one in a hundred of these statements: one that took a whole stage twice would be "
        "seen by its test, and others move these figures less than two runs differ (2 %)",
    },
}
"""What the rows depend on; see scripts/stale_evidence.py."""


def physics() -> list[evidence.Row]:
    """The row of the physics engine."""
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "physics_step.json"
        command = [sys.executable, "-m", "pytest", "benchmarks/test_physics_step.py", "-q"]
        command += ["-k", "the_goal", "--benchmark-enable", "--benchmark-only", "-n", "0"]
        subprocess.run([*command, f"--benchmark-json={results}"], cwd=ROOT, check=True)
        (goal,) = json.loads(results.read_text(encoding="utf-8"))["benchmarks"]
    return [
        evidence.Row(
            "physics, one core, against MuJoCo's C step in the same run",
            float(goal["extra_info"]["times_mujoco"]),
            "times",
            ">=",
            15.0,
            10.0,
            50,
            f"{COMMAND} physics",
        )
    ]


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


def study(folder: Path) -> list[evidence.Row]:
    """The rows of a study from nothing; the limits that its walk keeps are in the name of the row,
    because a training from nothing may lose one (a push, most often).
    """
    found = run(folder, "--scratch", memory=True)
    write_stages("stages-nothing", folder, found)
    stages = read_json(folder / "provenance.json")["stages"]
    rate = SAMPLES_FROM["scratch"] / stages["train-1"]["seconds"]
    what = f"from nothing to report, S05 ({found.kept} of {found.limits} limits kept)"
    about, minutes = f"{COMMAND} study", found.seconds / 60
    return [
        evidence.Row("samples/s of a real training", rate, "1/s", ">=", 20e3, 14e3, 1, about),
        evidence.Row(what, minutes, "min", "<=", 4.0, 6.0, 1, about),
        evidence.Row("memory of a study", found.memory, "GB", "<=", 1.0, 1.5, 1, about),
    ]


def new(folder: Path) -> list[evidence.Row]:
    """The row of a study from the general policy, as of somebody without a policy of their own."""
    found = run(folder, "--start", str(ROOT / "reports" / "general"))
    if found.kept < found.limits:
        raise SystemExit(f"{folder}: {found.kept} of {found.limits} limits are kept.")
    write_stages("stages-new", folder, found)
    what = "new subject, general policy to report, every limit kept"
    return [evidence.Row(what, found.seconds, "s", "<=", 90.0, 150.0, 1, f"{COMMAND} new")]


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    kinds = parser.add_subparsers(dest="kind", required=True)
    kinds.add_parser("physics")
    for kind in ("study", "new"):
        kinds.add_parser(kind).add_argument("folder", type=Path, nargs="?")
    arguments = parser.parse_args()
    if arguments.kind == "physics":
        rows = physics()
    else:
        measure = {"study": study, "new": new}[arguments.kind]
        with tempfile.TemporaryDirectory() as temporary:
            rows = measure(arguments.folder or Path(temporary) / "S05")
    evidence.write("cohort", rows)
    for row in rows:
        print(f"{row.what}: {row.value:.4g} {row.unit}")


if __name__ == "__main__":
    main()
