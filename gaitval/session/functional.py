"""Hip centres and knee axes from how the segments move, beside those of the standing trial.

The regression stays the hip centre that is used, unless the request says otherwise: between
sessions it repeats better than a functional centre, which depends on how the movement was done
(Kainz et al. 2017, Gait Posture 53:179-184), and skin that moves with the thigh displaces a
functional centre without a sign of it in its standard error.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ScalingError
from gaitval.mocap.cleaning import clean
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.reporting.recording_report import FunctionalRow
from gaitval.scaling.functional import (
    BallCentre,
    HingeAxis,
    SegmentMotion,
    ball_centre,
    hinge_axis,
    segment_motion,
)
from gaitval.scaling.joint_centres import locate, pelvis_frame
from gaitval.scaling.same_person import check_same_person
from gaitval.session.read import SessionRecordings, about_file, named, trajectories
from gaitval.session.request import Notify, Request, silent
from gaitval.session.standing import standing_places

_Joint = Literal["hip", "knee"]

REGRESSION_ERROR: Final = 0.0079
"""m, each way, of the hip centre by Harrington's regression: 12.3 ± 5.9 mm in space from that in 67
CT images (Mantovani et al. 2016, Gait Posture 44:48-54), √((12.3² + 5.9²)/3)."""

LARGEST_ERROR: Final = 0.008
"""m. A functional hip centre is used only if its standard error and half the distance of its two
images together are smaller: two thirds of the 12 mm by which the regression is wrong, because the
real error is up to twice as large as this shows
(`gaitval.scaling.functional.FUNCTIONAL_TRIAL.blocks`)."""


@dataclass(frozen=True)
class FunctionalHip:
    """A functional hip centre beside that of the regression.

    Attributes
    ----------
    found : in the axes of the standing trial.
    difference : (3,) m, from the regression's centre to it, in the axes of the pelvis: forward,
        left, up.
    to_ankle, to_ankle_error : m, distance from the ankle centre and its standard error.
    regression_to_ankle : m; its error is `REGRESSION_ERROR`.
    """

    found: BallCentre
    difference: Array
    to_ankle: float
    to_ankle_error: float
    regression_to_ankle: float

    @property
    def images_apart(self) -> float:
        """m, distance of the images of the centre in the pelvis and in the thigh."""
        return float(np.linalg.norm(self.found.proximal - self.found.distal))

    @property
    def error(self) -> float:
        """m, standard error and half the distance of the images together."""
        return float(np.hypot(self.found.standard_error, self.images_apart / 2))

    def figures(self) -> tuple[str, str, str]:
        """Against the standing trial, error, and hip centre to ankle, as the page shows them."""
        forward, left, up = 1000 * self.difference
        return (
            f"{forward:+.0f} mm forward, {left:+.0f} left, {up:+.0f} up",
            f"{1000 * self.error:.1f} mm",
            f"{1000 * self.to_ankle:.0f} ± {1000 * self.to_ankle_error:.0f} mm; by regression "
            f"{1000 * self.regression_to_ankle:.0f} ± {1000 * REGRESSION_ERROR:.0f} mm",
        )

    def record(self) -> dict[str, Any]:
        """The hip in `import.json`."""
        return {
            "difference_m": self.difference.tolist(),
            "standard_error_m": self.found.standard_error,
            "images_apart_m": self.images_apart,
            "residual_m": self.found.residual,
            "ranges_deg": list(self.found.ranges),
            "to_ankle_m": self.to_ankle,
            "to_ankle_error_m": self.to_ankle_error,
            "regression_to_ankle_m": self.regression_to_ankle,
            "regression_error_m": REGRESSION_ERROR,
        }


@dataclass(frozen=True)
class FunctionalKnee:
    """A functional knee axis beside the line from the lateral side through the joint centre.

    Attributes
    ----------
    found : in the axes of the standing trial, pointing to the person's left.
    angle : rad, between both.
    rotation : rad, of the functional axis against the other about the thigh's long axis; internal
        rotation is positive on both sides.
    higher : m, by which the functional axis passes above the joint centre, along the thigh.
    """

    found: HingeAxis
    angle: float
    rotation: float
    higher: float

    def figures(self) -> tuple[str, str, str]:
        """As those of a hip; nothing of the ankle."""
        return (
            f"{np.degrees(self.angle):.1f}°, of which {np.degrees(self.rotation):+.1f}° internal "
            "rotation",
            f"{np.degrees(self.found.standard_error):.1f}°",
            "",
        )

    def record(self) -> dict[str, Any]:
        """The knee in `import.json`."""
        return {
            "angle_rad": self.angle,
            "rotation_rad": self.rotation,
            "higher_m": self.higher,
            "standard_error_rad": self.found.standard_error,
            "images_apart_rad": self.found.between_images,
            "residual_m": self.found.residual,
            "ranges_deg": list(self.found.ranges),
        }


@dataclass(frozen=True)
class FunctionalJoint:
    """What a range-of-motion trial shows of one joint.

    Attributes
    ----------
    trial : name of the file.
    found : None if it could not be found.
    refused : why; empty if it was found.
    """

    trial: str
    side: Side
    joint: _Joint
    found: FunctionalHip | FunctionalKnee | None
    refused: str = ""

    def __str__(self) -> str:
        if self.found is None:
            return f"{self.side} {self.joint}: not found: {self.refused}"
        away, error, to_ankle = self.found.figures()
        ankle = f"; hip centre to ankle {to_ankle}" if to_ankle else ""
        return f"{self.side} {self.joint}: {away} (error {error}){ankle}"

    def row(self) -> FunctionalRow:
        """The row of the page."""
        figures = self.found.figures() if self.found else ("", "", "")
        return FunctionalRow(self.trial, f"{self.side} {self.joint}", self.refused, *figures)

    def record(self) -> dict[str, Any]:
        """The joint in `import.json`."""
        about = {name: getattr(self, name) for name in ("trial", "side", "joint", "refused")}
        return about | ({self.joint: self.found.record()} if self.found else {})


def functional_joints(
    request: Request,
    processing: ProcessingSettings,
    session: SessionRecordings,
    notify: Notify = silent,
) -> tuple[FunctionalJoint, ...]:
    """The hips and knees of each range-of-motion trial of `request`, and why any is not found.

    The trials get the axes and marker names of `session` and are cleaned by `processing`; `notify`
    is called with each joint. Raises RecordError if a file cannot be read, or is of another person.
    """
    joints: list[FunctionalJoint] = []
    places = standing_places(session.standing)
    with about_file(str(request.static)):
        points = locate(session.marker_set.on_landmarks(places), **request.widths)
    for file in request.functional:
        recording = _read(file, processing, session)
        for side in SIDES:
            leg = _Leg(session, places, points, recording, side)
            for joint, finder in _FINDERS.items():
                try:
                    joints.append(FunctionalJoint(file.name, side, joint, finder(leg)))
                except ScalingError as error:
                    joints.append(FunctionalJoint(file.name, side, joint, None, str(error)))
    for found in joints:
        notify("functional", f"{found.trial}: {found}")
    return tuple(joints)


def chosen_hips(
    request: Request, joints: Sequence[FunctionalJoint], notify: Notify = silent
) -> dict[str, Array]:
    """The functional hip centres that are used, (3,) m in standing, by "R.Hip.Centre".

    Of `joints`, those of the smallest error, if it is at most `LARGEST_ERROR`; none unless
    `request` asks for them. A side without one keeps the regression; `notify` is called with what
    is chosen.
    """
    if request.joint_centres != "functional":
        return {}
    chosen = {}
    for side in SIDES:
        hips = [
            (joint.found.error, joint.trial, joint.found.found.centre)
            for joint in joints
            if joint.side == side and isinstance(joint.found, FunctionalHip)
        ]
        error, trial, centre = min(hips, key=lambda hip: hip[0], default=(np.inf, "", np.empty(0)))
        if error <= LARGEST_ERROR:
            chosen[f"{side[0].upper()}.Hip.Centre"] = centre
            notify("scaling", f"{side} hip centre: functional, of {trial}")
        else:
            why = f"an error of {1000 * error:.0f} mm" if hips else "none was found"
            notify(
                "scaling",
                f"{side} hip centre: by regression; the functional one would have to have an error "
                f"of at most {1000 * LARGEST_ERROR:.0f} mm ({why})",
            )
    return chosen


def _read(file: Path, processing: ProcessingSettings, session: SessionRecordings) -> Recording:
    recording = named(read_recording(file, faulty=True), session.marker_set)
    recording, _ = clean(
        recording.turned(session.axes.rotation),
        session.marker_set.segments,
        processing,
        landmarks=session.marker_set.landmarks,
    )
    check_same_person(
        trajectories(session.standing),
        trajectories(recording),
        session.marker_set,
        names=(session.standing.source, recording.source),
    )
    return recording


@dataclass(frozen=True)
class _Leg:
    """One leg in a trial.

    Attributes
    ----------
    places : (3,) m of each marker in standing; points : landmarks and joint centres there.
    """

    session: SessionRecordings
    places: Mapping[str, Array]
    points: Mapping[str, Array]
    recording: Recording
    side: Side

    @property
    def letter(self) -> str:
        return self.side[0].upper()

    def motion(self, segment: str) -> SegmentMotion:
        """Rigid motion of a segment through its markers that both trials show."""
        names = self._seen_on(segment)
        return segment_motion(
            np.array([self.places[name] for name in names]).reshape(-1, 3),
            self.recording.columns(names),
            segment.partition("_")[0],
        )

    def thigh_about_hip(self, pelvis: SegmentMotion) -> SegmentMotion:
        """Motion of the thigh through its markers and, if they are two, the regression's hip
        centre, which moves with the pelvis (as Leardini et al. 2007 do).
        """
        thigh = f"thigh_{self.letter.lower()}"
        names = self._seen_on(thigh)
        # Three points fix a rigid body: with two markers the hip centre is the third.
        if len(names) != 2:
            return self.motion(thigh)
        hip = self.points[f"{self.letter}.Hip.Centre"]
        carried = pelvis.rotation @ hip + pelvis.translation
        markers = self.recording.columns(names)
        return segment_motion(
            np.array([*(self.places[name] for name in names), hip]),
            np.concatenate([markers, carried[:, None]], axis=1),
            "thigh, with the hip centre of the regression",
        )

    def _seen_on(self, segment: str) -> list[str]:
        return [
            name
            for name, on in self.session.marker_set.segments.items()
            if on == segment
            and name in self.places
            and name in self.recording.names
            and np.isfinite(self.recording.marker(name)).any()
        ]


def _hip(leg: _Leg) -> FunctionalHip:
    regression = leg.points[f"{leg.letter}.Hip.Centre"]
    ankle = leg.points[f"{leg.letter}.Ankle.Centre"]
    found = ball_centre(
        leg.motion("pelvis"), leg.motion(f"thigh_{leg.letter.lower()}"), near=regression
    )
    axes = pelvis_frame(leg.points["R.ASIS"], leg.points["L.ASIS"], leg.points["Mid.PSIS"])
    to_hip = found.centre - ankle
    length = float(np.linalg.norm(to_hip))
    return FunctionalHip(
        found=found,
        difference=axes.T @ (found.centre - regression),
        to_ankle=length,
        to_ankle_error=found.error_along(to_hip / length),
        regression_to_ankle=float(np.linalg.norm(regression - ankle)),
    )


def _knee(leg: _Leg) -> FunctionalKnee:
    side = leg.letter
    centre, lateral = leg.points[f"{side}.Knee.Centre"], leg.points[f"{side}.Knee"]
    # To the person's left on both sides: from the lateral marker on the right, to it on the left.
    across = (centre - lateral) * (1.0 if side == "R" else -1.0)
    across /= np.linalg.norm(across)
    found = hinge_axis(
        leg.thigh_about_hip(leg.motion("pelvis")),
        leg.motion(f"shank_{side.lower()}"),
        near=centre,
        towards=across,
    )
    up = leg.points[f"{side}.Hip.Centre"] - centre
    up /= np.linalg.norm(up)
    # About the thigh's long axis only: both axes without their part along it. Seen from above a
    # turn to the left is positive, which is internal rotation on the right.
    before, after = (axis - (axis @ up) * up for axis in (across, found.direction))
    turned = float(np.arctan2(np.cross(before, after) @ up, before @ after))
    return FunctionalKnee(
        found=found,
        angle=float(np.arccos(np.clip(across @ found.direction, -1.0, 1.0))),
        rotation=turned if side == "R" else -turned,
        higher=float((found.point - centre) @ up),
    )


_FINDERS: Final[Mapping[_Joint, Callable[[_Leg], FunctionalHip | FunctionalKnee]]] = {
    "hip": _hip,
    "knee": _knee,
}
