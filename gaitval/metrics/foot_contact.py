"""How a foot meets the ground: path of the centre of pressure, heel bounce, heel-strike transient.

The path is given in the footprint, the position of the flat foot at `FLAT` of its stance. The
footprint is fixed to the ground, as on a pressure plate, so the rising heel does not move it. Its
origin is the rearmost point of the sole's outline, below the line of the ankle; its axes are along
the foot (forward) and across it, towards the midline; lengths are fractions of foot length.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gaitval.arrays import Array, sample_deviation
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.curve_results import MeanCurve
from gaitval.metrics.cycles import GaitCycles
from gaitval.metrics.results import PROGRESS_AT, FootContact, PressurePath
from gaitval.metrics.typed import number, numbers
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.parameters import apply_parameters
from gaitval.model.tree import segment_frames
from gaitval.simulation.rollout import Rollout

FLAT = 0.3
"""Fraction of stance at which the foot is flat: after loading, before the heel rises."""
EARLY = 0.15
"""Fraction of stance in which a heel may bounce and the heel-strike transient occurs."""


@dataclass(frozen=True)
class Outline:
    """The contact spheres of one standing foot in the footprint.

    Attributes
    ----------
    length : m, from the edge of the heel to the edge of the toes.
    centres : (6, 2) along and across, in foot lengths.
    radii : (6,) in foot lengths.
    heel : (3,) m, the footprint's origin in the foot's frame.
    """

    length: float
    centres: Array
    radii: Array
    heel: Array


@dataclass(frozen=True)
class Stances:
    """How one foot met the ground in each of n stances.

    Attributes
    ----------
    places : (n, 2) m, world: the footprint's origin, where the heel stands, forward and left.
    path : (n, 101, 2) centre of pressure over stance, along and across, in foot lengths.
    bounces : (n,) how often the vertical force fell to nothing within `EARLY` of stance.
    transient : (n,) body weights, largest unfiltered vertical force within `EARLY` of stance.
    outline : of the foot.
    """

    places: Array
    path: Array
    bounces: Array
    transient: Array
    outline: Outline

    def contact(self) -> FootContact:
        """Means and standard deviations over the stances."""
        mean = self.path.mean(axis=0) if len(self.path) else None
        deviation = sample_deviation(self.path)
        along, across = (
            MeanCurve(
                mean=None if mean is None else numbers(100.0 * mean[:, axis]),
                sd=None if deviation is None else numbers(100.0 * deviation[:, axis]),
            )
            for axis in range(2)
        )
        return FootContact(
            stances=len(self.path),
            foot_length_m=self.outline.length,
            spheres=np.column_stack([self.outline.centres, self.outline.radii]).tolist(),
            path=PressurePath(along=along, across=across),
            progress={
                percent: None if mean is None else number(100.0 * mean[int(percent), 0])
                for percent in PROGRESS_AT
            },
            bounces_per_stance=float(self.bounces.mean()) if len(self.bounces) else None,
            transient_peak=None if mean is None else number(100.0 * self.transient.mean()),
        )


def outline(model: BodyModel, side: Side) -> Outline:
    """Outline of the foot on a `side` of `model`: its contact spheres with all joints at zero."""
    suffix = side[0]
    toes = model[f"toes_{suffix}"].joint_position
    spheres = [s for s in model.spheres if s.segment in (f"foot_{suffix}", f"toes_{suffix}")]
    places = np.array(
        [s.position + (toes if s.segment.startswith("toes") else 0.0) for s in spheres]
    )
    radii = np.array([s.radius for s in spheres])
    heel = (places[:, 0] - radii).min()
    length = float((places[:, 0] + radii).max() - heel)
    medial = 1.0 if side == "right" else -1.0
    # y points left, which is towards the midline for the right foot only
    centres = np.column_stack([places[:, 0] - heel, medial * places[:, 1]])
    sole = (places[:, 2] - radii).min()
    return Outline(length, centres / length, radii / length, np.array([heel, 0.0, sole]))


def foot_contacts(
    rollout: Rollout, cycles: GaitCycles, model: BodyModel, *, threshold: float
) -> Mapping[Side, Stances]:
    """How both feet met the ground in the stances that begin the `cycles` of a `rollout`.

    `model` is the body before mu, which the rollout contains. A foot is on the ground where its
    vertical force is above `threshold`, N.
    """
    # mu contains the length of the foot, and so its outline
    body = apply_parameters(model, rollout.mu)
    weight = model.mass * GRAVITY
    found: dict[Side, Stances] = {}
    for column, side in enumerate(SIDES):
        shape = outline(body, side)
        vertical = rollout.ground_reaction[:, column, 2]
        places, paths, bounces, transients = [], [], [], []
        for start, end in zip(cycles.starts[side], cycles.ends[side], strict=True):
            # a heel strike that starts a whole cycle is followed by one toe-off within it
            toe_offs = cycles.events[side].toe_offs
            stop = toe_offs[(toe_offs > start) & (toe_offs < end)][0]
            early = vertical[start : start + max(1, round(EARLY * (stop - start)))]
            on = early > threshold
            # each loss of contact within early stance is a bounce
            bounces.append(int((on[:-1] & ~on[1:]).sum()))
            transients.append(early.max() / weight)
            flat = start + round(FLAT * (stop - start))
            pose = segment_frames(body, rollout.positions[flat : flat + 1])[0]
            foot = pose[SEGMENTS.index(f"foot_{side[0]}")]
            place = foot[:2, :3] @ shape.heel + foot[:2, 3]
            path = _over_stance(rollout.centre_of_pressure[start:stop, column, :2])
            places.append(place)
            # the columns of `_axes` are unit vectors: the product is the place along and across the
            # foot
            paths.append((path - place) @ _axes(foot, side) / shape.length)
        found[side] = Stances(
            np.array(places).reshape(-1, 2),
            np.array(paths).reshape(-1, SAMPLES, 2),
            np.array(bounces, dtype=float),
            np.array(transients, dtype=float),
            shape,
        )
    return found


def _over_stance(path: Array) -> Array:
    """(101, 2) of the centre of pressure (T, 2) over a stance; gaps without load are bridged."""
    known = np.isfinite(path).all(axis=1)
    share = np.linspace(0.0, 1.0, len(path))[known]
    at = np.linspace(0.0, 1.0, SAMPLES)
    return np.column_stack([np.interp(at, share, column) for column in path[known].T])


def _axes(foot: Array, side: Side) -> Array:
    """(2, 2) horizontal unit vectors along a foot (4, 4) and towards the midline, in columns."""
    x, y = foot[:2, 0] / np.linalg.norm(foot[:2, 0])
    medial = 1.0 if side == "right" else -1.0
    return np.array([[x, -medial * y], [y, medial * x]])
