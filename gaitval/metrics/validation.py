"""Validate a subject's rollouts: the contents of `metrics.json`.

It is long because that file has many parts, and each is made here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitval._internal.io.artefacts import value_hash, versions
from gaitval.arrays import Array, sample_deviation
from gaitval.configuration import Configuration
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ArtefactError, GaitvalError
from gaitval.gait.cycle_curves import Curves
from gaitval.gait.record import GaitRecord
from gaitval.kinetics.musculature.gait import MuscleGait, muscles_of
from gaitval.metrics.acceptance import accepted, known_groups, lights, skill_measures
from gaitval.metrics.comparator import Comparator, compared_with
from gaitval.metrics.comparison import (
    compare_curve,
    foot_progression,
    hip_centres,
    low_pass_of,
    rmse_of,
    simulated_curves,
)
from gaitval.metrics.curve_results import (
    KINDS,
    RMSE,
    CurveError,
    CurveLights,
    Kind,
    KnownTo,
    MeanCurve,
    RecordedFigures,
    RecordResult,
    by_kind,
    mean_curves,
)
from gaitval.metrics.cycles import GaitCycles, cut, find_cycles, spatiotemporal, walking_speed
from gaitval.metrics.epsilon import NORMALISATION, epsilon
from gaitval.metrics.foot_contact import Stances, foot_contacts
from gaitval.metrics.gait_profile import walk_profiles
from gaitval.metrics.learned import learned
from gaitval.metrics.learning_gain import LearningGain
from gaitval.metrics.origin import Origins, uses
from gaitval.metrics.other_trials import unseen
from gaitval.metrics.recorded import errors_as_measured
from gaitval.metrics.results import (
    SCHEMA_VERSION,
    CorrectionResult,
    CountBySide,
    CurveErrors,
    CurveUnits,
    Endurance,
    FootContacts,
    HeldOutErrors,
    IdentificationResult,
    Method,
    Metrics,
    Provenance,
    PushRecovery,
    Repeat,
    SecondEngineResult,
    Spatiotemporal,
    SpatiotemporalResult,
    SubjectResult,
    TorqueShares,
    WalkedCurves,
    WalkResult,
    WalkResults,
)
from gaitval.metrics.rollouts import Rollouts
from gaitval.metrics.side_measures import side_values
from gaitval.metrics.tolerances import Measure, Verdict, measured
from gaitval.metrics.torques import torques_of
from gaitval.metrics.typed import number, numbers, rounded
from gaitval.metrics.unrecorded import step_width_measure, unrecorded
from gaitval.metrics.verdict_rows import (
    ENDURANCE,
    judged,
    measure_rows,
    repeated_values,
    spread_in_repeats,
    summary,
)
from gaitval.metrics.walk_muscles import walk_motion
from gaitval.metrics.walk_quantities import (
    found_quantities,
    power_result,
    quantity_measures,
    quantity_results,
    stored_quantities,
)
from gaitval.metrics.whole_body import centre_of_mass_measures, walked_centre_of_mass
from gaitval.metrics.whole_error import error_rows, uncorrected_measures
from gaitval.model.body import BodyModel
from gaitval.model.parameters import apply_parameters
from gaitval.subjects.prediction.known import is_predicted, is_unrecorded, quantities_recorded
from gaitval.walk.simulation.rollout import Rollout

if TYPE_CHECKING:
    from gaitval.subjects.subject import Subject

EXTERNAL_LOAD = (
    "no external force is applied to the body, by construction; checked in "
    "tests/simulation/test_walker.py::test_nothing_but_gravity_and_ground_acts_on_a_walk"
)
"""Stated instead of a verdict: a measured zero could not fail, but the test can."""

_SPATIOTEMPORAL_UNITS: Final[Mapping[Spatiotemporal, str]] = {
    "walking_speed": "m/s",
    "cadence": "steps/min",
    "stride_time_right": "s",
    "stride_time_left": "s",
    "stance_fraction_right": "1",
    "stance_fraction_left": "1",
    "double_support_fraction": "1",
    "step_length_right": "m",
    "step_length_left": "m",
    "step_width": "m",
}


@dataclass(frozen=True)
class StageResults:
    """What the stages of a run found beside its walks.

    Attributes
    ----------
    identification, correction, training, torque_shares : stored unchanged; the shares are of the
        validated rollout.
    pushes : of the validated body.
    second_engine : the compared rollout of that body in the second engine.
    again : what was measured of repeated walks (`repeats.repeated_walks`).
    centring : share of the policy's action bias that was removed, if not the configured one.
    prediction_errors : of held-out trials (`held_out.prediction_errors`), given beside the distance
        from a prediction.
    """

    identification: IdentificationResult | None = None
    correction: CorrectionResult | None = None
    training: LearningGain | None = None
    pushes: PushRecovery | None = None
    torque_shares: TorqueShares | None = None
    second_engine: Rollouts | None = None
    again: Sequence[Repeat] = ()
    centring: float | None = None
    prediction_errors: HeldOutErrors | None = None


@dataclass(frozen=True)
class _Compared:
    """The cycles of a rollout that are compared, and what is cut from them."""

    cycles: GaitCycles
    curves: Curves
    stances: Mapping[Side, Stances]


def _compared(rollout: Rollout, of: Comparator, configuration: Configuration) -> _Compared:
    validation = configuration.validation
    cycles = find_cycles(rollout, configuration).first(validation.cycles)
    filters = low_pass_of(of.record, validation.filter_frequency)
    curves = simulated_curves(rollout, cycles, mass=of.model.mass, filters=filters)
    threshold = configuration.contact.event_threshold
    return _Compared(cycles, curves, foot_contacts(rollout, cycles, of.model, threshold=threshold))


def _spatiotemporal(
    rollout: Rollout, compared: _Compared, recorded: RecordedFigures
) -> list[SpatiotemporalResult]:
    places = {side: compared.stances[side].places for side in SIDES}
    values = spatiotemporal(rollout, compared.cycles, places)
    rows = []
    for name, unit in _SPATIOTEMPORAL_UNITS.items():
        if name == "walking_speed":
            mean, deviation = walking_speed(rollout, compared.cycles), None
        else:
            found = values[name]
            mean = float(found.mean()) if len(found) else None
            deviation = float(found.std(ddof=1)) if len(found) > 1 else None
        rows.append(
            SpatiotemporalResult(
                name=name,
                unit=unit,
                mean=number(mean),
                sd=number(deviation),
                recorded=getattr(recorded, name),
            )
        )
    return rows


def _check_starts(walks: Rollouts, wanted: Sequence[float], which: str) -> None:
    compared = float(walks.compared.start_phase[0])
    seen = [start.start_phase for start in walks.starts]
    if len(seen) != len(wanted) or not np.allclose([compared, *seen], [wanted[0], *wanted]):
        raise ArtefactError(
            f"the {which} rollouts start at the phases {seen}, and the compared one at "
            f"{compared:g}, but validation.start_phases is {list(wanted)}: they are from another "
            "configuration. Run `gaitval stage simulate SUBJECT` again."
        )


def _validated(nominal: Rollouts, identified: Rollouts | None, phases: Sequence[float]) -> Rollouts:
    """The rollouts that tolerances apply to. Raises ArtefactError if they, or those that they are
    compared with, do not start from the `phases`.
    """
    if identified is None:
        _check_starts(nominal, phases, "nominal")
        return nominal
    # nominal walks are then only for comparison, from the first phase
    _check_starts(nominal, phases[:1], "nominal")
    _check_starts(identified, phases, "identified")
    return identified


def _unfiltered_measures(
    rollout: Rollout, cycles: GaitCycles, recorded: Mapping[str, Array], mass: float
) -> list[Measure]:
    """RMSE of the vertical force as it acts on the feet, which no filter has smoothed."""
    measures = []
    for column, side in enumerate(SIDES):
        force = rollout.ground_reaction[:, column, 2] * (100.0 / (mass * GRAVITY))
        curves = cut(force, cycles.starts[side], cycles.ends[side])
        name = f"vertical_{side[0]}"
        error = rmse_of(compare_curve(curves, recorded[name]))
        measures.append(measured("unfiltered_force_rmse", name, error))
    return measures


def _muscles(rollout: Rollout, of: Comparator, compared: _Compared) -> MuscleGait | None:
    """Muscles of the compared cycles; None where they cannot be worked out."""
    body = apply_parameters(of.person, rollout.mu)
    laden = None if of.person is of.model else apply_parameters(of.model, rollout.mu)
    try:
        motion = walk_motion(
            rollout, compared.cycles, body, height=of.height, lost=of.lost, laden=laden
        )
        return muscles_of([motion])
    except GaitvalError:  # a walk that no muscle could walk has its limits failed elsewhere
        return None


def _walk(
    walks: Rollouts, of: Comparator, compared: _Compared, muscles: MuscleGait | None = None
) -> tuple[WalkResult, list[Measure]]:
    """Everything reported on the rollouts with one set of body parameters, and their measures."""
    rollout, cycles = walks.compared, compared.cycles
    rows = _spatiotemporal(rollout, compared, of.recorded.spatiotemporal)
    error = epsilon(compared.curves, of.curves)
    recorded = by_kind(of.curves)
    means: dict[Kind, dict[str, MeanCurve]] = {kind: {} for kind in KINDS}
    each_error: dict[Kind, dict[str, CurveError | None]] = {kind: {} for kind in KINDS}
    for kind, simulated in by_kind(compared.curves).items():
        for name, curve in simulated.items():
            deviation = sample_deviation(curve)
            means[kind][name] = MeanCurve(
                mean=numbers(curve.mean(axis=0)) if len(curve) else None,
                sd=None if deviation is None else numbers(deviation),
            )
            each_error[kind][name] = compare_curve(curve, recorded[kind][name])
    curves, errors = WalkedCurves(**means), CurveErrors(**each_error)
    path = walked_centre_of_mass(rollout, cycles)
    torques = torques_of(rollout, cycles, model=of.model, height=of.height)
    stride = {row.name: row.mean for row in rows}
    found = found_quantities(
        compared.curves,
        {"r": stride["stride_time_right"], "l": stride["stride_time_left"]},
        muscles,
        stride.get("walking_speed"),
        of.laden,
        rollout.hip_centre,
    )
    walk = WalkResult(
        mu=rollout.mu.tolist(),
        starts=list(walks.starts),
        cycles=CountBySide(right=cycles.count("right"), left=cycles.count("left")),
        spatiotemporal=rows,
        foot_contact=FootContacts(**{side: compared.stances[side].contact() for side in SIDES}),
        curves=curves,
        errors=errors,
        errors_as_measured=errors_as_measured(curves, of.recorded.as_measured),
        joint_power=power_result(found),
        centre_of_mass=None if path is None else path.tolist(),
        epsilon=error,
        hip_centres=hip_centres(rollout.hip_centre, mean_curves(compared.curves), of.curves),
        quantities=quantity_results(found),
        energy=torques.energy,
    )
    return walk, [
        *rmse_measures(errors),
        *uncorrected_measures(walk),
        *skill_measures(errors, of.baselines),
        *_unfiltered_measures(rollout, cycles, recorded["forces"], of.model.mass),
        *unrecorded(rollout, cycles, mass=of.model.mass, ground=of.model.ground),
        *torques.measures,
        step_width_measure(
            stride["step_width"], of.leg_length, of.recorded.spatiotemporal.step_width
        ),
        *quantity_measures(found, stored_quantities(of.recorded)),
        *centre_of_mass_measures(path, np.array(of.recorded.centre_of_mass)),
        *(measured(*each) for each in side_values(mean_curves(compared.curves), of.curves)),
        *spatiotemporal_measures(rows),
        *endurance_measures(walks.starts),
        measured("epsilon", "walk", None if error is None else error.total),
    ]


def rmse_measures(errors: CurveErrors) -> list[Measure]:
    """RMSE of every curve in `errors`."""
    return [measured(RMSE[kind], name, rmse_of(error)) for kind, name, error in errors.items()]


def _measured(
    walks: Rollouts, of: Comparator, configuration: Configuration
) -> tuple[WalkResult, list[Measure]]:
    return _walk(walks, of, _compared(walks.compared, of, configuration))


def measures_of_walk(
    walks: Rollouts, of: Comparator, configuration: Configuration
) -> list[Measure]:
    """Everything measured of `walks` against `of` with `configuration`, as in `validate`."""
    return _measured(walks, of, configuration)[1]


def spatiotemporal_measures(rows: Sequence[SpatiotemporalResult]) -> list[Measure]:
    """Sizes of the errors of speed, stride time, stance and step lengths in `rows`."""
    row = {str(each.name): each for each in rows}

    def measure(kind: str, target: str, name: str, factor: float) -> Measure:
        mean, recorded = row[name].mean, row[name].wanted
        if mean is None or recorded is None:
            return measured(kind, target, None)
        return measured(kind, target, abs(factor * (mean - recorded)))

    def relative(kind: str, name: str) -> Measure:
        recorded = row[name].wanted
        return measure(kind, "walk", name, 100.0 / recorded if recorded else 0.0)

    return [
        relative("speed_error", "walking_speed"),
        relative("stride_time_error", "stride_time_right"),
        *(
            measure(f"{name}_error", side, f"{name}_{side}", 100.0)
            for name in ("stance_fraction", "step_length")
            for side in SIDES
        ),
    ]


def endurance_measures(starts: Sequence[Endurance]) -> list[Measure]:
    """Right cycles from each of `starts`, and how many of the walks fell."""
    reached = ((f"start phase {each.start_phase:g}", float(each.cycles.right)) for each in starts)
    return [
        *(measured("consecutive_cycles", *each) for each in reached),
        measured("falls", "walk", float(sum(start.fell for start in starts))),
    ]


def push_measures(pushes: PushRecovery | None) -> list[Measure]:
    """Share of the `pushes` that are survived, %, by phase; empty if nothing was pushed."""
    if pushes is None:
        return []
    return [
        measured("push_survival", target, 100.0 * sum(survived) / len(survived))
        for target, survived in zip(pushes.targets(), pushes.survived, strict=True)
    ]


def _method(
    record: GaitRecord, model: BodyModel, configuration: Configuration, centring: float | None
) -> Method:
    """How the rollouts were made and compared with the record."""
    settings = configuration.validation
    return Method(
        centring=configuration.environment.centring if centring is None else centring,
        model_mass_kg=model.mass,
        gravity_m_s2=GRAVITY,
        body_weight_n=model.mass * GRAVITY,
        event_threshold_n=configuration.contact.event_threshold,
        filter_frequency_hz=settings.filter_frequency,
        record_low_pass=record.low_pass,
        settling_cycles=settings.settling_cycles,
        cycles=settings.cycles,
        consecutive_cycles=settings.consecutive_cycles,
        epsilon=NORMALISATION,
        external_load=EXTERNAL_LOAD,
    )


def _second_engine(
    walks: Rollouts, measures: Sequence[Measure], origins: Origins
) -> SecondEngineResult:
    """The second-engine check: results of the same walk in the second engine."""
    (start,) = walks.starts
    counted = summary(judged([each for each in measures if each.measure not in ENDURANCE], origins))
    return SecondEngineResult(
        engine=f"MuJoCo {version('mujoco')}",
        fell=start.fell,
        cycles=start.cycles,
        limits=counted.accepted + counted.refused,
        limits_met=counted.accepted,
        measures=list(measures),
    )


def provenance_of(
    subject: str, settings: Mapping[str, object], recorded: RecordResult
) -> Provenance:
    """Versions, and hashes of what was compared: the text of the file of the `subject`, and the
    `settings`, sections of the configuration, as in theirs. What a later gaitval would write has
    other fields, and a stored baseline must keep its hash. `recorded` is as in `metrics.json`; its
    quantities are left out, because they follow from the rest.
    """
    # no number depends on how pages look
    numbers = {name: section for name, section in settings.items() if name != "report"}
    return Provenance(
        versions=versions(),
        configuration=value_hash(numbers),
        subject=value_hash(subject),
        record=value_hash(
            {name: part for name, part in recorded.as_dict().items() if name != "quantities"}
        ),
    )


@dataclass(frozen=True)
class _Judgement:
    """What is said of a walk by limits, guesses and the second engine."""

    verdicts: list[Verdict]
    lights: CurveLights
    known_to: list[KnownTo]
    second_engine: SecondEngineResult | None


def _judgement(
    measures: Sequence[Measure],
    walk: WalkResult,
    starts: Sequence[Endurance],
    of: Comparator,
    by: StageResults,
    configuration: Configuration,
) -> _Judgement:
    """The judgement of a `walk` with these `measures`, which began from the first of `starts`."""
    repeated = repeated_values(by.again)
    rows = [
        each.model_copy(update={"spread": spread_in_repeats(each, repeated, by.pushes, starts)})
        for each in judged(measures, of.baselines.origins)
    ]
    verdicts = accepted(rows, walk.errors, of.known, of.baselines)
    errors = curves = second = None
    if by.second_engine is not None:
        there, measured_there = _measured(by.second_engine, of, configuration)
        errors, curves = there.errors, there.curves
        second = _second_engine(by.second_engine, measured_there, of.baselines.origins)
    return _Judgement(
        verdicts,
        lights(walk.errors, verdicts, of.known, of.baselines, errors, by.prediction_errors),
        known_groups(walk.curves, curves, of.known, of.baselines.origins),
        second,
    )


def validate(
    subject: "Subject",
    record: GaitRecord,
    model: BodyModel,
    nominal: Rollouts,
    identified: Rollouts | None,
    configuration: Configuration,
    by: StageResults | None = None,
    *,
    others: Sequence["Subject"] = (),
) -> Metrics:
    """Compare rollouts with the record: the contents of `metrics.json`.

    The rollout from the first start phase is compared curve by curve; those from all phases must
    reach the number of cycles without a fall. Tolerances are applied to an identified body if any.
    Equal rollouts give equal bytes.

    Parameters
    ----------
    subject, record : whom and what they are compared with, in the `configuration` of the run.
    model : the body before mu.
    nominal, identified : rollouts without pushes with the nominal and identified body parameters.
        The validated ones start from each of `validation.start_phases`; nominal ones that are only
        compared start from the first.
    by : what further stages found.
    others : people from whom predictions without a model are made.

    Raises
    ------
    ArtefactError : the rollouts do not start from the configured phases.
    """
    by = by or StageResults()
    hip_centre = nominal.compared.hip_centre
    of = compared_with(subject, record, others, model, configuration, hip_centre)
    known = uses(subject, configuration, trained=by.training is None or by.training.samples > 0)
    unrecorded_speed = is_unrecorded(configuration.record)
    last = _validated(nominal, identified, configuration.validation.start_phases)
    compared = _compared(last.compared, of, configuration)
    walk, measures = _walk(last, of, compared, _muscles(last.compared, of, compared))
    measures += push_measures(by.pushes)
    found = _judgement(measures, walk, last.starts, of, by, configuration)
    recorded = rounded(of.recorded)
    return rounded(
        Metrics(
            schema_version=SCHEMA_VERSION,
            subject=SubjectResult(
                identifier=subject.identifier,
                source=subject.described,
                citation=subject.citation,
                licence=subject.licence,
            ),
            units=CurveUnits(angles="deg", moments="Nm/kg", forces="% BW"),
            method=_method(record, model, configuration, by.centring),
            record=recorded,
            recorded=[] if unrecorded_speed else list(quantities_recorded(subject)),
            known=known,
            predictions=list(of.baselines.guesses),
            unseen=[] if is_predicted(configuration.record) else unseen(subject, walk.curves),
            prediction_errors=by.prediction_errors,
            walks=WalkResults(
                nominal=walk if identified is None else _measured(nominal, of, configuration)[0],
                identified=None if identified is None else walk,
            ),
            final="nominal" if identified is None else "identified",
            measures=measure_rows(measures, known, of.baselines.origins),
            tolerances=found.verdicts,
            summary=summary(
                found.verdicts,
                error_rows(walk, of.recorded, of.baselines),
                learned(
                    by.identification,
                    by.training,
                    by.correction,
                    by.torque_shares,
                    walk.epsilon,
                    configuration.identification.kappa,
                ),
            ),
            lights=found.lights,
            known_to=found.known_to,
            push_recovery=by.pushes,
            torque_shares=by.torque_shares,
            gait_profiles=walk_profiles(
                compared.curves,
                foot_progression(last.compared, compared.cycles, of.model),
                of.record,
                of.baselines.origins,
            ),
            second_engine=found.second_engine,
            identification=by.identification,
            correction=by.correction,
            training=by.training,
            provenance=provenance_of(
                subject.to_toml(), configuration.model_dump(mode="json"), recorded
            ),
        )
    )
