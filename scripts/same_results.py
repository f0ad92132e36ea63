"""Check that two versions of gaitval give the same results for the stored baselines: every number
is compared.

    python scripts/same_results.py --before REVISION
    python scripts/same_results.py --python /path/to/python3.13

Walks the policy of each stored baseline again and validates it, as `gaitval check` does: with the
code of a git revision and with that of this checkout, or with another Python and with this one.
All numbers of the two results that have the same place are compared. Two revisions must agree in
every number, two Pythons (whose dartpy may differ too) within the margins of `gaitval check`.
The walks of a revision are kept in the temporary folder, so that they are walked once.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gaitval.apps.regression.regression import compare
from gaitval.artefacts import write_json
from gaitval.metrics.results import Metrics, metrics_from

ROOT = Path(__file__).resolve().parent.parent
WALK = """
import json, sys
from pathlib import Path
from unittest.mock import MagicMock
try:
    from gaitval.apps.regression.baseline import walk_again
except ModuleNotFoundError:  # before the package had its present layout
    from gaitval.pipeline import walk_again
found = walk_again(Path(sys.argv[1]), MagicMock())
found = found if isinstance(found, dict) else found.as_dict()
Path(sys.argv[2]).write_text(json.dumps(found))
"""


MEANT = {
    "/schema_version": "the version of metrics.json itself",
    "/summary/accepted": "verdicts on pelvis load, which could not fail, are no longer counted",
}
"""Numbers that a revision may have otherwise, with the reason."""


def main() -> None:
    """Compare and print; exit 1 if the versions differ by more than allowed."""
    arguments = _arguments()
    with tempfile.TemporaryDirectory() as temporary:
        code = ROOT
        if arguments.before:
            code = Path(temporary) / "before"
            _git("worktree", "add", "--detach", str(code), arguments.before)
        try:
            differ = _compare(arguments, code, Path(temporary))
        finally:
            if arguments.before:
                _git("worktree", "remove", "--force", str(code))
    sys.exit(1 if differ else 0)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--before", metavar="REVISION", help="compare with this git revision")
    parser.add_argument("--python", metavar="FILE", help="compare with this Python")
    parser.add_argument(
        "--store",
        action="store_true",
        help="keep the present walks' metrics as those of the baselines (after a change of schema)",
    )
    parser.add_argument("--subjects", type=int, nargs="+", default=range(1, 11), metavar="N")
    found = parser.parse_args()
    if bool(found.before) == bool(found.python):
        parser.error("give --before or --python")
    return found


def _git(*words: str) -> str:
    command = ["git", *words]
    return subprocess.run(
        command, cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.strip()


def _walk_before(revision: str, code: Path, subject: int) -> Any:
    """The walk of a revision's code, from the temporary folder where it was walked before."""
    sha = _git("rev-parse", revision)
    kept = Path(tempfile.gettempdir()) / "gaitval-same-results" / sha / f"S{subject:02d}.json"
    if not kept.is_file():
        kept.parent.mkdir(parents=True, exist_ok=True)
        unfinished = kept.with_suffix(f".{os.getpid()}")
        _walk(sys.executable, code, code / f"reports/S{subject:02d}/baseline", unfinished)
        unfinished.replace(kept)
    return json.loads(kept.read_text())


def _walk(python: str, code: Path, baseline: Path, out: Path) -> Any:
    subprocess.run(
        [python, "-c", WALK, str(baseline), str(out)],
        env={**os.environ, "PYTHONPATH": str(code), "OMP_NUM_THREADS": "1"},
        check=True,
    )
    return json.loads(out.read_text())


def _numbers(value: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Every number in a document with its place; rows of measures and verdicts go by their
    names.
    """
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _numbers(item, f"{place}/{key}")
    elif isinstance(value, list):
        for index, item in enumerate(value):
            names = isinstance(item, dict) and [
                str(item[key]) for key in ("id", "measure", "target", "name") if key in item
            ]
            yield from _numbers(item, f"{place}/{' '.join(names) if names else index}")
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield place, float(value)


def _typed(found: dict[str, Any]) -> Metrics:
    return metrics_from(found, "a walk")


def _compare(arguments: argparse.Namespace, code: Path, temporary: Path) -> int:
    places = differ = 0
    moved = (0, 0)
    worst: dict[str, float] = {}
    for subject in arguments.subjects:
        baseline = ROOT / f"reports/S{subject:02d}/baseline"
        if arguments.before:
            one = _walk_before(arguments.before, code, subject)
        else:
            one = _walk(arguments.python, ROOT, baseline, temporary / "one.json")
        two = _walk(sys.executable, ROOT, baseline, temporary / "two.json")
        if arguments.store:
            write_json(baseline / "metrics.json", two)
        before, now = dict(_numbers(one)), dict(_numbers(two))
        meant = [place for place in MEANT if before.get(place) != now.get(place)]
        common = [place for place in before if place in now and place not in meant]
        unequal = [place for place in common if before[place] != now[place]]
        for place in unequal:
            if place.startswith("/measures/") and place.endswith("/value"):
                name = place.split("/")[2]
                worst[name] = max(worst.get(name, 0.0), abs(before[place] - now[place]))
        rows = compare(*map(_typed, (two, one))) if arguments.python else []
        moved = (moved[0] + len(rows), moved[1] + sum(row.change != "kept" for row in rows))
        places += len(common)
        differ += len(unequal)
        print(
            f"S{subject:02d}: {len(common)} numbers in both, {len(unequal)} differ; only before: "
            f"{_folders(before, now)}; only now: {_folders(now, before)}",
            flush=True,
        )
        for place in meant:
            print(f"  meant: {place}: {MEANT[place]}")
    for name, difference in sorted(worst.items()):
        print(f"  {name}: differs by up to {difference:.4g}")
    if arguments.before:
        what = "numbers of the stored baselines' walks that differ from those before"
    else:
        what = (
            f"measures of the stored baselines beyond their margins, {_version(arguments.python)}"
        )
        places, differ = moved
    print(f"{differ} of {places} {what}")
    return differ


def _version(python: str) -> str:
    code = "import platform, dartpy; print(platform.python_version(), dartpy.__version__)"
    found = subprocess.run([python, "-c", code], check=True, capture_output=True, text=True)
    ours = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    one, two = (each.stdout.split() for each in (ours, found))
    return f"Python {two[0]}, dartpy {two[1]} against {one[0]}, {one[1]}"


def _folders(some: dict[str, float], others: dict[str, float]) -> str:
    """Places of the numbers that the others lack, at most two levels deep."""
    missing = {"/".join(place.split("/")[:3]) for place in some if place not in others}
    return ", ".join(sorted(missing)) or "none"


if __name__ == "__main__":
    main()
