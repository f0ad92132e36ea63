"""Plants faults and sees whether `gaitval check --quick`, or else a test, finds them.

    python tests/robustness/gate_mutations.py              # 40 min; goes on where it was stopped
    python tests/robustness/gate_mutations.py --only 'weights x 1.02'   # again, whatever is stored
    python tests/robustness/gate_mutations.py damages      # baselines that cannot be believed
    python tests/robustness/gate_mutations.py alarms       # an unchanged program

A fault is in a file of a baseline (`gate_artefacts.py`), or in a copy of the package
(`gate_faults.toml`). A baseline with a fault is refused as long as it is not sealed again; it is
sealed, to see whether its figures show the fault too. A fault counts if it moves a measure by more
than the largest difference that rounding makes (`benchmarks/margins.json`): one that moves less is
no fault of the walk. Where the check passes, the tests that belong to the fault run on the same
copy.

To save time, what of a check does not depend on the fault is taken from a check without one: its
stages run again by the same rule as those of any run folder.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from gate_artefacts import FAULTS, Fault

from claims import commit
from gaitval import __version__
from gaitval.apps.regression import baseline as study
from gaitval.apps.regression.regression import LONG_MEASURES, compare, lost
from gaitval.apps.regression.seal import seal
from gaitval.artefacts import read_json, versions, write_json
from gaitval.compiled import SOURCES
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import GaitvalError
from gaitval.metrics.results import Metrics, read_metrics
from gaitval.study.inputs import METRICS
from gaitval.study.stage import Observer

ROOT: Final = Path(__file__).resolve().parents[2]
STORE: Final = ROOT / "reports" / "robustness" / "gate.json"
SCATTER: Final = ROOT / "benchmarks" / "margins.json"
BASELINE: Final = ROOT / "reports" / "S05" / "baseline"
CODE: Final = ROOT / "tests" / "robustness" / "gate_faults.toml"
FOLDERS: Final = (
    *("gaitval", "models", "tests", "benchmarks"),
    *("claims", "experiments", "docs", "scripts"),
)
"""What a copy of the project needs for its tests."""
NOTHING: Final = "nothing"
"""The check without a fault, with which the others are compared."""
CERTAIN: Final = 1e6
"""Ratio for a measure that never scatters, or can no longer be measured."""
ALARMS: Final = 20
SECONDS: Final = 3600.0
"""A check or a test file that takes longer hangs, which counts as a failure; on a machine that is
busy with ten other things a check takes ten minutes."""
REFUSALS: Final = ("PolicyError", "SubjectError", "ConfigurationError", "ArtefactError")
"""Errors that refuse an input of the walk; any other says that the walk came to nothing."""
Json = dict[str, Any]


# ---- In the process whose package may have a fault. ----


def walk(baseline: Path, prepared: Path, out: Path) -> None:
    """What `gaitval check --quick` says of a baseline, with the package that is imported."""
    found: Json = {"refused": _refusal(lambda: study.stored_metrics(baseline / METRICS))}
    if found["refused"]:
        resealed = _refusal(lambda: study.seal_again(baseline))
        found["refused_when_sealed"] = resealed or _refusal(
            lambda: study.stored_metrics(baseline / METRICS)
        )
    walked = study._walked

    def from_prepared(run: Any, baseline: Path, *, quick: bool) -> Metrics:
        for path in prepared.rglob("*"):
            target = run.folder / path.relative_to(prepared)
            if path.is_file() and not target.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, target)
        metrics = walked(run, baseline, quick=quick)
        if not prepared.exists():
            shutil.copytree(run.folder, prepared, ignore=shutil.ignore_patterns(".*"))
            for name in ("subject.toml", "configuration.toml", "provenance.json"):
                (prepared / name).unlink(missing_ok=True)
        return metrics

    study._walked = from_prepared  # type: ignore[assignment]
    try:
        now = study.walk_again(baseline, Observer(), quick=True)
    except Exception as error:
        found["error"] = f"{type(error).__name__}: {error}"[:300]
    else:
        stored = read_metrics(baseline)
        rows = compare(stored, now, leave_out=LONG_MEASURES)
        found["inputs"] = study.changed_inputs(baseline, now)
        found["lost"] = [f"{row.measure} of {row.target}" for row in lost(rows)]
        found["improved"] = sum(row.change == "improved" for row in rows)
        found["values"] = {f"{row.measure} of {row.target}": row.current for row in rows}
    where = str(baseline)  # a folder that is gone afterwards
    messages = {
        name: text.replace(where, "BASELINE") if isinstance(text, str) else text
        for name, text in found.items()
    }
    write_json(out, messages)


def _refusal(action: Callable[[], object]) -> str | None:
    try:
        action()
    except GaitvalError as error:
        return str(error)
    return None


# ---- In the process that plants them. ----


def code_faults() -> dict[str, Json]:
    """By name, what is to be replaced in the package, and the tests that it belongs to."""
    with CODE.open("rb") as file:
        return {fault["name"]: fault for fault in tomllib.load(file)["fault"]}


@contextmanager
def copy_with(fault: Json | None) -> Iterator[tuple[Path, dict[str, str]]]:
    """A folder with a copy of the package, with a fault in it, and the environment to use it."""
    with tempfile.TemporaryDirectory(prefix="gaitval-gate-") as temporary:
        folder = Path(temporary)
        environment = {**os.environ, "TMPDIR": str(folder / "tmp"), "OMP_NUM_THREADS": "1"}
        (folder / "tmp").mkdir()
        if fault is None:
            yield folder, environment | {"PYTHONPATH": str(ROOT)}
            return
        for name in FOLDERS:
            shutil.copytree(ROOT / name, folder / name)
        shutil.copyfile(ROOT / "pyproject.toml", folder / "pyproject.toml")
        (folder / "reports").symlink_to(ROOT / "reports")
        plant(fault, folder / "gaitval")
        if fault["file"] in SOURCES:  # its own compiled code, which goes with it
            environment["XDG_CACHE_HOME"] = str(folder / "cache")
        yield folder, environment | {"PYTHONPATH": str(folder)}


def plant(fault: Json, package: Path) -> None:
    """Replace a fault's text in a copy of the package.

    Raises
    ------
    SystemExit : the text is not there, or not only once: the code has changed since.
    """
    path = package / fault["file"]
    text = path.read_text(encoding="utf-8")
    if text.count(fault["old"]) != 1:
        sys.exit(
            f"{CODE}: {fault['name']}: its text is {text.count(fault['old'])} times in "
            f"{fault['file']}, which has changed. Correct the fault."
        )
    path.write_text(text.replace(fault["old"], fault["new"]), encoding="utf-8")


def sealed_baseline(folder: Path) -> Path:
    """A copy of the baseline that says what it was made with, as a new one does."""
    copy = Path(shutil.copytree(BASELINE, folder / "baseline"))
    metrics = read_json(copy / METRICS)
    metrics["provenance"]["versions"] |= {"gaitval": __version__}
    write_json(copy / METRICS, metrics)
    seal(copy, versions=study.installed_versions(), commit=None)
    return copy


def checked(name: str, prepared: Path) -> Json:
    """What a check says of a fault, and the test that finds it where the check does not."""
    artefact: Fault | None = FAULTS.get(name)
    fault = code_faults().get(name)
    began = time.monotonic()
    with copy_with(fault) as (folder, environment):
        baseline = sealed_baseline(folder)
        if artefact is not None:
            artefact(baseline)
        out = folder / "found.json"
        command = [sys.executable, __file__, "walk", str(baseline), str(prepared), str(out)]
        found = _ended(command, environment, folder)
        if out.exists():
            found = read_json(out)
        found["kind"] = "code" if fault else "artefact"
        if name != NOTHING:
            found |= size_of(found, prepared.parent / "nothing.json")
            if fault and not found["by_check"]:
                found["by_test"] = _found_by(fault["tests"], environment, folder)
    found["seconds"] = round(time.monotonic() - began, 1)
    return found


def _ended(command: list[str], environment: Mapping[str, str], folder: Path) -> Json:
    """Why a check ended without a result; it may have."""
    try:
        done = subprocess.run(
            command, env=environment, cwd=folder, capture_output=True, text=True, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        return {"error": f"no end within {SECONDS:g} s"}
    return {"error": done.stderr.strip()[-300:]}


def _found_by(tests: list[str], environment: Mapping[str, str], folder: Path) -> str | None:
    """The first test that fails."""
    options = ["-q", "-x", "-n", "0", "-p", "no:cacheprovider", "--no-header", "-rf"]
    command = [sys.executable, "-m", "pytest", *options, *tests]
    try:
        done = subprocess.run(
            command, env=environment, cwd=folder, capture_output=True, text=True, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        return f"{tests[0]}: no end within {SECONDS:g} s"
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    if done.returncode in (1, 2):  # 2: not even the test's imports work
        return failed[0].split(" - ")[0].split(" ", 1)[1] if failed else tests[0]
    assert done.returncode == 0, done.stdout + done.stderr
    return None


def size_of(found: Json, without: Path) -> Json:
    """By how many times the scatter a fault moves the measure that it moves most, and how the
    check takes it.
    """
    scatter: dict[str, float] = {}
    for measures in read_json(SCATTER)["scatter"].values():
        for name, value in measures.items():
            scatter[name] = max(scatter.get(name, 0.0), value)
    before, now = read_json(without)["values"], found.pop("values", None)
    if now is None:
        ratio, most = CERTAIN, "it does not walk"
    else:
        ratio, most = max(
            (_ratio(before[target], now.get(target), scatter[target.split(" of ")[0]]), target)
            for target in before
            if target.split(" of ")[0] in scatter
        )
    by = None
    if "error" in found:
        by = "does not walk"
    elif found["lost"]:
        by = "figures"
    elif found["refused"]:
        by = "refused"
    return {"ratio": round(ratio, 2), "most": most, "by_check": by}


def _ratio(before: float | None, now: float | None, scatter: float) -> float:
    if before == now:
        return 0.0
    if before is None or now is None or scatter == 0.0:
        return CERTAIN
    return min(abs(now - before) / scatter, CERTAIN)


def damages() -> Json:
    """How many damaged baselines are refused: those of the tests, and whole files lost or cut."""
    sys.path.insert(0, str(ROOT / "tests" / "study"))
    import test_stored_baseline as known

    done: dict[str, bool] = {}

    def one(name: str, change: Callable[[Path], object]) -> None:
        with tempfile.TemporaryDirectory(prefix="gaitval-gate-") as temporary:
            copy = Path(shutil.copytree(BASELINE, Path(temporary) / "baseline"))
            change(copy)
            done[name] = _refusal(lambda: study.stored_metrics(copy / METRICS)) is not None

    for name, (change, _) in known.DAMAGES.items():
        one(f"metrics.json: {name}", known._edit("metrics.json", change))
    for name, (edit, _) in known.EDITS.items():
        one(f"edited: {name}", edit)
    for name in (*study.STORED_FILES, "seal.json"):
        one(f"{name}: lost", lambda copy, name=name: (copy / name).unlink())
        one(f"{name}: empty", lambda copy, name=name: (copy / name).write_bytes(b""))
        one(f"{name}: half", lambda copy, name=name: _cut(copy / name))
        one(f"{name}: a bit", lambda copy, name=name: _bit(copy / name))
    return {"n": len(done), "not_refused": sorted(name for name, was in done.items() if not was)}


def _cut(path: Path) -> None:
    contents = path.read_bytes()
    path.write_bytes(contents[: len(contents) // 2])


def _bit(path: Path) -> None:
    """Another digit (in text), or bit, near the middle of a file."""
    contents = bytearray(path.read_bytes())
    middle = len(contents) // 2
    if path.suffix != ".safetensors":
        middle = next(at for at in range(middle, len(contents)) if chr(contents[at]).isdigit())
    contents[middle] ^= 1
    path.write_bytes(contents)


def alarms() -> Json:
    """Losses that the check reports for walks whose body differs in the tenth digit, none of which
    the margins were made from.
    """
    import margins

    stored = read_metrics(BASELINE)
    messages = {}
    for number, now in margins.new_walks(BASELINE, range(margins.WALKS, margins.WALKS + ALARMS)):
        rows = lost(compare(stored, now, leave_out=LONG_MEASURES))
        messages[str(number)] = [f"{row.measure} of {row.target}" for row in rows]
    return {
        "n": len(messages),
        "false": {number: rows for number, rows in messages.items() if rows},
    }


def message(stored: Json) -> list[str]:
    """What the store has shown of faults that count, damages and false alarms, in sentences."""
    faults = stored["faults"]
    counts = [each for name, each in faults.items() if name != NOTHING and each["ratio"] > 1.0]
    caught = [each for each in counts if each["by_check"] or each.get("by_test")]
    figures = [each for each in counts if by_figures(each)]
    found = [
        f"{len(faults) - (NOTHING in faults)} faults planted, {len(counts)} above the scatter; "
        f"{len(caught)} of these caught by check --quick or tests, {len(figures)} by its figures"
    ]
    if "damages" in stored:
        of = stored["damages"]
        found.append(f"{len(of['not_refused'])} of {of['n']} damaged baselines were not refused")
    if "alarms" in stored:
        of = stored["alarms"]
        found.append(f"{len(of['false'])} false alarms over {of['n']} seeds")
    return found


def by_figures(found: Json) -> bool:
    """Whether the check detects a fault by what is measured of the walk, or that there is none."""
    if found["by_check"] == "does not walk":
        return not found["error"].startswith(REFUSALS)
    return bool(found["by_check"] == "figures")


def save(**parts: Any) -> Json:
    """Add what was found to the store; faults that were found on another commit go."""
    stored: Json = read_json(STORE) if STORE.exists() else {}
    faults = stored_faults()
    for name, value in parts.items():
        stored[name] = {**faults, **value} if name == "faults" else value
        stored.setdefault("commits", {})[name] = commit()
    stored |= {
        "date": datetime.now(UTC).date().isoformat(),
        "versions": versions(),
        "baseline": load_subject(str(BASELINE / "subject.toml")).identifier,
    }
    STORE.parent.mkdir(parents=True, exist_ok=True)
    write_json(STORE, stored)
    return stored


def stored_faults() -> Json:
    """Of the faults in the store, those that were planted in this commit."""
    stored: Json = read_json(STORE) if STORE.exists() else {}
    here = stored.get("commits", {}).get("faults") == commit()
    return dict(stored["faults"]) if here else {}


def run(only: list[str], workers: int, keep: Path | None) -> None:
    """Check the named faults, or all that are not stored yet.

    Parameters
    ----------
    keep : folder for the check without a fault, which a later call goes on from.
    """
    known = [*FAULTS, *code_faults()]
    unknown = [name for name in only if name not in known]
    if unknown:
        sys.exit(f"No such fault: {', '.join(unknown)}. There are: {', '.join(known)}.")
    done = stored_faults()
    names = only or [name for name in _spread(known) if name not in done]
    with tempfile.TemporaryDirectory(prefix="gaitval-gate-") as temporary:
        prepared = (keep or Path(temporary)) / "prepared"
        if not (prepared.parent / "nothing.json").exists():
            without = checked(NOTHING, prepared)
            if without.get("lost") or "error" in without:
                text = without.get("lost") or without["error"]
                sys.exit(f"The check without a fault fails: {text}")
            write_json(prepared.parent / "nothing.json", without)
        with ThreadPoolExecutor(workers) as pool:  # each waits for a process
            started = {pool.submit(checked, name, prepared): name for name in names}
            for each in as_completed(started):
                name, found = started[each], each.result()
                save(faults={name: found})
                by = found["by_check"] or found.get("by_test") or "NOT CAUGHT"
                text = f"{found['ratio']:10.4g}  {found['seconds']:6.1f} s"
                print(f"{name:48s} {text}  {by}", flush=True)


def _spread(names: list[str]) -> list[str]:
    """Some of each kind early, for a run that is stopped; what must be compiled again last."""
    faults = code_faults()
    mixed = [name for first in range(5) for name in names[first::5]]
    return sorted(mixed, key=lambda name: name in faults and faults[name]["file"] in SOURCES)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="?", default="faults",
                        choices=["faults", "damages", "alarms", "walk"])  # fmt: skip
    parser.add_argument("paths", nargs="*", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="for a run in several parts")
    arguments = parser.parse_args()
    if arguments.what == "walk":
        walk(*arguments.paths)
        return
    if arguments.what == "faults":
        run(arguments.only, arguments.workers, arguments.keep)
    elif arguments.what == "damages":
        print(json.dumps(save(damages=damages())["damages"], indent=1))
    elif arguments.what == "alarms":
        print(json.dumps(save(alarms=alarms())["alarms"], indent=1))
    print("\n".join(message(read_json(STORE))))


if __name__ == "__main__":
    main()
