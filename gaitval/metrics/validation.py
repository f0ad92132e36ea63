"""Validation of a subject's simulated walks: the content of `metrics.json`."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

import jsonschema
import numpy as np

from gaitval.artefacts import value_hash, versions
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES
from gaitval.data.record import GaitRecord
from gaitval.errors import ArtefactError, ToleranceError
from gaitval.kinematics.tree import GRAVITY
from gaitval.metrics.comparison import (
    Curves,
    compare_curve,
    low_pass_of,
    recorded_curves,
    simulated_curves,
)
from gaitval.metrics.cycles import GaitCycles, find_cycles, spatiotemporal, walking_speed
from gaitval.metrics.epsilon import NORMALISATION, epsilon
from gaitval.metrics.tolerances import UNITS, Measure, Verdict, evaluate
from gaitval.simulation.rollout import Rollout

if TYPE_CHECKING:
    from gaitval.data.subject import Subject

Json = dict[str, Any]

SCHEMA_VERSION = 1

CURVE_UNITS = {"angles": "deg", "moments": "Nm/kg", "forces": "% BW"}
"""Units of the curves and their errors in `metrics.json`."""
_SCALE = {"angles": 180.0 / math.pi, "moments": 1.0, "forces": 100.0}
_RMSE = {"angles": "angle_rmse", "moments": "moment_rmse", "forces": "force_rmse"}

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


def _by_kind(curves: Curves) -> dict[str, dict[str, Any]]:
    """The curves of each kind in the units of `CURVE_UNITS`."""
    return {
        kind: {name: curve * scale for name, curve in getattr(curves, kind).items()}
        for kind, scale in _SCALE.items()
    }


def _recorded(record: GaitRecord) -> Json:
    phase = np.arange(1000) / 1000
    force = {side: record.ground_reaction(side, phase) for side in SIDES}
    right_on = phase <= record.stance_fraction["right"]
    left_on = (phase - record.left_phase) % 1.0 <= record.stance_fraction["left"]
    return {
        "curves": _by_kind(recorded_curves(record)),
        "spatiotemporal": {
            "walking_speed": record.speed,
            "cadence": 120.0 / record.stride_time,
            "stride_time_right": record.stride_time,
            "stride_time_left": record.stride_time,
            "stance_fraction_right": record.stance_fraction["right"],
            "stance_fraction_left": record.stance_fraction["left"],
            "double_support_fraction": float((right_on & left_on).mean()),
        },
        "left_phase": record.left_phase,
        "mean_vertical_force": float(sum(force[side][:, 2].mean() for side in SIDES)),
    }


def _start(rollout: Rollout, cycles: GaitCycles) -> Json:
    """What is told of every walk, the compared one and those from the other start phases."""
    return {
        "start_phase": float(rollout.start_phase[0]),
        "fell": bool(rollout.fell[0]),
        "seconds": float(rollout.time[-1] - rollout.time[0]),
        "cycles": {side: cycles.count(side) for side in SIDES},
        "scuffs": {side: cycles.events[side].scuffs for side in SIDES},
        "walking_speed": walking_speed(rollout, cycles),
    }


def _spatiotemporal(rollout: Rollout, cycles: GaitCycles, recorded: Json) -> list[Json]:
    speed = walking_speed(rollout, cycles)
    values = spatiotemporal(rollout, cycles)
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


def _external_load(rollouts: Sequence[Rollout]) -> tuple[float, float, float]:
    """Largest external force N and moment Nm on the pelvis, largest ground reaction N."""
    load = np.concatenate([rollout.root_force for rollout in rollouts])
    ground = np.concatenate([rollout.ground_reaction.reshape(-1, 3) for rollout in rollouts])
    force, moment = (np.linalg.norm(part, axis=1).max() for part in (load[:, 3:], load[:, :3]))
    if force != 0.0 or moment != 0.0:
        raise ToleranceError(
            f"a walk to be validated has an external load on the pelvis of {force:g} N and "
            f"{moment:g} Nm, but it must be held up by its feet alone. Validate walks without "
            "pushes."
        )
    return float(force), float(moment), float(np.linalg.norm(ground, axis=1).max())


def _check_starts(rollouts: Sequence[Rollout], configuration: Configuration, which: str) -> None:
    seen = [float(rollout.start_phase[0]) for rollout in rollouts]
    wanted = configuration.validation.start_phases
    if len(seen) != len(wanted) or not np.allclose(seen, wanted, atol=1e-6):
        raise ArtefactError(
            f"the {which} walks start at the phases {seen}, but validation.start_phases is "
            f"{list(wanted)}: they are of another configuration. Run `gaitval simulate` again."
        )


def _walk(
    rollouts: Sequence[Rollout],
    record: GaitRecord,
    recorded: Json,
    mass: float,
    configuration: Configuration,
) -> tuple[Json, list[Measure]]:
    """Everything told of the walks with one set of body parameters, and what is measured."""
    force, moment, ground = _external_load(rollouts)
    cycles = [find_cycles(rollout, configuration) for rollout in rollouts]
    compared = simulated_curves(
        rollouts[0],
        cycles[0],
        mass=mass,
        filters=low_pass_of(record, configuration.validation.filter_frequency),
    )
    error = epsilon(compared, recorded_curves(record))
    curves: Json = {}
    errors: Json = {}
    measures = []
    for kind, simulated in _by_kind(compared).items():
        curves[kind], errors[kind] = {}, {}
        for name, curve in simulated.items():
            curves[kind][name] = {
                "mean": curve.mean(axis=0) if len(curve) else None,
                "sd": curve.std(axis=0, ddof=1) if len(curve) > 1 else None,
            }
            found = compare_curve(curve, recorded["curves"][kind][name])
            errors[kind][name] = None if found is None else asdict(found)
            measures.append(Measure(_RMSE[kind], name, None if found is None else found.rmse))
    starts = [_start(rollout, found) for rollout, found in zip(rollouts, cycles, strict=True)]
    rows = _spatiotemporal(rollouts[0], cycles[0], recorded)
    mean = {row["name"]: row["mean"] for row in rows}
    for measure, name in (
        ("speed_error", "walking_speed"),
        ("stride_time_error", "stride_time_right"),
    ):
        target = recorded["spatiotemporal"][name]
        found_mean = mean[name]
        relative = None if found_mean is None else 100.0 * abs(found_mean / target - 1.0)
        measures.append(Measure(measure, "walk", relative))
    for start in starts:
        measures.append(
            Measure(
                "consecutive_cycles",
                f"start phase {start['start_phase']:g}",
                float(start["cycles"]["right"]),
            )
        )
    measures += [
        Measure("falls", "walk", float(sum(start["fell"] for start in starts))),
        Measure("root_force", "walk", force),
        Measure("root_moment", "walk", moment),
        Measure("root_force_share", "walk", 100.0 * force / ground if ground > 0.0 else None),
        Measure("epsilon", "walk", None if error is None else error.total),
    ]
    return {
        "mu": rollouts[0].mu,
        "starts": starts,
        "spatiotemporal": rows,
        "curves": curves,
        "errors": errors,
        "epsilon": None if error is None else error.as_dict(),
    }, measures


def _verdict_row(verdict: Verdict) -> Json:
    return {
        **verdict.tolerance.model_dump(exclude={"applies_to", "value"}),
        "target": verdict.target,
        "value": verdict.value,
        "tolerance": verdict.tolerance.value,
        "passed": verdict.passed,
    }


def _tidy(value: Any) -> Any:
    """JSON-able copy, floats to six significant digits, what is not finite as null.

    So the file does not hang on the last bits of an arithmetic unit.
    """
    if isinstance(value, Mapping):
        return {str(key): _tidy(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _tidy(value.tolist())
    if isinstance(value, list | tuple):
        return [_tidy(item) for item in value]
    if isinstance(value, np.generic):
        return _tidy(value.item())
    if isinstance(value, float):
        return float(f"{value:.6g}") + 0.0 if math.isfinite(value) else None
    return value


def validate(
    subject: "Subject",
    record: GaitRecord,
    model_mass: float,
    rollouts_nominal: Sequence[Rollout],
    rollouts_identified: Sequence[Rollout],
    configuration: Configuration,
    *,
    identification: Mapping[str, Any] | None = None,
    training: Mapping[str, Any] | None = None,
) -> Json:
    """Compare simulated walks with the record: the content of `metrics.json`.

    The walk from the first start phase is compared curve by curve; all of them are held to the
    number of cycles, and none may fall. Tolerances judge the identified body, or the nominal one
    where there is no identified one. The result holds no times, and equal walks give equal bytes.

    Parameters
    ----------
    model_mass : kg.
    rollouts_nominal, rollouts_identified : walks without pushes at the nominal and at the
        identified body parameters, one for each of `validation.start_phases`; there may be no
        identified ones.
    identification, training : told as they are.

    Raises
    ------
    ArtefactError : the walks are not those of the configured start phases.
    ToleranceError : an external force holds the pelvis.
    """
    recorded = _recorded(record)
    walks: Json = {}
    measured: dict[str, list[Measure]] = {}
    for which, rollouts in (("nominal", rollouts_nominal), ("identified", rollouts_identified)):
        if which == "identified" and not rollouts:
            walks[which] = None
            continue
        _check_starts(rollouts, configuration, which)
        walks[which], measured[which] = _walk(rollouts, record, recorded, model_mass, configuration)
    final = "nominal" if walks["identified"] is None else "identified"
    verdicts = evaluate(measured[final])
    accepted = [verdict.passed for verdict in verdicts if verdict.tolerance.role == "acceptance"]
    settings = configuration.validation
    metrics: Json = _tidy(
        {
            "schema_version": SCHEMA_VERSION,
            "subject": {
                "identifier": subject.identifier,
                "source": subject.source,
                "citation": subject.citation,
                "licence": subject.licence,
            },
            "units": CURVE_UNITS,
            "method": {
                "model_mass_kg": model_mass,
                "gravity_m_s2": GRAVITY,
                "body_weight_n": model_mass * GRAVITY,
                "event_threshold_n": configuration.contact.event_threshold,
                "filter_frequency_hz": settings.filter_frequency,
                "record_low_pass": None if record.low_pass is None else asdict(record.low_pass),
                "settling_cycles": settings.settling_cycles,
                "cycles": settings.cycles,
                "epsilon": NORMALISATION,
            },
            "record": recorded,
            "walks": walks,
            "final": final,
            "measures": [
                {**asdict(measure), "unit": UNITS[measure.measure]} for measure in measured[final]
            ],
            "tolerances": [_verdict_row(verdict) for verdict in verdicts],
            "summary": {"accepted": sum(accepted), "refused": len(accepted) - sum(accepted)},
            "identification": identification,
            "training": training,
        }
    )
    metrics["provenance"] = {
        "versions": versions(),
        "configuration": value_hash(configuration.model_dump(mode="json")),
        "subject": value_hash(subject.to_toml()),
        "record": value_hash(metrics["record"]),
    }
    check_metrics(metrics, "the metrics of this run")
    return metrics


@cache
def _schema() -> Json:
    text = resources.files("gaitval.metrics").joinpath("metrics.schema.json").read_text("utf-8")
    schema: Json = json.loads(text)
    return schema


def check_metrics(metrics: Any, origin: str) -> None:
    """Raise ArtefactError where `metrics` is not of the published schema, saying where.

    Parameters
    ----------
    origin : where they come from, for the message.
    """
    error = jsonschema.exceptions.best_match(
        jsonschema.Draft202012Validator(_schema()).iter_errors(metrics)
    )
    if error is not None:
        place = "/".join(str(part) for part in error.absolute_path) or "the top level"
        raise ArtefactError(
            f"{origin}: not of the schema of metrics.json: at {place}, {error.message[:200]}. "
            "It is damaged or of another version of gaitval; run `gaitval validate` again."
        )
