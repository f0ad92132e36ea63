"""A patient's walk by the general policy, without training, and how near it is to the strides.

This is the main job with a light validation: body, reference, policy and correction are the same,
but nothing is identified or pushed. From every start phase of the validation it walks as far as the
main job asks; the first cycles of all starts are compared with the strides as recorded.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval._internal.io.artefacts import read_json, value_hash, write_json
from gaitval._internal.numba.one_thread import one_thread
from gaitval.apps.patients.gentle_fit import gentle_reference
from gaitval.apps.patients.known_record import expected_record
from gaitval.apps.patients.passive_foot import patient_record
from gaitval.apps.patients.records import Patient, two_sided
from gaitval.apps.patients.turned_feet import turned_feet, with_turned_feet
from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES
from gaitval.correction.correct import correct
from gaitval.gait.cycle_curves import JOINT_MOMENTS
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.metrics.comparison import curves_of, foot_progression, rms
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.gait_profile import gait_profile
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.rollouts import record_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.prediction.known import KINEMATIC_ACCURACY
from gaitval.subjects.subject_file import builtin_subjects
from gaitval.walk.reference.adjustment import adjusted
from gaitval.walk.simulation.walker import WalkingTask

COMPARED: Final = 4
"""Cycles of each start that are compared, after the settling ones: 32 of eight starts."""
KNOWN: Final = tuple(name for name in PROFILE_ANGLES if name != "foot_progression")
"""Angles that the model knows, and has a coordinate for."""
VERSION: Final = 2
"""Of what a walk gives; one more when the same patient and settings give other figures."""
_PHASE: Final = np.linspace(0.0, 1.0, 101)

_Json = dict[str, Any]


@one_thread()
def walk(patient: Patient, policy: Policy, configuration: Configuration) -> _Json:
    """The results of the walk of a `patient` with a `policy`, by the `configuration`, for JSON:
    `falls` of `starts`; `cycles`, the fewest of a start and side that did not fall; `angles`, RMS
    from the stride by name, deg, and `angle`, their mean; `correction`, errors of the walk against
    its reference (`Corrected.errors`), and why a correction is not used; `scores`, Gait Profile
    Score of the stride and of the walk over nine angles, deg; `moments` of the walk and `expected`
    of healthy people, (101,) Nm/kg by name; `speed`, m/s. Angles, walk's score and moments are None
    if no start walked.
    """
    subject, others = patient.subject, builtin_subjects()
    straight = scale_subject(subject, symmetric=not two_sided(patient.person)).model
    record = patient_record(patient, others, straight)
    turns = turned_feet(patient.strides, record, straight)
    model = with_turned_feet(straight, turns)
    reference = gentle_reference(
        record, model, configuration.contact, KINEMATIC_ACCURACY, patient.person.amputation
    )
    task = WalkingTask(model=model, record=record, reference=reference, configuration=configuration)
    validation, mu = configuration.validation, nominal_parameters()
    correction = correct(task, policy, mu)
    changed = adjusted(reference, task.reference_body, correction.correction)
    task = replace(task, reference=changed)
    group = WalkingGroup([task] * 8)
    starts = validation.start_phases[:8]
    angles: dict[str, list[Array]] = {}
    moments: dict[str, list[Array]] = {}
    for rollout in record_together(
        group, policy, mu=mu, start_phases=starts, cycles=validation.settling_cycles + COMPARED
    ):
        cycles = find_cycles(rollout, configuration).first(COMPARED)
        if rollout.fell[0] or not all(cycles.count(side) for side in SIDES):
            continue
        curves = curves_of(task, rollout, cycles)
        points = foot_progression(rollout, cycles, model)
        for side, turn in turns.items():
            points[f"foot_progression_{side[0]}"] -= turn
        for name, values in (curves.angles | points).items():
            angles.setdefault(name, []).append(np.degrees(values))
        for name, values in curves.moments.items():
            moments.setdefault(name, []).append(values)
    went = correction.starts
    stood = [each for each in went if not each.fell]
    walked = {name: np.concatenate(each).mean(axis=0) for name, each in angles.items()}
    errors = {
        f"{name}_{side[0]}": rms(
            walked[f"{name}_{side[0]}"] - patient.strides.angles[f"{name}_{side[0]}"]
        )
        for name in (PROFILE_ANGLES if walked else ())
        for side in SIDES
    }
    controls = load_controls().curves
    usual = expected_record(subject, others)
    names = [f"{name}_{side[0]}" for name in JOINT_MOMENTS for side in SIDES]
    known_errors = [value for name, value in errors.items() if name[:-2] in KNOWN]
    return {
        "name": subject.identifier,
        "group": patient.strides.group,
        "affected": patient.affected,
        "prosthesis": patient.person.amputation,
        "starts": len(went),
        "falls": len(went) - len(stood),
        "cycles": min((min(each.cycles.right, each.cycles.left) for each in stood), default=0),
        "speed": float(np.mean([each.walking_speed or 0.0 for each in stood])) if stood else None,
        "angles": errors or None,
        "angle": float(np.mean(known_errors)) if known_errors else None,
        "correction": {"errors": correction.errors, "refused": correction.refused},
        "scores": {
            "stride": gait_profile(patient.strides.angles, controls).total,
            "walk": gait_profile(walked, controls).total if walked else None,
        },
        "moments": {
            name: np.concatenate(each).mean(axis=0).round(5).tolist()
            for name, each in moments.items()
        }
        or None,
        "expected": {name: usual.moments[name](_PHASE).round(5).tolist() for name in names},
    }


def walk_all(
    patients: Mapping[str, Patient],
    folder: Path,
    policy: Policy,
    configuration: Configuration,
    notify: Callable[[str], None],
) -> list[_Json]:
    """`walk` of all `patients`, each in `folder`/NAME.json; one that is there, of the same subject,
    settings and `VERSION`, is not walked again. `notify` is called with a sentence for each.
    """
    found = []
    for number, (name, patient) in enumerate(patients.items(), start=1):
        path = folder / f"{name}.json"
        of = value_hash(
            {
                "subject": patient.subject.to_toml(),
                "affected": patient.affected,
                "settings": configuration.model_dump(mode="json"),
                "version": VERSION,
                "policy": policy.key,
            }
        )
        result = read_json(path) if path.is_file() else {}
        if result.get("of") != of:
            result = {"of": of, **walk(patient, policy, configuration)}
            write_json(path, result)
        found.append(result)
        message = f"falls from {result['falls']} of {result['starts']} starts"
        if result["angle"] is not None:
            message = f"{message}, {result['angle']:.2f}° from the stride"
        notify(f"{name}: {message} ({number} of {len(patients)})")
    return found
