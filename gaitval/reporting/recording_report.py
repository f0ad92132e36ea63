"""The report of an import: what was recorded, what was computed from it, and its quality.

`RecordingSummary` contains everything on the page, in SI units, radians and the project's axes; the
page shows degrees, centimetres and per cent of body weight.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import ReportSettings
from gaitval.coordinates import SIDES, Side
from gaitval.findings import Looked
from gaitval.gait.cycle_curves import Curves
from gaitval.kinetics.musculature.gait import MuscleGait
from gaitval.metrics.norms import Norm, norms_at
from gaitval.metrics.recording_limits import State
from gaitval.metrics.single_case import compare_with_group
from gaitval.metrics.walk_quantities import found_quantities
from gaitval.quantities import BY_NAME, JOINT_CONTACT, MUSCLE_ACTIVATION, Found
from gaitval.reporting import grids
from gaitval.reporting import recording_figures as figures
from gaitval.reporting.figure_data import table
from gaitval.reporting.measurement_part import MeasurementPart
from gaitval.reporting.muscle_figures import DrawnMuscles
from gaitval.reporting.page import Draw, counted, write_page
from gaitval.reporting.recording_figures import MeanAndDeviation
from gaitval.reporting.tables import tables_of
from gaitval.scaling.segments import ScaledSegment
from gaitval.subjects.plausible import ADULT

BAR_HEADROOM: Final = 1.25
"""Length of the marker error scale / the larger of limit and largest error."""
MARKERS_PRINTED: Final = 5
"""Largest marker errors on paper; a screen has all."""
LEFT_OUT_SHOWN: Final = 40
"""Largest number of omitted gait cycles in the table; their total number is always given."""

NAN: Final = float("nan")


class InputFile(NamedTuple):
    """A file that the import read: its role ("static", "trial"), name, SHA-256 and bytes."""

    role: str
    name: str
    sha256: str
    size: int


class Decision(NamedTuple):
    """A decision of gaitval or input of the user: the stage, and a sentence with its basis."""

    name: str
    decided: str


class GateRow(NamedTuple):
    """A published limit, and whether the import keeps it.

    Attributes
    ----------
    value : measured value, in `unit`; NaN or None if it could not be measured.
    limit : largest accepted value, in `unit`.
    source : who published the limit.
    applies : whether the limit is meant for this value; one that is not is shown without a verdict.
    remedy : what to do if it is not kept.
    target : what of the import it is of, such as a trial's file; empty where the title says it.
    """

    title: str
    value: float | None
    limit: float
    unit: str
    passed: bool
    source: str
    applies: bool = True
    remedy: str = ""
    target: str = ""

    @property
    def name(self) -> str:
        """Title and target."""
        return f"{self.title} ({self.target})" if self.target else self.title

    @property
    def state(self) -> State:
        """The verdict in a word."""
        if not self.applies:
            return "not judged"
        return "passed" if self.passed else "FAILED"

    @property
    def failed(self) -> bool:
        """Whether the limit is meant for the value, and not kept."""
        return self.applies and not self.passed


class MarkerError(NamedTuple):
    """Distance of one marker from its place on the model after inverse kinematics.

    Attributes
    ----------
    rms, largest : m, over the frames that show it.
    seen : fraction of the frames that show it, 0 to 1.
    """

    name: str
    rms: float
    largest: float
    seen: float = 1.0


class FunctionalRow(NamedTuple):
    """A joint of a range-of-motion trial, in words with units; empty where there is nothing.

    Attributes
    ----------
    refused : why it was not found.
    against : place or direction relative to the one of the standing trial.
    error : of it.
    to_ankle : distance of the hip centre from the ankle, by either way.
    """

    trial: str
    joint: str
    refused: str
    against: str
    error: str
    to_ankle: str


class SpatiotemporalRow(NamedTuple):
    """A parameter of gait as mean and SD over its cycles or steps of each side, in `unit`; None if
    not measured.
    """

    name: str
    unit: str
    right: tuple[float, float] | None = None
    left: tuple[float, float] | None = None
    digits: int = 2


class LeftOut(NamedTuple):
    """A gait cycle that is not part of the means: its trial, when it began there (s), and why."""

    trial: str
    side: Side
    start: float
    reason: str


@dataclass(frozen=True)
class ResidualCurves:
    """Residuals of inverse dynamics on the pelvis, which nothing exerts in reality.

    Attributes
    ----------
    time : (T,) s.
    force, moment : (T, 3) N and Nm, axes forward, left, up.
    force_limit, moment_limit : N and Nm, of the largest magnitude; NaN for none.
    """

    time: Array
    force: Array
    moment: Array
    force_limit: float = NAN
    moment_limit: float = NAN


class GivenCentreRow(NamedTuple):
    """A joint centre that came with the recording, of a `source`, from ours, mm in the segment
    above, and by how much the moments about it differ, Nm/kg (RMS over stance); NaN without.
    """

    side: Side
    joint: str
    source: str
    forward: float
    outwards: float
    up: float
    flexion: float
    abduction: float


class ConsistencyChange(NamedTuple):
    """What `--consistent` changed or reached: a quantity before and after, in `unit`."""

    name: str
    before: float
    after: float
    unit: str


@dataclass(frozen=True)
class RecordingSummary:
    """Everything that the report of an import shows.

    Attributes
    ----------
    identifier : of the subject.
    sex : "F" or "M".
    mass, height : kg, m.
    trial : name of the walking trial, or of all.
    first_trial : of several, the one whose marker errors, residuals and `changes` these are; empty
        of one.
    duration : s, of the trial.
    marker_rate, force_rate : Hz; force_rate 0 without force plates.
    walking_speed : m/s; NaN where not known.
    cycles : gait cycles in the means, by side.
    stance_fraction : mean toe-off as a fraction of the cycle, by side; NaN if not known.
    angles : rad; moments : Nm/kg; forces : body weights. Mean (101,) and SD (101,) by name with
        "_r" or "_l" (`gaitval.coordinates`; forces "forward", "medial", "vertical").
    strides : (n, 101) of each cycle, by "angles/knee_angle_r", where they are kept.
    age, leg_length : years and m, for the norms; None if not known.
    functional : joints of the range-of-motion trials.
    given_centres : joint centres that came with the recording, beside those of the model.
    weight_ratio : share of the body weight that the plates carried over whole gait cycles; None if
        no cycle of both feet is shown whole.
    residuals : None without inverse dynamics.
    marker_rms_limit, marker_largest_limit : m, drawn and applied to `marker_errors`.
    changes : of `--consistent`; empty without it.
    measurement : what `gaitval.session.measurement` says, with its template and drawings; or None.
    warnings : where data contradict physics or normal gait, a sentence each.
    looked : every finding that was looked for, with its value and limits.
    repairs : what cleaning found and did, one sentence each.
    left_out : empty if every cycle is in the means.
    versions : of gaitval and the libraries that the results depend on.
    commit : of gaitval's code (`build_info.source_commit`); empty if not known.
    written : when the import was made (`build_info.now`); empty if not known.
    """

    identifier: str
    sex: str
    mass: float
    height: float
    trial: str
    duration: float
    marker_rate: float
    force_rate: float
    walking_speed: float
    cycles: Mapping[Side, int]
    stance_fraction: Mapping[Side, float]
    inputs: Sequence[InputFile]
    decisions: Sequence[Decision]
    gates: Sequence[GateRow]
    marker_errors: Sequence[MarkerError]
    marker_rms_limit: float
    marker_largest_limit: float
    segments: Sequence[ScaledSegment]
    angles: Mapping[str, MeanAndDeviation]
    moments: Mapping[str, MeanAndDeviation] = field(default_factory=dict)
    forces: Mapping[str, MeanAndDeviation] = field(default_factory=dict)
    functional: Sequence[FunctionalRow] = ()
    given_centres: Sequence[GivenCentreRow] = ()
    weight_ratio: float | None = None
    strides: Mapping[str, Array] = field(default_factory=dict)
    age: float | None = None
    leg_length: float | None = None
    residuals: ResidualCurves | None = None
    spatiotemporal: Sequence[SpatiotemporalRow] = ()
    changes: Sequence[ConsistencyChange] = ()
    measurement: MeasurementPart | None = None
    warnings: Sequence[str] = ()
    looked: Sequence[Looked] = ()
    repairs: Sequence[str] = ()
    left_out: Sequence[LeftOut] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    commit: str = ""
    written: str = ""
    first_trial: str = ""
    muscles: MuscleGait | None = None


def write_recording_report(
    folder: Path, summary: RecordingSummary, settings: ReportSettings | None = None
) -> None:
    """Write `recording.html` and `recording.pdf` of `summary` into `folder`, with the tables;
    `settings` are A4 and English by default.

    The HTML needs no other file. Equal summaries give equal HTML.
    """
    folder.mkdir(parents=True, exist_ok=True)
    settings = settings or ReportSettings()
    context = {
        "summary": summary,
        "sides": SIDES,
        "gates": sorted(summary.gates, key=lambda gate: (not gate.failed, not gate.applies)),
        "markers": _marker_rows(summary),
        "markers_printed": MARKERS_PRINTED,
        "left_out": summary.left_out[:LEFT_OUT_SHOWN],
        "case": _case(summary),
        "left_out_reasons": Counter(one.reason for one in summary.left_out).most_common(),
        "extensor_positive": settings.extensor_positive,
        **counted(settings.convention),
        **_drawings(summary, settings),
    }
    write_page(folder, "recording", "recording.html.j2", context, settings)


def _case(summary: RecordingSummary) -> dict[str, Any] | None:
    """The person against healthy adults; None for a child, and without angles."""
    if summary.age is not None and summary.age < ADULT:
        return None
    angles = {name: np.degrees(mean) for name, (mean, _) in summary.angles.items()}
    found = compare_with_group(angles)
    if found is None:
        return None
    return {
        "people": found.people,
        "p": found.p,
        "outside": [
            {
                "name": name[:-2],
                "side": "right" if name[-1] == "r" else "left",
                "first": region.first,
                "last": region.last,
            }
            for name, regions in found.regions.items()
            for region in regions
        ],
    }


def _marker_rows(summary: RecordingSummary) -> list[dict[str, Any]]:
    """Markers, worst first, with the lengths of their bars as percentages of the scale."""
    largest = [one.largest for one in summary.marker_errors if np.isfinite(one.largest)]
    # one scale for all markers, on which the limits can be drawn too
    scale = BAR_HEADROOM * max([summary.marker_largest_limit, *largest])

    def place(value: float) -> float | None:
        return 100.0 * value / scale if np.isfinite(value) else None

    # markers without a finite error first, then by falling RMS
    ordered = sorted(
        summary.marker_errors,
        key=lambda one: (np.isfinite(one.rms), -one.rms if np.isfinite(one.rms) else 0.0, one.name),
    )
    return [
        {
            "marker": one,
            "passed": bool(
                one.rms <= summary.marker_rms_limit and one.largest <= summary.marker_largest_limit
            ),
            "rms_place": place(one.rms),
            "largest_place": place(one.largest),
            "rms_limit_place": place(summary.marker_rms_limit),
            "largest_limit_place": place(summary.marker_largest_limit),
        }
        for one in ordered
    ]


def _drawings(summary: RecordingSummary, looks: ReportSettings) -> dict[str, Any]:
    """What draws each figure, its table, and the names of the figures of each section; `looks` are
    the zero of angles and the sign of moments.
    """
    normal: Mapping[str, Norm] = {}
    if summary.leg_length is not None and np.isfinite(summary.walking_speed):
        normal = norms_at(summary.walking_speed, summary.leg_length, summary.age)
    rows = partial(
        figures.curve_rows,
        stance_fraction=summary.stance_fraction,
        norms=normal,
        strides=summary.strides,
    )
    quantities = quantities_of(summary)
    nothing = np.full(101, NAN)
    every = {
        "angles": rows(
            summary.angles, kind="angles", layout=grids.KINEMATICS, factor=float(np.degrees(1.0))
        ),
        "moments": rows(summary.moments, kind="moments", layout=grids.MOMENTS),
        **{
            name: rows({key: (curve, nothing) for key, curve in found.curves.items()}, kind=name)
            for name, found in quantities.items()
        },
        "forces": rows(summary.forces, kind="forces", factor=100.0),
    }
    every = {
        kind: grids.in_convention(each, looks.convention) for kind, each in every.items() if each
    }
    for name in quantities:
        if BY_NAME[name].of_muscles is not None or BY_NAME[name].shown != "curves":
            every.pop(name, None)
    drawings: dict[str, Draw] = {
        kind: partial(
            grids.grid,
            each,
            height=1.3,
            figure_name=kind,
            words=("trunk", "measured"),
            linked=False,
            extensor_positive=looks.extensor_positive,
        )
        for kind, each in every.items()
    }
    data = {kind: grids.grid_table(each) for kind, each in every.items()}
    names = {kind: [kind] for kind in every}
    names["quantities"] = [name for name in quantities if name in every]
    if summary.muscles is not None and summary.muscles.legs:
        shown = DrawnMuscles.of(summary.muscles)
        drawings |= {MUSCLE_ACTIVATION.name: shown.activations, JOINT_CONTACT.name: shown.contacts}
        tables = shown.tables()
        data[MUSCLE_ACTIVATION.name] = tables["activations"]
        data[JOINT_CONTACT.name] = tables["contacts"]
        names["quantities"] += [MUSCLE_ACTIVATION.name, JOINT_CONTACT.name]
    left = summary.residuals
    if left is not None:
        names["residuals"] = ["residuals"]
        drawings["residuals"] = partial(
            figures.residuals,
            left.time,
            left.force,
            left.moment,
            force_limit=left.force_limit,
            moment_limit=left.moment_limit,
            figure_name="residuals",
        )
        data["residuals"] = _residual_table(left)
    if summary.measurement is not None:
        drawings |= summary.measurement.drawings(looks.extensor_positive)
    return {
        "drawings": drawings,
        "data": data,
        "names": names,
        "quantities": BY_NAME,
        "figure_tables": [
            table
            for name, found in quantities.items()
            if BY_NAME[name].shown != "nothing" and BY_NAME[name].of_muscles is None
            for table in tables_of(BY_NAME[name], found, None)
        ],
    }


def quantities_of(summary: RecordingSummary) -> dict[str, Found]:
    """The quantities of the mean curves of `summary`, by name, without those for which something
    was not measured.
    """
    times = next((row for row in summary.spatiotemporal if row.name == "Stride time"), None)
    seconds = {
        "r": times and times.right and times.right[0],
        "l": times and times.left and times.left[0],
    }
    means = Curves(
        *(
            {name: mean for name, (mean, _) in each.items()}
            for each in (summary.angles, summary.moments, summary.forces)
        )
    )
    return found_quantities(means, seconds, summary.muscles, summary.walking_speed)


def _residual_table(left: ResidualCurves) -> str:
    columns: dict[str, Any] = {"time_s": left.time}
    for kind, unit, values in (("force", "n", left.force), ("moment", "nm", left.moment)):
        for axis, direction in enumerate(("forward", "left", "up")):
            columns[f"{kind}_{direction}_{unit}"] = values[:, axis]
    return table(columns)
