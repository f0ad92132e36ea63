"""Whether a general policy helps people whom it has never seen.

    python -m experiments.left_out     # 70 min on an otherwise idle machine

The built-in subjects are left out in groups: for each group a general policy is trained on the
others alone, their angles at three speeds. Then every subject is studied from the policy that has
not seen it, with 500,000 samples. The goals that these walks reach are counted among those that the
stored walkers reach (`reports/S*/baseline`), which trained for 2,000,000 samples from a general
policy that knew their angles. Writes `reports/general/left_out.json`, the table of
docs/learning.md and a row of `reports/evidence/cohort.csv`. Interrupted, the same command resumes
in --work.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

import evidence
from evidence.marked_table import with_table
from gaitval.artefacts import read_json, versions, write_json, write_text
from gaitval.datasets.subject_file import BUILTIN

ROOT: Final = Path(__file__).resolve().parent.parent
STORE: Final = ROOT / "reports" / "general" / "left_out.json"
COMMAND: Final = "python -m experiments.left_out"
SAMPLES: Final = 500_000
PAGE: Final = ROOT / "docs" / "learning.md"
Json = dict[str, Any]
MEASURES = {
    "*": {
        "code": ("@study", "extras/gaitval_virtual/person.py", "experiments/general_policy.py"),
        "allowed": 60,
        "why": "a share of 430 goals, told apart in steps of 0.2 %: it bears changes that leave "
        "each walk within the margins of gaitval check, which must pass at every change",
    },
}
"""What the rows depend on; see evidence/stale.py."""


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
    command = [sys.executable, "-m", "experiments.general_policy", *others]
    command += ["--samples", str(samples), "--alone", "--out", str(folder)]
    command += ["--work", str(work / f"training-{name}")]
    subprocess.run(command, cwd=ROOT, check=True)
    return folder


def studies(policies: dict[str, Path], work: Path) -> Path:
    """The folder of a cohort of all subjects, each from its policy."""
    rows = [f"{name},{policies[name].resolve()},{SAMPLES}" for name in BUILTIN]
    table = work / "left-out.csv"
    write_text(table, "\n".join(["subject,policy,training.samples", *rows]) + "\n")
    out = work / "studies"
    command = [sys.executable, "-m", "gaitval", "cohort", str(table), "--out", str(out)]
    subprocess.run(command, cwd=ROOT, check=True)
    return out / "studies"


def reached(metrics: Json) -> dict[str, bool]:
    """Goals of a study: "measure target" to whether the walk reaches it."""
    return {
        f"{row['measure']} {row['target'] or ''}".strip(): bool(row["reached"])
        for row in metrics["tolerances"]
        if row["role"] == "acceptance" and row["goal"] is not None
    }


def summary(metrics: Json) -> Json:
    """Goals and the missed ones of a study, and its limits."""
    goals = reached(metrics)
    missed = sorted(name for name, kept in goals.items() if not kept)
    return {"goals": len(goals), "missed": missed, "limits": metrics["summary"]}


def compared(few: Json, many: Json) -> tuple[int, int]:
    """Goals that are reached with many samples, and those of them with few."""
    lost = [each for each in few["missed"] if each not in many["missed"]]
    kept = many["goals"] - len(many["missed"])
    return kept, kept - len(lost)


def totals(found: dict[str, dict[str, Json]]) -> tuple[int, int]:
    """The two counts of `compared` for all subjects together."""
    counts = [compared(both["left out"], both["stored"]) for both in found.values()]
    among, kept = (sum(each) for each in zip(*counts, strict=True))
    return among, kept


def table(found: dict[str, dict[str, Json]]) -> str:
    """Goals and limits by subject."""
    lines = [
        "| subject | goals reached, 0.5 M samples, left out | 2 M, not left out "
        "| limits failed, 0.5 M |",
        "|---|---|---|---|",
    ]
    for name, both in found.items():
        shown = [
            f"{each['goals'] - len(each['missed'])} of {each['goals']}"
            for each in (both["left out"], both["stored"])
        ]
        failed = both["left out"]["limits"]["refused"]
        lines.append(f"| {name} | {shown[0]} | {shown[1]} | {failed} |")
    missed = [each for both in found.values() for each in both["left out"]["missed"]]
    pushes = sum(each.startswith("push_survival") for each in missed)
    among, kept = totals(found)
    failed = sum(both["left out"]["limits"]["refused"] for both in found.values())
    said = (
        f"Of the {among} goals that the stored walkers reach, these reach {kept} "
        f"({100.0 * kept / among:.1f} %)."
    )
    other = (
        f"{len(missed)} goals are missed with 0.5 M samples; {pushes} of them are pushes of 300 N. "
        f"{failed} limits fail."
    )
    return "\n".join([*lines, "", said, other])


def main() -> None:
    """Train, study, count and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--groups", type=int, default=3, help="default: %(default)s")
    parser.add_argument(
        "--samples",
        type=int,
        default=22_000_000,
        help="of a general policy; default: %(default)s, as of the shipped one",
    )
    parser.add_argument("--work", type=Path, default=ROOT / "reports" / "left-out")
    arguments = parser.parse_args()
    os.environ["PYTHONPATH"] = str(ROOT)
    policies = {
        name: train_general(group, arguments.samples, arguments.work)
        for group in groups(arguments.groups)
        for name in group
    }
    folder = studies(policies, arguments.work)
    found = {
        name: {
            "left out": summary(read_json(folder / name / "metrics.json")),
            "stored": summary(read_json(ROOT / "reports" / name / "baseline" / "metrics.json")),
        }
        for name in BUILTIN
    }
    among, kept = totals(found)
    what = "left-out subjects from the general policy: goals kept with 0.5 M samples, of those"
    value = 100.0 * kept / among
    row = evidence.Row(f"{what} with 2 M", value, "%", ">=", 97.0, 93.0, among)
    about = {"groups": groups(arguments.groups), "samples": arguments.samples}
    write_json(STORE, {**about, "studies": found, "versions": versions()})
    text = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, with_table(text, "left-out", table(found)))
    evidence.write("cohort", [row], COMMAND)
    print(f"{row.what}: {row.value:.1f} %, {kept} of {among}")


if __name__ == "__main__":
    main()
