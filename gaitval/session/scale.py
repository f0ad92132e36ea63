"""Scale the body of the person by the standing and walking trials."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import ProcessingSettings
from gaitval.conventions import GENERIC
from gaitval.errors import RecordError
from gaitval.findings import Looked, Result, look
from gaitval.findings.standing import StandingBody
from gaitval.gait.filters import low_pass
from gaitval.gait.quality_flags import QualityFlag
from gaitval.kinetics.inverse.marker_labels import Exchange, find_exchanged
from gaitval.kinetics.inverse.marker_placement import MarkerPlacement, place_markers
from gaitval.kinetics.inverse.model_fit import MODEL_FIT, ModelFit, fit_model
from gaitval.mocap.exchanges import ARMS
from gaitval.mocap.recording import Recording
from gaitval.model.body import BodyModel
from gaitval.model.ground import Ground
from gaitval.model.markers import ModelMarker
from gaitval.scaling.joint_centres import FUNCTIONAL, measure
from gaitval.scaling.marker_set import MarkerSet
from gaitval.scaling.markers.spines import SPINES
from gaitval.scaling.measurements import Measurements, with_fitted_lengths
from gaitval.scaling.scaling import ScaledBody, build_body
from gaitval.session.pelvis_markers import FROM_CRESTS
from gaitval.session.read import SessionRecordings, about_file, of_trial
from gaitval.session.request import Notify, Request, silent
from gaitval.session.standing import standing_places


@dataclass(frozen=True)
class FittedBody:
    """The person's body.

    Attributes
    ----------
    chosen : lengths of the model, those of the joint fit.
    scaled : the model that is used, and its table.
    markers : on that model.
    placement : of the markers on the body of the standing trial alone.
    fit : the joint fit.
    centres : (3,) m in standing, joint centres that the body was given.
    looked : what was looked for in the body by the standing trial.
    walking : the walking trials with the labels of the standing one.
    warnings : warnings about the labels of each walking trial, and in the first about lengths.
    """

    chosen: Measurements
    scaled: ScaledBody
    markers: tuple[ModelMarker, ...]
    placement: MarkerPlacement
    fit: ModelFit
    walking: tuple[Recording, ...]
    warnings: tuple[tuple[QualityFlag, ...], ...]
    centres: Mapping[str, Array] = field(default_factory=dict)
    looked: tuple[Looked, ...] = ()

    @property
    def model(self) -> BodyModel:
        """The model that is used."""
        return self.scaled.model

    def on(self, ground: Ground) -> "FittedBody":
        """The same on another ground."""
        model = replace(self.scaled.model, ground=ground)
        return replace(self, scaled=replace(self.scaled, model=model))


HIP_LENGTHS: Final = ("hip_half_width", "hip_forward", "hip_up")
"""Lengths of the joint fit that say where the hips are in the pelvis."""
GIVEN_SD: Final = 0.0001
"""m, of the place of a given joint centre in the joint."""
FITTED_WEIGHT: Final = 20.0
"""Of a given joint centre in the joint fit, beside a marker. Without it the fit moves the markers,
and with them the centre, by 10 mm or more."""
TISSUE_OVER_RESIDUAL: Final = 2.5
"""Soft tissue, 10 mm, over the 4 mm that a fit to the walk leaves of ten children (McGill)."""


def scale_body(
    request: Request,
    processing: ProcessingSettings,
    session: SessionRecordings,
    notify: Notify = silent,
    *,
    centres: Mapping[str, Array] | None = None,
    centres_source: str = FUNCTIONAL,
    symmetric: bool = True,
) -> FittedBody:
    """Scale the body by the standing trial of `session`, then fit it to both trials: each
    measurement replaces a guess of the one before.

    `request` has mass, stature and widths, `processing` the filter of the walk; `notify` is called
    with each decision. `centres` (3,) m in standing ("R.Hip.Centre") of this source replace those
    by landmarks. `symmetric` is that of the configuration's `scaling`. Raises ScalingError or
    RecordError.
    """
    stood = _by_standing(
        request, session, notify, centres, centres_source=centres_source, symmetric=symmetric
    )
    odd = list(stood.odd.flags)
    model, placement = stood.scaled.model, stood.placement
    checked = []
    for number in range(len(session.walking)):
        with of_trial(number):
            checked.append(_with_right_labels(model, placement, session, number, request, notify))
    fit = _fit_to_trials(
        request, processing, session, checked[0][0], model, placement, centres or {}
    )
    notify(
        "scaling",
        f"joint fit: marker RMS from {1000 * fit.rms_before:.1f} to {1000 * fit.rms_after:.1f} mm, "
        f"largest from {1000 * fit.largest_before:.0f} to {1000 * fit.largest_after:.0f} mm",
    )
    if not fit.converged:
        odd.append(
            QualityFlag(
                "joint fit", "joint fit", 0.0, 1.0, "1", "it ended before it had found what fits "
                "best: lengths and places of markers may be off. Look at the labels of the markers "
                "in standing and walking",
            )
        )  # fmt: skip
        notify("warnings", str(odd[-1]))
    chosen = _with_lengths_of(fit, stood.measured)
    return FittedBody(
        chosen=chosen,
        scaled=build_body(request, chosen),
        markers=fit.markers,
        placement=placement,
        fit=fit,
        walking=tuple(walking for walking, _ in checked),
        warnings=tuple(
            (*(odd if number == 0 else ()), *warnings)
            for number, (_, warnings) in enumerate(checked)
        ),
        centres=centres or {},
        looked=stood.odd.looked,
    )


class _Standing(NamedTuple):
    """The body by the standing trial alone, and warnings about it."""

    measured: Measurements
    scaled: ScaledBody
    odd: Result
    placement: MarkerPlacement


def _by_standing(
    request: Request,
    session: SessionRecordings,
    notify: Notify,
    centres: Mapping[str, Array] | None,
    *,
    centres_source: str,
    symmetric: bool,
) -> _Standing:
    """The body by the landmarks of the standing trial."""
    places, marker_set = standing_places(session.standing), session.marker_set
    on_landmarks = marker_set.on_landmarks({name: at.tolist() for name, at in places.items()})
    by_crests = any(warning.check == FROM_CRESTS for _, warning in session.warnings)
    estimated = SPINES if by_crests else ()
    with about_file(str(request.static)):
        measured = measure(
            on_landmarks, **request.widths, centres=centres, centres_source=centres_source
        )
        measured = replace(measured, symmetric=symmetric and not measured.legs_differ)
        if "midfoot" in measured.sources.get("foot", ""):
            notify("scaling", f"foot: {measured.sources['foot']}; no marker shows how long it is")
        scaled = build_body(request, measured)
        odd = look(
            StandingBody(
                points={name: at for name, at in on_landmarks.items() if name not in estimated},
                lengths=scaled.table,
                widths={"knee width": request.knee_width, "ankle width": request.ankle_width},
                height=request.height_m,
                stood=not request.stands_in_walk,
                longer_leg=measured.longer_leg,
            )
        )
        for warning in odd.flags:
            notify("warnings", str(warning))
        placement = place_markers(
            scaled.model, measured, places, marker_set, **request.widths, centres=centres
        )
    return _Standing(measured, scaled, odd, placement)


def _fit_to_trials(
    request: Request,
    processing: ProcessingSettings,
    session: SessionRecordings,
    walking: Recording,
    model: BodyModel,
    placement: MarkerPlacement,
    centres: Mapping[str, Array],
) -> ModelFit:
    """The joint fit of lengths and places of markers to the standing and one `walking` trial."""
    names = [marker.name for marker in placement.markers]
    stood = session.standing.columns(names)
    stood[:, [name in placement.moved for name in names]] = np.nan
    smooth = low_pass(
        walking.markers,
        rate=walking.marker_rate,
        cutoff_hz=processing.marker_cutoff_hz,
        order=processing.filter_order,
    )
    roles = session.marker_set.markers
    placed = {name: MODEL_FIT.anatomical_sd for name in names if roles[name].role == "anatomical"}
    placed |= {name: sd for name, sd in session.placement_sd.items() if name in names}
    markers, walked = placement.markers, replace(walking, markers=smooth)
    if request.joint_centres == "given":
        from gaitval.scaling.given_centres import segment_below, with_centres

        # A marker in each joint, which goes with those of the segment above.
        markers += tuple(
            ModelMarker(name, segment_below(name), np.zeros(3), FITTED_WEIGHT) for name in centres
        )
        there = np.tile(np.array([*centres.values()]), (len(stood), 1, 1))
        stood = np.concatenate([stood, there], axis=1)
        walked = with_centres(
            walked, session.marker_set.segments, standing_places(session.standing), centres
        )
        names = [*names, *centres]
        placed |= dict.fromkeys(centres, GIVEN_SD)
    fitted = partial(
        fit_model,
        model,
        markers,
        stood,
        walked.columns(names),
        placement_sd=placed,
    )
    # Who asks for the hips of a model, or gives centres, wants those, not what the walk makes of
    # them.
    if request.joint_centres == "given":
        fitted = partial(fitted, length_sd=dict.fromkeys(_given_lengths(centres), 0.0))
    elif request.joint_centres in GENERIC:
        fitted = partial(fitted, length_sd=dict.fromkeys(HIP_LENGTHS, 0.0))
    fit, tissue = fitted(), MODEL_FIT.soft_tissue_sd
    # Without a standing trial, only the walk can show that its markers move less than skin does.
    while request.stands_in_walk and TISSUE_OVER_RESIDUAL * fit.measurement_sd < 0.95 * tissue:
        tissue = TISSUE_OVER_RESIDUAL * fit.measurement_sd
        fit = fitted(soft_tissue_sd=tissue)
    return replace(fit, markers=fit.markers[: len(placement.markers)])


def _given_lengths(centres: Collection[str]) -> tuple[str, ...]:
    """Lengths of the joint fit that `centres` of both sides determine."""
    hips, knees, ankles = (
        all(f"{side}.{joint}.Centre" in centres for side in "RL")
        for joint in ("Hip", "Knee", "Ankle")
    )
    return (
        *(HIP_LENGTHS if hips else ()),
        *(("thigh",) if hips and knees else ()),
        *(("shank",) if knees and ankles else ()),
    )


def _with_lengths_of(fit: ModelFit, measured: Measurements) -> Measurements:
    """Measurements with the lengths of the joint fit. Arms without markers keep de Leva's; trunk
    and shoulders depend on the hips, which the fit moves.
    """
    taken = {
        length.name: length.fitted
        for length in fit.lengths
        if length.fitted != length.prior
        or length.name in ("lumbar_forward", "lumbar_up", "shoulder_up")
    }
    return with_fitted_lengths(measured, taken, "joint fit to standing and walking")


def _with_right_labels(
    model: BodyModel,
    placement: MarkerPlacement,
    session: SessionRecordings,
    number: int,
    request: Request,
    notify: Notify,
) -> tuple[Recording, list[QualityFlag]]:
    """The walking trial `number`, in which no two markers have each other's names: those that have
    are put right, and this is reported, or refused (`exchanged_markers.put_right`).
    """
    walking, warnings = session.walking[number], list[QualityFlag]()
    while True:
        markers = [
            marker
            for marker in placement.markers
            if marker.name in walking.names and marker.name not in placement.moved
        ]
        measured = walking.columns([marker.name for marker in markers])
        exchange = find_exchanged(model, markers, measured)
        if exchange is None:
            return walking, warnings
        standing, again = str(request.static), len(warnings) < len(markers)
        walking, warning = put_right(exchange, session.marker_set, walking, standing, again=again)
        warnings.append(warning)
        notify("warnings", f"{request.called(number)}: {warning}")


def put_right(
    exchange: Exchange, marker_set: MarkerSet, walking: Recording, static: str, *, again: bool
) -> tuple[Recording, QualityFlag]:
    """A walking trial in which two markers no longer have each other's names, and what was done.

    Two tracking markers of one segment are exchanged back: which of them is which matters to
    nothing but their own places. Two of arms and trunk are left out.

    Parameters
    ----------
    exchange : of the two markers.
    marker_set : their segments and roles.
    walking : the trial.
    static : the standing trial, for the message of the error.
    again : whether so few were exchanged so far that it may help.

    Raises
    ------
    RecordError : others are exchanged, or it did not help.
    """
    first, second = (marker_set.markers[name] for name in (exchange.first, exchange.second))
    both = f"{exchange.first} and {exchange.second}"
    if {first.segment, second.segment} <= ARMS:
        # An arm turns as it likes, and no leg needs its markers.
        kept = [name for name in walking.names if name not in (exchange.first, exchange.second)]
        return walking.with_markers(kept, walking.columns(kept)), QualityFlag(
            *("exchanged markers", both, exchange.own, exchange.crossed, "m"),
            f"may have each other's names: {exchange}. No leg needs them: left out",
        )
    tracking = first.role == second.role == "tracking" and first.segment == second.segment
    if not (tracking and again):
        raise RecordError(
            f"{walking.source}: the markers {both} have each other's names here or in {static}: "
            f"{exchange}. Look at both trials in the recording program, correct the labels and "
            "export again."
        )
    swap = {exchange.first: exchange.second, exchange.second: exchange.first}
    names = [swap.get(name, name) for name in walking.names]
    return walking.with_markers(names, walking.markers), QualityFlag(
        *("exchanged markers", both, exchange.own, exchange.crossed, "m"),
        f"have each other's names in walking or in standing: {exchange}. Exchanged back, for both "
        "only track one segment; look at the labels",
    )
