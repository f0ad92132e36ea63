"""How long an import takes: a 30 s treadmill session, and 20 overground trials.

The second session is the overground walk of Rajagopal et al. 2016, copied twenty times under other
names. Each is the whole command in a new process, its page and PDF included, on as many cores as
the machine has; the shortest of two, because other work only adds. Writes two rows of
`reports/evidence/recordings.csv`.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from pathlib import Path

import evidence

TRIALS = 20
REPEATS = 2
MEASURES = {
    "*": {
        "code": ("@motion",),
        "allowed": 50,
        "why": "one in a hundred of these statements: less than two runs differ (3 %)",
    },
}
"""What the rows depend on; see evidence/stale.py."""


def seconds(arguments: list[str], out: Path) -> float:
    """Shortest time of the command, s."""
    found = []
    for number in range(REPEATS):
        begin = time.perf_counter()
        subprocess.run(
            [
                sys.executable,
                "-m",
                "gaitval.cli",
                "import",
                *arguments,
                f"--out={out / str(number)}",
            ],
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        found.append(time.perf_counter() - begin)
    return min(found)


@evidence.measurement(evidence.DATA)
def times(arguments: Namespace) -> list[evidence.Row]:
    """Seconds of two imports by the command, pages and PDF included."""
    data = arguments.data
    raw, walk = data / "wbds" / "raw", data / "opensim_rajagopal" / "ExpData"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        treadmill = seconds(
            [f"--static={raw / 'WBDS01static1.c3d'}", f"--trial={raw / 'WBDS01walkT01.c3d'}",
             "--mass=74.3", "--height=1.725", "--sex=M"],
            folder / "treadmill",
        )  # fmt: skip
        given = [f"--static={walk / 'static_walk_1.trc'}"]
        given += ["--mass=85.07", "--height=1.829", "--sex=M"]
        for number in range(TRIALS):
            markers, forces = (folder / f"walk{number}{end}" for end in (".trc", ".mot"))
            shutil.copy(walk / "motion_capture_walk.trc", markers)
            shutil.copy(walk / "grf_walk.mot", forces)
            given += [f"--trial={markers}", f"--forces={forces}"]
        overground = seconds(given, folder / "overground")
    return [
        evidence.Row(
            f"import of a 30 s treadmill session, {os.cpu_count()} cores, whole command",
            treadmill, "s", "<=", 15, 30, REPEATS,
        ),
        evidence.Row(
            f"import of {TRIALS} overground trials, {os.cpu_count()} cores, whole command",
            overground, "s", "<=", 60, 120, REPEATS,
        ),
    ]  # fmt: skip
