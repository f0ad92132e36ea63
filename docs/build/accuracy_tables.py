"""Write the accuracy tables of README.md and reports/README.md from the stored baselines, the
figures that `fed_figures` finds in docs/ from the claims, and `reports/errors.csv`.

Every figure of a table comes from reports/Snn/baseline/metrics.json, which `make baseline` writes;
how far the physics step changes results, in docs/speed.md, from `gaitval/metrics/time_step.csv`.
`gaitval compare reports` has every measure of all of them.

`reports/errors.csv` has every mean error over the ten people now, and of the last release. Each
that changed by more than 3 %, for the worse or the better, is printed, and has to stand in
CHANGELOG.md below "Unreleased" with its reason in brackets: "hip rotation 2.60 -> 2.86 deg, +10 %
(the reason)". `--release VERSION` makes what is there now that of the last release.

`--check` writes nothing and fails if a table does not match the baselines or a change of an error
is not named (for CI).
"""

import argparse
import csv
import re
import statistics
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import fed_figures
import numpy as np

from claims.marked_table import with_table
from claims.numerics import changes_by_step
from gaitval._internal.io.text_tables import csv_text
from gaitval._internal.text.number_text import number, unit_sign
from gaitval.metrics.curve_results import OF_SKILL, RMSE
from gaitval.metrics.results import ErrorRow, Metrics, read_metrics
from gaitval.metrics.tolerances import Verdict
from gaitval.metrics.verdicts import bound_text, value_text
from gaitval.metrics.whole_error import (
    MeanError,
    changed_errors,
    error_name,
    mean_errors,
)

ROOT = Path(__file__).parents[2]
SAGITTAL: Final = ("hip_flexion", "knee_angle", "ankle_angle")
EXAMPLE: Final = "S05"
"""Whose errors README tells."""

ABOUT_ERRORS = """\
RMSE of mean curves, mean of both sides and of {people} people. *As measured*: from the curves of
the plates as they were. *Corrected*: from those of the corrected plates, which the walker was
given; the hip moments are about the hip centres of the measurement, which the fit finds, *about own
hips* about the walker's. *Correction*: what it changes in the measured curve. *Best prediction*:
for each curve the nearest of all predictions without a model, which are lines through other people
and the person's own other trials, copied or interpolated; it has the same freedom of hip centres.
*Nearer*: curves to which the walk is nearer.

**Nearer than the best prediction without a model: {nearer} of {curves} curves.** That prediction
meets {guess_deciding} of {deciding} limits on curves that decide, those on sagittal angles, and
{within} of all {judged}: the others are context, for nearness decides. Of all that decides, with
distance, falls and pushes, {accepted} of {all} values are met. {pushes} of {pushed} pushes of 300 N
were survived; {falls} of {walks} walks fell.
"""

TITLE = """# Accuracy by subject

`make subject S=5` makes each of these results, from the general policy, as for anybody else. `make
baseline S=5` stores it beside this page, and `docs/build/accuracy_tables.py` writes the page. Each
is a deterministic walk of the policy with the identified body, without pushes, compared with the
person's measured mean curves. Nothing but gravity and ground acts on it, by construction.
[tolerances.toml](../gaitval/metrics/tolerances.toml) has the limits and their sources,
[errors.csv](errors.csv) every mean error now and of the last release.
"""
ABOUT_LIMITS = """
*Best prediction*: for how many values that prediction would meet the limit.
"""
ABOUT_PEOPLE = """
*Narrowly*: met, but not in each of eight repeats of the walk (other starts, with noise), or not
with its whole 90 % interval, or not with one push less survived.
"""
ABOUT_CURVES = """\
RMSE, mean of both sides. **Bold**: on at least one side not nearer than the best prediction.
Moments and forces: as measured / corrected; of the hip also / about own hips.
"""
ABOUT_PUSHES = """\
300 N for 50 ms at the pelvis, from 25 directions within 90° of straight ahead, by phase of the
right gait cycle; in brackets the 90 % interval of the share. Survived: no fall within five gait
cycles.
"""


def load(root: Path) -> list[Metrics]:
    """The metrics of all baselines in `root`, by subject."""
    return [read_metrics(path) for path in sorted(root.glob("reports/S*/baseline/metrics.json"))]


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _digits(unit: str) -> int:
    return 3 if unit == "Nm/kg" else 2


def _mean(values: Sequence[float | None]) -> float:
    """Mean; every one is known of the ten people."""
    return statistics.fmean(each for each in values if each is not None)


def _name(row: ErrorRow) -> str:
    return error_name(RMSE[row.kind], row.curve)


def _deciding(metrics: Metrics) -> list[Verdict]:
    return [row for row in metrics.tolerances if row.role == "acceptance"]


def _skills(metrics: Metrics) -> dict[str, list[Verdict]]:
    """Rows of nearness by the name of the curve, of both sides."""
    found: dict[str, list[Verdict]] = {}
    for row in _deciding(metrics):
        if row.measure in OF_SKILL:
            kind = row.measure.removesuffix("_skill")
            found.setdefault(error_name(f"{kind}_rmse", row.target), []).append(row)
    return found


def _nearer(row: Verdict) -> bool:
    return "limit" not in row.failed_by


def _value(metrics: Metrics, measure: str, target: str) -> float:
    (value,) = [
        each.value
        for each in metrics.measures
        if (each.measure, each.target) == (measure, target) and each.value is not None
    ]
    return value


# --- all people ---------------------------------------------------------------------------


def error_table(people: Sequence[Metrics]) -> str:
    """One row a curve: its errors, the best prediction's, and how often the walk is nearer."""
    lines = []
    for rows in zip(*(each.summary.errors for each in people), strict=True):
        first = rows[0]
        assert {row.curve for row in rows} == {first.curve}
        near = [skill for each in people for skill in _skills(each).get(_name(first), ())]

        def cell(column: str, shown: bool = True, rows: Sequence[ErrorRow] = rows) -> str:
            mean = _mean([getattr(row, column) for row in rows]) if shown else None
            return number(mean, _digits(rows[0].unit))

        plates = first.kind != "angles"
        lines.append(
            [
                f"{_name(first)}, {unit_sign(first.unit)}",
                cell("as_measured", plates),
                cell("corrected"),
                cell("own_hips", first.of_hip),
                cell("correction", plates),
                cell("prediction", bool(near)),
                f"{sum(map(_nearer, near))} of {len(near)}" if near else "–",
            ]
        )
    headings = ("error", "as measured", "corrected", "about own hips", "correction")
    counts = [each.summary for each in people]
    pushes = [each.push_recovery for each in people if each.push_recovery is not None]
    survived = [each for found in pushes for phase in found.survived for each in phase]
    starts = [start for each in people for start in each.walk.starts]
    beside = [
        row.guess_within
        for each in people
        for row in _deciding(each)
        if row.measure in RMSE.values() and row.guess_within is not None
    ]
    about = ABOUT_ERRORS.format(
        people=len(people),
        nearer=sum(each.nearer for each in counts),
        curves=sum(each.curves for each in counts),
        within=sum(each.guess_within for each in counts),
        judged=sum(each.guess_judged for each in counts),
        guess_deciding=sum(beside),
        deciding=len(beside),
        accepted=sum(each.accepted for each in counts),
        all=sum(each.accepted + each.refused for each in counts),
        pushes=sum(survived),
        pushed=len(survived),
        falls=sum(start.fell for start in starts),
        walks=len(starts),
    )
    return table((*headings, "best prediction", "nearer"), lines) + "\n" + about


def reading(people: Sequence[Metrics]) -> str:
    """How README's table is to be read, with its figures."""
    one = next(each for each in people if each.subject.identifier == EXAMPLE)
    learned = [each.summary.learned for each in people if each.summary.learned is not None]
    shares = [share for each in learned for share in each.feed_forward]
    ratios = [each.ratio_before for each in learned]
    hips = [
        (_value(each, "moment_rmse_own_hips", curve), each.lights.moments[curve].guess_error)
        for each in people
        for curve in ("hip_flexion_r", "hip_flexion_l")
    ]
    farther = sum(error >= guess for error, guess in hips if guess is not None)
    plates = [each.record.plates for each in people if each.record.plates is not None]
    loads = [1.0 / each.scale for each in plates]
    apart = 100.0 * _mean([each.shift_right - each.shift_left for each in plates])
    errors = {
        measure: ", ".join(f"{_value(one, measure, f'{name}_r'):.3f}" for name in SAGITTAL)
        for measure in ("moment_rmse", "moment_rmse_as_measured")
    }
    summary = one.summary
    bullets = (
        f"""**This is a fit.** The walker was given the curves that it is compared with; moments fed
        forward explain {min(shares):.2f} to {max(shares):.2f} of the variance of its sagittal
        moments. [Fitted and predicted](docs/held-out.md) has what gaitval predicts from angles
        alone or at another speed; [Accuracy by subject](reports/README.md) has every person.""",
        f"""**The best prediction is good, too**: for {EXAMPLE} it meets {summary.guess_within} of
        {summary.guess_judged} limits on curves, and the walk is nearer in {summary.nearer} of
        {summary.curves}. It is chosen curve by curve with the measurement at hand.""",
        f"""**Hip moments are about the laboratory's hip centres**, which the fit finds. About the
        walker's own, {farther} of {len(hips)} hip flexion moments are farther off than the best
        prediction.""",
        f"""**The measured curves are corrected.** Mean vertical forces are {min(loads):.2f} to
        {max(loads):.2f} body weights, and the two plates are off by {apart:.1f} cm relative to each
        other ([how we know](docs/paper.md#force-plates-that-are-out-of-place)). Against the
        corrected right hip, knee and ankle moments {EXAMPLE}'s walker is {errors["moment_rmse"]}
        Nm/kg off; against those measured {errors["moment_rmse_as_measured"]}.""",
        f"""**The paper's criterion to stop**, ε below {learned[0].kappa:g} times that of the
        reference, holds for {sum(each.rule_met for each in learned)} of {len(ratios)} people before
        the correction: it is {min(ratios):.2f} to {max(ratios):.2f} times.""",
    )
    return "\n".join(f"* {' '.join(each.split())}" for each in bullets)


def limits_table(people: Sequence[Metrics]) -> str:
    """One row a limit that decides, beside nearness: how many values meet it, for how many the best
    prediction would, and the worst value.
    """
    by_limit: dict[str, list[tuple[str, Verdict]]] = {}
    for each in people:
        for row in _deciding(each):
            by_limit.setdefault(row.id, []).append((each.subject.identifier, row))
    lines = []
    for found in by_limit.values():
        first = found[0][1]
        sign = -1.0 if first.limit in ("at_least", "above") else 1.0
        whose, worst = max(found, key=lambda each, sign=sign: sign * (each[1].value or 0.0))  # type: ignore[misc]
        beside = [row.guess_within for _, row in found if row.guess_within is not None]
        lines.append(
            [
                first.title,
                bound_text(first, first.tolerance),
                f"{sum(row.passed for _, row in found)} of {len(found)}",
                f"{sum(beside)} of {len(beside)}" if beside else "–",
                f"{value_text(worst)} ({whose})",
            ]
        )
    headings = ("limit that decides", "", "met", "best prediction", "worst")
    return table(headings, lines) + ABOUT_LIMITS


# --- by person ----------------------------------------------------------------------------


def people_table(people: Sequence[Metrics]) -> str:
    """One row a person: how many limits and curves."""
    lines = []
    for each in people:
        rows, counts = _deciding(each), each.summary
        missed = {row.title for row in rows if not row.passed}
        failed = sorted({re.split(":| nearer| for ", name)[0] for name in missed})
        lines.append(
            [
                each.subject.identifier,
                each.subject.source,
                number(each.record.spatiotemporal.walking_speed),
                f"{counts.nearer} of {counts.curves}",
                f"{counts.accepted} of {counts.accepted + counts.refused}",
                f"{counts.not_shown}",
                f"{sum(bool(row.spread and row.spread.close) for row in rows)}",
                "; ".join(failed) or "none",
            ]
        )
    headings = ("subject", "trial", "m/s", "curves nearer", "limits met", "not shown", "narrowly")
    return table((*headings, "not met"), lines) + ABOUT_PEOPLE


def curves_table(people: Sequence[Metrics], kind: str) -> str:
    """One row a person, one column a curve of a `kind`."""
    lines = []
    for each in people:
        rows = [row for row in each.summary.errors if row.kind == kind]
        lines.append([each.subject.identifier, *(_cell(row, _skills(each)) for row in rows)])
    return table(("subject", *map(_name, rows)), lines)


def _cell(row: ErrorRow, skills: Mapping[str, Sequence[Verdict]]) -> str:
    values = [row.corrected]
    if row.kind != "angles":
        values.insert(0, row.as_measured)
    if row.kind == "moments" and row.curve.startswith("hip"):
        values.append(row.own_hips)
    text = " / ".join(number(value, _digits(row.unit)) for value in values)
    return text if all(map(_nearer, skills.get(_name(row), ()))) else f"**{text}**"


def pushes_table(people: Sequence[Metrics]) -> str:
    """Share of the directions in which the required push is survived, by phase."""
    lines = []
    for each in people:
        rows = [row for row in _deciding(each) if row.measure == "push_survival"]
        cells = []
        for row in rows:
            assert row.value is not None
            assert row.spread is not None
            assert row.spread.low is not None
            assert row.spread.high is not None
            text = f"{row.value:.0f} ({row.spread.low:.0f}–{row.spread.high:.0f})"
            cells.append(text if row.passed else f"**{text}**")
        lines.append([each.subject.identifier, *cells])
    return table(("subject", *(row.target for row in rows)), lines)


def report(people: Sequence[Metrics]) -> str:
    """The page reports/README.md."""
    sections = [
        ("All people", "", error_table(people) + "\n" + limits_table(people)),
        ("By person", "", people_table(people)),
        ("Angles, °", ABOUT_CURVES, curves_table(people, "angles")),
        ("Moments, Nm/kg", "", curves_table(people, "moments")),
        ("Ground reaction, % of body weight", "", curves_table(people, "forces")),
        ("Pushes: directions survived, %", ABOUT_PUSHES, pushes_table(people)),
    ]
    parts = [TITLE]
    for title, about, tables in sections:
        parts.append(f"## {title}\n\n" + (f"{about}\n" if about else "") + tables)
    return "\n".join(parts)


# --- errors now and of the last release ---------------------------------------------------


def errors_now(people: Sequence[Metrics]) -> dict[MeanError, float]:
    """Every mean error over `people`, with the digits that are stored."""
    found: dict[MeanError, list[float]] = {}
    for each in people:
        values = {(row.measure, row.target): row.value for row in each.measures}
        for error, value in mean_errors(values).items():
            found.setdefault(error, []).append(value)
    return {error: float(f"{_mean(values):.4g}") for error, values in found.items()}


def errors_released(root: Path) -> tuple[str, dict[MeanError, float]]:
    """The last release, and its mean errors, of `reports/errors.csv`."""
    with (root / "reports" / "errors.csv").open(encoding="utf-8", newline="") as file:
        (_, _, release, _), *rows = csv.reader(file)
    return release, {MeanError(name, unit): float(value) for name, unit, value, _ in rows if value}


def errors_text(
    release: str, before: Mapping[MeanError, float], now: Mapping[MeanError, float]
) -> str:
    """`reports/errors.csv`: mean errors of the last release and now."""
    rows = [
        [error.name, error.unit, before.get(error, ""), now.get(error, "")]
        for error in dict.fromkeys([*now, *before])
    ]
    return csv_text([["error", "unit", release, "now"], *rows])


def changes(before: Mapping[MeanError, float], now: Mapping[MeanError, float]) -> list[str]:
    """What of the errors changed by more than 3 %, in words."""
    found = [error.changed(*both) for error, both in changed_errors(before, now).items()]
    return found + [f"{error.name} not measured" for error in before if error not in now]


def unnamed(changed: Sequence[str], changelog: str) -> list[str]:
    """Those of the changes that the unreleased part of the changelog does not name with a reason in
    brackets.
    """
    _, _, rest = changelog.partition("\n## Unreleased\n")
    section = " ".join(rest.partition("\n## ")[0].split())
    return [each for each in changed if f"{each} (" not in section]


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


def pages(root: Path, people: Sequence[Metrics]) -> dict[Path, str]:
    """What has to be in each page."""
    readme = root / "README.md"
    text = readme.read_text(encoding="utf-8")
    text = with_table(text, "accuracy", error_table(people).rstrip("\n"))
    found = {
        root / "reports" / "README.md": report(people),
        readme: with_table(text, "reading", reading(people)),
    }
    values = fed_figures.claims()
    for page in sorted((root / "docs").rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        if "<!-- table 1: begin -->" in text:
            text = with_table(text, "table 1", fed_figures.people_table())
        if "<!-- time step: begin -->" in text:
            text = with_table(text, "time step", time_step_table().rstrip("\n"))
        found[page] = fed_figures.fed(text, values, str(page.relative_to(root)))
    return found


def main(arguments: Sequence[str] | None = None, root: Path = ROOT) -> int:
    """Write, or with --check compare, all pages."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail if out of date")
    parser.add_argument("--release", metavar="VERSION", help="what is there now is its errors")
    options = parser.parse_args(arguments)
    people = load(root)
    now = errors_now(people)
    release, before = errors_released(root)
    if options.release:
        release, before = options.release, now
    wanted = pages(root, people)
    wanted[root / "reports" / "errors.csv"] = errors_text(release, before, now)
    stale = [p for p, text in wanted.items() if not p.exists() or p.read_text("utf-8") != text]
    for path in stale:
        if options.check:
            sys.stderr.write(
                f"{path}: does not match the baselines or the claims. Run `make tables`.\n"
            )
        else:
            path.write_text(wanted[path], encoding="utf-8")
    changed = changes(before, now)
    for each in changed:
        print(f"since {release}: {each}")
    missing = unnamed(changed, (root / "CHANGELOG.md").read_text(encoding="utf-8"))
    for each in missing:
        sys.stderr.write(f"CHANGELOG.md, Unreleased: does not name with its reason: {each}\n")
    return int(options.check and bool(stale or missing))


if __name__ == "__main__":
    sys.exit(main())
