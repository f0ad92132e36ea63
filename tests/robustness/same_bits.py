"""Whether a study gives the same bits with other workers and threads, as a study of a cohort, and
after a kill; and how far apart its measures are on a machine with other instructions.

    python tests/robustness/same_bits.py --log FILE      # goes on from it

A line of JSON for each way. Each is the whole main job of one subject with quick settings. All
results are compared, byte for byte: body, reference, policy, parameters, correction, walks, pushes,
and every measure. Settings and provenance name the workers themselves, so they are not.
"""

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

import kills

from gaitval.apps.regression.regression import compare
from gaitval.artefacts import file_hash, read_json
from gaitval.metrics.results import read_metrics

SUBJECT: Final = "5"
RESULTS: Final = (
    *("model.urdf", "scaling.csv", "reference.npz", "identification.json", "correction.json"),
    *("policy/policy.safetensors", "rollouts/nominal.npz", "rollouts/identified.npz", "push.json"),
)
WAYS: Final = {
    "one worker, one thread": (1, 1),
    "two workers": (2, 1),
    "four workers": (4, 1),
    "two threads": (1, 2),
    "a study of a cohort": (1, 1),
    "killed and started again": (1, 1),
}
"""Workers and threads of each way; the first is what the others are compared with."""
MACHINES: Final = {
    "NumPy without AVX2 and AVX512": {
        "NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX"
    },
    "OpenBLAS for Sandy Bridge": {"OPENBLAS_CORETYPE": "Sandybridge"},
    "OpenBLAS for Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
}
"""Environments in which libraries take other instructions, as on another machine."""
Json = dict[str, Any]


def started(arguments: list[str], threads: int, others: dict[str, str]) -> None:
    """Run `gaitval` to its end. Raises CalledProcessError."""
    own = {"PYTHONPATH": str(kills.ROOT), "OMP_NUM_THREADS": str(threads)}
    environment = {**os.environ, **own, **others}
    subprocess.run(
        [sys.executable, "-P", "-m", "gaitval", *arguments],
        env=environment, stdout=subprocess.DEVNULL, check=True,
    )  # fmt: skip


def settings(workers: int) -> list[str]:
    """Quick settings with so many workers."""
    quick = [each for each in kills.QUICK if not each.startswith("training.workers")]
    return [f"--set={each}" for each in (*quick, f"training.workers={workers}")]


def studied(way: str, folder: Path, seed: int) -> Path:
    """The run folder of one way."""
    workers, threads = WAYS.get(way, (1, 1))
    run = folder / "run"
    job = ["subject", SUBJECT, "--out", str(run), *settings(workers)]
    if way.startswith("killed"):
        temporary = folder / "tmp"
        temporary.mkdir()
        found = kills.killed(
            kills.Job([job], run), random.Random(seed).uniform(5.0, 30.0), temporary,
            clock_back=False,
        )  # fmt: skip
        if found is None or found["returned"]:
            raise SystemExit(f"{way}: {found}")
    elif way.endswith("cohort"):
        table = folder / "table.csv"
        table.write_text(f"name,subject\na,{SUBJECT}\n")
        started(["cohort", str(table), "--workers", "1", "--out", str(run), *settings(1)], 1, {})
        return run / "studies" / "a"
    else:
        started(job, threads, MACHINES.get(way, {}))
    return run


def results(run: Path) -> dict[str, str]:
    """The bits of each result of a run, hexadecimal, and of its measures."""
    found = {name: file_hash(run / name) for name in RESULTS if (run / name).exists()}
    measures = read_json(run / "metrics.json")["measures"]
    return found | {f"{each['measure']} {each['target']}": repr(each["value"]) for each in measures}


def apart(one: float | None, other: float | None, margin: float) -> float:
    """How many margins two values differ by; some values, such as counts, have a margin of 0."""
    if one == other:
        return 0.0
    if one is None or other is None or margin == 0.0:
        return float("inf")
    return abs(one - other) / margin


def compared(way: str, seed: int, first: Path) -> Json:
    """What differs between a way and the `first` run."""
    with tempfile.TemporaryDirectory(prefix="gaitval-bits-") as name:
        run = studied(way, Path(name), seed)
        one, other = results(first), results(run)
        rows = compare(read_metrics(first), read_metrics(run))
        steps = [apart(row.current, row.baseline, row.margin) for row in rows]
    return {
        "way": way,
        "ours": way in WAYS,
        "results": len(one),
        "differ": sorted(each for each in {*one, *other} if one.get(each) != other.get(each)),
        "beyond": sorted(f"{row.measure} {row.target}" for row in rows if row.change != "kept"),
        "margins": max(steps, default=0.0),
    }


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--log", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=43, help="of the moment of the kill")
    parser.add_argument("--first", type=Path, help="the run of the first way, made or to be made")
    given = parser.parse_args()
    done = {each["way"] for each in kills.logged(given.log)}
    with tempfile.TemporaryDirectory(prefix="gaitval-bits-") as name:
        first = given.first or Path(name)
        way = next(iter(WAYS))
        if not (first / "metrics.json").exists():
            job = ["subject", SUBJECT, "--out", str(first), *settings(WAYS[way][0])]
            started(job, WAYS[way][1], {})
        for each in (*WAYS, *MACHINES):
            if each not in done:
                found = compared(each, given.seed, first)
                with given.log.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(found) + "\n")
                print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
