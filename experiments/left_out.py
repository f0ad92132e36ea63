"""What a person's own training adds for the built-in people, each from a general policy that has
never seen this person.

    python -m experiments.left_out run [--work FOLDER]    # 2 hours on an otherwise idle machine
    python -m experiments.left_out table [--rows]

They are left out in groups: for each group a general policy is trained on the others alone, their
angles at three speeds, in the two steps of the shipped one. From it everybody of the group is
studied without own samples, with 0.5 M and with 2 M. Body, reference and identification are those
of the study without; see `own_training`, which does these studies for strangers. `run` may be
started again, and several times at once after the policies are there.
"""

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import evidence
from evidence.marked_table import with_table
from experiments.own_training import (
    MOST,
    POINTS,
    collected,
    measured,
    study_once,
    table,
)
from gaitval.artefacts import read_json, versions, write_json, write_text
from gaitval.datasets.subject_file import BUILTIN

ROOT: Final = Path(__file__).resolve().parent.parent
STORE: Final = ROOT / "reports" / "general" / "left_out.json"
PAGE: Final = ROOT / "docs" / "learning.md"
COMMAND: Final = "python -m experiments.left_out table --rows"
WORK: Final = ROOT / "reports" / "left-out"
GROUPS: Final = 3
STEPS: Final = (22_000_000, 24_000_000)
"""Samples of the two steps in which the shipped policy was trained."""
SEEDS: Final = 2
SOME: Final = max(POINTS)
"""Own samples of a further study, with one seed."""
WHERE: Final = "own training of the ten, each left out of the general policy"
MEASURES = {
    "*": {
        "code": (
            "@walk",
            "gaitval/apps/virtual/person.py",
            "experiments/general_policy.py",
            "experiments/own_training.py:study,figures,pairs,walking,handed_on,ratio,kept",
        ),
        "results": ("reports/general/left_out.json",),
        "allowed": 120,
        "why": "ratios of two walks of the same code, and shares of goals: what changes both alike "
        "leaves them, and tests/policy and gaitval check say whether walks and learning do",
    },
}
"""What the rows depend on; see evidence/stale.py."""


def groups(count: int = GROUPS) -> list[list[str]]:
    """The subjects that are left out together."""
    return [list(BUILTIN)[number::count] for number in range(count)]


def general(left_out: list[str], work: Path) -> Path:
    """The folder of a general policy of the subjects that are not left out."""
    name = "-".join(left_out)
    others = [each for each in BUILTIN if each not in left_out]
    folders = [work / f"{step}-{name}" for step in ("first", "without")]
    for number, (folder, samples) in enumerate(zip(folders, STEPS, strict=True), start=1):
        if (folder / "about.json").is_file():
            continue
        command = [sys.executable, "-m", "experiments.general_policy", *others, "--alone"]
        command += ["--samples", str(samples), "--out", str(folder)]
        command += ["--work", str(work / f"training-{name}-{number}")]
        if number > 1:
            command += ["--start", str(folders[0])]
        subprocess.run(command, cwd=ROOT, check=True)
    return folders[-1]


def jobs(seeds: int = SEEDS) -> Iterator[tuple[str, int, int]]:
    """Person, seed and number of own samples of each study, the most needed ones first."""
    for seed in range(seeds):
        for name in BUILTIN:
            if seed == 0:
                yield name, 0, 0
            yield name, seed, MOST
    for name in BUILTIN:
        yield name, 0, SOME


def run(arguments: argparse.Namespace) -> None:
    """Train the policies and do every study that is lacking and that no other process does."""
    os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), str(ROOT / "extras")])
    start = {name: general(group, arguments.work) for group in groups() for name in group}
    for name, seed, samples in jobs(arguments.seeds):
        study_once(arguments.work, name, seed, samples, name, start[name])


def written(arguments: argparse.Namespace) -> None:
    """Collect what is finished in --work, if it is there, and write the table and the rows."""
    if arguments.work.is_dir():
        found = collected(arguments.work, tuple(BUILTIN))
        about = {"groups": groups(), "samples": STEPS}
        write_json(STORE, {**about, "studies": found, "versions": versions()})
    studies = read_json(STORE)["studies"]
    page = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, with_table(page, "left-out", table(studies, tuple(BUILTIN))))
    rows = measured(studies, WHERE)
    for row in rows:
        print(f"{row.what}: {row.value:.4g} {row.unit}")
    if arguments.rows:
        evidence.write("seconds", rows, COMMAND)


def main() -> None:
    """Train and study, or write what was found."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(required=True)
    runs = commands.add_parser("run")
    runs.set_defaults(do=run)
    runs.add_argument("--work", type=Path, default=WORK)
    runs.add_argument("--seeds", type=int, default=SEEDS)
    tables = commands.add_parser("table")
    tables.set_defaults(do=written)
    tables.add_argument("--work", type=Path, default=WORK)
    tables.add_argument("--rows", action="store_true", help="and the rows of evidence")
    arguments = parser.parse_args()
    arguments.do(arguments)


if __name__ == "__main__":
    main()
