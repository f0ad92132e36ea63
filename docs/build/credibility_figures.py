"""Shipped: writes gaitval/reporting/evidence.toml, what the project, not one run, has measured.

    python docs/build/credibility_figures.py [--check]

A report cites these figures of verification, validation and uncertainty. They come with the
package because an installed one has no `reports/` and no `docs/`. Nothing is typed in: each is
looked up by name in reports/evidence, in a table of docs/speed.md or in benchmarks/margins.json,
and stands with the command that measured it, the hash of the row that it came from and the day on
which it was measured; of a table, that on which its file last changed. A row that stands in
reports/evidence/past only was measured on code that has changed since; the figure names the commit.
`--check` writes nothing and fails if a figure is not that of the tree; days do not count.
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import tomli_w

import evidence
from gaitval.artefacts import write_text
from gaitval.metrics.tolerances import UNITS

ROOT: Final = Path(__file__).resolve().parents[2]
TARGET: Final = ROOT / "gaitval" / "reporting" / "evidence.toml"
SPEED: Final = "docs/speed.md"
MARGINS: Final = "benchmarks/margins.json"

EVIDENCE: Final = (
    # part of the page, file of reports/evidence, `what` of its row
    ("verification", "ground", "failures of the suite on Python 3.13.0"),
    ("verification", "ground", "rows of the limits table with a mutation that fails them"),
    ("verification", "fitted", "the same policies in MuJoCo: goals of accuracy reached"),
    (
        "verification",
        "robustness",
        "planted faults above the scatter caught by check --quick or tests",
    ),
    *(
        (
            "verification",
            "recordings",
            f"{joint} moments against the peer's own results, same convention: RMS, mean of legs "
            "and trials",
        )
        for joint in ("hip", "knee", "ankle")
    ),
    (
        "validation",
        "fitted",
        "acceptance goals reached (arms not actuated by the policy; force plates corrected)",
    ),
    *(
        ("validation", "held_out", f"kinetics from kinematics: skill, {what}, record corrected")
        for what in ("vertical force", "hip moment", "knee moment", "ankle moment")
    ),
    *(
        (
            "validation",
            "held_out",
            f"unseen speed within 40 %: {what}, skill against nearest trial copied",
        )
        for what in ("sagittal angles", "moments", "forces")
    ),
    *(
        (
            "validation",
            "held_out",
            f"unseen speed within 15 %: {what}, error over that of the fitted trial, worst",
        )
        for what in ("sagittal angles", "moments", "forces")
    ),
    (
        "uncertainty",
        "identification",
        "virtual people: coverage of 90 % intervals, all parameters that the fit looks for, at "
        "least",
    ),
    (
        "uncertainty",
        "identification",
        "virtual people: leg length by markers (prior misses 1.7 cm RMS), RMS error",
    ),
    (
        "uncertainty",
        "identification",
        "two seeds of the search, largest difference of the result",
    ),
    (
        "uncertainty",
        "identification",
        "6-seed ablation, body by stature: seeds whose epsilon, mean of the subjects, is lower "
        "with identification",
    ),
    ("history", "robustness", "damaged baselines refused"),
    ("history", "robustness", "false alarms of check --quick over seeds of an unchanged program"),
)  # fmt: skip

ENERGY: Final = "energy that the work of servos and ground does not explain"
STEPS: Final = (
    # part, table of docs/speed.md, column, which of its numbers, what, unit, steps in ms
    ("verification", "steps", 3, 0, ENERGY, "% of the servos' work", (1, 2)),
    (
        *("verification", "steps", 1, 2),
        "vertical ground reaction off that of a step of 0.125 ms, RMS",
        *("% of body weight", (1, 2)),
    ),
    (
        *("sensitivity", "steered", 1, 0),
        "hip, knee and ankle angles off those of a step of 0.25 ms, RMS",
        *("deg", (1, 2)),
    ),
    (
        *("sensitivity", "steered", 2, 0),
        "moments of hip, knee and ankle off those of a step of 0.25 ms, RMS",
        *("Nm/kg", (1, 2)),
    ),
    (
        *("sensitivity", "steered", 3, 0),
        "vertical force off that of a step of 0.25 ms, RMS",
        *("% of body weight", (1, 2)),
    ),
)

SCATTERED: Final = ("angle_rmse", "moment_rmse", "force_rmse", "epsilon")
"""Measures whose scatter between walks that differ by rounding is given."""


def figures() -> dict[str, dict[str, Any]]:
    """Every figure by its key, without the day."""
    found = [*_of_evidence(), *_of_tables(), *_of_scatter()]
    keyed = {_key(each["part"], each["what"]): each for each in found}
    assert len(keyed) == len(found), "two figures have the same name"
    return keyed


def _key(part: str, what: str) -> str:
    return f"{part}-{hashlib.sha256(what.encode()).hexdigest()[:8]}"


def _figure(
    part: str,
    what: str,
    value: float,
    unit: str,
    n: int | None,
    source: str,
    command: str,
    row: str,
) -> dict[str, Any]:
    return {
        "part": part,
        "what": what,
        "value": value,
        "unit": unit,
        **({} if n is None else {"n": n}),
        "source": source,
        "command": command,
        "sha256": hashlib.sha256(row.encode()).hexdigest(),
    }


def _of_evidence() -> Iterator[dict[str, Any]]:
    for part, topic, what in EVIDENCE:
        for source in (f"reports/evidence/{topic}.csv", f"reports/evidence/past/{topic}.csv"):
            path = ROOT / source
            rows = evidence.read(path) if path.is_file() else []
            row = next((row for row in rows if row["what"] == what), None)
            if row:
                break
        else:
            sys.exit(f"{source}: has no row {what!r}. Correct the name in {__file__}.")
        figure = _figure(
            part, what, float(row["value"]), row["unit"], int(row["n"]), source, row["command"],
            json.dumps(row, sort_keys=True),
        )  # fmt: skip
        yield figure | {"date": row["date"], "commit": row["commit"]}


def _of_tables() -> Iterator[dict[str, Any]]:
    text = (ROOT / SPEED).read_text(encoding="utf-8")
    for part, table, column, number, what, unit, steps in STEPS:
        rows = text.split(f"<!-- {table}: begin -->")[1].split(f"<!-- {table}: end -->")[0]
        for step in steps:
            line = next((row for row in rows.splitlines() if row.startswith(f"| {step} |")), None)
            if line is None:
                sys.exit(f"{SPEED}: no step of {step} ms in its table {table!r}.")
            cell = [each.strip() for each in line.strip("|").split("|")][column]
            value = float(cell.split(" / ")[number])
            yield _figure(
                part, f"{what}, at a step of {step} ms", value, unit, None, SPEED,
                f"python docs/build/speed_tables.py {table}", line,
            )  # fmt: skip


def _of_scatter() -> Iterator[dict[str, Any]]:
    stored = json.loads((ROOT / MARGINS).read_text(encoding="utf-8"))
    walks = len(stored["scatter"]) * (stored["walks"] + 1)
    for measure in SCATTERED:
        values = {name: found[measure] for name, found in stored["scatter"].items()}
        yield _figure(
            "uncertainty",
            f"scatter of {measure} between walks that differ by rounding, largest",
            max(values.values()), UNITS[measure], walks, MARGINS,
            "python -m experiments.margins measure", json.dumps(values, sort_keys=True),
        )  # fmt: skip


def _day(source: str) -> str:
    """The day on which a file last changed, by git."""
    command = ["git", "log", "-1", "--format=%cs", "--", source]
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.strip()


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    check = parser.parse_args().check
    wanted = figures()
    if check:
        stored = tomllib.loads(TARGET.read_text(encoding="utf-8"))["figure"]
        undated, asked = (
            {
                key: {name: value for name, value in each.items() if name != "date"}
                for key, each in given.items()
            }
            for given in (stored, wanted)
        )
        changed = sorted(key for key in {*asked, *undated} if asked.get(key) != undated.get(key))
        if changed:
            sys.exit(
                f"{TARGET}: not as in the tree: {', '.join(changed)}. Run this without --check."
            )
        return
    dated = {
        key: {**each, "date": each.get("date") or _day(each["source"])}
        for key, each in wanted.items()
    }
    header = (
        "# Figures of verification, validation and uncertainty that the project, not a run, has\n"
        "# measured. Written by docs/build/credibility_figures.py; sha256 is of the row of\n"
        "# `source`.\n"
    )
    write_text(TARGET, header + "\n" + tomli_w.dumps({"figure": dated}))
    print(f"{TARGET}: {len(dated)} figures")


if __name__ == "__main__":
    main()
