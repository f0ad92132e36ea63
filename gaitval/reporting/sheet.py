"""The first page of a report: what decides, on one sheet of paper."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, NamedTuple

from gaitval._internal.text.number_text import number, rough, unit_text
from gaitval.coordinates import SIDES, Side, split_side
from gaitval.metrics.curve_results import CURVE_UNITS, OF_SKILL, CurveLight, Kind, Light, Reason
from gaitval.metrics.norms import norms
from gaitval.metrics.origin import curve_origin, not_recorded
from gaitval.metrics.results import ErrorRow, Learned, Metrics
from gaitval.metrics.verdicts import (
    GUESSES,
    LimitVerdict,
    counted_limits,
    failed_limits,
    target_text,
)
from gaitval.reporting.grids import curve_name, panel_name
from gaitval.reporting.tables import CURVES
from gaitval.subjects.subject import Subject

WARNINGS: Final = 2
"""Shown, the gravest first."""
FAILED_SHOWN: Final = 3
"""Failed limits that the sheet lists; it counts the others."""
PLATES_UNCERTAIN: Final = 0.02
"""Share of the force by which plates may be wrong before the sheet says so."""


class Cell(NamedTuple):
    """A number and how it is printed.

    Attributes
    ----------
    digits : decimals; below zero, as many figures that count, without zeros at the end.
    """

    value: float | None
    digits: int = 0

    @property
    def text(self) -> str:
        """The number as printed, with a decimal point; a dash if there is none."""
        if self.digits >= 0:
            return number(self.value, self.digits)
        text = rough(self.value, -self.digits)
        return text.rstrip("0").rstrip(".") if "." in text else text


class SheetWarning(NamedTuple):
    """Why the verdict may mislead: the template has its words and what would help, by `kind`."""

    kind: str
    cells: Mapping[str, Cell] = MappingProxyType({})
    words: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True)
class Sheet:
    """What the template of the sheet shows.

    Attributes
    ----------
    counts : "all" and "failed" limits of each role.
    accepted, judged : values of the walk.
    repeats : "kept" of "repeats", of the weakest accepted value and of pushes.
    failed, more : failed limits, and how many are not listed.
    known, held_out : what of the measurements was used as input.
    wrong : how far predictions of held-out trials were off, unit and group; empty where the walk
        is held against a measurement.
    profile : None with fewer than two gait cycles.
    people : behind the healthy columns.
    push_off : of each ankle, "walk", "record" and how much "more" the walk does, %.
    reasons : why curves may not simply be believed.
    known_to : of the errors of groups of curves, by "record", "time_step", "second_engine".
    nearer : to how many "curves" the walk is "nearer" than any prediction without a model, and how
        many limits of "judged" the best one meets, "within".
    errors : of moments and forces, before and after the correction of the plates.
    moved : how far the correction moved the plates forward, mm, by side; empty without any.
    learned : None without a study's stages.
    """

    counts: Mapping[str, Cell]
    accepted: Cell
    judged: Cell
    repeats: Mapping[str, Cell]
    failed: Sequence["FailedLimit"]
    more: Cell
    known: Sequence[str]
    held_out: Sequence[str]
    wrong: Sequence[tuple[Cell, str, str]]
    parameters: Sequence["SheetParameter"]
    warnings: Sequence[SheetWarning]
    profile: "Profile | None"
    people: Mapping[str, Cell]
    push_off: Mapping[Side, Mapping[str, Cell]]
    lights: Mapping[str, Sequence["LightRow"]]
    reasons: Sequence["Why"]
    known_to: Mapping[str, Sequence[tuple[Cell, str]]]
    nearer: Mapping[str, Cell]
    errors: Sequence["ErrorCells"]
    moved: Mapping[Side, Cell]
    learned: Learned | None


def sheet(metrics: Metrics, subject: Subject, extensor_positive: bool = False) -> Sheet:
    """The sheet of a run of `subject` with the results `metrics`. Moments are called as they are
    drawn.
    """
    failed = failed_limits(metrics)
    counts = {
        f"{which}_{role}": Cell(
            sum(which == "all" or not each.passed for each in counted_limits(metrics, role))
        )
        for role in ("acceptance", "context")
        for which in ("all", "failed")
    }
    return Sheet(
        counts=counts,
        accepted=Cell(metrics.summary.accepted),
        judged=Cell(metrics.summary.accepted + metrics.summary.refused),
        repeats=_repeats(metrics),
        failed=[_failed(each) for each in failed[:FAILED_SHOWN]],
        more=Cell(max(0, len(failed) - FAILED_SHOWN)),
        known=_known(metrics, subject),
        wrong=_wrong(metrics),
        held_out=[name for name in metrics.recorded if not metrics.known[name]],
        parameters=_parameters(metrics, subject),
        warnings=list(_warnings(metrics, subject))[:WARNINGS],
        profile=_profile(metrics),
        people=_people(metrics, subject),
        push_off=_push_off(metrics),
        lights=_lights(metrics, extensor_positive),
        reasons=_reasons(metrics, extensor_positive),
        known_to=_known_to(metrics),
        nearer={
            "nearer": Cell(metrics.summary.nearer),
            "curves": Cell(metrics.summary.curves),
            "within": Cell(metrics.summary.guess_within),
            "judged": Cell(metrics.summary.guess_judged),
        },
        errors=[
            _error_cells(row, extensor_positive)
            for row in metrics.summary.errors
            if row.kind != "angles"
        ],
        moved=_moved(metrics),
        learned=metrics.summary.learned,
    )


def _known(metrics: Metrics, subject: Subject) -> list[str]:
    """What of the measurements was used as input: a prediction is made from the other trials."""
    read = [name for name, by in metrics.known.items() if by]
    others = [each.name for each in subject.trials]
    if not metrics.is_recorded_at_all:
        others.insert(0, subject.trial)
    return ["speed", *(read or ([f"trials {', '.join(others)}"] if others else []))]


def _wrong(metrics: Metrics) -> list[tuple[Cell, str, str]]:
    errors = metrics.prediction_errors
    if errors is None or metrics.is_recorded_at_all:
        return []
    return [
        (Cell(row.mean, -2), row.unit, row.group) for row in errors.groups if row.group in _KNOWN
    ]


class ErrorCells(NamedTuple):
    """Errors of a moment or a force, mean of both sides."""

    kind: Kind
    name: str
    as_measured: Cell
    corrected: Cell
    own_hips: Cell
    correction: Cell
    prediction: Cell


def _error_cells(row: ErrorRow, extensor_positive: bool) -> ErrorCells:
    digits = 3 if row.kind == "moments" else 2
    return ErrorCells(
        kind=row.kind,
        name=panel_name(row.kind, row.curve, extensor_positive),
        as_measured=Cell(row.as_measured, digits),
        corrected=Cell(row.corrected, digits),
        own_hips=Cell(row.own_hips if row.of_hip else None, digits),
        correction=Cell(row.correction, digits),
        prediction=Cell(row.prediction, digits),
    )


def _moved(metrics: Metrics) -> dict[Side, Cell]:
    """How far the correction moved each plate forward, mm."""
    plates = metrics.record.plates
    if plates is None:
        return {}
    return {side: Cell(1000.0 * getattr(plates, f"shift_{side}")) for side in SIDES}


def _repeats(metrics: Metrics) -> dict[str, Cell]:
    """The weakest accepted value over the walks from other starts, and the pushes survived."""
    spreads = [
        (row.measure == "push_survival", row.spread)
        for row in metrics.tolerances
        if row.role == "acceptance" and row.spread is not None
    ]
    found = {}
    if walks := [spread for pushed, spread in spreads if not pushed]:
        weakest = min(walks, key=lambda spread: spread.kept / max(1, spread.repeats))
        found = {"kept": Cell(weakest.kept), "repeats": Cell(weakest.repeats)}
    if pushes := [spread for pushed, spread in spreads if pushed]:
        found["pushes_kept"] = Cell(sum(spread.kept for spread in pushes))
        found["pushes_repeats"] = Cell(sum(spread.repeats for spread in pushes))
    return found


class FailedLimit(NamedTuple):
    """A failed limit by its worst row: what that `missed` if it is not the limit itself, `value`
    and `limit` (`sign` before it), and how many rows `failed` of `all`.
    """

    role: str
    title: str
    value: Cell
    limit: Cell
    missed: str | None
    sign: str
    unit: str
    failed: Cell
    all: Cell
    remedy: str


def _failed(limit: LimitVerdict) -> FailedLimit:
    """A failed limit: the limit itself, the prediction that is nearer, or what the measured curve
    is known to, with the value on its other side.
    """
    worst, unit = limit.worst, unit_text(limit.worst.unit).strip()
    missed: str = next(iter(worst.failed_by), "limit")
    value, bound, sign = worst.value, worst.tolerance, limit.limit_text().split()[0]
    if worst.guess is not None:
        missed = "measurement" if "record" in worst.failed_by else "prediction"
        unit = unit_text(CURVE_UNITS[OF_SKILL[worst.measure]]).strip()
        value, sign = worst.guess.walk, "<"
        bound = worst.guess.error if missed == "prediction" else worst.known or 0.0
    return FailedLimit(
        role=worst.role,
        title=worst.title
        if worst.guess is None
        else f"{worst.title.removesuffix(' without a model')}: {target_text(worst.target)}",
        value=_beside(limit, Cell(value, -2)),
        limit=Cell(bound, -3 if missed == "limit" else -2),
        missed=None if missed == "limit" else missed,
        sign=sign,
        unit=unit,
        failed=Cell(len(limit.failed)),
        all=Cell(len(limit.rows)),
        remedy=_remedy(limit),
    )


def _remedy(limit: LimitVerdict) -> str:
    """What to do about a failed `limit`: in the place of curves that something is nearer to, use
    that.
    """
    worst = limit.worst
    if worst.guess is None:
        return limit.remedy
    kind, best = OF_SKILL[worst.measure], worst.guess.guess
    return f"For {kind} marked ○ use the measurement, or {GUESSES.get(best, best).rstrip(',')}."


def _beside(limit: LimitVerdict, cell: Cell) -> Cell:
    """The `cell` with as many figures as it takes to see on which side of its `limit` it is."""
    bound = limit.worst.tolerance
    value = cell.value
    while value is not None and value != bound and f"{value:.{-cell.digits}g}" == f"{bound:g}":
        cell = cell._replace(digits=cell.digits - 1)
    return cell


_PEOPLE: Final = {
    "angles": "angles/hip_flexion",
    "kinetics": "moments/hip_flexion",
    "steps": "parameter/cadence",
    "stance": "parameter/stance_fraction",
}
"""Norms whose people the sheet counts."""


def _people(metrics: Metrics, subject: Subject) -> dict[str, Cell]:
    """How many healthy people stand behind each column and band, once for the whole report; none
    for children, of whom only curves may be shipped.
    """
    normal = norms(subject)
    if not {*_PEOPLE.values()} <= set(normal):
        return {}
    found = {name: Cell(normal[each].people) for name, each in _PEOPLE.items()}
    if metrics.gait_profiles is not None:
        from gaitval.gait.healthy_controls import load_controls

        found["score"] = Cell(load_controls().people)
    return found


class LightRow(NamedTuple):
    """The lights of a curve by side, as in the metrics."""

    name: str
    lights: Mapping[Side, CurveLight]


def _lights(metrics: Metrics, extensor_positive: bool) -> dict[str, list[LightRow]]:
    """Whether each curve may be believed, by kind."""
    return {
        kind: [
            LightRow(
                panel_name(kind, name, extensor_positive),
                {side: metrics.lights.of(kind)[f"{name}_{side[0]}"] for side in SIDES},
            )
            for name in names
        ]
        for kind, names, _ in CURVES
    }


class Why(NamedTuple):
    """Curves that are not to be believed, or with care, for one reason; each with its side, or
    None for both.
    """

    light: Light
    reason: Reason
    curves: Sequence[tuple[str, Side | None]]


def _reasons(metrics: Metrics, extensor_positive: bool) -> list[Why]:
    """The reasons of all curves that are not simply to be believed, the gravest first."""
    found: dict[tuple[Light, Reason], list[tuple[str, Side | None]]] = {}
    for kind, names, _ in CURVES:
        of_kind: dict[tuple[Light, Reason], list[tuple[str, Side]]] = {}
        for name in names:
            for side in SIDES:
                each = metrics.lights.of(kind)[f"{name}_{side[0]}"]
                if each.light != "believe":
                    words = curve_name(kind, name, extensor_positive)
                    of_kind.setdefault((each.light, each.reason), []).append((words, side))
        for key, curves in of_kind.items():
            if len(curves) == 2 * len(names):
                found.setdefault(key, []).append((f"all {kind}", None))
                continue
            sides = {words: [each for word, each in curves if word == words] for words, _ in curves}
            found.setdefault(key, []).extend(
                (words, of[0] if len(of) == 1 else None) for words, of in sides.items()
            )
    order: list[Light] = ["do not", "with care"]
    return [
        Why(*key, curves)
        for key, curves in sorted(found.items(), key=lambda pair: order.index(pair[0][0]))
    ]


_KNOWN: Final = ("sagittal angles", "moments", "vertical force")
"""Groups whose doubt the sheet gives."""


def _known_to(metrics: Metrics) -> dict[str, list[tuple[Cell, str]]]:
    """What the errors of `_KNOWN` are known to by record, time step and second engine, with units;
    without those that say nothing.
    """
    rows = [row for row in metrics.known_to if row.group in _KNOWN]
    found = {
        of: [(Cell(getattr(row, of), -2), row.unit) for row in rows]
        for of in ("record", "time_step", "second_engine")
    }
    return {of: each for of, each in found.items() if any(c.value is not None for c, _ in each)}


def _push_off(metrics: Metrics) -> dict[Side, dict[str, Cell]]:
    """Positive work of each ankle in a cycle, J/kg, of walk and record, and how much more of it the
    walk does, %; empty where either is not known.
    """
    found = {}
    for side in SIDES:
        name = f"ankle_angle_{side[0]}"
        recorded = metrics.record.joint_power.generated[name]
        if curve_origin("moments", name, metrics.origins) != "recorded" or not recorded:
            return {}
        if metrics.walk.joint_power is None:
            return {}
        walked = metrics.walk.joint_power.generated[name]
        more = Cell(100.0 * (walked / recorded - 1.0))
        found[side] = {"walk": Cell(walked, 2), "record": Cell(recorded, 2), "more": more}
    return found


class SheetParameter(NamedTuple):
    """A spatiotemporal parameter: `of` each side, or of the walk, the cells "mean" and "recorded";
    and of healthy people.
    """

    label: str
    unit: str
    of: tuple[Mapping[str, Cell], ...]
    norm_mean: Cell
    norm_sd: Cell


def _parameters(metrics: Metrics, subject: Subject) -> list[SheetParameter]:
    """Spatiotemporal parameters of walk and record, and their norm."""
    normal = norms(subject)
    rows: list[SheetParameter] = []
    for row in metrics.walk.spatiotemporal:
        centimetres = row.name.startswith("step_")
        share = 100.0 if row.unit == "1" or centimetres else 1.0
        digits = {"1": 1, "steps/min": 1, "m": 1}.get(row.unit, 2)
        side = next((each for each in SIDES if row.name.endswith(f"_{each}")), None)
        plain = row.name.removesuffix(f"_{side}")
        label = plain.removesuffix("_fraction").replace("_", " ").capitalize()
        of = {
            name: Cell(None if value is None else share * value, digits)
            for name, value in (("mean", row.mean), ("recorded", row.wanted))
        }
        if rows and rows[-1].label == label:  # the other side's
            rows[-1] = rows[-1]._replace(of=(*rows[-1].of, of))
            continue
        norm = f"parameter/{plain}"
        healthy = [
            Cell(share * float(getattr(normal[norm], name)) if norm in normal else None, digits)
            for name in ("mean", "sd")
        ]
        unit = "% of cycle" if row.unit == "1" else "cm" if centimetres else row.unit
        rows.append(SheetParameter(label, unit, (of,), *healthy))
    return rows


_WHICH: Final = ("record", "walk")


class ProfileRow(NamedTuple):
    """The scores of a side of record or walk ("which"), the total last."""

    side: Side
    which: str
    cells: Sequence[Cell]


class Profile(NamedTuple):
    """Movement Analysis Profile and Gait Profile Score.

    Attributes
    ----------
    names : of the angles, and "total".
    rows : of record and walk, by side.
    healthy : mean and SD of controls.
    scores : the totals, by "record", "walk" and "healthy".
    """

    names: Sequence[str]
    rows: Sequence[ProfileRow]
    healthy: Sequence[Sequence[Cell]]
    scores: Mapping[str, Sequence[Cell]]


def _profile(metrics: Metrics) -> Profile | None:
    if metrics.gait_profiles is None:
        return None
    from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls

    profiles = metrics.gait_profiles
    controls, names = load_controls(), profiles.variables
    rows = []
    for side in SIDES:
        for which, found in (("record", profiles.record), ("walk", profiles.walk)):
            if found is not None:
                values = [*(found.scores[f"{name}_{side[0]}"] for name in names), found.of(side)]
                rows.append(ProfileRow(side, which, [Cell(value, 1) for value in values]))
    # of fewer angles than theirs a score says nothing beside theirs
    scored = controls.side if len(names) == len(PROFILE_ANGLES) else (None, None)
    both = [*((name, controls.scores[name]) for name in names), ("side", scored)]
    healthy = [[Cell(each[i], 1) for _, each in both] for i in range(2)]
    by_side = {which: [r.cells[-1] for r in rows if r.which == which] for which in _WHICH}
    known = healthy[0][-1].value is not None
    scores = {**by_side, "healthy": [each[-1] for each in healthy] if known else []}
    return Profile([*names, "total"], rows, healthy, scores)


def _warnings(metrics: Metrics, subject: Subject) -> Iterator[SheetWarning]:
    """All that speaks against trusting the verdict but what failed, the gravest first: what it
    compares with, and what the record itself lacks.
    """
    if metrics.second_engine is not None and metrics.second_engine.fell:
        yield SheetWarning("falls there")
    close = sum(len(each.close) for each in counted_limits(metrics, "acceptance"))
    if close:
        yield SheetWarning("narrow", {"count": Cell(close)})
    missing = sorted({name for name, *_ in not_recorded(metrics.origins)})
    if not metrics.is_recorded_at_all:
        yield SheetWarning("nothing recorded")
    elif missing:
        yield SheetWarning("not recorded", words={"what": ", ".join(missing)})
    if metrics.known.get("forces"):
        yield SheetWarning("fit")
    yield from _of_score(metrics)
    plates = metrics.record.plates
    if plates is not None and abs(plates.scale - 1.0) > PLATES_UNCERTAIN:
        yield SheetWarning("plates", {"carried": Cell(100.0 / plates.scale, 1)})
    # an import keeps how much the strides differ
    if metrics.is_recorded_at_all and not subject.uncertainty:
        yield SheetWarning("one cycle")
    if metrics.identification is not None:
        verdicts = metrics.identification.verdicts
        cells = {"identified": Cell(verdicts.count("identified")), "all": Cell(len(verdicts))}
        yield SheetWarning("parameters", cells)


def _of_score(metrics: Metrics) -> Iterator[SheetWarning]:
    """A side whose Gait Profile Score differs from the record's by what matters clinically."""
    profiles = metrics.gait_profiles
    if profiles is None or profiles.record is None:
        return
    from gaitval.metrics.gait_profile import SMALLEST_DIFFERENCE

    record, walk = profiles.record, profiles.walk
    side = max(SIDES, key=lambda each: abs(walk.of(each) - record.of(each)))
    away = walk.of(side) - record.of(side)
    if abs(away) >= SMALLEST_DIFFERENCE:
        worst = max(record.scores, key=lambda key: abs(walk.scores[key] - record.scores[key]))
        of, name = split_side(worst)
        words = {"side": side, "angle": name, "angle_side": of}
        yield SheetWarning("score", {"away": Cell(away, 1)}, words)
