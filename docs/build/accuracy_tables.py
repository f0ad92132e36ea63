"""Write the accuracy tables of README.md and reports/README.md from the stored baselines, and the
figures that `fed_figures` finds in docs/ from the claims.

Every figure of a table comes from reports/Snn/baseline/metrics.json, which `make baseline` writes;
how far the physics step changes results, in docs/speed.md, from `gaitval/metrics/time_step.csv`.
`gaitval compare reports` has every measure of all of them. `--check` writes nothing and fails
if a table does not match the baselines (for CI).
"""

import argparse
import statistics
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import fed_figures
import numpy as np

from claims.marked_table import with_table
from claims.numerics import changes_by_step
from claims.skill_interval import skill_interval
from gaitval._internal.text.number_text import unit_text
from gaitval.metrics.results import read_metrics
from gaitval.metrics.validation import EXTERNAL_LOAD

ROOT = Path(__file__).parents[2]

AT_GOAL, WITHIN, FAILED = "●", "○", "✗"

TITLE = f"""# Accuracy by subject

`make subject S=5` makes each of these results, from the general policy, as for anybody else. `make
baseline S=5` stores it beside this page, and `docs/build/accuracy_tables.py` writes the page. Each
is a deterministic walk of the policy with the identified body, without pushes, compared with the
person's measured mean curves. No external force on the pelvis is no criterion, because it cannot
fail: {EXTERNAL_LOAD}.

{AT_GOAL} reaches the goal (or the limit, if there is no goal), {WITHIN} is accepted without it,
**{FAILED}** is not accepted, for its limit or because a prediction without a model is as near. Two
values are those of the right and the left side. Limits and goals, with their sources:
[tolerances.toml](../gaitval/metrics/tolerances.toml).
"""

Metrics = dict[str, Any]
Row = dict[str, Any]


@dataclass(frozen=True)
class Stored:
    """A stored baseline: contents of its `metrics.json`."""

    metrics: Metrics

    @property
    def name(self) -> str:
        """Identifier of the subject."""
        return str(self.metrics["subject"]["identifier"])

    def verdicts(self) -> list[Row]:
        """Verdicts that decide, one per measured value."""
        return [row for row in self.metrics["tolerances"] if row["role"] == "acceptance"]

    def verdict(self, measure: str, target: str) -> Row | None:
        """The verdict on one measured value."""
        for row in self.verdicts():
            if (row["measure"], row["target"]) == (measure, target):
                return row
        return None

    def walk(self) -> dict[str, Any]:
        """The rollouts that are validated."""
        walk: dict[str, Any] = self.metrics["walks"][self.metrics["final"]]
        return walk

    def predictions(self) -> list[dict[str, Any]]:
        """Predictions of the record without a model."""
        found: list[dict[str, Any]] = self.metrics["predictions"]
        return found


def load(folder: Path) -> list[Stored]:
    """All baselines below `folder`, by subject."""
    files = sorted(folder.glob("S*/baseline/metrics.json"))
    return [Stored(read_metrics(path).as_dict()) for path in files]


# --- cells --------------------------------------------------------------------------------


def mark(row: Row) -> str:
    """Whether a value reaches the goal, meets the limit, or neither; without a goal, only the
    limit.
    """
    if not row["passed"]:
        return f"**{FAILED}**"
    return WITHIN if row["reached"] is False else AT_GOAL


def _digits(unit: str) -> int:
    return {"Nm/kg": 3, "cycles": 0, "walks": 0, "N": 0}.get(unit, 2)


def value_text(row: Row) -> str:
    """A value with its mark."""
    if row["value"] is None:
        return f"not measured {mark(row)}"
    return f"{row['value']:.{_digits(row['unit'])}f} {mark(row)}"


def _cell(stored: Stored, measure: str, *targets: str) -> str:
    rows = [stored.verdict(measure, target) for target in targets]
    return " / ".join("–" if row is None else value_text(row) for row in rows)


def _worst(stored: Stored, measure: str) -> str:
    """The worst of all values of a measure."""
    rows = [row for row in stored.verdicts() if row["measure"] == measure]
    return value_text(worst_of(rows)) if rows else "–"


def worst_of(rows: Sequence[Row]) -> Row:
    """The row that misses its limit by most; one that could not be measured, if any."""

    def badness(row: Row) -> float:
        if row["value"] is None:
            return float("inf")
        return -float(row["value"]) if row["limit"] == "at_least" else float(row["value"])

    return max(rows, key=badness)


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


# --- tables -------------------------------------------------------------------------------


def criteria_table(baselines: Sequence[Stored]) -> str:
    """One row per criterion over all subjects: how many values are accepted, for how many the best
    prediction without a model meets the limit, and the worst one.
    """
    by_criterion: dict[str, list[tuple[Stored, Row]]] = {}
    for stored in baselines:
        for row in stored.verdicts():
            by_criterion.setdefault(row["id"], []).append((stored, row))
    lines = []
    for found in by_criterion.values():
        rows = [row for _, row in found]
        first, worst = rows[0], worst_of(rows)
        whose = next(stored.name for stored, row in found if row is worst)
        sign = {"at_most": "≤", "at_least": "≥", "exactly": "="}[first["limit"]]
        lines.append(
            [
                first["title"],
                f"{sign} {first['tolerance']:g}{unit_text(first['unit'])}",
                f"{sum(row['passed'] for row in rows)} of {len(rows)}",
                _within(rows),
                f"{value_text(worst)} ({whose})",
            ]
        )
    every = [row for stored in baselines for row in stored.verdicts()]
    passed = f"{sum(row['passed'] for row in every)} of {len(every)}"
    lines.append(["**all**", "", passed, _within(every), ""])
    headings = ("measure", "limit", "accepted", "baseline prediction within", "worst")
    whole = [each.name for each in baselines if all(row["passed"] for row in each.verdicts())]
    names = f" ({', '.join(whole)})" if whole else ""
    return (
        table(headings, lines)
        + ABOUT_ACCEPTED
        + f"\nAccepted as a whole: {len(whole)} of {len(baselines)} people{names}.\n"
    )


def _within(rows: Sequence[Row]) -> str:
    """For how many of `rows` the best prediction without a model meets the limit, and of how many
    that there are predictions of.
    """
    beside = [bool(row["guess_within"]) for row in rows if row.get("guess_within") is not None]
    return f"{sum(beside)} of {len(beside)}" if beside else "–"


def summary_table(baselines: Sequence[Stored]) -> str:
    """One row per subject: how many of its values reach goal and limit."""
    lines = []
    for stored in baselines:
        rows = stored.verdicts()
        failed = sorted({row["title"].split(":")[0] for row in rows if not row["passed"]})
        lines.append(
            [
                stored.name,
                stored.metrics["subject"]["source"],
                f"{stored.metrics['record']['spatiotemporal']['walking_speed']:.2f}",
                f"{sum(bool(row['reached']) for row in rows)} of "
                f"{sum(row['goal'] is not None for row in rows)}",
                f"{sum(row['passed'] for row in rows)} of {len(rows)}",
                f"{sum(row.get('state') == 'not shown' for row in rows)}",
                f"{sum(bool(row['spread'] and row['spread']['close']) for row in rows)}",
                "; ".join(failed) or "none",
            ]
        )
    headings = (
        *("subject", "trial", "m/s", "at the goal", "accepted", "not shown", "narrowly"),
        "not accepted",
    )
    return table(headings, lines) + ABOUT_NARROW


def measure_table(
    baselines: Sequence[Stored], columns: Sequence[tuple[str, Callable[[Stored], str]]]
) -> str:
    """One row per subject, one column per measure."""
    return table(
        ("subject", *(heading for heading, _ in columns)),
        [[stored.name, *(cell(stored) for _, cell in columns)] for stored in baselines],
    )


def _sides(measure: str, name: str) -> Callable[[Stored], str]:
    return lambda stored: _cell(stored, measure, f"{name}_r", f"{name}_l")


def _feet(measure: str) -> Callable[[Stored], str]:
    return lambda stored: _cell(stored, measure, "right", "left")


GROUPS: tuple[tuple[str, tuple[tuple[str, Callable[[Stored], str]], ...]], ...] = (
    (
        "Sagittal angles, RMSE, °",
        (
            ("hip flexion", _sides("angle_rmse", "hip_flexion")),
            ("knee", _sides("angle_rmse", "knee_angle")),
            ("ankle", _sides("angle_rmse", "ankle_angle")),
        ),
    ),
    (
        "Hip adduction, hip rotation and pelvis, RMSE, °",
        (
            ("hip adduction", _sides("angle_rmse", "hip_adduction")),
            ("hip rotation", _sides("angle_rmse", "hip_rotation")),
            ("pelvis tilt", _sides("angle_rmse", "pelvis_tilt")),
            ("pelvis list", _sides("angle_rmse", "pelvis_list")),
            ("pelvis rotation", _sides("angle_rmse", "pelvis_rotation")),
        ),
    ),
    (
        "Sagittal moments, RMSE, Nm/kg",
        (
            ("hip", _sides("moment_rmse", "hip_flexion")),
            ("knee", _sides("moment_rmse", "knee_angle")),
            ("ankle", _sides("moment_rmse", "ankle_angle")),
        ),
    ),
    (
        "Hip adduction moment, RMSE, Nm/kg",
        (("hip adduction", _sides("moment_rmse", "hip_adduction")),),
    ),
    (
        "Ground reaction, RMSE, % of body weight",
        (
            ("vertical", _sides("force_rmse", "vertical")),
            ("anterior–posterior", _sides("force_rmse", "forward")),
            ("mediolateral", _sides("force_rmse", "medial")),
        ),
    ),
    (
        "Speed, timing and steps compared with the record, and endurance",
        (
            ("stance, % of cycle", _feet("stance_fraction_error")),
            ("step length, cm", _feet("step_length_error")),
            ("speed, %", lambda stored: _cell(stored, "speed_error", "walk")),
            ("cycles, fewest of all starts", lambda s: _worst(s, "consecutive_cycles")),
            ("falls", lambda stored: _cell(stored, "falls", "walk")),
        ),
    ),
)


SKILLS = {
    "Hip flexion": ("angles", "hip_flexion"),
    "Knee angle": ("angles", "knee_angle"),
    "Ankle angle": ("angles", "ankle_angle"),
    "Hip moment": ("moments", "hip_flexion"),
    "Hip adduction moment": ("moments", "hip_adduction"),
    "Knee moment": ("moments", "knee_angle"),
    "Ankle moment": ("moments", "ankle_angle"),
    "Vertical force": ("forces", "vertical"),
    "Anterior–posterior force": ("forces", "forward"),
    "Mediolateral force": ("forces", "medial"),
}


def skill_table(baselines: Sequence[Stored]) -> str:
    """Errors of the walkers beside those of predictions without a model, over all subjects."""
    lines = []
    for title, (kind, name) in SKILLS.items():
        walked = []  # by person, (sides, 2): errors of the walker and of the guess
        for stored in baselines:
            errors, predictions = stored.walk()["errors"][kind], stored.predictions()
            both = [
                (errors[curve]["rmse"], predictions[0]["rmse"][kind][curve])
                for curve in (f"{name}_r", f"{name}_l")
                if errors[curve] is not None and predictions
            ]
            walked += [both] if both else []
        if not walked:
            continue
        ours, guesses = zip(*chain.from_iterable(walked), strict=True)
        low, high = skill_interval(*np.array([np.mean(each, axis=0) for each in walked]).T)
        unit = baselines[0].metrics["units"][kind]
        digits = _digits(unit)
        better = sum(a < b for a, b in zip(ours, guesses, strict=True))
        lines.append(
            [
                f"{title}, {unit_text(unit).strip()}",
                f"{statistics.mean(ours):.{digits}f} ± {statistics.stdev(ours):.{digits}f}",
                f"{statistics.mean(guesses):.{digits}f} ± {statistics.stdev(guesses):.{digits}f}",
                f"{1.0 - statistics.mean(ours) / statistics.mean(guesses):.2f} "
                f"({low:.2f} to {high:.2f})",
                f"{better} of {len(ours)}",
            ]
        )
    headings = ("RMSE, mean ± SD", "walker", "prediction", "skill (90 %)", "walker nearer")
    return table(headings, lines)


def survival_table(baselines: Sequence[Stored]) -> str:
    """Fraction of directions in which the walker survives the required push, by phase."""
    tested = [stored for stored in baselines if stored.metrics["push_recovery"] is not None]
    if not tested:
        return "No pushes tested.\n"
    pushes = tested[0].metrics["push_recovery"]
    lines = [
        [
            stored.name,
            *(
                _with_interval(stored, f"phase {phase:g}")
                for phase in stored.metrics["push_recovery"]["phases"]
            ),
        ]
        for stored in tested
    ]
    return table(("subject", *(f"at {100 * p:g} %" for p in pushes["phases"])), lines)


def _with_interval(stored: Stored, phase: str) -> str:
    row = stored.verdict("push_survival", phase)
    interval = f" ({row['spread']['low']:.0f}–{row['spread']['high']:.0f})" if row else ""
    return _cell(stored, "push_survival", phase) + interval


ABOUT_ACCEPTED = """
*Accepted*: within the limit and, by group of curves and side, nearer to the measured curves than
the better of two predictions without a model: a regression on speed over the nine other people, and
the mean of people at that speed. *Baseline prediction within*: how often that prediction meets the
limit itself. ● reaches a stricter goal, ○ does not. Most limits are our own conventions;
`tolerances.toml` has their sources.
"""
ABOUT_NARROW = """
*Narrowly*: the value meets the limit, but not in each of eight repeats of the walk (other starts,
with noise), or not with its whole 90 % interval, or would fail with one push less survived.
"""
ABOUT_SURVIVAL = """\
300 N for 50 ms at the pelvis, from 25 directions within 90° of straight ahead, by phase of the
right gait cycle; in brackets the 90 % interval of the share. Survived: no fall within five gait
cycles.
"""
ABOUT_SKILL = """\
The walkers are fitted to the measured gait. The baseline prediction is not: it is a straight line
on dimensionless speed through the nine other people, which knows only walking speed and leg length.
Skill is 1 − RMSE / RMSE of that prediction: 1 is perfect, and below 0 the prediction is nearer to
the measurement than the walker; in brackets its 90 % interval, by drawing people again. Last
column: curves (of each side) where the walker is nearer. Forces and moments are those after the
correction of the force plates. Against the curves as measured the skill of the moments is below
zero: the prediction copies the fault of the plates, and the walkers were given the corrected curves
([Fitted and predicted](../docs/held-out.md)).
"""


def report(baselines: Sequence[Stored]) -> str:
    """The page reports/README.md."""
    sections = [
        ("All subjects", "", criteria_table(baselines) + "\n" + summary_table(baselines)),
        ("More than a prediction without a model?", ABOUT_SKILL, skill_table(baselines)),
        *((title, "", measure_table(baselines, columns)) for title, columns in GROUPS),
        ("Pushes: directions survived, %", ABOUT_SURVIVAL, survival_table(baselines)),
    ]
    parts = [TITLE]
    for title, about, tables in sections:
        parts.append(f"## {title}\n\n" + (f"{about}\n" if about else "") + tables)
    return "\n".join(parts)


def time_step_table() -> str:
    """How far a quarter of the physics step changes the result of the whole study."""
    lines = []
    for (group, unit), values in changes_by_step().items():
        change, error = np.array(values).T
        lines.append(
            [
                f"{group}, {unit}",
                f"{len(values)}",
                f"{change.mean():.2g}",
                f"{change.max():.2g}",
                f"{error.mean():.2g}",
                f"{change.mean() / error.mean():.2f}",
                f"{(change / error).max():.2f}",
            ]
        )
    headings = ("mean curves of", "people", "change, mean", "largest", "error shown, mean")
    return table((*headings, "change over error", "largest"), lines)


def main() -> int:
    """Write, or with --check compare, all pages."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail if out of date")
    check = parser.parse_args().check
    baselines = load(ROOT / "reports")
    readme = ROOT / "README.md"
    wanted = {
        ROOT / "reports" / "README.md": report(baselines),
        readme: with_table(
            readme.read_text(encoding="utf-8"),
            "accuracy",
            criteria_table(baselines).rstrip("\n"),
        ),
    }
    values = fed_figures.claims()
    for page in sorted((ROOT / "docs").rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        if "<!-- table 1: begin -->" in text:
            text = with_table(text, "table 1", fed_figures.people_table())
        if "<!-- time step: begin -->" in text:
            text = with_table(text, "time step", time_step_table().rstrip("\n"))
        wanted[page] = fed_figures.fed(text, values, str(page.relative_to(ROOT)))
    stale = [p for p, text in wanted.items() if not p.exists() or p.read_text("utf-8") != text]
    for path in stale:
        if check:
            sys.stderr.write(
                f"{path}: does not match the baselines or the claims. Run `make tables`.\n"
            )
        else:
            path.write_text(wanted[path], encoding="utf-8")
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())
