"""The first page of a report: what decides, on one sheet of paper.

Every number on it is a `Cell`, which says where it was read: a place in `metrics.json`
("metrics.json#/summary/accepted"), in `subject.toml`, among the norms of the person's speed and age
("norms#parameter/cadence/mean") or among the controls of the Gait Profile Score. A number made of
several has all their places and how it was made; tests/reporting/test_sheet.py makes each anew.
"""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Final, NamedTuple

from gaitval.coordinates import SIDES, split_side
from gaitval.datasets.subject import Subject
from gaitval.metrics.groups import group_curves, group_rows
from gaitval.metrics.norms import norms
from gaitval.metrics.origin import curve_origin, not_recorded
from gaitval.metrics.results import METRICS, Metrics
from gaitval.metrics.verdicts import LimitVerdict, failed_limits, limit_verdicts, unit_text
from gaitval.reporting.facts import at

WARNINGS: Final = 3
"""Shown, the gravest first."""
FAILED_SHOWN: Final = 6
"""Failed limits that the sheet lists; it counts the others."""
PLATES_UNCERTAIN: Final = 0.02
"""Share of the force by which plates may be wrong before the sheet says so."""


class Cell(NamedTuple):
    """A number and where it is from.

    Attributes
    ----------
    digits : decimals; -1 for three figures.
    source : "file#place", several apart by spaces.
    how : what is made of them: "mean", "sum", "count", or as the test names it.
    scale : the printed number over the one made.
    """

    value: float | None
    digits: int
    source: str
    how: str = ""
    scale: float = 1.0

    @property
    def shown(self) -> float | None:
        """The number as printed."""
        return None if self.value is None else self.scale * self.value


class SheetWarning(NamedTuple):
    """Why the verdict may mislead: the template has its words and what would help, by `kind`."""

    kind: str
    cells: Mapping[str, Cell] = MappingProxyType({})
    words: Mapping[str, str] = MappingProxyType({})


def _read(metrics: Metrics, *pointers: str, digits: int, how: str = "", scale: float = 1.0) -> Cell:
    """The number at a place in `metrics`, or one made of several."""
    found = [at(metrics, pointer) for pointer in pointers]
    known = [float(each) for each in found if isinstance(each, int | float)]
    value = None
    if len(known) == len(found):
        value = sum(known) / (len(known) if how == "mean" else 1)
    places = " ".join(f"{METRICS}#{pointer}" for pointer in pointers)
    return Cell(value, digits, places, how, scale)


def _count(value: int, how: str) -> Cell:
    return Cell(value, 0, f"{METRICS}#/tolerances", how)


def sheet(metrics: Metrics, subject: Subject) -> dict[str, object]:
    """What the template of the sheet shows of a run of `subject` with the results `metrics`."""
    failed = failed_limits(metrics)
    counts = {
        f"{which}_{role}": _count(
            sum(which == "all" or not each.passed for each in limit_verdicts(metrics, role)),
            f"{which} limits {role}",
        )
        for role in ("acceptance", "context")
        for which in ("all", "failed")
    }
    return {
        "counts": counts,
        "accepted": _read(metrics, "/summary/accepted", digits=0),
        "judged": _read(metrics, "/summary/accepted", "/summary/refused", digits=0, how="sum"),
        "repeats": _repeats(metrics),
        "failed": [_failed(metrics, each) for each in failed[:FAILED_SHOWN]],
        "more": _count(max(0, len(failed) - FAILED_SHOWN), "unlisted limits"),
        "known": ["speed", *(name for name, by in metrics.told.items() if by)],
        "held_out": [name for name in metrics.recorded if not metrics.told[name]],
        "skills": _skills(metrics),
        "parameters": _parameters(metrics, subject),
        "doubts": list(_warnings(metrics, subject, failed))[:WARNINGS],
        "profile": _profile(metrics),
        "people": [
            Cell(norm.people, 0, f"norms#{name}/people")
            for name in ("parameter/cadence", "parameter/stance_fraction")
            if (norm := norms(subject).get(name)) is not None
        ],
    }


def _repeats(metrics: Metrics) -> dict[str, Cell]:
    """The weakest accepted value over the walks from other starts, and the pushes survived."""
    rows = [
        (index, row)
        for index, row in enumerate(metrics.tolerances)
        if row.role == "acceptance" and row.spread is not None
    ]
    found = {}
    walks = [(i, row.spread) for i, row in rows if row.measure != "push_survival" and row.spread]
    if walks:
        index, _ = min(walks, key=lambda pair: pair[1].kept / max(1, pair[1].repeats))
        for name in ("kept", "repeats"):
            found[name] = _read(metrics, f"/tolerances/{index}/spread/{name}", digits=0)
    pushes = [index for index, row in rows if row.measure == "push_survival"]
    if pushes:
        for name in ("kept", "repeats"):
            places = [f"/tolerances/{index}/spread/{name}" for index in pushes]
            found[f"pushes_{name}"] = _read(metrics, *places, digits=0, how="sum")
    return found


def _failed(metrics: Metrics, limit: LimitVerdict) -> dict[str, object]:
    worst = limit.worst
    index = next(i for i, row in enumerate(metrics.tolerances) if row is worst)
    return {
        "role": worst.role,
        "title": worst.title,
        "value": _read(metrics, f"/tolerances/{index}/value", digits=-1),
        "limit": _read(metrics, f"/tolerances/{index}/tolerance", digits=-1),
        "sign": limit.limit_text().split()[0],
        "unit": unit_text(worst.unit).strip(),
        "failed": _count(len(limit.failed), f"failed rows {worst.id}"),
        "all": _count(len(limit.rows), f"all rows {worst.id}"),
        "remedy": limit.remedy,
    }


def _skills(metrics: Metrics) -> list[dict[str, object]]:
    """Mean RMSE of each group of curves: the walk's, the first guess's, and the skill."""
    rows: list[dict[str, object]] = []
    for row in group_rows(metrics):
        kind, every, unit = group_curves(metrics)[row.group]
        recorded = [c for c in every if curve_origin(kind, c, metrics.origins) == "recorded"]
        curves, digits = recorded or list(every), 3 if unit == "Nm/kg" else 1
        walk = [f"/walks/{metrics.final}/errors/{kind}/{curve}/rmse" for curve in curves]
        guess = [f"/predictions/0/rmse/{kind}/{curve}" for curve in curves]
        name = metrics.predictions[0].name if metrics.predictions else None
        cells = None
        if name is not None and recorded:
            both = " ".join(f"{METRICS}#{pointer}" for pointer in (*walk, *guess))
            cells = {
                "guess": _read(metrics, *guess, digits=digits, how="mean"),
                "skill": Cell(row.skills()[name], 2, both, "skill"),
            }
        walked = Cell(row.walked, digits, " ".join(f"{METRICS}#{p}" for p in walk), "mean")
        rows.append({"group": row.group, "unit": unit, "walk": walked, "cells": cells})
    return rows


def _parameters(metrics: Metrics, subject: Subject) -> list[dict[str, object]]:
    """Spatiotemporal parameters of walk and record, and their norm."""
    normal = norms(subject)
    rows: list[dict[str, object]] = []
    for index, row in enumerate(metrics.walk.spatiotemporal):
        place = f"/walks/{metrics.final}/spatiotemporal/{index}"
        share = 100.0 if row.unit == "1" else 1.0
        digits = {"1": 1, "steps/min": 1}.get(row.unit, 2)
        side = next((each for each in SIDES if row.name.endswith(f"_{each}")), None)
        plain = row.name.removesuffix(f"_{side}")
        label = plain.removesuffix("_fraction").replace("_", " ").capitalize()
        norm = f"parameter/{plain}"
        rows.append(
            {
                "label": f"{label}, {side}" if side else label,
                "unit": "% of cycle" if row.unit == "1" else row.unit,
                **{
                    name: _read(metrics, f"{place}/{at}", digits=digits, scale=share)
                    for name, at in (
                        ("mean", "mean"),
                        ("sd", "sd"),
                        ("recorded", "recorded" if row.predicted is None else "predicted"),
                    )
                },
                **{
                    f"norm_{name}": Cell(
                        float(getattr(normal[norm], name)) if norm in normal else None,
                        *(digits, f"norms#{norm}/{name}", "", share),
                    )
                    for name in ("mean", "sd")
                },
            }
        )
    return rows


def _profile(metrics: Metrics) -> dict[str, object] | None:
    """Movement Analysis Profile and Gait Profile Score by side, of record, walk and controls."""
    if metrics.curve_statistics is None:
        return None
    from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls

    profiles, place = metrics.curve_statistics.profiles, "/curve_statistics/profiles"
    controls, names = load_controls(), profiles.variables
    rows = []
    for side in SIDES:
        for which in ("record", "walk"):
            if which == "record" and profiles.record is None:
                continue
            cells = [
                _read(metrics, f"{place}/{which}/scores/{name}_{side[0]}", digits=1)
                for name in names
            ]
            total = _read(metrics, f"{place}/{which}/{side}", digits=1)
            rows.append({"side": side, "which": which, "cells": [*cells, total]})
    # of fewer angles than theirs a score says nothing beside theirs
    scored = controls.side if len(names) == len(PROFILE_ANGLES) else (None, None)
    both = [*((name, controls.scores[name]) for name in names), ("side", scored)]
    healthy = [[Cell(each[i], 1, f"controls#{n}/{i}") for n, each in both] for i in range(2)]
    return {"names": [*names, "total"], "rows": rows, "healthy": healthy}


def _warnings(
    metrics: Metrics, subject: Subject, failed: Sequence[LimitVerdict]
) -> Iterator[SheetWarning]:
    """All that speaks against trusting the verdict, the gravest first: what decides it, what it
    compares with, and what the record itself lacks.
    """
    decisive = [each for each in failed if each.first.role == "acceptance"]
    if decisive:
        yield SheetWarning("failed", {"count": _count(len(decisive), "failed limits acceptance")})
    if metrics.witness is not None and metrics.witness.fell:
        yield SheetWarning("falls there")
    close = sum(len(each.close) for each in limit_verdicts(metrics, "acceptance"))
    if close:
        yield SheetWarning("narrow", {"count": _count(close, "close acceptance")})
    missing = sorted({name for name, *_ in not_recorded(metrics.origins)})
    if not metrics.is_recorded_at_all:
        yield SheetWarning("nothing recorded")
    elif missing:
        yield SheetWarning("not recorded", words={"what": ", ".join(missing)})
    if metrics.told.get("forces"):
        yield SheetWarning("fit")
    yield from _of_score(metrics)
    plates = metrics.record.plates
    if plates is not None and abs(plates.scale - 1.0) > PLATES_UNCERTAIN:
        place = f"{METRICS}#/record/plates/scale"
        yield SheetWarning("plates", {"off": Cell(plates.scale - 1.0, 1, place, "less one", 100.0)})
    below = [row for row in metrics.measures if row.measure.endswith("_skill")]
    worse = sum(row.value is not None and row.value < 0.0 for row in below)
    if worse:
        cells = {"worse": worse, "all": len(below)}
        yield SheetWarning(
            "guess",
            {k: Cell(v, 0, f"{METRICS}#/measures", f"{k} skills") for k, v in cells.items()},
        )
    if not subject.uncertainty:  # an import keeps how much the strides differ
        yield SheetWarning("one cycle")
    if metrics.identification is not None:
        verdicts = metrics.identification.verdicts
        cells = {"identified": verdicts.count("identified"), "all": len(verdicts)}
        place = f"{METRICS}#/identification/verdicts"
        yield SheetWarning(
            "parameters", {k: Cell(v, 0, place, f"{k} verdicts") for k, v in cells.items()}
        )


def _of_score(metrics: Metrics) -> Iterator[SheetWarning]:
    """A side whose Gait Profile Score differs from the record's by what matters clinically."""
    statistics = metrics.curve_statistics
    if statistics is None or statistics.profiles.record is None:
        return
    from gaitval.metrics.gait_profile import SMALLEST_DIFFERENCE

    record, walk = statistics.profiles.record, statistics.profiles.walk
    side = max(SIDES, key=lambda each: abs(walk.of(each) - record.of(each)))
    away = walk.of(side) - record.of(side)
    if abs(away) >= SMALLEST_DIFFERENCE:
        place = f"{METRICS}#/curve_statistics/profiles"
        both = f"{place}/walk/{side} {place}/record/{side}"
        worst = max(record.scores, key=lambda key: abs(walk.scores[key] - record.scores[key]))
        of, name = split_side(worst)
        words = {"side": side, "angle": name, "angle_side": of}
        yield SheetWarning("score", {"away": Cell(away, 1, both, "difference")}, words)
