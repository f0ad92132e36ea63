"""The command `python -m claims`, from the project's folder; README.md has examples."""

import argparse
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

from . import changes, registry
from .given import Given


def run(names: Sequence[str], given: Given, *, again: bool) -> int:
    """Make measurements and write the rows of each as it ends; the number of those that failed.

    What this commit has been measured for is not measured again, so a run that was stopped goes on.
    """
    from . import rows

    path, failed = rows.path_of(), 0
    for each in registry.chosen(names):
        try:
            measure, needs = each.load()
        except ImportError as error:
            print(f"{each.name}: not measured, it needs {error.name}", flush=True)
            continue
        lacking = [name for name in needs.folders if not getattr(given, name).is_dir()]
        if lacking:
            print(f"{each.name}: not measured, there is no --{lacking[0]} "
                  f"{getattr(given, lacking[0])}", flush=True)  # fmt: skip
            continue
        source = rows.source_of(needs.stored)
        known = [row for row in rows.read(path) if row["by"] == each.name]
        whole = {row["commit"] for row in known} == {source.commit}
        if whole and not again and not source.commit.endswith(rows.UNCOMMITTED):
            print(f"{each.name}: measured at {source.commit} already", flush=True)
            continue
        began = time.perf_counter()
        given.work.mkdir(parents=True, exist_ok=True)
        try:
            found = measure(given)
        except registry.LackingError as error:
            print(f"{each.name}: not measured, {error}", flush=True)
            continue
        except Exception:  # the others are measured nevertheless
            traceback.print_exc()
            print(f"{each.name}: FAILED", flush=True)
            failed += 1
            continue
        made = found if isinstance(found, list) else [found]
        for claim in made:
            print(f"  {claim.what}: {claim.value:.6g} {claim.unit}, n {claim.n}")
        rows.write(each.name, made, source, path)
        print(f"{each.name}: {time.perf_counter() - began:.0f} s, {path}", flush=True)
    return failed


def listed(names: Sequence[str] = ()) -> str:
    """Measurements, a line each."""
    return "\n".join(f"{each.name:28} {each.about}" for each in registry.chosen(names))


def main(words: Sequence[str]) -> int:
    """The exit code: 1 if a measurement failed."""
    parser = argparse.ArgumentParser(prog="python -m claims", description=(
        "Measures what a user may hold gaitval to, into reports/claims/VERSION.csv."))  # fmt: skip
    parser.add_argument("names", nargs="*", metavar="TOPIC", help="or TOPIC.NAME (default: all)")
    parser.add_argument("--list", action="store_true", help="what there is to measure")
    parser.add_argument("--again", action="store_true", help="also what this commit is known for")
    parser.add_argument(
        "--page",
        action="store_true",
        help="write reports/claims/README.md: what moved since the version before",
    )
    usual = Given()
    for name, about in (
        ("data", "folder of the raw data; GAITVAL_DATA"),
        ("public", "clones of the repositories of public recordings, OWNER+NAME; GAITVAL_PUBLIC"),
        ("work", "folder of what long measurements go on from"),
    ):
        parser.add_argument(f"--{name}", type=Path, default=getattr(usual, name), help=about)
    given = parser.parse_args(words)
    if given.list:
        print(listed(given.names))
        return 0
    if given.page:
        print(changes.write_page())
        return 0
    folders = Given(given.data, given.public, given.work)
    return 1 if run(given.names, folders, again=given.again) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
