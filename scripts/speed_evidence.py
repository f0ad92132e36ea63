"""Figures of how fast a study is, for `reports/evidence/cohort.csv`.

    python scripts/speed_evidence.py physics
    python scripts/speed_evidence.py study [FOLDER]

`physics` runs `benchmarks/test_physics_step.py` and takes the ratio of its goal: MuJoCo's C step
over a step of one of eight walkers side by side, least times in the same run on one core. `study`
runs `gaitval subject 5 --scratch` into FOLDER (a temporary one if not given), on a machine that
should be idle, and takes the time of the whole run, the samples a second of its first training with
all that surrounds it, and the largest memory of its processes together, shared pages counted once.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import evidence

from gaitval.artefacts import read_json
from gaitval.configuration import Configuration

ROOT = Path(__file__).resolve().parent.parent
COMMAND = "python scripts/speed_evidence.py"
LOOK = 0.5
"""s between two looks at the memory of a study."""


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


def study(folder: Path) -> list[evidence.Row]:
    """The rows of a study from nothing."""
    command = [sys.executable, "-m", "gaitval", "subject", "5", "--scratch", "--out", str(folder)]
    began, largest = time.monotonic(), 0.0
    with subprocess.Popen(command, cwd=ROOT) as process:
        while process.poll() is None:
            largest = max(largest, memory_of(process.pid))
            time.sleep(LOOK)
    minutes = (time.monotonic() - began) / 60.0
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}.")
    stages = read_json(folder / "provenance.json")["stages"]
    rate = Configuration().training.samples / stages["train-1"]["seconds"]
    about = f"{COMMAND} study"
    return [
        evidence.Row("samples/s of a real training", rate, "1/s", ">=", 20e3, 14e3, 1, about),
        evidence.Row("from nothing to report, S05", minutes, "min", "<=", 4.0, 6.0, 1, about),
        evidence.Row("memory of a study", largest, "GB", "<=", 1.0, 1.5, 1, about),
    ]


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    kinds = parser.add_subparsers(dest="kind", required=True)
    kinds.add_parser("physics")
    kinds.add_parser("study").add_argument("folder", type=Path, nargs="?")
    arguments = parser.parse_args()
    if arguments.kind == "physics":
        rows = physics()
    else:
        with tempfile.TemporaryDirectory() as temporary:
            rows = study(arguments.folder or Path(temporary) / "S05")
    evidence.write("cohort", rows)
    for row in rows:
        print(f"{row.what}: {row.value:.4g} {row.unit}")


if __name__ == "__main__":
    main()
