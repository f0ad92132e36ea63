"""Validate a subject's rollouts: the contents of `metrics.json`."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitval.artefacts import value_hash, versions
from gaitval.configuration import Configuration
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ArtefactError
from gaitval.gait.record import GaitRecord
from gaitval.metrics.baselines import predicted_parts, skill
from gaitval.metrics.comparison import (
    Curves,
    compare_curve,
    low_pass_of,
    recorded_curves,
    simulated_curves,
)
from gaitval.metrics.cycles import GaitCycles, cut, find_cycles, spatiotemporal, walking_speed
from gaitval.metrics.epsilon import NORMALISATION, epsilon
from gaitval.metrics.foot_contact import FootContact, foot_contacts
from gaitval.metrics.joint_power import JointPower, joint_power, power_measures
from gaitval.metrics.origin import (
    Origins,
    record_origins,
)
from gaitval.metrics.recorded import (
    CURVE_UNITS,
    by_kind,
    errors_as_measured,
    kinetics,
    recorded_part,
)
from gaitval.metrics.results import SCHEMA_VERSION, metrics_from
from gaitval.metrics.rollouts import Endurance, Rollouts
from gaitval.metrics.spread import (
    repeated_values,
)
from gaitval.metrics.told_measures import uses
from gaitval.metrics.tolerances import UNITS, Measure
from gaitval.metrics.torque_shares import Shares
from gaitval.metrics.typed import tidy
from gaitval.metrics.unrecorded import step_width_measure, unrecorded
from gaitval.metrics.unseen import unseen
from gaitval.metrics.verdict_rows import (
    judged,
    measure_rows,
    spread_in_repeats,
    summary,
    verdict_row,
)
from gaitval.metrics.walk_statistics import foot_progression, walk_statistics
from gaitval.metrics.whole_body import (
    walked_centre_of_mass,
    whole_body_measures,
)
from gaitval.model.body import BodyModel
from gaitval.prediction.told import is_unrecorded, quantities_recorded
from gaitval.simulation.rollout import Rollout

if TYPE_CHECKING:
    from gaitval.datasets.subject import Subject

Json = dict[str, Any]

ENDURANCE = ("consecutive_cycles", "falls")
"""Measures of how far walks go; the second engine's is no longer than what is compared."""

EXTERNAL_LOAD = (
    "no external force is applied to the body, by construction; checked in "
    "tests/simulation/test_walker.py::test_nothing_but_gravity_and_ground_acts_on_a_walk"
)
"""Stated instead of a verdict: a measured zero could not fail, but the test can."""

RMSE = {"angles": "angle_rmse", "moments": "moment_rmse", "forces": "force_rmse"}
_SKILL = {"angles": "angle_skill", "moments": "moment_skill", "forces": "force_skill"}

_SPATIOTEMPORAL_UNITS = {
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


def _spatiotemporal(
    rollout: Rollout, cycles: GaitCycles, places: Mapping[Side, Any], recorded: Json
) -> list[Json]:
    speed = walking_speed(rollout, cycles)
    values = spatiotemporal(rollout, cycles, places)
    rows = []
    for name, unit in _SPATIOTEMPORAL_UNITS.items():
        if name == "walking_speed":
            mean, deviation = speed, None
        else:
            found = values[name]
            mean = float(found.mean()) if len(found) else None
            deviation = float(found.std(ddof=1)) if len(found) > 1 else None
        rows.append(
            {
                "name": name,
                "unit": unit,
                "mean": mean,
                "sd": deviation,
                "recorded": recorded["spatiotemporal"].get(name),
            }
        )
    return rows


def _check_starts(walks: Rollouts, wanted: Sequence[float], which: str) -> None:
    compared = float(walks.compared.start_phase[0])
    seen = [start.start_phase for start in walks.starts]
    if len(seen) != len(wanted) or not np.allclose([compared, *seen], [wanted[0], *wanted]):
        raise ArtefactError(
            f"the {which} rollouts start at the phases {seen}, and the compared one at "
            f"{compared:g}, but validation.start_phases is {list(wanted)}: they are from another "
            "configuration. Run `gaitval simulate` again."
        )


def _compared(
    rollout: Rollout,
    record: GaitRecord,
    recorded: Json,
    model: BodyModel,
    configuration: Configuration,
) -> tuple[GaitCycles, Curves, Mapping[Side, FootContact], list[Json]]:
    """The compared cycles, with their curves, contacts and spatiotemporal parameters."""
    validation = configuration.validation
    cycles = find_cycles(rollout, configuration).first(validation.cycles)
    filters = low_pass_of(record, validation.filter_frequency)
    curves = simulated_curves(rollout, cycles, mass=model.mass, filters=filters)
    threshold = configuration.contact.event_threshold
    contacts = foot_contacts(rollout, cycles, model, threshold=threshold)
    places = {side: contact.places for side, contact in contacts.items()}
    return cycles, curves, contacts, _spatiotemporal(rollout, cycles, places, recorded)


def skill_measures(errors: Json, guesses: Sequence[Json]) -> list[Measure]:
    """Skill against the first prediction, of every curve that was recorded."""
    return [
        Measure(_SKILL[kind], name, skill(None if error is None else error["rmse"], guess))
        for prediction in guesses[:1]
        for kind, each in errors.items()
        for name, error in each.items()
        if (guess := prediction["rmse"][kind][name]) is not None
    ]


def _unfiltered_measures(
    rollout: Rollout, cycles: GaitCycles, recorded: Json, mass: float
) -> list[Measure]:
    """RMSE of the vertical force as it acts on the feet, which no filter has smoothed."""
    measures = []
    for column, side in enumerate(SIDES):
        force = rollout.ground_reaction[:, column, 2] * (100.0 / (mass * GRAVITY))
        curves = cut(force, cycles.starts[side], cycles.ends[side])
        name = f"vertical_{side[0]}"
        found = compare_curve(curves, recorded["curves"]["forces"][name])
        measures.append(
            Measure("unfiltered_force_rmse", name, None if found is None else found.rmse)
        )
    return measures


def _walk(
    walks: Rollouts,
    record: GaitRecord,
    recorded: Json,
    guesses: Sequence[Json],
    model: BodyModel,
    leg_length: float,
    configuration: Configuration,
) -> tuple[Json, list[Measure]]:
    """Everything reported on the rollouts with one set of body parameters, and their measures."""
    rollout = walks.compared
    cycles, compared, contacts, rows = _compared(rollout, record, recorded, model, configuration)
    of_record = recorded_curves(record)
    error = epsilon(compared, of_record)
    curves: Json = {}
    errors: Json = {}
    measures = []
    for kind, simulated in by_kind(compared).items():
        curves[kind], errors[kind] = {}, {}
        for name, curve in simulated.items():
            curves[kind][name] = {
                "mean": curve.mean(axis=0) if len(curve) else None,
                "sd": curve.std(axis=0, ddof=1) if len(curve) > 1 else None,
            }
            found = compare_curve(curve, recorded["curves"][kind][name])
            errors[kind][name] = None if found is None else asdict(found)
            measures.append(Measure(RMSE[kind], name, None if found is None else found.rmse))
    path = walked_centre_of_mass(rollout, cycles)
    stride = {row["name"]: row["mean"] for row in rows}
    power = joint_power(compared, {side[0]: stride[f"stride_time_{side}"] for side in SIDES})
    return {
        "mu": rollout.mu,
        "starts": [start.as_dict() for start in walks.starts],
        "cycles": {side: cycles.count(side) for side in SIDES},
        "spatiotemporal": rows,
        "foot_contact": {side: contact.as_dict() for side, contact in contacts.items()},
        "curves": curves,
        "errors": errors,
        "errors_as_measured": errors_as_measured(curves, recorded["as_measured"]),
        "joint_power": None if power is None else asdict(power),
        "centre_of_mass": path,
        "epsilon": None if error is None else error.as_dict(),
    }, [
        *measures,
        *skill_measures(errors, guesses),
        *_unfiltered_measures(rollout, cycles, recorded, model.mass),
        *unrecorded(rollout, cycles, mass=model.mass).measures(),
        step_width_measure(stride["step_width"], leg_length),
        *power_measures(power, JointPower(**recorded["joint_power"])),
        *whole_body_measures(
            path,
            recorded["centre_of_mass"],
            {name: each.mean(axis=0) for name, each in kinetics(compared).items() if len(each)},
            kinetics(of_record),
        ),
        *spatiotemporal_measures(rows),
        *endurance_measures(walks.starts),
        Measure("epsilon", "walk", None if error is None else error.total),
    ]


def compared_with(
    subject: "Subject",
    record: GaitRecord,
    others: Sequence["Subject"],
    configuration: Configuration,
) -> tuple[Json, list[Json]]:
    """The record's part of `metrics.json`, and that of the predictions without a model."""
    origins = record_origins(subject, configuration.record)
    recorded = {**recorded_part(record, subject), "origins": origins}
    return recorded, predicted_parts(subject, others, recorded["curves"], origins)


def measures_of_walk(
    walks: Rollouts,
    record: GaitRecord,
    recorded: Json,
    guesses: Sequence[Json],
    model: BodyModel,
    leg_length: float,
    configuration: Configuration,
) -> list[Measure]:
    """Everything that is measured of a walk, as `validate` measures it."""
    return _walk(walks, record, recorded, guesses, model, leg_length, configuration)[1]


def _statistics(
    rollout: Rollout,
    record: GaitRecord,
    recorded: Json,
    model: BodyModel,
    configuration: Configuration,
    origins: Origins,
    age_years: float | None,
) -> Json | None:
    """Statistics of the whole curves of a walk."""
    cycles = find_cycles(rollout, configuration).first(configuration.validation.cycles)
    filters = low_pass_of(record, configuration.validation.filter_frequency)
    curves = simulated_curves(rollout, cycles, mass=model.mass, filters=filters)
    feet = foot_progression(rollout, cycles, model)
    return walk_statistics(curves, feet, record, recorded["curves"], origins, age_years=age_years)


def _spatiotemporal_errors(rows: Sequence[Json]) -> list[Measure]:
    """Speed, stride time, stance and steps, simulated less recorded."""
    row = {each["name"]: each for each in rows}

    def error(name: str) -> float | None:
        mean = row[name]["mean"]
        return None if mean is None else mean - row[name]["recorded"]

    def measure(kind: str, target: str, name: str, factor: float) -> Measure:
        found = error(name)
        return Measure(kind, target, None if found is None else factor * found)

    relative = {
        name: 100.0 / row[name]["recorded"] for name in ("walking_speed", "stride_time_right")
    }
    return [
        measure("speed_error", "walk", "walking_speed", relative["walking_speed"]),
        measure("stride_time_error", "walk", "stride_time_right", relative["stride_time_right"]),
        *(
            measure("stance_fraction_error", side, f"stance_fraction_{side}", 100.0)
            for side in SIDES
        ),
        *(measure("step_length_error", side, f"step_length_{side}", 100.0) for side in SIDES),
    ]


def spatiotemporal_measures(rows: Sequence[Json]) -> list[Measure]:
    """Absolute errors of speed, stride time, stance and steps."""
    return [
        replace(each, value=None if each.value is None else abs(each.value))
        for each in _spatiotemporal_errors(rows)
    ]


def endurance_measures(starts: Sequence[Endurance]) -> list[Measure]:
    """Cycles from each start, and falls."""
    return [
        *(
            Measure(
                "consecutive_cycles",
                f"start phase {start.start_phase:g}",
                float(start.cycles["right"]),
            )
            for start in starts
        ),
        Measure("falls", "walk", float(sum(start.fell for start in starts))),
    ]


def push_measures(pushes: Mapping[str, Any] | None) -> list[Measure]:
    """Share of the pushes that are survived, by phase."""
    if pushes is None:
        return []
    return [
        Measure("push_survival", f"phase {phase:g}", 100.0 * sum(survived) / len(survived))
        for phase, survived in zip(pushes["phases"], pushes["survived"], strict=True)
    ]


def _method(
    record: GaitRecord, model: BodyModel, configuration: Configuration, centring: float | None
) -> Json:
    """How the rollouts were made and compared with the record."""
    settings = configuration.validation
    share = configuration.environment.centring if centring is None else centring
    return {
        "centring": share,
        "model_mass_kg": model.mass,
        "gravity_m_s2": GRAVITY,
        "body_weight_n": model.mass * GRAVITY,
        "event_threshold_n": configuration.contact.event_threshold,
        "filter_frequency_hz": settings.filter_frequency,
        "record_low_pass": None if record.low_pass is None else asdict(record.low_pass),
        "settling_cycles": settings.settling_cycles,
        "cycles": settings.cycles,
        "consecutive_cycles": settings.consecutive_cycles,
        "epsilon": NORMALISATION,
        "external_load": EXTERNAL_LOAD,
    }


def _witness(walks: Rollouts, measures: Sequence[Measure], origins: Origins) -> Json:
    """What a walk in the second engine says about the walk that is validated."""
    (start,) = walks.starts
    verdicts = judged([each for each in measures if each.measure not in ENDURANCE], origins)
    counted = summary(verdicts)
    return {
        "engine": f"MuJoCo {version('mujoco')}",
        "fell": start.fell,
        "cycles": start.cycles,
        "goals": counted["goals"],
        "goals_reached": counted["goals_reached"],
        "measures": [{**asdict(each), "unit": UNITS[each.measure]} for each in measures],
    }


def provenance_of(subject: "Subject", configuration: Configuration, recorded: Json) -> Json:
    """Versions, and hashes of what was compared."""
    return {
        "versions": versions(),
        # no number depends on how pages look
        "configuration": value_hash(configuration.model_dump(mode="json", exclude={"report"})),
        "subject": value_hash(subject.to_toml()),
        "record": value_hash(recorded),
    }


def validate(
    subject: "Subject",
    record: GaitRecord,
    model: BodyModel,
    nominal: Rollouts,
    identified: Rollouts | None,
    configuration: Configuration,
    *,
    identification: Mapping[str, Any] | None = None,
    correction: Mapping[str, Any] | None = None,
    training: Mapping[str, Any] | None = None,
    pushes: Mapping[str, Any] | None = None,
    others: Sequence["Subject"] = (),
    torque_shares: Shares | None = None,
    witness: Rollouts | None = None,
    repeats: Sequence[Mapping[str, Any]] = (),
    centring: float | None = None,
    prediction_errors: Mapping[str, Any] | None = None,
) -> Json:
    """Compare rollouts with the record: the contents of `metrics.json`.

    The rollout from the first start phase is compared curve by curve; those from all phases must
    reach the number of cycles without a fall. Tolerances are applied to the identified body if any.
    Equal rollouts give equal bytes. It is long because the file has many parts, which are listed
    once, here.

    Parameters
    ----------
    model : the body before mu.
    nominal, identified : rollouts without pushes with the nominal and identified body parameters.
        Those that are validated start from each of `validation.start_phases`; nominal ones that are
        only compared, from the first one.
    identification, correction, training : stored unchanged.
    pushes : `PushRecovery.as_dict` of the validated body.
    others, torque_shares : who predictions without a model are made from; of the validated rollout.
    witness : the compared rollout of that body in the second physics engine.
    repeats : what was measured of repeated walks (`repeats.repeated_walks`).
    centring : share of the policy's habit that was taken away, if not the configured one.
    prediction_errors : of trials that were held out (`held_out.prediction_errors`), to stand beside
        the distance from a prediction.

    Raises
    ------
    ArtefactError : the rollouts do not start from the configured phases.
    """
    recorded, guesses = compared_with(subject, record, others, configuration)
    origins = recorded["origins"]
    told = uses(subject, configuration)
    unrecorded_speed = is_unrecorded(configuration.record)
    final = "nominal" if identified is None else "identified"
    phases = configuration.validation.start_phases
    walks: Json = {"identified": None}
    measures: list[Measure] = []
    for which, each in (("nominal", nominal), ("identified", identified)):
        if each is not None:
            _check_starts(each, phases if which == final else phases[:1], which)
            shared = (record, recorded, guesses, model, subject.leg_length_m, configuration)
            walks[which], measures = _walk(each, *shared)
    measures += push_measures(pushes)
    verdicts = judged(measures, origins)
    repeated, starts = repeated_values(repeats), (identified or nominal).starts
    metrics: Json = tidy(
        {
            "schema_version": SCHEMA_VERSION,
            "subject": {
                "identifier": subject.identifier,
                "source": subject.described,
                "citation": subject.citation,
                "licence": subject.licence,
            },
            "units": CURVE_UNITS,
            "method": _method(record, model, configuration, centring),
            "record": recorded,
            "recorded": [] if unrecorded_speed else list(quantities_recorded(subject)),
            "told": told,
            "predictions": guesses,
            "unseen": [] if unrecorded_speed else unseen(subject, walks[final]["curves"]),
            "prediction_errors": prediction_errors,
            "walks": walks,
            "final": final,
            "measures": measure_rows(measures, told, origins),
            "tolerances": [
                verdict_row(verdict, spread_in_repeats(verdict, repeated, pushes, starts))
                for verdict in verdicts
            ],
            "summary": summary(verdicts),
            "push_recovery": pushes,
            "torque_shares": torque_shares,
            "curve_statistics": _statistics(
                (identified or nominal).compared,
                record,
                recorded,
                model,
                configuration,
                origins,
                subject.age_years,
            ),
            "witness": witness and _witness(witness, _walk(witness, *shared)[1], origins),
            "identification": identification,
            "correction": correction,
            "training": training,
        }
    )
    metrics["provenance"] = provenance_of(subject, configuration, metrics["record"])
    return metrics_from(metrics, "the metrics of this run").as_dict()
