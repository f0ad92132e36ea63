"""Write the accuracy tables of README.md and reports/README.md from the stored baselines, and the
figures that `fed_figures` finds in docs/ from the newest claims.

Every figure of a table comes from files under reports/Snn/baseline, which `make baseline` writes:
accuracy from `metrics.json`, wall times from `times.json`; how far the physics step changes
results, in docs/speed.md, from `gaitval/metrics/time_step.csv`. `--check` writes nothing and fails
if a table does not match the baselines (for CI).
"""

import argparse
import csv
import json
import statistics
import sys
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import fed_figures
import numpy as np

from claims.marked_table import with_table
from claims.skill_interval import skill_interval
from gaitval.metrics.learning_gain import NEEDED, RULE, LearningGain
from gaitval.metrics.policy_comparison import push_limit
from gaitval.metrics.results import read_metrics
from gaitval.metrics.tolerances import Verdict
from gaitval.metrics.validation import EXTERNAL_LOAD
from gaitval.metrics.verdicts import close_text, spread_text, target_text
from gaitval.number_text import unit_text

ROOT = Path(__file__).parents[2]

AT_GOAL, WITHIN, FAILED = "●", "○", "✗"

TITLE = f"""# Accuracy by subject

`make subject S=5` makes each of these results: the same fit as for anybody else, from the general
policy. `make baseline S=5` keeps it beside this page, and `docs/build/accuracy_tables.py` writes
the page from what is kept. Each is a deterministic walk of the policy with the identified body,
without pushes, compared with the recorded mean curves of the person. That no external force acts
on the pelvis is not listed as a criterion, because it could not fail: {EXTERNAL_LOAD}.

{AT_GOAL} reaches the goal (or the limit, if there is no goal), {WITHIN} is accepted without it,
**{FAILED}** is not accepted, for its limit or because a guess is as near to the record. Two values
are those of the right and the left side. Limits and goals, with their sources:
[tolerances.toml](../gaitval/metrics/tolerances.toml).
"""

Metrics = dict[str, Any]
Row = dict[str, Any]


@dataclass(frozen=True)
class Stored:
    """A stored baseline: contents of its `metrics.json` and, if it exists, `times.json`."""

    metrics: Metrics
    times: dict[str, Any] | None

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
    stored = []
    for path in sorted(folder.glob("S*/baseline/metrics.json")):
        times = path.with_name("times.json")
        stored.append(
            Stored(
                read_metrics(path).as_dict(),
                json.loads(times.read_text(encoding="utf-8")) if times.exists() else None,
            )
        )
    return stored


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
    """One row per criterion over all subjects: how many values reach the goal and pass, how many
    the best guess would pass in their place, and the worst one.
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
        goal = first["goal"]
        lines.append(
            [
                first["title"],
                "" if goal is None else f"{sign} {goal:g}{unit_text(first['unit'])}",
                f"{sign} {first['tolerance']:g}{unit_text(first['unit'])}",
                "" if goal is None else f"{sum(bool(row['reached']) for row in rows)}",
                f"{sum(row['passed'] for row in rows)} of {len(rows)}",
                _guess(rows, "guess_passes"),
                _guess(rows, "guess_within"),
                f"{value_text(worst)} ({whose})",
            ]
        )
    every = [row for stored in baselines for row in stored.verdicts()]
    passed = f"{sum(row['passed'] for row in every)} of {len(every)}"
    guesses = (_guess(every, name) for name in ("guess_passes", "guess_within"))
    lines.append(["**all**", "", "", "", passed, *guesses, ""])
    headings = (
        "measure",
        "goal",
        "limit",
        "at the goal",
        "accepted",
        "the guess: accepted",
        "the guess: within the limit alone",
        "worst",
    )
    whole = [each.name for each in baselines if all(row["passed"] for row in each.verdicts())]
    names = f" ({', '.join(whole)})" if whole else ""
    return (
        table(headings, lines)
        + ABOUT_ACCEPTED
        + f"\nAccepted as a whole: {len(whole)} of {len(baselines)} people{names}.\n"
    )


def _guess(rows: Sequence[Row], name: str) -> str:
    """How many of `rows` the best guess keeps in the place of the walk, and of how many."""
    beside = [bool(row[name]) for row in rows if row.get(name) is not None]
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


def narrow_table(baselines: Sequence[Stored]) -> str:
    """Every accepted value that a repeat, or one push, may fail."""
    lines = [
        [
            stored.name,
            row["title"],
            target_text(row["target"]),
            value_text(row),
            spread_text(Verdict.model_validate(row)),
            close_text(Verdict.model_validate(row)),
        ]
        for stored in baselines
        for row in stored.verdicts()
        if row["spread"] and row["spread"]["close"]
    ]
    if not lines:
        return "None.\n"
    return table(("subject", "measure", "of", "value", "in repeats", ""), lines)


def learning_table(baselines: Sequence[Stored]) -> str:
    """What each training gave, on walks that were not used for learning."""
    lines = []
    for stored in baselines:
        gain = LearningGain.model_validate(stored.metrics["training"])
        after = gain.trained if gain.samples else None
        cells = [
            (
                "–" if each.epsilon is None else f"{each.epsilon:.4f}",
                f"{each.survived} of {each.pushes}",
                f"{each.falls}",
            )
            if each is not None
            else ("–", "–", "–")
            for each in (gain.start, after)
        ]
        kept = "trained" if gain.trained_is_handed_on else "start"
        lines.append([stored.name, f"{gain.samples:,}", *chain.from_iterable(cells), kept])
    headings = ("subject", "samples", "start: ε", "pushes", "falls")
    return table((*headings, "trained: ε", "pushes", "falls", "handed on"), lines)


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
            ("fore-aft", _sides("force_rmse", "forward")),
            ("medial", _sides("force_rmse", "medial")),
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
    "Fore-aft force": ("forces", "forward"),
    "Medial force": ("forces", "medial"),
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
    headings = ("RMSE, mean ± SD", "walker", "guess", "skill (90 %)", "walker nearer")
    return table(headings, lines)


def unrecorded_table(baselines: Sequence[Stored]) -> str:
    """What no record shows, by subject."""
    columns = (
        ("shoulder moment RMS, Nm", "shoulder_moment_rms", ("right", "left")),
        ("its peak, Nm", "shoulder_moment_peak", ("right", "left")),
        ("work of the arms over the legs', %", "arm_work_share", ("walk",)),
        ("ringing of the vertical force, % BW", "force_ringing", ("walk",)),
    )
    lines = []
    for stored in baselines:
        found = {(row["measure"], row["target"]): row for row in stored.metrics["tolerances"]}
        lines.append(
            [
                stored.name,
                *(
                    " / ".join(value_text(found[measure, target]) for target in targets)
                    for _, measure, targets in columns
                ),
            ]
        )
    return table(("subject", *(heading for heading, *_ in columns)), lines)


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


def push_table(baselines: Sequence[Stored]) -> str:
    """Largest push survived by phase and direction."""
    tested = [stored for stored in baselines if stored.metrics["push_recovery"] is not None]
    lines = []
    for stored in tested:
        pushes = stored.metrics["push_recovery"]
        for phase, forces in zip(pushes["phases"], pushes["largest"], strict=True):
            lines.append(
                [
                    stored.name,
                    f"{100 * phase:g} %",
                    *(f"{'≥ ' if f >= pushes['ceiling'] else ''}{f:g}" for f in forces),
                    f"{statistics.median(forces):g}",
                ]
            )
    directions = tested[0].metrics["push_recovery"]["directions"] if tested else ()
    return table(("subject", "right cycle", *(f"{d:g}°" for d in directions), "median"), lines)


def plates_table(baselines: Sequence[Stored]) -> str:
    """What the correction of the force plates changes."""
    lines = []
    for stored in baselines:
        record = stored.metrics["record"]
        plates, errors = record["plates"], stored.walk()["errors_as_measured"]
        asymmetry = record["consistency"]["moment_asymmetry"]
        now = [
            f"{asymmetry[name]['mean_difference']:+.2f}"
            for name in ("hip_flexion", "knee_angle", "ankle_angle")
        ]
        if plates is None:
            lines.append([stored.name, *["–"] * 5, *now])
            continue
        lines.append(
            [
                stored.name,
                f"{100 * (plates['scale'] - 1):+.1f}",
                *(
                    " / ".join(f"{errors[kind][f'{name}_{side}']:.{digits}f}" for side in "rl")
                    for kind, name, digits in (
                        ("forces", "vertical", 2),
                        ("moments", "hip_flexion", 3),
                        ("moments", "knee_angle", 3),
                        ("moments", "ankle_angle", 3),
                    )
                ),
                *now,
            ]
        )
    return table(
        (
            "subject",
            "force scaled by, %",
            "as measured: vertical RMSE, % BW",
            "hip moment, Nm/kg",
            "knee",
            "ankle",
            "corrected: hip moment, right minus left",
            "knee",
            "ankle",
        ),
        lines,
    )


def mechanics_table(baselines: Sequence[Stored]) -> str:
    """Power, work and the whole body: the worst value of each measure by subject."""
    columns = (
        ("burst of power, SD between people", "power_burst_error"),
        ("work of a joint, J/kg", "joint_work_error"),
        ("centre of mass, mm", "centre_of_mass_rmse"),
        ("first peak of the vertical force, % BW", "loading_peak_error"),
        ("ground reaction ahead of the ankle, mm", "pressure_arm_rmse"),
        ("step width, SD", "step_width"),
        ("trunk, SD", "trunk_motion"),
        ("lumbar moment, Nm/kg", "lumbar_moment_peak"),
    )
    lines = []
    for stored in baselines:
        cells = []
        for _, measure in columns:
            rows = [row for row in stored.metrics["tolerances"] if row["measure"] == measure]
            cells.append(value_text(worst_of(rows)))
        lines.append([stored.name, *cells])
    return table(("subject", *(heading for heading, _ in columns)), lines)


def witness_table(baselines: Sequence[Stored]) -> str:
    """The same walkers in the second physics engine."""
    lines = []
    for stored in baselines:
        found = stored.metrics["second_engine"]
        if found is None:
            lines.append([stored.name, *["not run"] * 4])
            continue
        there = {(row["measure"], row["target"]): row["value"] for row in found["measures"]}
        differences = []
        for kind in ("angle_rmse", "moment_rmse", "force_rmse"):
            both = [
                abs(row["value"] - there[kind, row["target"]])
                for row in stored.metrics["measures"]
                if row["measure"] == kind
                and row["value"] is not None
                and there[kind, row["target"]] is not None
            ]
            differences.append(f"{max(both):.3g}" if both else "–")
        stood = "falls" if found["fell"] else f"{found['goals_reached']} of {found['goals']}"
        lines.append([stored.name, stood, *differences])
    return table(
        (
            "subject",
            "goals reached there",
            "largest change of an angle's RMSE, °",
            "of a moment's, Nm/kg",
            "of a force's, % BW",
        ),
        lines,
    )


def contact_table(baselines: Sequence[Stored]) -> str:
    """How the feet meet the ground."""
    lines = []
    for stored in baselines:
        walk = stored.walk()
        feet = [walk["foot_contact"][side] for side in ("right", "left")]
        both = next(r for r in walk["spatiotemporal"] if r["name"] == "double_support_fraction")
        lines.append(
            [
                stored.name,
                *(_feet_text([f["progress"][at] for f in feet], 0) for at in ("10", "50", "90")),
                _feet_text([f["bounces_per_stance"] for f in feet], 2),
                _feet_text([f["transient_peak"] for f in feet], 0),
                f"{_number(both['mean'], 3)} ({_number(both['recorded'], 3)})",
            ]
        )
    return table(
        (
            "subject",
            "pressure at 10 % of stance, % of foot",
            "at 50 %",
            "at 90 %",
            "bounces per stance",
            "early peak, % of body weight",
            "double support, fraction of the cycle (recorded)",
        ),
        lines,
    )


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def _feet_text(values: Sequence[float | None], digits: int) -> str:
    return " / ".join(_number(value, digits) for value in values)


START_KINDS = {
    "scratch": "from nothing to report",
    "general": "from the policy of several people",
    "policy": "from another policy of this body",
}
"""What a run may start from, as in `times.json`."""
MINUTES = {"scratch": (30.0, 45.0), "general": (5.0, 8.0), "policy": (5.0, 8.0)}
"""Goal and limit of the wall time on two processors, min; convention: short enough to wait for."""


def time_table(baselines: Sequence[Stored]) -> str:
    """Wall times of the runs that made the baselines."""
    lines = []
    for stored in baselines:
        times = stored.times or {}
        lines.append([stored.name, *(_minutes(times.get(k), *MINUTES[k]) for k in START_KINDS)])
    return table(("subject", *START_KINDS.values()), lines)


def _minutes(run: dict[str, Any] | None, goal: float, limit: float) -> str:
    if run is None:
        return "not measured"
    whole = run["seconds"] / 60
    learning = sum(s for name, s in run["stages"].items() if name.startswith("train-")) / 60
    verdict = mark({"passed": whole <= limit, "reached": whole <= goal})
    return f"{whole:.1f} min {verdict} (learning {learning:.1f}), {run['processors']} processors"


ABOUT_ACCEPTED = """
Accepted: within the limit, and for a curve also nearer to the record than the best guess that knows
as much as the walk was told: its group of curves on its side, beside the line through the nine
others, and what is expected of anybody at this speed. A guess is never nearer than itself. The
guess: the best one in the place of the walk; falls and pushes it does not have. Limits are our own
conventions, and rules that follow from a source are marked as such.
"""
ABOUT_NARROW = """
Narrowly: values that keep the limit, but not in every repeat of the walk (eight walks from other
starts with noise) or with the whole 90 % interval, or that one push less survived would fail.
"""
ABOUT_LEARNING = (
    textwrap.fill(
        f"{NEEDED.format(limit=push_limit())} {RULE} ε is the mean over the start phases; pushes "
        "of 300 N come from all around, halfway between the phases of the table of pushes below.",
        width=100,
    )
    + "\n"
)
ABOUT_SURVIVAL = """\
300 N for 50 ms at the pelvis, from 25 directions within 90° of straight ahead, by phase of the
right gait cycle; in brackets the 90 % interval of the share. Survived: no fall within five gait
cycles.
"""
ABOUT_LARGEST = """\
The largest tested force up to which every tested push of 50 ms was survived, by phase and
direction (0° pushes ahead, 90° to the left).
"""
ABOUT_SKILL = """\
The walkers are fitted to the record. The guess is not: it is a straight line on dimensionless speed
through the nine other people, which knows only walking speed and leg length. Skill is
1 − RMSE / RMSE of the guess: 1 is perfect, and below 0 the guess is nearer to the record than the
walker; in brackets its 90 % interval, by drawing people again. Last column: curves (of each side)
where the walker is nearer. Forces and moments are those
of the corrected records; against the records as measured the skill of the moments is below zero,
because the guess copies the fault of the plates, and the walkers were told the corrected record
([Fitted and predicted](../docs/held-out.md)).
"""
ABOUT_UNRECORDED = """\
The arms are not recorded, and the comparison's low-pass filter hides what the force does above
10 Hz. So a walker is free to use both. Limits:
[tolerances.toml](../gaitval/metrics/tolerances.toml).
"""
ABOUT_PLATES = """\
The records' plates read too little, and their centres of pressure are out of place
([docs/paper.md](../docs/paper.md)). Walkers are given, and compared with, the corrected
record; here are their errors against the record as measured, and what is left of the difference
between right and left moments (mean over the cycle, Nm/kg).
"""
ABOUT_MECHANICS = """\
The worst of each walker, beside limits that decide nothing
([tolerances.toml](../gaitval/metrics/tolerances.toml)): power, work, centre of mass, loading and
the arm of the ground reaction against the record; step width, trunk and lumbar moment against what
is published of other people.
"""
ABOUT_WITNESS = """\
The same policy, body and reference in MuJoCo: other equations of motion, another integrator and a
quarter of the step, with the same contact law. Goals that a walk of the compared cycles can reach.
"""
ABOUT_TIMES = """\
Sum over all stages of the run, on the machine that made the baseline. Goals: 30 min from nothing
(limit 45), 5 min from the general policy (limit 8).
"""


def report(baselines: Sequence[Stored]) -> str:
    """The page reports/README.md."""
    sections = [
        ("All subjects", "", criteria_table(baselines) + "\n" + summary_table(baselines)),
        ("Passes narrowly", "", narrow_table(baselines)),
        ("What learning gave", ABOUT_LEARNING, learning_table(baselines)),
        ("More than a guess?", ABOUT_SKILL, skill_table(baselines)),
        ("Arms and ringing", ABOUT_UNRECORDED, unrecorded_table(baselines)),
        *((title, "", measure_table(baselines, columns)) for title, columns in GROUPS),
        ("Pushes: directions survived, %", ABOUT_SURVIVAL, survival_table(baselines)),
        ("Pushes: largest survived, N", ABOUT_LARGEST, push_table(baselines)),
        ("Power, work and the whole body", ABOUT_MECHANICS, mechanics_table(baselines)),
        ("Force plates", ABOUT_PLATES, plates_table(baselines)),
        ("How the feet meet the ground", "", contact_table(baselines)),
        ("A second physics engine", ABOUT_WITNESS, witness_table(baselines)),
        ("Wall times", ABOUT_TIMES, time_table(baselines)),
    ]
    parts = [TITLE]
    for title, about, tables in sections:
        parts.append(f"## {title}\n\n" + (f"{about}\n" if about else "") + tables)
    return "\n".join(parts)


def time_step_table() -> str:
    """How far a quarter of the physics step changes the result of the whole study."""
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    text = (ROOT / "gaitval" / "metrics" / "time_step.csv").read_text(encoding="utf-8")
    for row in csv.DictReader(line for line in text.splitlines() if not line.startswith("#")):
        of = found.setdefault((row["group"], row["unit"]), [])
        of.append((float(row["change"]), float(row["error"])))
    lines = []
    for (group, unit), values in found.items():
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
