"""The command `python -m claims`, from the project's folder; README.md has examples."""

import csv
import datetime
import importlib
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from . import ROOT, TOPICS, Claim, Given, LackingError, commit

STORE: Final = ROOT / "reports" / "claims.csv"
COLUMNS: Final = ("what", "value", "unit", "n", "commit", "date", "by")
"""`by` is the measurement, TOPIC.NAME, that made the row."""


def measurements(topics: Iterable[str] = TOPICS) -> dict[str, Callable[..., Any]]:
    """Every measurement of some topics by its name, TOPIC.NAME, in the order of the files."""
    return {
        f"{topic}.{name}": function
        for topic in topics
        for name, function in vars(importlib.import_module(f"claims.{topic}")).items()
        if hasattr(function, "needs")
    }


def chosen(names: Sequence[str]) -> dict[str, Callable[..., Any]]:
    """The measurements of some topics or names; all if none is named. Raises SystemExit, with the
    names that there are, if there is none of that name.
    """
    topics = list(dict.fromkeys(each.partition(".")[0] for each in names)) or TOPICS
    every = measurements(topics) if set(topics) <= set(TOPICS) else {}
    found = {
        name: function
        for name, function in every.items()
        if not names or {name, name.partition(".")[0]} & set(names)
    }
    lacking = [
        name for name in names if not any(name in (each, each.partition(".")[0]) for each in found)
    ]
    if lacking:
        raise SystemExit(f"There is no claim {', '.join(lacking)}. Topics: {', '.join(TOPICS)}.")
    return found


def run(names: Sequence[str], given: Given, store: Path = STORE) -> int:
    """Make measurements and write the rows of each as it ends; the number of those that failed."""
    failed = 0
    for name, measure in chosen(names).items():
        began = time.perf_counter()
        try:
            for folder in vars(measure)["needs"]:
                if not getattr(given, folder).is_dir():
                    raise LackingError(f"there is no folder {getattr(given, folder)}")
            given.work.mkdir(parents=True, exist_ok=True)
            found = measure(given)
        except LackingError as error:
            print(f"{name}: not measured, {error}", flush=True)
            continue
        except Exception:  # the others are measured nevertheless
            traceback.print_exc()
            print(f"{name}: FAILED", flush=True)
            failed += 1
            continue
        made = [found] if isinstance(found, Claim) else list(found)
        for claim in made:
            print(f"  {claim.what}: {claim.value:.6g} {claim.unit}, n {claim.n}")
        write(name, made, store)
        print(f"{name}: {time.perf_counter() - began:.0f} s, {store}", flush=True)
    return failed


def read(store: Path = STORE) -> list[dict[str, str]]:
    """The rows; none if there is no file."""
    if not store.is_file():
        return []
    with store.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write(by: str, made: Iterable[Claim], store: Path) -> None:
    """Put what a measurement found in the place of what it had found before."""
    new = {
        each.what: {
            **{"what": each.what, "value": f"{each.value:.6g}", "unit": each.unit},
            **{"n": str(each.n), "commit": commit(), "by": by},
            "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        }
        for each in made
    }
    kept = {row["what"]: row for row in read(store) if row["by"] != by}
    with store.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows((kept | new).values())


if __name__ == "__main__":
    sys.exit(1 if run(sys.argv[1:], Given()) else 0)
