"""Whether a general policy helps people whom it has never seen.

    python scripts/left_out.py     # 70 min on an otherwise idle machine

The built-in subjects are left out in groups: for each group a general policy is trained on the
others alone, their angles at three speeds. Then every subject is studied from the policy that has
not seen it, with 500,000 samples and with 2,000,000, and the goals that the walks reach are
counted. Writes `reports/general/left_out.json` and a row of `reports/evidence/cohort.csv`.
Interrupted, the same command resumes in --work.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

import evidence

from gaitval.artefacts import read_json, versions, write_json, write_text
from gaitval.datasets.subject_file import BUILTIN

ROOT: Final = Path(__file__).resolve().parent.parent
STORE: Final = ROOT / "reports" / "general" / "left_out.json"
COMMAND: Final = "python scripts/left_out.py"
SAMPLES: Final = (500_000, 2_000_000)
Json = dict[str, Any]


def groups(count: int) -> list[list[str]]:
    """The subjects that are left out together."""
    return [list(BUILTIN)[number::count] for number in range(count)]


def train_general(left_out: list[str], samples: int, work: Path) -> Path:
    """The folder of a general policy of the subjects that are not left out."""
    name = "-".join(left_out)
    folder = work / f"without-{name}"
    if (folder / "about.json").is_file():
        return folder
    others = [each for each in BUILTIN if each not in left_out]
    command = [sys.executable, str(ROOT / "scripts" / "general_policy.py"), *others]
    command += ["--samples", str(samples), "--alone", "--out", str(folder)]
    command += ["--work", str(work / f"training-{name}")]
    subprocess.run(command, check=True)
    return folder


def studies(policies: dict[str, Path], samples: int, work: Path) -> Path:
    """The folder of a cohort of all subjects, each from its policy."""
    rows = [f"{name},{folder.resolve()},{samples}" for name, folder in policies.items()]
    work.mkdir(parents=True, exist_ok=True)
    table = work / f"left-out-{samples}.csv"
    write_text(table, "\n".join(["subject,policy,training.transfer_samples", *rows]) + "\n")
    out = work / f"studies-{samples}"
    command = [sys.executable, "-m", "gaitval", "cohort", str(table), "--out", str(out)]
    done = subprocess.run(command, cwd=ROOT)
    if done.returncode not in (0, 1):  # 1: a walk does not keep a limit
        raise SystemExit(f"{' '.join(command)} ended with {done.returncode}.")
    return out


def reached(metrics: Json) -> dict[str, bool]:
    """Goals of a study: "measure target" to whether the walk reaches it."""
    return {
        f"{row['measure']} {row['target'] or ''}".strip(): bool(row["reached"])
        for row in metrics["tolerances"]
        if row["role"] == "acceptance" and row["goal"] is not None
    }


def summary(out: Path) -> dict[str, Json]:
    """By subject: goals, limits kept, and errors of groups of curves."""
    found = {}
    for name in BUILTIN:
        folder = out / "studies" / name
        metrics = read_json(folder / "metrics.json")
        goals = reached(metrics)
        found[name] = {
            "goals": len(goals),
            "missed": sorted(each for each, kept in goals.items() if not kept),
            "summary": metrics["summary"],
        }
    return found


def row_of(few: dict[str, Json], many: dict[str, Json]) -> evidence.Row:
    """Goals kept with few samples, of those that are kept with many."""
    both, kept = 0, 0
    for name in BUILTIN:
        with_many = many[name]["goals"] - len(many[name]["missed"])
        lost = [each for each in few[name]["missed"] if each not in many[name]["missed"]]
        both += with_many
        kept += with_many - len(lost)
    what = "left-out subjects from the general policy: goals kept with 0.5 M samples, of those"
    value = 100.0 * kept / both
    return evidence.Row(f"{what} with 2 M", value, "%", ">=", 97.0, 93.0, both, COMMAND)


def main() -> None:
    """Train, study, count and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--groups", type=int, default=3, help="default: %(default)s")
    parser.add_argument("--samples", type=int, default=6_000_000, help="of a general policy")
    parser.add_argument("--work", type=Path, default=ROOT / "reports" / "left-out")
    arguments = parser.parse_args()
    os.environ["PYTHONPATH"] = str(ROOT)
    policies = {
        name: train_general(group, arguments.samples, arguments.work)
        for group in groups(arguments.groups)
        for name in group
    }
    found = {}
    for samples in SAMPLES:
        ordered = {name: policies[name] for name in BUILTIN}
        found[str(samples)] = summary(studies(ordered, samples, arguments.work))
    few, many = (found[str(samples)] for samples in SAMPLES)
    row = row_of(few, many)
    about = {"groups": groups(arguments.groups), "samples": arguments.samples}
    write_json(STORE, {**about, "studies": found, "versions": versions()})
    evidence.write("cohort", [row])
    print(f"{row.what}: {row.value:.1f} %")


if __name__ == "__main__":
    main()
