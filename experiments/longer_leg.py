"""Whether the leg that a record calls longer is longer: what else is known of S08.

    python -m experiments.longer_leg

Standing, the joint centres by markers give each side's thigh and shank and how far its knee is
bent; so do those of the nine others. Then the record is fitted again with the left knee's zero
moved, half of it by the thigh's axes and half by the shank's, as if the bend were an error of the
markers. Writes `reports/identification/longer_leg.json`.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval.artefacts import versions, write_json
from gaitval.configuration import load_configuration
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects, load_subject
from gaitval.gait.record import GaitRecord
from gaitval.identification.body_fit import BodyFit
from gaitval.identification.offsets import offset_of
from gaitval.identification.prior import prior_sd
from gaitval.identification.shared_errors import identified
from gaitval.model.parameters import nominal_parameters
from gaitval.scaling.joint_centres import locate
from gaitval.scaling.scaling import scale_subject

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "longer_leg.json"
PERSON: Final = "S08"
STRAIGHTER: Final = (0.0, 5.0, 10.0)
"""Degrees that are taken from the left knee."""
_STANCE: Final = np.linspace(0.08, 0.58, 50)


def standing(subject: Subject) -> dict[str, float]:
    """Left less right in standing: leg (thigh + shank) and pelvis' markers, m; bend of the knee,
    rad.
    """
    points = locate({name: np.array(place) for name, place in subject.markers.items()})
    legs, bends = {}, {}
    for side in "LR":
        joints = [points[f"{side}.{name}.Centre"] for name in ("Hip", "Knee", "Ankle")]
        thigh, shank = joints[0] - joints[1], joints[1] - joints[2]
        lengths = np.linalg.norm(thigh), np.linalg.norm(shank)
        legs[side] = float(sum(lengths))
        bends[side] = float(np.arccos(thigh @ shank / np.prod(lengths)))
    return {
        "leg": legs["L"] - legs["R"],
        "bend": bends["L"] - bends["R"],
        **{
            name: subject.markers[f"L.{name}"][2] - subject.markers[f"R.{name}"][2]
            for name in ("ASIS", "Iliac.Crest", "PSIS")
        },
    }


def straighter(record: GaitRecord, degrees: float) -> GaitRecord:
    """The record with a left knee that is bent less, by the axes of thigh and shank alike."""
    angles = dict(record.angles)
    for name, share in (("knee_angle_l", 1.0), ("hip_flexion_l", 0.5), ("ankle_angle_l", 0.5)):
        curve = angles[name]
        angles[name] = replace(curve, mean=curve.mean - share * np.radians(degrees))
    return replace(record, angles=angles)


def walking(subject: Subject, degrees: float) -> dict[str, float]:
    """What the record says of the legs with a straighter knee, m."""
    configuration, model = load_configuration(), scale_subject(subject).model
    fit = BodyFit(
        straighter(subject.record(), degrees), model, configuration.contact, configuration.noise,
        prior_sd=prior_sd(subject),
    )  # fmt: skip
    found = identified(fit, fit.solve(fixed=nominal_parameters()), offset_of(subject))
    mean, sd = found.legs.estimate
    alone, alone_sd = found.legs.alone
    return {
        "straighter_deg": degrees, "mean": mean, "sd": sd, "alone": alone, "alone_sd": alone_sd,
        "odds": found.legs.odds, "cost": found.cost,
    }  # fmt: skip


def main() -> None:
    """All of it."""
    subject = load_subject(PERSON)
    knees = [subject.record().angles[f"knee_angle_{side}"](_STANCE).mean() for side in "lr"]
    found: dict[str, Any] = {
        "standing": {each.identifier: standing(each) for each in builtin_subjects()},
        "bend_in_stance": float(knees[0] - knees[1]),
        "walking": [walking(subject, each) for each in STRAIGHTER],
    }
    write_json(STORE, {"versions": versions(), "person": PERSON, **found})
    print(found)


if __name__ == "__main__":
    main()
