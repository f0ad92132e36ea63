"""Joint centres that come with a recording, beside ours: how far they are, and what it makes of the
moments.

Results of OpenSim, Plug-in Gait or Visual3D are about the joint centres of those programs. Where
the files have them, nobody need wonder why moments differ: a centre that is moved by d changes the
moment about it by the cross product of the joint's force and d.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ModelError, RecordError, ScalingError
from gaitval.gait.quality_flags import QualityFlag
from gaitval.kinetics.inverse.inverse_dynamics import JOINTS
from gaitval.kinetics.inverse.inverse_kinematics import inverse_kinematics
from gaitval.model.body import PARENTS, SEGMENTS
from gaitval.model.tree import segment_frames
from gaitval.reporting.recording_report import GivenCentreRow
from gaitval.scaling.given_centres import (
    LARGEST_RESIDUAL,
    GivenCentre,
    LaidCentre,
    laid,
    of_model,
)
from gaitval.scaling.opensim.model_file import read_model
from gaitval.session.read import SessionRecordings
from gaitval.session.request import Notify, Request, silent
from gaitval.session.scale import FittedBody
from gaitval.session.standing import standing_places
from gaitval.session.trial import WalkingTrial

CHECK: Final = "joint centres"
MOVED_RESIDUAL: Final = 0.005
"""m, RMS over the markers of a segment, from which a model's markers were not moved to this
standing trial: 0.3 mm where OpenSim's scaling moved them (OpenCap's Subject4, Gait2354), 8 to 22 mm
where it scaled alone (Gait2354)."""
LARGEST_CHANGE: Final = 0.10
"""Nm/kg, RMS over stance, from which a reader is warned: moments of one person by two laboratories
differ by as much, and the goal of a comparison is not more."""
_DISTAL: Final = dict(zip(JOINTS, ("thigh", "shank", "foot"), strict=True))


@dataclass(frozen=True)
class CentreDifference:
    """A given joint centre beside that of the body.

    Attributes
    ----------
    difference : (3,) m, from ours to it, in the segment above: forward, outwards, up.
    flexion, abduction : Nm/kg, RMS over stance, by which the moments about it differ; NaN without
        moments.
    used : whether the body has been given it.
    """

    source: str
    side: Side
    joint: str
    difference: Array
    flexion: float
    abduction: float
    used: bool

    @property
    def title(self) -> str:
        """Such as "right knee"."""
        return f"{self.side} {self.joint}"

    @property
    def away(self) -> str:
        """The difference in words, whole millimetres."""
        words = (("forward", "back"), ("outwards", "inwards"), ("up", "down"))
        return ", ".join(
            f"{abs(mm):.0f} mm {more if mm > 0 else less}"
            for mm, (more, less) in zip(1000 * self.difference, words, strict=True)
            if abs(mm) >= 0.5
        )

    @property
    def moments(self) -> str:
        """The change of the moments in words; empty without moments."""
        if not np.isfinite(self.flexion):
            return ""
        return f"flexion moment {self.flexion:.2f}, abduction moment {self.abduction:.2f} Nm/kg"

    def __str__(self) -> str:
        about = f"; about it, in stance, {self.moments} apart (RMS)" if self.moments else ""
        where = f"{self.away} of ours" if self.away else "where ours is"
        return f"{self.title} centre of {self.source}: {where}{about}"

    def row(self) -> GivenCentreRow:
        """The row of the page."""
        forward, outwards, up = (1000 * self.difference).tolist()
        return GivenCentreRow(
            self.side, self.joint, self.source, forward, outwards, up, self.flexion, self.abduction
        )

    def record(self) -> dict[str, Any]:
        """The row in `import.json`."""
        return {
            "source": self.source,
            "side": self.side,
            "joint": self.joint,
            "difference_m": self.difference.tolist(),
            "flexion_moment_Nm_per_kg": self.flexion,
            "abduction_moment_Nm_per_kg": self.abduction,
            "used": self.used,
        }


class GivenInStanding(NamedTuple):
    """Given joint centres in the standing trial, and what makes a model's doubtful."""

    centres: tuple[LaidCentre, ...] = ()
    flags: tuple[QualityFlag, ...] = ()


def given_centres(
    request: Request, session: SessionRecordings, notify: Notify = silent
) -> GivenInStanding:
    """The joint centres that come with the recordings of `session`, in its standing trial: of the
    model of `request`, else of points in the files; none without either.

    `notify` is called with those that cannot be laid there; a flag says why a model is not
    compared. Where `request` asks for the centres, raises ModelError if the model cannot be read;
    ScalingError if it is another person's, or there are none.
    """
    given: Sequence[GivenCentre] = session.points
    flags: tuple[QualityFlag, ...] = ()
    try:
        if request.scaled_model is not None:
            file = request.scaled_model
            given = of_model(read_model(file), file.name, session.marker_set.renamed)
        found, refused = laid(given, standing_places(session.standing))
        if request.scaled_model is not None:
            flags = _of_model(request.scaled_model, found, refused)
        else:
            found, refused = _near_points(found, refused)
    except (ModelError, RecordError, ScalingError) as error:
        if request.joint_centres == "given":
            raise
        what = f"its joint centres are not compared: {error}".removesuffix(".")
        flag = QualityFlag(CHECK, "--scaled-model", float("nan"), 0.0, "", what)
        return GivenInStanding(flags=(flag,))
    for message in refused:
        notify("scaling", f"not laid on the standing trial: {message}")
    if request.joint_centres == "given" and not found:
        why = "; ".join(refused) or "no file has such points, and --scaled-model names no model"
        raise ScalingError(
            f"--joint-centres given: no joint centres came with the recording: {why}. Give the "
            "person's model with --scaled-model, or leave --joint-centres out."
        )
    return GivenInStanding(tuple(found), flags)


def _of_model(
    file: Path, found: Sequence[LaidCentre], refused: Sequence[str]
) -> tuple[QualityFlag, ...]:
    """What makes the centres of the model in a `file` doubtful. Raises ScalingError if it is
    another person's.
    """
    if not found:
        raise ScalingError(
            f"{file}: its markers are not those of the standing trial. "
            f"{'; '.join(refused[:2])}. Give the model that was scaled to these markers, with its "
            "marker set in it."
        )
    worst = max(found, key=lambda each: each.residual)
    off = f"its markers above the {worst.title} are {1000 * worst.residual:.0f} mm off"
    if worst.residual > LARGEST_RESIDUAL:
        raise ScalingError(
            f"{file}: not this person's model, or not scaled: laid on the standing trial, {off} "
            f"(RMS; a scaled model's are less than {1000 * LARGEST_RESIDUAL:.0f} mm). Give the "
            "model that OpenSim's scaling wrote for this person."
        )
    if worst.residual <= MOVED_RESIDUAL:
        return ()
    return (
        QualityFlag(
            CHECK, "--scaled-model", worst.residual, MOVED_RESIDUAL, "m",
            f"{file.name}: laid on the standing trial, {off} (RMS). OpenSim's scaling moves a "
            "model's markers to those of its standing trial, so this one was scaled without that, "
            "by another trial, or for another person; its joint centres are as unsure",
        ),
    )  # fmt: skip


def _near_points(
    found: Sequence[LaidCentre], refused: Sequence[str]
) -> tuple[list[LaidCentre], list[str]]:
    """The centres of points whose markers are as far from each other as in standing, and why others
    are not taken: in the walk that has the points, markers are exchanged, or put elsewhere.
    """
    odd = [
        f"{each.title} of {each.source}: beside it, the markers of the segment above are "
        f"{1000 * each.residual:.0f} mm (RMS) from where they are in standing, more than "
        f"{1000 * LARGEST_RESIDUAL:.0f} mm: they are exchanged, or were moved between the trials"
        for each in found
        if each.residual > LARGEST_RESIDUAL
    ]
    return [each for each in found if each.residual <= LARGEST_RESIDUAL], [*refused, *odd]


def beside_given(
    request: Request,
    session: SessionRecordings,
    body: FittedBody,
    walks: Sequence[WalkingTrial],
    given: Sequence[LaidCentre],
) -> tuple[CentreDifference, ...]:
    """Every `given` centre beside that of the `body`, which stands as `session` shows it, and what
    it makes of the moments of `walks`.
    """
    if not given:
        return ()
    stood = session.standing.columns([marker.name for marker in body.markers])
    pose = inverse_kinematics(body.model, body.markers, np.nanmedian(stood, axis=0)[None])
    frames = segment_frames(body.model, pose.positions)[0]
    rows = []
    for each in given:
        side: Side = "right" if each.name.startswith("R") else "left"
        joint = each.name.split(".")[1].lower()
        segment = f"{_DISTAL[joint]}_{side[0]}"
        above = frames[SEGMENTS.index(PARENTS[segment])]
        # From the world into the segment, Rᵀ (p - o), with vectors as rows.
        moved = (each.place - above[:3, 3]) @ above[:3, :3] - body.model[segment].joint_position
        flexion, abduction = _moments_about(body, walks, side, joint, moved)
        outwards = np.array([1.0, -1.0 if side == "right" else 1.0, 1.0])
        used = request.joint_centres == "given"
        rows.append(
            CentreDifference(each.source, side, joint, moved * outwards, flexion, abduction, used)
        )
    order = [f"{side} {joint}" for joint in JOINTS for side in SIDES]
    return tuple(sorted(rows, key=lambda row: order.index(row.title)))


def _moments_about(
    body: FittedBody, walks: Sequence[WalkingTrial], side: Side, joint: str, moved: Array
) -> tuple[float, float]:
    """Nm/kg, RMS over all stances, by which the flexion and the abduction moment change about a
    centre that is `moved` (3,) m in the segment above.
    """
    segment = f"{_DISTAL[joint]}_{side[0]}"
    above, below = SEGMENTS.index(PARENTS[segment]), SEGMENTS.index(segment)
    changes = []
    for walk in walks:
        if walk.moments is None or walk.loads is None:
            continue
        stance = walk.moments.leg_known(side)
        stance = stance & np.isfinite(walk.loads.centre_of_pressure[:, SIDES.index(side), 0])
        frames = segment_frames(body.model, walk.motion[stance])
        force = walk.moments.joint_force[stance, SIDES.index(side), JOINTS.index(joint)]
        change = -np.cross(frames[:, above, :3, :3] @ moved, force)
        # Grood and Suntay's axes: across the upper segment, and across that and along the lower.
        left = frames[:, above, :3, 1]
        floating = np.cross(left, frames[:, below, :3, 2])
        floating /= np.linalg.norm(floating, axis=1)[:, None]
        changes.append(np.stack([(change * axis).sum(axis=1) for axis in (left, floating)]))
    together = np.concatenate(changes, axis=1) if changes else np.empty((2, 0))
    if not together.shape[1]:
        return float("nan"), float("nan")
    flexion, abduction = np.sqrt((together**2).mean(axis=1)) / body.model.mass
    return float(flexion), float(abduction)


def given_warnings(rows: Sequence[CentreDifference]) -> Iterator[QualityFlag]:
    """One warning if the body could not take given centres that it was to use, and a moment changes
    by more than `LARGEST_CHANGE` for it: about the centre of the largest change.
    """
    changes = {max(row.flexion, row.abduction): row for row in rows if row.used and row.moments}
    most = max(changes, default=0.0)
    if most > LARGEST_CHANGE:
        worst = changes[most]
        yield QualityFlag(
            CHECK, worst.title, most, LARGEST_CHANGE, "Nm/kg",
            f"the centre of {worst.source} is {worst.away} of ours; about it, in stance, "
            f"{worst.moments} apart (RMS). The body cannot take it: its legs are alike (--set "
            "scaling.symmetric=false keeps each side's own), and its knees are hinges that "
            "hyperextend by 25° at most",
        )  # fmt: skip
