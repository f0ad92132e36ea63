"""The page of a history: its figures over commits, and the commits at which they took a step."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from gaitval.apps.regression import change_points
from gaitval.apps.regression.change_points import CHANCE, LEAST, SIDE
from gaitval.apps.regression.history import UNKNOWN, Check, Key, series_of
from gaitval.apps.regression.history import CheckedFigure as Value
from gaitval.apps.regression.regression import shown
from gaitval.artefacts import write_text
from gaitval.metrics.verdicts import target_text
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.figures import RECORD_SHADE
from gaitval.reporting.page import write_page
from gaitval.text_tables import csv_text

COLUMNS: Final = 3
PANELS: Final = 9
"""Most panels of a drawing, so that drawings fill printed pages."""
_WORSE, _BETTER, _LINE = "#d55e00", "#0072b2", "#1a1a1a"
LABEL: Final = 40
"""Most characters of a title in a drawing."""
_SAME: Final = 1e-5
"""Relative; stored figures have six digits."""


@dataclass(frozen=True)
class FoundStep:
    """A step of one figure, or where it could no longer be measured, or could be again.

    Attributes
    ----------
    revision, time : of the first check after it.
    before, after : means; None where it was not measured.
    chance : as of a `change_points.Step`; 0 where a value is missing, which scatter does not do.
    last : the commit of the last check before it.
    change : "worse" or "better" if the means differ by more than the margin, or if there is no
        margin; else "within the margin".
    """

    subject: str
    measure: str
    target: str
    machine: str
    unit: str
    last: str
    revision: str
    time: str
    before: float | None
    after: float | None
    margin: float | None
    chance: float
    change: str


def find_steps(checks: Sequence[Check]) -> list[FoundStep]:
    """The steps in all series of a history (`checks`), in the order of their commits."""
    series = {
        key: measured
        for key, rows in series_of(checks).items()
        if len(measured := [row for row in rows if row[1].value is not None]) >= LEAST
    }
    order = {id(check): number for number, check in enumerate(checks)}
    found = [
        (order[id(rows[step.index][0])], _found(key, rows, step))
        for key, rows in series.items()
        for step in change_points.steps([_value(row) for row in rows], len(series))
    ]
    for key, rows in series_of(checks).items():
        found += [(order[id(rows[place][0])], _gap(key, rows, place)) for place in _gaps(rows)]
    return [each for _, each in sorted(found, key=lambda pair: pair[0])]


def _gaps(rows: Sequence[tuple[Check, Value]]) -> list[int]:
    """The first places from which a figure is not measured, or is again."""
    there = [figure.value is not None for _, figure in rows]
    return [place for place in range(1, len(there)) if there[place] != there[place - 1]]


def _gap(key: Key, rows: Sequence[tuple[Check, Value]], place: int) -> FoundStep:
    before, after = rows[place - 1][1].value, rows[place][1].value
    step = change_points.Step(place, before or 0.0, after or 0.0, 0.0)
    change = "worse" if after is None else "better"
    return replace(_found(key, rows, step), before=before, after=after, change=change)


def _value(row: tuple[Check, Value]) -> float:
    assert row[1].value is not None
    return row[1].value


def _found(key: Key, rows: Sequence[tuple[Check, Value]], step: change_points.Step) -> FoundStep:
    subject, measure, target, machine = key
    check, figure = rows[step.index]
    worse = step.after - step.before if figure.better == "lower" else step.before - step.after
    if abs(worse) <= (figure.margin or 0.0):
        change = "within the margin"
    else:
        change = "worse" if worse > 0.0 else "better"
    return FoundStep(
        subject=subject,
        measure=measure,
        target=target,
        machine=machine,
        unit=figure.unit,
        last=rows[step.index - 1][0].revision,
        revision=check.revision,
        time=check.time,
        before=step.before,
        after=step.after,
        margin=figure.margin,
        chance=step.chance,
        change=change,
    )


def write_history(folder: Path, name: str, checks: Sequence[Check]) -> list[FoundStep]:
    """Write the page of a history (`checks`) into `folder` as `name`.html, `name`.pdf and, with all
    values, `name`.csv; returns the steps, as `find_steps`.
    """
    steps = find_steps(checks)
    groups = series_of(checks)
    longest = max(len(rows) for rows in groups.values()) if groups else 0
    write_text(folder / f"{name}.csv", csv_text(_rows(checks)))
    write_page(
        folder,
        name,
        "gaitval.apps.regression:history.html.j2",
        {
            "name": name,
            "checks": [_row(check) for check in checks],
            "latest": _row(checks[-1]) if checks else None,
            "unknown": sum(not _is_known(check) for check in checks),
            "steps": [_step_row(step) for step in steps],
            "panels": _drawn(checks, groups, steps),
            "unchanged": _unchanged(groups),
            "few": [key for key, rows in groups.items() if len(rows) < LEAST],
            "series": len(groups),
            "longest": longest,
            "least": LEAST,
            "side": SIDE,
            "chance": CHANCE,
        },
    )
    return steps


def short(revision: str) -> str:
    """A commit (`revision`) as shown: eight characters, and whether the tree had changes."""
    return revision if len(revision) <= 12 else revision[:8] + ("+" if revision[-1] == "+" else "")


def _row(check: Check) -> dict[str, Any]:
    return {
        "revision": short(check.revision),
        "known": _is_known(check),
        "time": check.time[:16].replace("T", " "),
        "machine": check.machine,
        "subject": check.subject or "benchmarks",
        "figures": len(check.figures),
        "lost": sum(map(_lost, check.figures)) if check.kind == "check" else None,
    }


def _is_known(check: Check) -> bool:
    """Whether a check knows its commit."""
    return check.revision.rstrip("+") != UNKNOWN


def _lost(figure: Value) -> bool:
    """Whether a figure is worse than in its baseline by more than its margin."""
    if figure.stored is None or figure.margin is None:
        return False
    if figure.value is None:
        return True
    worse = (
        figure.value - figure.stored if figure.better == "lower" else figure.stored - figure.value
    )
    return worse > figure.margin


def _step_row(step: FoundStep) -> dict[str, Any]:
    return {
        "revision": short(step.revision),
        "last": short(step.last),
        "subject": step.subject or "benchmark",
        "measure": "" if not step.subject else step.measure.replace("_", " "),
        "target": target_text(step.target) if step.subject else step.target,
        "before": shown(step.before),
        "after": shown(step.after),
        "unit": step.unit,
        "margin": "" if step.margin is None else f"{step.margin:g}",
        "chance": _chance(step),
        "change": step.change,
    }


def _chance(step: FoundStep) -> str:
    if None in (step.before, step.after):
        return ""
    return f"{step.chance:.1g}" if step.chance >= 1e-6 else "< 0.000001"


def _varies(rows: Sequence[tuple[Check, Value]]) -> bool:
    values = [row[1].value for row in rows]
    if None in values:
        return values.count(None) < len(values)
    data = np.array(values, dtype=float)
    return bool(np.ptp(data) > _SAME * np.abs(data).max())


def _unchanged(groups: Mapping[Key, Sequence[tuple[Check, Value]]]) -> int:
    return sum(not _varies(rows) for rows in groups.values())


def _drawn(
    checks: Sequence[Check],
    groups: Mapping[Key, Sequence[tuple[Check, Value]]],
    steps: Sequence[FoundStep],
) -> list[dict[str, Any]]:
    """A drawing for each subject and machine, with a panel for each measure that ever changed."""
    revisions = list(dict.fromkeys(check.revision for check in checks))
    at = {revision: number for number, revision in enumerate(revisions)}
    drawings = []
    varying = {key: rows for key, rows in groups.items() if _varies(rows)}
    keys = sorted(varying, key=lambda key: (key[0] == "", key[0], key[3]))
    for number, ((subject, machine), of_one) in enumerate(
        groupby(keys, key=lambda key: (key[0], key[3]))
    ):
        panels: dict[str, list[Key]] = {}
        for key in of_one:
            # each benchmark has a scale of its own
            panels.setdefault(key[1] if subject else key[2], []).append(key)
        names = list(panels)
        parts = [names[first : first + PANELS] for first in range(0, len(names), PANELS)]
        drawings.append(
            {
                "title": subject or "Benchmarks",
                "machine": machine,
                "panels": names,
                "drawings": [
                    _small_multiples(
                        {name: panels[name] for name in part},
                        varying, steps, at, revisions, f"history{number}-{count}-",
                        first=1 + count * PANELS,
                    )
                    for count, part in enumerate(parts)
                ],
            }
        )  # fmt: skip
    return drawings


def _small_multiples(
    panels: Mapping[str, Sequence[Key]],
    groups: Mapping[Key, Sequence[tuple[Check, Value]]],
    steps: Sequence[FoundStep],
    at: Mapping[str, int],
    revisions: Sequence[str],
    name: str,
    *,
    first: int,
) -> str:
    rows = -(-len(panels) // COLUMNS)
    with new_figure(1.35 * rows + 0.3) as figure:
        axes = figure.subplots(rows, COLUMNS, squeeze=False, sharex=True).ravel()
        for index, (axis, (title, keys)) in enumerate(zip(axes, panels.items(), strict=False)):
            # names from outside are not drawn: matplotlib would read them as mathematics
            unit = groups[keys[0]][0][1].unit if keys[0][0] else "s"
            label = title.replace("_", " ") if keys[0][0] else f"benchmark {first + index}"
            axis.set_title(f"{_plain(label)}, {_plain(unit)}", loc="left")
            _panel(axis, keys, groups, steps, at)
        for axis in axes[len(panels) :]:
            axis.set_visible(False)
        last = len(revisions) - 1
        for axis in axes:
            axis.set_xlim(-0.5, last + 0.5)
            axis.set_xticks([0, last] if last else [0])
            axis.set_xticklabels(
                [_plain(short(revisions[n])) for n in ([0, last] if last else [0])]
            )
            axis.tick_params(labelbottom=True)
        # text in it comes from commits and units: svg() draws it as outlines
        return svg(figure, name)


def _plain(text: str) -> str:
    """Text that matplotlib draws as it is, and that does not spread over a page."""
    return "".join(each for each in text[:LABEL] if each.isprintable() and each not in "$\\")


def _panel(
    axis: Axes,
    keys: Sequence[Key],
    groups: Mapping[Key, Sequence[tuple[Check, Value]]],
    steps: Sequence[FoundStep],
    at: Mapping[str, int],
) -> None:
    for key in keys:
        rows = groups[key]
        places = [at[check.revision] for check, _ in rows]
        values = [np.nan if value.value is None else value.value for _, value in rows]
        mine = [
            step for step in steps
            if (step.subject, step.measure, step.target, step.machine) == key
        ]  # fmt: skip
        axis.plot(
            places, values, color=_LINE if mine else RECORD_SHADE, zorder=3 if mine else 2,
            linestyle="-" if mine else (0, (1, 1.5)), linewidth=1.0, marker="o", markersize=2.2,
        )  # fmt: skip
        for step in mine:
            axis.axvline(
                at[step.revision] - 0.5,
                color=_WORSE if step.change == "worse" else _BETTER,
                linestyle="-" if step.change == "worse" else (0, (3, 2)),
                linewidth=0.9,
                zorder=1,
            )


def _rows(checks: Sequence[Check]) -> Iterator[tuple[object, ...]]:
    """All values, a row each, below a header."""
    yield (
        *("commit", "commit_time", "time", "machine", "subject", "measure", "target"),
        *("unit", "value", "stored", "margin"),
    )
    for check in checks:
        about = (check.revision, check.revised, check.time, check.machine, check.subject)
        for figure in check.figures:
            numbers = (figure.value, figure.stored, figure.margin)
            yield (*about, figure.measure, figure.target, figure.unit, *numbers)
