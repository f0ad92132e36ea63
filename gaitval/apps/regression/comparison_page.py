"""One report of many walks: tables by subject, curves side by side, and what changed between two
versions.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from gaitval._internal.io.artefacts import write_text
from gaitval._internal.io.text_tables import csv_text
from gaitval._internal.text.number_text import number
from gaitval.apps.regression.quantity_tables import (
    FIGURE_COLUMNS,
    WalkQuantities,
    curve_rows,
    figure_rows,
    figure_tables,
    quantities_of,
)
from gaitval.apps.regression.regression import Row, shown
from gaitval.apps.regression.versions import StoredWalk, Versions, in_margins
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.metrics.baselines import group_rows
from gaitval.metrics.curve_results import KINDS, Kind
from gaitval.metrics.origin import is_judged, measure_origin
from gaitval.metrics.results import Metrics
from gaitval.metrics.typed import array
from gaitval.metrics.verdicts import target_text
from gaitval.reporting.drawing import WIDTH, new_figure, svg
from gaitval.reporting.figures import COLOURS, NAMES, PERCENT, RECORD_COLOUR
from gaitval.reporting.page import write_page

CURVES: Final[tuple[tuple[Kind, str], ...]] = (
    *(("angles", name) for name in ("hip_flexion", "knee_angle", "ankle_angle")),
    *(("moments", name) for name in ("hip_flexion", "knee_angle", "ankle_angle")),
    *(("forces", name) for name in ("vertical", "forward", "medial")),
)
COLUMNS: Final = 5
SUBJECTS: Final = 10
"""Most columns of a table, so that it fits on a printed page, and panels of a drawing."""
_HEIGHTS: Final = {1: 1.6, 2: 2.0, 3: 1.7, 4: 1.45}
"""Inches of a row of panels by their number, where they are wider than those of `COLUMNS`."""
SHOWN: Final = 60
"""Most rows of what changed; all are in the CSV file."""
_KINDS: Final = {"angles": "angle", "moments": "moment", "forces": "force"}


def write_comparison(
    folder: Path, name: str, walks: Sequence[StoredWalk], versions: Versions | None
) -> None:
    """Write `name`.html, `name`.pdf, all measures as `name`.csv, all curves as `name`_curves.csv,
    and figures of quantities as `name`_figures.csv into `folder`, of at least one of `walks`; the
    same person may be there more than once. `versions` are the same walks matched with those
    before; None if nothing is compared with.
    """
    before = {} if versions is None else {id(pair.now): pair.before for pair in versions.pairs}
    labels = _labels(walks)
    groups = list(_groups(walks, labels))
    write_text(folder / f"{name}.csv", _measures_csv(walks, labels, versions))
    quantities = quantities_of(walks, labels, before)
    write_text(folder / f"{name}_curves.csv", _curves_csv(quantities, before))
    write_text(folder / f"{name}_figures.csv", csv_text([FIGURE_COLUMNS, *figure_rows(quantities)]))
    write_page(
        folder,
        name,
        "gaitval.apps.regression:comparison.html.j2",
        {
            "name": name,
            "walks": [_overview(walk, label) for walk, label in zip(walks, labels, strict=True)],
            "group_names": [row.group for row in group_rows(walks[0].metrics)],
            "group_units": [row.unit for row in group_rows(walks[0].metrics)],
            "groups": groups,
            "errors": [_before_and_after(walk.metrics) for walk in walks],
            "means": _mean_rows(groups, [walk.subject for walk in walks]),
            "figure_tables": figure_tables(quantities, most=SUBJECTS),
            "small_multiples": _drawings(walks, labels, before),
            "three_abreast": len(walks) == 1,
            "before": bool(before),
            "versions": None if versions is None else _versions(versions),
        },
    )


def _labels(walks: Sequence[StoredWalk]) -> list[str]:
    """The subject of each walk; where there is another of the same, with what they differ in: what
    the model was told, the speed, the version that walked, and if that is not enough the folder.
    """
    labels = []
    for place, walk in enumerate(walks):
        others = [
            each for other, each in enumerate(walks)
            if other != place and each.subject == walk.subject
        ]  # fmt: skip
        differs = [
            fact for number, fact in enumerate(_facts(walk))
            if any(_facts(other)[number] != fact for other in others)
        ]  # fmt: skip
        told_apart = all(_facts(other) != _facts(walk) for other in others)
        if others and not told_apart:
            differs.append(str(walk.folder))
        labels.append(f"{walk.subject} ({', '.join(differs)})" if differs else walk.subject)
    return labels


def _facts(walk: StoredWalk) -> tuple[str, ...]:
    """What may tell a walk from another of the same person, in words."""
    speed = walk.metrics.record.spatiotemporal.walking_speed
    return (
        f"told {_told(walk)}",
        "" if speed is None else f"{number(speed, 2)} m/s",
        f"gaitval {walk.metrics.provenance.versions.get('gaitval', 'not known')}",
    )


def _told(walk: StoredWalk) -> str:
    """What the model was told of the record."""
    every = walk.metrics.known
    known = [name for name, by in every.items() if by]
    return "all" if len(known) == len(every) else ", ".join(known) or "nothing"


def _overview(walk: StoredWalk, label: str) -> dict[str, Any]:
    metrics = walk.metrics
    pushes = metrics.push_recovery
    stood = None if pushes is None else [each for row in pushes.survived for each in row]
    return {
        "label": label,
        "source": metrics.subject.source,
        "told": _told(walk),
        "speed": metrics.record.spatiotemporal.walking_speed,
        "recorded": metrics.is_recorded_at_all,
        "accepted": metrics.summary.accepted,
        "judged": metrics.summary.accepted + metrics.summary.refused,
        "nearer": metrics.summary.nearer,
        "curves": metrics.summary.curves,
        "falls": sum(start.fell for start in metrics.walk.starts),
        "starts": len(metrics.walk.starts),
        "stood": None if stood is None else f"{sum(stood)} of {len(stood)}",
        "version": metrics.provenance.versions.get("gaitval", "not known"),
        "folder": str(walk.folder),
        "sealed": walk.margins is not None,
    }


def _groups(walks: Sequence[StoredWalk], labels: Sequence[str]) -> Iterator[dict[str, Any]]:
    """RMSE and skill of each group of curves, a row a walk."""
    for walk, label in zip(walks, labels, strict=True):
        cells = []
        for row in group_rows(walk.metrics):
            skills = list(row.skills().values())
            cells.append(
                {
                    "rmse": row.walked if is_judged(row.origin) else None,
                    "skill": skills[0] if skills else None,
                    "told": row.status == "fitted",
                    "digits": 3 if row.unit == "Nm/kg" else 2,
                }
            )
        yield {"label": label, "cells": cells}


def _before_and_after(metrics: Metrics) -> list[dict[str, Any]]:
    """Errors of moments and forces of a walk, by curve: as measured, corrected, own hips."""
    return [
        {
            "name": each.curve,
            "kind": each.kind,
            "unit": each.unit,
            "digits": 3 if each.unit == "Nm/kg" else 2,
            "values": [each.as_measured, each.corrected] + ([each.own_hips] if each.of_hip else []),
        }
        for each in metrics.summary.errors
        if each.kind != "angles"
    ]


def _mean_rows(groups: Sequence[Mapping[str, Any]], people: Sequence[str]) -> list[dict[str, Any]]:
    """Rows of mean and SD over the people (`people`, a name a row), of each column: of curves that
    the models were told by themselves, and of those that were held out; none for fewer than two.
    """
    rows = []
    for told, words in ((True, "fitted"), (False, "held out")):
        kept = [[cell if cell["told"] is told else None for cell in row["cells"]] for row in groups]
        walks = sum(any(cell is not None for cell in row) for row in kept)
        cells = [_mean(cells, people) for cells in zip(*kept, strict=True)]
        most = max((cell["people"] for cell in cells), default=0)
        if most > 1:
            rows.append({"words": words, "people": most, "walks": walks, "cells": cells})
    return rows


def _mean(cells: Sequence[Mapping[str, Any] | None], people: Sequence[str]) -> dict[str, Any]:
    """Mean and SD over the people of a column, and of how many; none where a walk was too short.
    Who walked more than once counts once, with the mean of those walks: they are not independent.
    """
    walked: dict[str, list[float | None]] = {}
    for person, cell in zip(people, cells, strict=True):
        if cell is not None:
            walked.setdefault(person, []).append(cell["rmse"])
    known = None not in [each for values in walked.values() for each in values]
    errors = [float(np.mean([e for e in v if e is not None])) for v in walked.values() if known]
    whole = len(errors) > 1
    return {
        "people": len(walked),
        "mean": float(np.mean(errors)) if whole else None,
        "sd": float(np.std(errors, ddof=1)) if whole else None,
        "digits": next((cell["digits"] for cell in cells if cell is not None), 2),
    }


def _versions(versions: Versions) -> dict[str, Any]:
    moved = [*versions.lost(), *versions.improved()]
    rows = [row for pair in versions.pairs for row in pair.rows]
    return {
        "pairs": [
            {
                "subject": pair.now.subject,
                "before": str(pair.before.folder),
                "now": str(pair.now.folder),
                "sealed": pair.before.margins is not None,
                "same_record": pair.same_record,
                **{
                    change: sum(row.change == change for row in pair.rows)
                    for change in ("lost", "improved", "kept", "new")
                },
            }
            for pair in versions.pairs
        ],
        "rows": [_moved(subject, row) for subject, row in moved[:SHOWN]],
        "more": max(0, len(moved) - SHOWN),
        "lost": len(versions.lost()),
        "improved": len(versions.improved()),
        "count": len(rows),
        "only_before": versions.only_before,
        "only_now": versions.only_now,
    }


def _moved(subject: str, row: Row) -> dict[str, Any]:
    grown = in_margins(row)
    return {
        "subject": subject,
        "measure": row.measure.replace("_", " "),
        "target": target_text(row.target),
        "before": shown(row.baseline),
        "now": shown(row.current),
        "unit": row.unit,
        "margin": f"{row.margin:g}",
        "grown": "" if grown is None or math.isinf(grown) else number(grown, 1),
        "lost": row.change == "lost",
    }


def _drawings(
    walks: Sequence[StoredWalk], labels: Sequence[str], before: Mapping[int, StoredWalk]
) -> list[dict[str, Any]]:
    """Each curve of all walks, a panel a walk."""
    found = []
    for kind, name in CURVES:
        parts = [
            _panels(
                walks[first : first + SUBJECTS],
                labels[first : first + SUBJECTS],
                *(kind, name, before, first),
            )
            for first in range(0, len(walks), SUBJECTS)
        ]
        found.append({"title": _title(walks, kind, name), "parts": parts})
    return found


def _title(walks: Sequence[StoredWalk], kind: Kind, name: str) -> str:
    """A quantity and its unit."""
    unit = walks[0].metrics.units.of(kind).replace("deg", "°")
    return f"{NAMES[name]}{'' if kind == 'angles' else ' ' + _KINDS[kind]}, {unit}"


def _panels(
    walks: Sequence[StoredWalk],
    labels: Sequence[str],
    kind: Kind,
    name: str,
    before: Mapping[int, StoredWalk],
    first: int,
) -> str:
    rows = -(-len(walks) // COLUMNS)
    columns = min(COLUMNS, len(walks))
    with new_figure(_HEIGHTS.get(columns, 1.25) * rows + 0.2, width=_width(len(walks))) as figure:
        axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
        for index, (axis, walk) in enumerate(zip(axes, walks, strict=False)):
            axis.set_title(_short(labels[index], first + index), loc="left", pad=2)
            _panel(axis, walk, kind, name, before.get(id(walk)))
        for axis in axes[len(walks) :]:
            axis.set_visible(False)
        axes[0].set_xlim(0, 100)
        axes[0].set_xticks([0, 50, 100])
        return svg(figure, f"{kind}-{name}-{first}")


def _width(walks: int) -> float:
    """Inches of a drawing with a panel for each walk; those of one walk stand three abreast."""
    return WIDTH / 3 if walks == 1 else WIDTH


def _short(name: str, number: int) -> str:
    """A name that is short and plain enough to be drawn; else the number of the walk in the table,
    with its person if that is short: the name comes from outside and may be long.
    """
    person, _, differs = name.partition(" (")
    for each, plain in ((name, not differs), (f"{number + 1}: {person}", bool(differs))):
        plain = plain and each.isascii() and all(c.isalnum() or c in "-_.: " for c in each)
        if plain and len(each) <= 14:
            return each.replace("_", "-")
    return str(number + 1)


def _panel(axis: Axes, walk: StoredWalk, kind: Kind, name: str, before: StoredWalk | None) -> None:
    axis.axhline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
    for side in SIDES:
        key = f"{name}_{side[0]}"
        recorded = walk.metrics.record.curves.of(kind)[key]
        style = "-" if side == "right" else (0, (3, 1.5))
        axis.plot(
            PERCENT, _array(recorded), color=RECORD_COLOUR, linewidth=1.7, linestyle=style, zorder=2
        )
        if before is not None:
            earlier = before.metrics.walk.curves.of(kind)[key].mean
            axis.plot(
                PERCENT, _array(earlier), color=COLOURS[side], linewidth=0.8,
                linestyle=(0, (1, 1.2)), zorder=3,
            )  # fmt: skip
        axis.plot(
            PERCENT, _array(walk.metrics.walk.curves.of(kind)[key].mean), color=COLOURS[side],
            linewidth=1.0, linestyle=style, zorder=4,
        )  # fmt: skip


def _array(values: Sequence[float | None] | None) -> Array:
    """A curve, nulls as NaN; nothing but NaN for a curve that is not there."""
    if values is None:
        return np.full(len(PERCENT), np.nan)
    return array(values)


def _measures_csv(
    walks: Sequence[StoredWalk], labels: Sequence[str], versions: Versions | None
) -> str:
    pairs = {} if versions is None else {id(pair.now): pair for pair in versions.pairs}
    lines: list[list[object]] = [
        [
            *("walk", "subject", "measure", "target", "unit", "comparison", "value"),
            *("before", "margin", "change", "compared_with"),
        ]
    ]
    for walk, label in zip(walks, labels, strict=True):
        how = {(m.measure, m.target): m.comparison for m in walk.metrics.measures}
        origins = walk.metrics.origins
        pair = pairs.get(id(walk))
        if pair is None:
            lines += [
                [
                    *(label, walk.subject, row.measure, row.target, row.unit),
                    *(row.comparison, row.value, None, None, None),
                    measure_origin(row.measure, row.target, origins),
                ]
                for row in walk.metrics.measures
            ]
            continue
        lines += [
            [
                *(label, walk.subject, row.measure, row.target, row.unit),
                *(how.get((row.measure, row.target)), row.current, row.baseline, row.margin),
                *(row.change, measure_origin(row.measure, row.target, origins)),
            ]
            for row in pair.rows
        ]
    return csv_text(lines)


def _curves_csv(walks: Sequence[WalkQuantities], before: Mapping[int, StoredWalk]) -> str:
    lines: list[list[object]] = [
        [
            *("walk", "quantity", "side", "percent", "unit"),
            *("recorded", "simulated", "sd", "before"),
        ]
    ]
    for each in walks:
        walk, label = each.walk, each.label
        earlier = before.get(id(walk))
        for kind in sorted(KINDS):
            unit = walk.metrics.units.of(kind)
            for key, curve in walk.metrics.walk.curves.of(kind).items():
                old = None if earlier is None else earlier.metrics.walk.curves.of(kind)[key].mean
                recorded = walk.metrics.record.curves.of(kind)[key]
                columns = (recorded, curve.mean, curve.sd, old)
                name, side = key[:-2], {"r": "right", "l": "left"}[key[-1]]
                lines += [
                    [label, f"{name} {_KINDS[kind]}", side, percent, unit]
                    + [None if column is None else column[percent] for column in columns]
                    for percent in PERCENT.tolist()
                ]
        lines += curve_rows(each)
    return csv_text(lines)
