"""Damages input files in seeded ways and looks at what the project makes of them.

    python tests/robustness/fuzz.py [--cases 2000] [--seed 0] [--kinds trc mot …] [--store]
    python tests/robustness/fuzz.py --replay trc:17 [mot:3 …] [--store]
    python tests/robustness/fuzz.py --nightly

Each case runs in another process, with a limit of time and memory. Its outcome is one of

* refused: the project said what is wrong (`GaitvalError`);
* equal: the result is that of the undamaged files, within `fuzz_cases.LIMITS`;
* told: the result is another, and the user sees a sentence that the undamaged files do not cause;
* another input: a subject, setting, body or policy that may be as it is;
* silent: the result is another, or cannot be, and nothing says so;
* fault: any other exception, the end of the process, over a minute of computing, over 2 GB.

With `--log FILE` each case is written there, and not run again by the same command. `--store` puts
the figures of each kind into reports/robustness/fuzz.json, in place of those of the same seeds.
Replayed cases replace those that were bad, for only of these it is stored what they were.
"""

import argparse
import json
import multiprocessing
import os
import resource
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

import fuzz_cases  # noqa: E402
import fuzz_commands  # noqa: E402
import numpy as np  # noqa: E402

from gaitval.artefacts import read_json, write_json  # noqa: E402
from gaitval.errors import GaitvalError  # noqa: E402

SECONDS: Final = 60.0
"""Longest computing time of a case; the undamaged session takes one. Not the clock's, for the
machine may be busy with something else."""
LONGEST: Final = 600.0
"""s of the clock after which a case that does not compute either has no end."""
MEMORY: Final = 2 * 2**30
"""Bytes that a case may need beyond what is loaded before it."""
BAD: Final = ("silent", "fault")
FIRST: Final = (
    *("c3d_standing", "c3d_walking", "trc", "mot", "wbds"),
    *("subject", "configuration", "urdf", "policy", "baseline"),
)
"""Kinds of `fuzz_cases`."""
OFTEN: Final = 5
"""Cases of a kind of `fuzz_commands` for one of those that take long."""
STORE: Final = ROOT / "reports" / "robustness" / "fuzz.json"


@dataclass(frozen=True)
class Case:
    """One case and its outcome; `kind` and `seed` make it again.

    Attributes
    ----------
    why : the refusal, the warnings, or what went wrong.
    off : differences of the result in multiples of `fuzz_cases.LIMITS`.
    """

    kind: str
    seed: int
    file: str
    mutator: str
    outcome: str
    why: str
    off: Mapping[str, float]
    seconds: float


def run_case(
    kind: str, seed: int, made: fuzz_cases.Kind, before: fuzz_cases.Result, folder: Path
) -> Case:
    """Damage a file in an own folder and work it out."""
    name, mutator, data = fuzz_cases.damaged(kind, made, seed)
    begin = time.monotonic()
    for each, content in made.seeds.items():
        path = folder / each
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data if each == name else content)
    outcome, why, off = _outcome(made, before, folder, same=data == made.seeds[name])
    return Case(kind, seed, name, mutator, outcome, why, off, time.monotonic() - begin)


def _outcome(
    made: fuzz_cases.Kind, before: fuzz_cases.Result, folder: Path, *, same: bool
) -> tuple[str, str, dict[str, float]]:
    try:
        now = made.run(folder)
    except GaitvalError as error:
        return "refused", str(error).replace(str(folder), "")[:300], {}
    except fuzz_cases.SilentNonsense as error:
        return "silent", str(error), {}
    except BaseException:
        return "fault", traceback.format_exc()[-1500:], {}
    off = fuzz_cases.differences(before, now)
    if max(off.values(), default=0.0) > 1.0:
        messages = sorted(now.told - before.told)
        return "told" if messages else "silent", " | ".join(messages)[:600], off
    return "equal" if same or before.curves or before.exact else "another input", "", off


def _work(
    channel: Connection,
    kinds: Mapping[str, fuzz_cases.Kind],
    results: Mapping[str, fuzz_cases.Result],
) -> None:
    """Run the cases that come through a channel until it is closed."""
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    # What is loaded takes several GB of addresses already; this only ends what runs away.
    addresses = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (addresses + MEMORY, addresses + MEMORY))
    while True:
        try:
            kind, seed = channel.recv()
        except EOFError:
            return
        with tempfile.TemporaryDirectory(prefix="gaitval-fuzz-") as folder:
            channel.send(run_case(kind, seed, kinds[kind], results[kind], Path(folder)))


class Worker:
    """A process that runs cases, and is replaced when one kills it."""

    def __init__(self, kinds: Mapping[str, fuzz_cases.Kind]) -> None:
        self.kinds = kinds
        self.results: dict[str, fuzz_cases.Result] = {}
        for name, made in kinds.items():
            with tempfile.TemporaryDirectory(prefix="gaitval-fuzz-") as folder:
                for each, content in made.seeds.items():
                    path = Path(folder) / each
                    path.parent.mkdir(parents=True, exist_ok=True)
                    path.write_bytes(content)
                self.results[name] = made.run(Path(folder))
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("fork")  # everything is loaded and compiled here
        self.channel, other = context.Pipe()
        self.process = context.Process(
            target=_work, args=(other, self.kinds, self.results), daemon=True
        )
        self.process.start()
        other.close()

    def _computed(self) -> float:
        """Computing time of the process so far, s (proc(5): fields 14 and 15 of stat)."""
        stat = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")

    def run(self, kind: str, seed: int) -> Case:
        """The outcome of a case, whatever it does to the process."""
        self.channel.send((kind, seed))
        why = f"no end within {SECONDS:.0f} s of computing"
        begin, used = time.monotonic(), self._computed()
        try:
            while time.monotonic() - begin < LONGEST and self._computed() - used < SECONDS:
                if self.channel.poll(0.5):
                    found: Case = self.channel.recv()
                    return found
        except EOFError:
            self.process.join()
            why = f"the process ended with {self.process.exitcode}"
        if time.monotonic() - begin >= LONGEST:
            why = f"no end within {LONGEST:.0f} s of the clock"
        self.close()
        self._start()
        name, mutator, _ = fuzz_cases.damaged(kind, self.kinds[kind], seed)
        return Case(kind, seed, name, mutator, "fault", why, {}, SECONDS)

    def close(self) -> None:
        """End the process."""
        self.channel.close()
        self.process.kill()
        self.process.join()


def cases(
    worker: Worker,
    count: int,
    seed: int,
    *,
    minutes: float = float("inf"),
    known: Mapping[tuple[str, int], Case] | None = None,
) -> Iterator[Case]:
    """Cases of all kinds in turn, each with the seeds `seed`, `seed` + 1, …; those that are known
    are not run.
    """
    end = time.monotonic() + 60.0 * minutes
    names = [name for name in worker.kinds for _ in range(turns(name))]
    seeds = dict.fromkeys(names, seed)
    for i in range(count):
        if time.monotonic() > end:
            return
        name = names[i % len(names)]
        case = (known or {}).get((name, seeds[name]))
        yield worker.run(name, seeds[name]) if case is None else case
        seeds[name] += 1


def turns(kind: str) -> int:
    """Cases of a kind in turn, so that those that take long do not take all of the time."""
    known = fuzz_cases.TURNS.get(kind, 1)
    return known if kind in FIRST or kind in fuzz_commands.SLOW else OFTEN


def all_kinds(folder: Path) -> dict[str, fuzz_cases.Kind]:
    """Every kind of file, with the undamaged ones, which are made in an empty folder."""
    parts = {}
    for each in (fuzz_cases, fuzz_commands):
        part = folder / each.__name__
        part.mkdir()
        parts |= each.kinds(part)
    return parts


def logged(log: Path | None) -> dict[tuple[str, int], Case]:
    """The cases of a log."""
    if log is None or not log.exists():
        return {}
    found = [Case(**json.loads(line)) for line in log.read_text().splitlines()]
    return {(case.kind, case.seed): case for case in found}


def counted(found: list[Case]) -> dict[str, dict[str, int]]:
    """Number of cases by kind and outcome."""
    table: dict[str, Counter[str]] = {}
    for case in found:
        table.setdefault(case.kind, Counter())[case.outcome] += 1
    return {kind: dict(sorted(counts.items())) for kind, counts in sorted(table.items())}


def _run(found: list[Case]) -> dict[str, Any]:
    """The figures of cases of one kind."""
    seeds = [case.seed for case in found]
    return {
        "seeds": [min(seeds), max(seeds)],
        "date": datetime.now(UTC).date().isoformat(),
        "cases": len(found),
        "outcomes": dict(sorted(Counter(case.outcome for case in found).items())),
        "mutators": dict(sorted(Counter(case.mutator for case in found).items())),
        "bad": [
            {name: value for name, value in asdict(case).items() if name in _TOLD}
            for case in found
            if case.outcome in BAD
        ],
    }


def merged(stored: dict[str, list[dict[str, Any]]], found: list[Case]) -> None:
    """Put cases in the place of the stored ones of the same kinds and seeds.

    Raises
    ------
    SystemExit : they are only a part of those; nobody could then say what of the stored figures
        still holds.
    """
    for kind in {case.kind for case in found}:
        new = _run([case for case in found if case.kind == kind])
        first, last = new["seeds"]
        kept = []
        for run in stored.get(kind, []):
            if run["seeds"][1] < first or run["seeds"][0] > last:
                kept.append(run)
            elif not first <= run["seeds"][0] <= run["seeds"][1] <= last:
                sys.exit(f"{kind}: the seeds {first} to {last} are a part of {run['seeds']}")
        stored[kind] = sorted([*kept, new], key=lambda run: run["seeds"])


def replaced(stored: dict[str, list[dict[str, Any]]], found: list[Case]) -> None:
    """Put the outcomes of cases in the place of those that were bad.

    Raises
    ------
    SystemExit : one of them is not among the bad ones.
    """
    for case in found:
        for run in stored.get(case.kind, []):
            old = [bad for bad in run["bad"] if bad["seed"] == case.seed]
            if old:
                break
        else:
            sys.exit(f"{case.kind}:{case.seed} is not among the bad cases that are stored")
        run["bad"].remove(old[0])
        counts = Counter(run["outcomes"])
        counts[old[0]["outcome"]] -= 1
        counts[case.outcome] += 1
        run["outcomes"] = dict(sorted((+counts).items()))
        messages = {name: value for name, value in asdict(case).items() if name in _TOLD}
        if case.outcome in BAD:
            run["bad"].append(messages)
        else:
            was = {"was": old[0]["outcome"], "date": datetime.now(UTC).date().isoformat()}
            run.setdefault("mended", []).append(messages | was)


def _store(found: list[Case], put: Callable[[dict[str, Any], list[Case]], None]) -> None:
    """Store cases, by `merged` or `replaced`, and print how many all that is stored have bad."""
    kinds = read_json(STORE)["kinds"] if STORE.exists() else {}
    put(kinds, found)
    write_json(STORE, {"limits": fuzz_cases.LIMITS, "kinds": kinds})
    runs = [run for each in kinds.values() for run in each]
    count, bad = sum(run["cases"] for run in runs), sum(len(run["bad"]) for run in runs)
    print(f"{bad} of {count} stored cases are bad", flush=True)


_TOLD: Final = ("kind", "seed", "file", "mutator", "outcome", "why")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--cases", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", nargs="+")
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--log", type=Path, help="a line of JSON for each case; goes on from it")
    parser.add_argument("--replay", metavar="KIND:SEED", nargs="+", default=[])
    parser.add_argument("--store", action="store_true")
    parser.add_argument("--hours", type=float, help="instead of --minutes")
    parser.add_argument("--nightly", action="store_true", help="an hour, with the day's seeds")
    given = parser.parse_args()
    if given.hours is not None:
        given.minutes, given.cases = 60.0 * given.hours, max(given.cases, 100_000)
    if given.nightly:
        day = datetime.now(UTC).date().toordinal()
        given.minutes, given.seed, given.cases = 60.0, 100_000 * day, 100_000
    return given


def main() -> int:
    """Exit code 1 if a case was silent nonsense or a fault."""
    given = _arguments()
    with tempfile.TemporaryDirectory(prefix="gaitval-fuzz-") as folder:
        kinds = all_kinds(Path(folder))
    if given.replay:
        wanted = [case.partition(":")[::2] for case in given.replay]
        worker = Worker({kind: kinds[kind] for kind, _ in wanted})
        found = [worker.run(kind, int(seed)) for kind, seed in wanted]
        for case in found:
            print(json.dumps(asdict(case), indent=1))
    else:
        chosen = given.kinds or list(kinds)
        worker = Worker({name: kinds[name] for name in chosen})
        found = []
        known = logged(given.log)
        for case in cases(worker, given.cases, given.seed, minutes=given.minutes, known=known):
            found.append(case)
            if given.log and (case.kind, case.seed) not in known:
                with given.log.open("a") as log:
                    log.write(json.dumps(asdict(case)) + "\n")
            if case.outcome in BAD:
                message = (
                    f"{case.outcome}: {case.kind}:{case.seed} {case.mutator}: {case.why[-300:]}"
                )
                print(message, flush=True)
        for name, counts in counted(found).items():
            print(f"{name}: {counts}")
    worker.close()
    if given.store:
        _store(found, replaced if given.replay else merged)
    return int(any(case.outcome in BAD for case in found))


if __name__ == "__main__":
    sys.exit(main())
