"""Whether mass, speed and lengths of a subject can be one person's, before hours are spent."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.configuration import Configuration, ContactSettings
from gaitval.coordinates import SIDES
from gaitval.errors import GaitvalError
from gaitval.gait.record import GaitRecord
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.scaling.scaling import scale_subject
from gaitval.scaling.stature import mean_lengths
from gaitval.subjects.prediction.known import quantities_known
from gaitval.subjects.subject import Subject
from gaitval.walk.reference.motion import build_reference


@dataclass(frozen=True)
class PlausibleGait:
    """What forces, travel and legs may differ by."""

    force: float = 0.05
    """Share by which the mean vertical force may miss one body weight: plates and filters err by 1
    to 3 % in the built-in subjects."""
    travel: float = 0.15
    """Share by which the foot may travel otherwise under the pelvis than the belt: about three SDs
    of soft tissue (6 %), legs (2.5 %) and belt (1.25 %) together."""
    legs: float = 0.12
    """Share by which legs may be longer or shorter than stature has them: three SDs of `prior`'s
    for thigh and shank together."""
    stance: tuple[float, float] = (0.08, 0.58)
    """Part of the cycle, half of it, in which the ball of the foot is taken to lie on the
    ground."""


PLAUSIBLE_GAIT: Final = PlausibleGait()


def travel(record: GaitRecord, model: BodyModel, contact: ContactSettings) -> float:
    """How fast the ball of the foot travels back under the pelvis at the angles of a `record`, over
    the speed that it states; mean of both sides. `model` is the body as scaled; `contact` gives the
    height of the feet.
    """
    reference = build_reference(record, model, contact)
    frames = segment_frames(model, reference.positions)
    found = []
    for side in SIDES:
        ball = frames[:, SEGMENTS.index(f"toes_{side[0]}"), 0, 3] - frames[:, 0, 0, 3]
        begin = 0.0 if side == "right" else record.left_phase
        at = [
            np.interp((begin + each) % 1.0, reference.phase, ball) for each in PLAUSIBLE_GAIT.stance
        ]
        found.append(at[0] - at[1])
    seconds = (PLAUSIBLE_GAIT.stance[1] - PLAUSIBLE_GAIT.stance[0]) * record.stride_time
    return float(np.mean(found)) / seconds / record.speed


def implausible(subject: Subject, configuration: Configuration, record: GaitRecord) -> list[str]:
    """What cannot be right about a `subject`, each in a sentence with what to do; empty if nothing.
    Said by `scale`, and so at the start of a study. What scaling or the reference refuse is left to
    them.

    `record` is what is known of the person's gait. Of the `configuration` the contact law is used;
    forces that are held out by it are not looked at.
    """
    found = []
    model = scale_subject(subject).model
    known = "forces" in quantities_known(subject, configuration.record)
    force = subject.mean_vertical_force if known else None
    if force is not None and subject.aid is None and abs(force - 1.0) > PLAUSIBLE_GAIT.force:
        found.append(
            f"mass_kg = {subject.mass_kg:g}, but both feet together carry {force:.2f} body weights "
            f"in the mean of a cycle, which is 1 for everybody who walks on: either the mass is "
            f"{subject.mass_kg * force:.1f} kg or the plates' calibration is off. Weigh again, or "
            "check the plates with a known weight."
        )
    try:
        share = travel(record, model, configuration.contact)
    except (GaitvalError, ValueError):  # no finite reference
        share = 1.0
    if abs(share - 1.0) > PLAUSIBLE_GAIT.travel:
        found.append(
            f"walking_speed_m_s = {record.speed:g}, but at the known angles a foot "
            f"travels back under the pelvis at {share * record.speed:.2f} m/s during "
            f"stance: speed, stride time ({record.stride_time:g} s) or the legs are wrong by "
            f"{100 * abs(share - 1.0):.0f} %. Check the unit (km/h is 3.6 times m/s) and the "
            "belt's speed."
        )
    lengths = mean_lengths(subject.height_m)
    usual = lengths["thigh"] + lengths["shank"]
    if abs(model.leg_length / usual - 1.0) > PLAUSIBLE_GAIT.legs:
        found.append(
            f"thigh and shank are {100 * model.leg_length:.1f} cm long, but {100 * usual:.1f} cm "
            f"are usual at height_m = {subject.height_m:g}: the stature, a marker or the unit of "
            "the markers is wrong. Compare with the leg's length by tape."
        )
    return found
