"""Joint centres and axes from how two segments move relative to each other.

The centre of a ball joint is the point that is fixed in both segments: the symmetrical centre of
rotation estimation, SCoRE (Ehrig et al. 2006, J Biomech 39:2798-2809). The axis of a hinge is the
line that is fixed in both: the symmetrical axis of rotation approach, SARA (Ehrig et al. 2007,
J Biomech 40:2150-2157). Each segment is a rigid body through its markers (Kabsch), referred to
where the markers are in a standing trial. So both images of the centre, the one of the proximal
and the one of the distal segment, are places in that standing trial; they coincide if nothing but
the joint moved.

What skin and muscle do in the rhythm of the movement is a movement of the segment for this method.
Neither the residual nor the standard error shows it; the distance of the two images does in part.
Noise of the markers that is new in every frame pulls a centre towards the markers, with its square:
by 0.1 mm for 1 mm of noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.errors import ScalingError
from gaitval.scaling.rigid import superimposed


@dataclass(frozen=True)
class FunctionalLimits:
    """What a trial must show for a functional joint centre."""

    least_spread: float = 0.010
    """m, root mean square distance of a segment's markers from the line through them. Nearer to a
    line they do not show how the segment turns about it: 1 mm of noise is 6 degrees there."""
    least_frames: int = 50
    """Frames in which both segments must be seen."""
    hip_ranges: tuple[float, float] = (45.0, 20.0)
    """Degrees, least range of a ball joint about its first and second principal axis. Where each
    marker of the thigh wanders by 5 mm (SD, each way, in the rhythm of the movement), the centre of
    40 synthetic hips is wrong by 15 mm there, 26 mm at (30, 15), 9 at (60, 30) and 5 at (90, 50);
    the regression that it should better is wrong by 12 mm. Walking shows 40 to 45 and 15 to 19:
    there the clusters of a recorded walk (FunctionalWalk.c3d of BTKData) place the hip 20 to 180 mm
    aside."""
    hinge_range: float = 40.0
    """Degrees, least range of a hinge. With the same wandering the axis of 40 synthetic knees is
    wrong by 3.6 degrees there, by 7 at 25 and by 2 at 60, which walking shows."""
    blocks: int = 5
    """Parts of the trial, one after the other; the standard error is that of leaving out one by
    one. Neighbouring frames are not independent, parts of some seconds nearly are. With 5 parts it
    is 0.5 to 0.8 of the real error of these synthetic hips and 1.1 to 1.5 of that of the knees;
    with 10 parts it is a fifth smaller."""


FUNCTIONAL_TRIAL: Final = FunctionalLimits()


@dataclass(frozen=True)
class SegmentMotion:
    """Rigid motion of a segment: a point p of the standing trial is at rotation @ p + translation.

    Attributes
    ----------
    rotation : (T, 3, 3); NaN in frames with fewer than three markers.
    translation : (T, 3) m.
    residual : m, RMS distance of the markers from the rigid body.
    """

    rotation: Array
    translation: Array
    residual: float


@dataclass(frozen=True)
class BallCentre:
    """Centre of a ball joint, m, in the axes and at the place of the standing trial.

    Attributes
    ----------
    centre : (3,) middle of both images.
    proximal, distal : (3,) its images in the two segments.
    covariance : (3, 3) m², of `centre`, from leaving out parts of the trial.
    residual : m, RMS distance of the two images from each other in the trial.
    ranges : degrees, about the three principal axes of the relative rotation, largest first.
    """

    centre: Array
    proximal: Array
    distal: Array
    covariance: Array
    residual: float
    ranges: tuple[float, float, float]

    @property
    def standard_error(self) -> float:
        """m, root of the summed variances of the three coordinates."""
        return float(np.sqrt(np.trace(self.covariance)))

    def error_along(self, direction: Array) -> float:
        """m, standard error along a unit vector (3,), with half the distance of the images."""
        half = float((self.proximal - self.distal) @ direction) / 2
        return float(np.hypot(np.sqrt(direction @ self.covariance @ direction), half))


@dataclass(frozen=True)
class HingeAxis:
    """Axis of a hinge in the axes and at the place of the standing trial.

    Attributes
    ----------
    point : (3,) m, of the axis, nearest to the point asked for.
    direction : (3,) unit vector, with a positive component along the vector asked for.
    standard_error : rad, of the direction, from leaving out parts of the trial.
    between_images : rad, angle between the images of the axis in the two segments.
    residual : m, RMS distance of the two images of `point` from each other in the trial.
    ranges : degrees, as of `BallCentre`.
    """

    point: Array
    direction: Array
    standard_error: float
    between_images: float
    residual: float
    ranges: tuple[float, float, float]


def segment_motion(standing: Array, markers: Array, name: str = "segment") -> SegmentMotion:
    """The rigid motion that takes the standing markers nearest to the measured ones.

    Parameters
    ----------
    standing : (M, 3) m, place of each marker in standing.
    markers : (T, M, 3) m; NaN where a marker was not seen.
    name : of the segment, for messages.

    Raises
    ------
    ScalingError : fewer than three markers, or markers almost on a line.
    """
    if len(standing) < 3:
        raise ScalingError(f"{name}: markers in both trials: {len(standing)}; three are needed")
    spread = np.linalg.svd(standing - standing.mean(axis=0), compute_uv=False)[1]
    if spread / np.sqrt(len(standing)) < FUNCTIONAL_TRIAL.least_spread:
        raise ScalingError(
            f"{name}: its markers are within {1000 * spread / np.sqrt(len(standing)):.0f} mm of a "
            f"line ({1000 * FUNCTIONAL_TRIAL.least_spread:.0f} mm are needed)"
        )
    seen = np.isfinite(markers).all(axis=2)
    rotation = np.full((len(markers), 3, 3), np.nan)
    translation = np.full((len(markers), 3), np.nan)
    squares, count = 0.0, 0
    # Frames that show the same markers have the same standing markers to be fitted to.
    for pattern in np.unique(seen, axis=0):
        if pattern.sum() < 3:
            continue
        frames = (seen == pattern).all(axis=1)
        rotation[frames], translation[frames] = superimposed(
            standing[pattern], markers[frames][:, pattern]
        )
        placed = np.einsum("tij,mj->tmi", rotation[frames], standing[pattern])
        left = markers[frames][:, pattern] - placed - translation[frames, None]
        squares, count = squares + float((left**2).sum()), count + left.shape[0] * left.shape[1]
    return SegmentMotion(rotation, translation, float(np.sqrt(squares / count)) if count else 0.0)


def ball_centre(proximal: SegmentMotion, distal: SegmentMotion, near: Array) -> BallCentre:
    """Centre of the ball joint between two segments, `proximal` and `distal`, by SCoRE.

    Minimises Σ |R₁c₁ + t₁ - R₂c₂ - t₂|² over the two images c₁ and c₂ of the centre. The numbers
    are worked out about `near` (3,) m, any point near the joint in standing.

    Raises ScalingError, which says what was seen, if there are too few frames, or a range of motion
    is below `FUNCTIONAL_TRIAL.hip_ranges`.
    """
    joint = _Joint.of(proximal, distal, near)
    if any(
        seen < least for seen, least in zip(joint.ranges, FUNCTIONAL_TRIAL.hip_ranges, strict=False)
    ):
        raise ScalingError(
            f"the joint turned by {_listed(joint.ranges[:2])} about its two main axes; "
            f"{_listed(FUNCTIONAL_TRIAL.hip_ranges)} are needed: swing the straight leg forward, "
            "backward and aside"
        )
    images = np.linalg.solve(joint.normal.sum(axis=0), joint.right.sum(axis=0))
    centre = (images[:3] + images[3:]) / 2
    without = [
        np.linalg.solve(normal, right).reshape(2, 3).mean(axis=0)
        for normal, right in joint.leaving_out()
    ]
    return BallCentre(
        centre=near + centre,
        proximal=near + images[:3],
        distal=near + images[3:],
        covariance=_jackknife(np.array(without)),
        residual=joint.residual(images),
        ranges=joint.ranges,
    )


def hinge_axis(
    proximal: SegmentMotion, distal: SegmentMotion, near: Array, towards: Array
) -> HingeAxis:
    """Axis of the hinge between two segments by SARA.

    The equations of SCoRE have no unique solution for a hinge: every point of the axis solves them.
    Their least singular vector is the direction of the axis in both segments.

    Parameters
    ----------
    proximal, distal : the motions of the segments.
    near : (3,) m, point whose neighbour on the axis is wanted.
    towards : (3,) the direction of the axis has a positive component along it.

    Raises
    ------
    ScalingError : too few frames, or a range of motion below `FUNCTIONAL_TRIAL.hinge_range`; says
        what was seen.
    """
    joint = _Joint.of(proximal, distal, near)
    if joint.ranges[0] < FUNCTIONAL_TRIAL.hinge_range:
        raise ScalingError(
            f"the joint turned by {_listed(joint.ranges[:1])}; "
            f"{FUNCTIONAL_TRIAL.hinge_range:.0f}° are needed: bend "
            "and stretch it"
        )
    images, axes = _line(joint.normal.sum(axis=0), joint.right.sum(axis=0))
    direction = _towards(axes[0] + axes[1], towards)
    without = np.array(
        [
            _towards(axes_left[0] + axes_left[1], towards)
            for normal, right in joint.leaving_out()
            for axes_left in [_line(normal, right)[1]]
        ]
    )
    point = (images[:3] + images[3:]) / 2
    return HingeAxis(
        # The point of the axis that is nearest to `near`.
        point=near + point - (point @ direction) * direction,
        direction=direction,
        standard_error=float(np.sqrt(np.trace(_jackknife(without)))),
        between_images=float(np.arccos(np.clip(axes[0] @ axes[1], -1.0, 1.0))),
        residual=joint.residual(images),
        ranges=joint.ranges,
    )


@dataclass(frozen=True)
class _Joint:
    """Normal equations of SCoRE about a point, summed over each of `FUNCTIONAL_TRIAL.blocks` parts
    of the trial.

    Attributes
    ----------
    normal, right : (B, 6, 6) and (B, 6).
    squares : Σ |t₂ - t₁|², m², and frames : their number.
    ranges : degrees, see `BallCentre`.
    """

    normal: Array
    right: Array
    squares: float
    frames: int
    ranges: tuple[float, float, float]

    @classmethod
    def of(cls, proximal: SegmentMotion, distal: SegmentMotion, near: Array) -> "_Joint":
        seen = np.isfinite(proximal.translation + distal.translation).all(axis=1)
        if seen.sum() < FUNCTIONAL_TRIAL.least_frames:
            raise ScalingError(
                f"both segments are seen in {seen.sum()} frames; {FUNCTIONAL_TRIAL.least_frames} "
                "are needed"
            )
        first, second = proximal.rotation[seen], distal.rotation[seen]
        # R₁c₁ - R₂c₂ = t₂ - t₁ in every frame, with both images as the unknowns, about `near`.
        apart = distal.translation[seen] - proximal.translation[seen] + (second - first) @ near
        rows = np.concatenate([first, -second], axis=2)
        blocks = np.array_split(np.arange(len(rows)), FUNCTIONAL_TRIAL.blocks)
        return cls(
            normal=np.array([np.einsum("tki,tkj->ij", rows[b], rows[b]) for b in blocks]),
            right=np.array([np.einsum("tki,tk->i", rows[b], apart[b]) for b in blocks]),
            squares=float((apart**2).sum()),
            frames=len(rows),
            ranges=_ranges(np.swapaxes(first, 1, 2) @ second),
        )

    def leaving_out(self) -> list[tuple[Array, Array]]:
        """The normal equations without each part."""
        normal, right = self.normal.sum(axis=0), self.right.sum(axis=0)
        return [(normal - n, right - r) for n, r in zip(self.normal, self.right, strict=True)]

    def residual(self, images: Array) -> float:
        """m, RMS distance of two images of a point, (6,) m, in the trial."""
        normal, right = self.normal.sum(axis=0), self.right.sum(axis=0)
        # |A x - b|² from the normal equations, without the frames.
        squares = self.squares - 2 * images @ right + images @ normal @ images
        return float(np.sqrt(max(float(squares), 0.0) / self.frames))


def _ranges(relative: Array) -> tuple[float, float, float]:
    """Degrees, range of relative rotations (T, 3, 3) about their principal axes, without the
    outermost 1 % at either end.
    """
    turned = Rotation.from_matrix(relative)
    # From the mean rotation, so that rotation vectors are far from their jump at half a turn.
    vectors = (turned.mean().inv() * turned).as_rotvec()
    _, _, axes = np.linalg.svd(vectors - vectors.mean(axis=0), full_matrices=False)
    low, high = np.percentile(vectors @ axes.T, [1.0, 99.0], axis=0)
    first, second, third = sorted(np.degrees(high - low), reverse=True)
    return float(first), float(second), float(third)


def _line(normal: Array, right: Array) -> tuple[Array, tuple[Array, Array]]:
    """The images (6,) of a point of a hinge's axis, and its directions in both segments."""
    values, vectors = np.linalg.eigh(normal)
    # The singular direction is the axis, in both segments. Without it the solution is that point of
    # the axis which is nearest to the origin.
    least = vectors[:, 0]
    kept = vectors[:, 1:]
    images = kept @ ((kept.T @ right) / values[1:])
    return images, (least[:3] / np.linalg.norm(least[:3]), least[3:] / np.linalg.norm(least[3:]))


def _towards(axis: Array, towards: Array) -> Array:
    unit = axis / np.linalg.norm(axis)
    return np.asarray(unit if unit @ towards >= 0 else -unit)


def _jackknife(without: Array) -> Array:
    """Covariance (3, 3) of an estimate from those (B, 3) without each of B parts."""
    apart = without - without.mean(axis=0)
    return np.asarray((len(without) - 1) / len(without) * apart.T @ apart)


def _listed(angles: Sequence[float]) -> str:
    return " and ".join(f"{angle:.1f}°" for angle in angles)
