"""From a laboratory's recordings to a body, its motion, its joint moments and its mean gait cycle.

What `gaitval import` does, in the order of the stages: read, name and turn the trials; clean the
markers; scale the body and fit it to both trials; inverse kinematics; forces to feet; inverse
dynamics; gait cycles. `gaitval.session.importing.write` writes the results.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import SIDES, Side
from gaitval.errors import RecordError
from gaitval.findings import Looked, look
from gaitval.findings.means import MeanGait
from gaitval.gait.cycles import AverageCurve
from gaitval.gait.foot_forces import LIGHTEST, of_weight
from gaitval.gait.quality_flags import QualityFlag, refuse_certain, told_once
from gaitval.reporting.measurement_part import MeasurementPart
from gaitval.scaling.joint_centres import FUNCTIONAL
from gaitval.session.average import check_mass, mean_angles, mean_kinetics
from gaitval.session.incline import ground_of
from gaitval.session.one_side import one_side_warnings
from gaitval.session.read import SessionRecordings, read_session
from gaitval.session.request import Notify, Request, silent
from gaitval.session.scale import FittedBody, scale_body
from gaitval.session.trial import WalkingTrial, require_cycles, work_out_trial
from gaitval.subjects.plausible import unusual_build

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from gaitval.arrays import Array
    from gaitval.scaling.given_centres import LaidCentre
    from gaitval.session.functional import FunctionalJoint
    from gaitval.session.given_centres import CentreDifference


class SessionMeasurement(MeasurementPart, Protocol):
    """What `gaitval.session.measurement` says of a session."""

    @property
    def faults(self) -> Sequence["DataclassInstance"]:
        """A row for each fault that was looked for."""

    def uncertainty(self) -> dict[str, float]:
        """Half of the median width of each band, and those of lengths: the subject's file."""

    def columns(self) -> "dict[str, Array]":
        """Half widths of bands, and curves before a correction, (101,) by their columns."""

    def band_records(self) -> dict[str, dict[str, object]]:
        """The bands by curve and length (m), with the sources of their variance."""

    def at_once(self) -> float | None:
        """Standard deviations within which all curves of a second session stay (`Bands`)."""


@dataclass(frozen=True)
class Import:
    """Everything that an import found.

    Attributes
    ----------
    angles : rad, mean curves by name (`hip_flexion_r`, …), 0 to 100 % of the side's cycle.
    moments : Nm/kg, likewise; empty without forces.
    forces : body weights, (101, 3) forward, left, up for each side; empty without forces.
    weight_ratio : mean vertical force over whole gait cycles, as a fraction of body weight; None if
        no cycle of both feet is shown whole.
    of_means, looked_means : warnings about the mean curves, and what was looked for in them.
    functional : what the range-of-motion trials show of hips and knees.
    given : joint centres that came with the recording, beside ours.
    decisions : what was decided: the step, and a sentence.
    measurement : what `gaitval.session.measurement.measured` found; None before it has looked.
    """

    request: Request
    processing: ProcessingSettings
    session: SessionRecordings
    body: FittedBody
    trials: tuple[WalkingTrial, ...]
    angles: Mapping[str, AverageCurve]
    moments: Mapping[str, AverageCurve]
    forces: Mapping[Side, AverageCurve]
    weight_ratio: float | None
    decisions: tuple[tuple[str, str], ...]
    functional: "tuple[FunctionalJoint, ...]" = ()
    given: "tuple[CentreDifference, ...]" = ()
    of_means: tuple[QualityFlag, ...] = ()
    looked_means: tuple[Looked, ...] = ()
    measurement: "SessionMeasurement | None" = None

    @property
    def given_hips(self) -> str:
        """Whose hip centres the body was given, of those that came with the recording; else ""."""
        return next((row.source for row in self.given if row.used and row.joint == "hip"), "")

    @property
    def warnings(self) -> tuple[tuple[str, QualityFlag], ...]:
        """All warnings, each with its trial; what several trials show alike is one."""
        of_trials = ((walk.name, warning) for walk in self.trials for warning in walk.warnings)
        of_means = (("all trials", warning) for warning in self.of_means)
        return told_once((*self.session.warnings, *of_trials, *of_means))

    @property
    def looked(self) -> tuple[tuple[str, Looked], ...]:
        """What was looked for in each trial, with value and limits, also where these are kept."""
        of_trials = ((walk.name, row) for walk in self.trials for row in walk.looked)
        of_means = (("all trials", row) for row in self.looked_means)
        return (*self.session.looked, *of_trials, *of_means)


@dataclass
class ImportProgress:
    """What an import has found so far; a refusal leaves it to be written."""

    decisions: list[tuple[str, str]] = field(default_factory=list)
    session: SessionRecordings | None = None
    body: FittedBody | None = None
    trials: list[WalkingTrial] = field(default_factory=list)

    def noting(self, notify: Notify) -> Notify:
        """A `notify` that also keeps what it is called with among the decisions."""

        def noted(step: str, message: str) -> None:
            self.decisions.append((step, message))
            notify(step, message)

        return noted


def work_out_trials(
    request: Request,
    processing: ProcessingSettings,
    notify: Notify = silent,
    progress: ImportProgress | None = None,
    *,
    symmetric: bool = True,
) -> Import:
    """Everything from the files of `request` to the mean gait cycle, with the filters of
    `processing`; what `gaitval.session.measurement` says of it comes after
    (`gaitval.session.importing`).

    A trial that cannot be used is left out if there are others. `notify` is called with each
    decision: the step, and a sentence. `progress` receives what is found, step by step. `symmetric`
    is that of the configuration's `scaling`. Raises RecordError or ScalingError as each step does.
    """
    known = ImportProgress() if progress is None else progress
    noted = known.noting(notify)
    usual, processing = processing, of_weight(processing, request.mass_kg)
    if processing != usual:
        noted(
            "forces",
            f"a foot is on the ground from {processing.force_threshold_n:.1f} N on, "
            f"{100 * LIGHTEST:g} % of the weight, not from {usual.force_threshold_n:g} N",
        )
    if request.aid is not None:
        noted(
            "warnings",
            f"with {request.aid}, what the feet carry is below one body weight, and the rest is "
            "not measured: moments, residuals and the walk that knows them carry this error",
        )
    while True:
        try:
            session, functional, laid, body = _scaled(request, processing, known, noted, symmetric)
            break
        except RecordError as error:
            if error.trial is None or len(request.trials) == 1:
                raise
            noted("trials", f"{request.called(error.trial)} is left out: {error}")
            request = request.without_trial(error.trial)
    walks = _usable_walks(request, processing, known, noted)
    require_cycles(walks)
    ground = ground_of(request, walks, noted)
    if ground != body.model.ground:
        # what the segments weigh, and so all moments, changes with gravity's direction
        body = known.body = body.on(ground)
        known.trials.clear()
        walks = _usable_walks(request, processing, known, silent)
    weight_ratio = check_mass(request, walks)
    moments, forces = mean_kinetics(request, walks)
    angles = mean_angles(body.model, walks)
    build = unusual_build(request.mass_kg, request.height_m, request.age)
    given = _beside_given(request, session, body, walks, laid, noted)
    of_means = look(MeanGait(angles, moments, _speeds(walks)))
    doubts = (
        *one_side_warnings(walks, angles, forces),
        *build,
        *of_means.flags,
        *_of_given(given),
    )
    for warning in doubts:
        noted("warnings", str(warning))
    return Import(
        request=request,
        processing=processing,
        session=session,
        body=body,
        trials=tuple(walks),
        angles=angles,
        moments=moments,
        forces=forces,
        weight_ratio=weight_ratio,
        decisions=tuple(known.decisions),
        of_means=doubts,
        looked_means=of_means.looked,
        functional=functional,
        given=given,
    )


def _beside_given(
    request: Request,
    session: SessionRecordings,
    body: FittedBody,
    walks: Sequence[WalkingTrial],
    laid: "Sequence[LaidCentre]",
    noted: Notify,
) -> "tuple[CentreDifference, ...]":
    """The given joint centres, which are `laid` on the standing trial, beside those of `body`."""
    if not laid:
        return ()
    from gaitval.session.given_centres import beside_given

    rows = beside_given(request, session, body, walks, laid)
    for row in rows:
        noted("scaling", str(row))
    return rows


def _of_given(rows: "Sequence[CentreDifference]") -> Iterator[QualityFlag]:
    """The warning about given joint centres that the body could not take."""
    if rows:
        from gaitval.session.given_centres import given_warnings

        yield from given_warnings(rows)


def _speeds(walks: Sequence[WalkingTrial]) -> dict[str, float]:
    """m/s, of each trial that shows its speed."""
    speeds = {
        walk.name: np.concatenate([walk.gait[side].speed for side in SIDES]) for walk in walks
    }
    return {
        name: float(np.nanmean(each)) for name, each in speeds.items() if np.isfinite(each).any()
    }


def _scaled(
    request: Request,
    processing: ProcessingSettings,
    known: ImportProgress,
    noted: Notify,
    symmetric: bool,
) -> "tuple[SessionRecordings, tuple[FunctionalJoint, ...], tuple[LaidCentre, ...], FittedBody]":
    """The recordings of all trials, functional joints, joint centres that came with them, and the
    body. Raises RecordError, of which `trial` says whether it is about one trial.
    """
    session = known.session = read_session(request, processing, noted)
    functional: tuple[FunctionalJoint, ...] = ()
    centres: dict[str, Array] = {}
    source = FUNCTIONAL
    if request.functional:
        from gaitval.session.functional import chosen_hips, functional_joints

        functional = functional_joints(request, processing, session, noted)
        centres = chosen_hips(request, functional, noted)
    laid: tuple[LaidCentre, ...] = ()
    if session.points or request.scaled_model or request.joint_centres == "given":
        from gaitval.session.given_centres import given_centres

        laid, doubts = given_centres(request, session, noted)
        for doubt in doubts:
            noted("warnings", str(doubt))
        of_model = [("all trials", doubt) for doubt in doubts]
        session = known.session = replace(session, warnings=(*session.warnings, *of_model))
    if request.joint_centres == "given":
        centres, source = {each.name: each.place for each in laid}, f"of {laid[0].source}"
        noted("scaling", f"joint centres {source}: {', '.join(each.title for each in laid)}")
    body = known.body = scale_body(
        request, processing, session, noted,
        centres=centres, centres_source=source, symmetric=symmetric,
    )  # fmt: skip
    session = known.session = replace(
        session,
        walking=body.walking,
        looked=(*session.looked, *((request.called(0), row) for row in body.looked)),
        warnings=(
            *session.warnings,
            *(
                (request.called(number), warning)
                for number, warnings in enumerate(body.warnings)
                for warning in warnings
            ),
        ),
    )
    return session, functional, laid, body


def _usable_walks(
    request: Request, processing: ProcessingSettings, known: ImportProgress, noted: Notify
) -> list[WalkingTrial]:
    """The walking trials that can be used. Raises RecordError if none can."""
    session, body = known.session, known.body
    assert session is not None
    assert body is not None
    walks, failed = list[WalkingTrial](), list[tuple[str, RecordError]]()
    for number, recording in enumerate(session.walking):
        name = request.called(number)
        try:
            walk = work_out_trial(request, processing, session, body, name, recording, noted)
            known.trials.append(walk)
        except RecordError as error:
            failed.append((name, error))
    for walk in known.trials:
        try:
            refuse_certain(walk.recording.source, walk.warnings, len(walk.recording.plates))
            walks.append(walk)
        except RecordError as error:
            failed.append((walk.name, error))
    if not walks:
        raise failed[-1][1]
    for name, why in failed:
        noted("trials", f"{name} is left out: {why}")
    return walks
