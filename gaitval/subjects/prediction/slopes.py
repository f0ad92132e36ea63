"""A person on a slope, or with a load, of whom only level walking is known.

What is published of people on slopes is added to the level record: how thigh, knee and ankle move
(`slope_angles.csv`) and how the stride changes (`STRIDE_FREQUENCY`). The record is then turned into
the axes of the ground, in which gravity is not -z (`model.ground`). Moments and how forces are
spread over the cycle follow from Newton's law in the fit (`walk.reference.dynamic_fit`), which
holds the level ones loosely (`ON_A_SLOPE`). A load is a vest, part of the trunk: nothing published
is added for it, so the person is taken to walk as without it, and Newton's law does the rest.
"""

from dataclasses import replace
from functools import cache
from typing import Final

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from gaitval._internal.io.text_tables import shipped_table
from gaitval.arrays import Array
from gaitval.configuration import ContactSettings, RecordSettings
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ConfigurationError
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.record import GaitRecord, PeriodicCurve, periodic_through, weighted_sum
from gaitval.model.body import BodyModel
from gaitval.model.devices.composite import fitted, parallel_axes, part_place
from gaitval.model.devices.loads import trunk_load
from gaitval.model.ground import Ground
from gaitval.model.parameters import NOMINAL_FRICTION
from gaitval.model.rotations import pelvis_angles, pelvis_rotation

STEEPEST: Final = 10.0
"""Degrees, 17.6 %: the steepest slope, up and down, that people were measured on."""

LOADED: Final = 0.2
"""Body weights on a foot from which on it must not slide: of less, shear over normal force is
noise."""

STRIDE_FREQUENCY: Final = (
    (0.75, (0.85, 0.83, 0.79, 0.74, 0.71, 0.70, 0.73)),
    (1.25, (0.99, 0.98, 0.95, 0.93, 0.91, 0.91, 0.92)),
    (1.75, (1.10, 1.08, 1.06, 1.05, 1.05, 1.06, 1.07)),
)
"""Hz, mean of ten adults on a treadmill, by speed (m/s) and slope (`FRANZ_SLOPES`): Franz and Kram
(2012), Gait Posture 35:143, table 1."""
FRANZ_SLOPES: Final = (-9.0, -6.0, -3.0, 0.0, 3.0, 6.0, 9.0)
"""Degrees."""

ON_A_SLOPE: Final = RecordAccuracy(
    sagittal=np.deg2rad(1.5),
    frontal=np.deg2rad(1.2),
    rotation=np.deg2rad(1.2),
    pelvis=np.deg2rad(1.6),
    moment=0.05,
    flexion_moments=1.0,
    adduction_moment=0.1,
    forward_force=0.03,
    sideways_force=0.008,
    vertical_force=0.04,
    twist=5e-4,
    ankle_power=np.inf,
    hip_centre=0.0,
)
"""How closely a fit follows what is predicted on a slope. The ankle's moment is that of level
walking: the centre of pressure moves under the foot as it does there, whatever the ground's slope.
What hips and knees need for it follows, and is held to nothing. With the moments of all joints held
to .25 Nm/kg, S05's knees were not loaded more downhill, for the fit stood on its toes instead."""

_SAGITTAL: Final = {"thigh": "hip_flexion", "knee": "knee_angle", "ankle": "ankle_angle"}
_SERIES: Final = 12
"""Harmonics of a turned pelvis."""
_PHASE: Final = np.arange(100) / 100


@cache
def _table() -> dict[str, tuple[Array, Array]]:
    """Change (50,) deg over a side's own cycle of each of `_SAGITTAL` at -10 and +10 degrees."""
    rows = shipped_table("gaitval.subjects.prediction", "slope_angles.csv").by_name()
    return {
        name: (
            np.array([float(row[f"{name}_-10"]) for row in rows]),
            np.array([float(row[f"{name}_+10"]) for row in rows]),
        )
        for name in _SAGITTAL
    }


def angle_change(name: str, slope_deg: float) -> PeriodicCurve:
    """Change, rad, of the angle of a `thigh` (to the vertical, forward positive), `knee` or `ankle`
    (flexion and dorsiflexion positive) over the side's own cycle on a slope: the parabola through
    none on the level and what was measured at -10 and +10 degrees.
    """
    down, up = _table()[name]
    share = slope_deg / STEEPEST
    change = 0.5 * (up - down) * share + 0.5 * (up + down) * share**2
    return periodic_through(np.deg2rad(change), 10)


def stride_time_factor(speed: float, slope_deg: float) -> float:
    """Stride time on a slope over that on the level, at the same `speed` m/s."""
    speeds = np.array([each for each, _ in STRIDE_FREQUENCY])
    rows, slopes = np.array([row for _, row in STRIDE_FREQUENCY]), np.array(FRANZ_SLOPES)
    table = RegularGridInterpolator((speeds, slopes), rows)
    within = float(np.clip(speed, speeds[0], speeds[-1]))
    there = float(np.clip(slope_deg, slopes[0], slopes[-1]))
    found = table([[within, 0.0], [within, there]])
    return float(found[0] / found[1])


def ground_of(settings: RecordSettings) -> Ground:
    """The ground that a run with `settings` walks on."""
    return Ground(settings.slope, settings.cross_slope)


def is_changed(settings: RecordSettings) -> bool:
    """Whether, by `settings`, the ground is not level or the person is laden."""
    return not ground_of(settings).level or settings.load > 0.0


def body_on(model: BodyModel, settings: RecordSettings) -> BodyModel:
    """The body `model` on the ground and with the load of `settings`."""
    if not is_changed(settings):
        return model
    laden = fitted(model, (trunk_load(settings.load, model.mass),)) if settings.load else model
    return replace(laden, ground=ground_of(settings))


def body_without(model: BodyModel, settings: RecordSettings) -> BodyModel:
    """The person's own body of `model`, which `body_on` gave the load of `settings`; as muscles
    know it.
    """
    if not settings.load:
        return model
    torso, whole = model["torso"], model.mass / (1.0 + settings.load / 100.0)
    (vest,) = trunk_load(settings.load, whole).parts
    place, inertia = part_place(vest, torso, model)
    mass = torso.mass - vest.mass
    centre = (torso.mass * torso.centre_of_mass - vest.mass * place) / mass
    own = torso.inertia - inertia - vest.mass * parallel_axes(place - torso.centre_of_mass)
    own = own - mass * parallel_axes(centre - torso.centre_of_mass)
    bare = replace(torso, mass=mass, centre_of_mass=centre, inertia=own)
    return replace(model, segments=tuple(bare if s.name == "torso" else s for s in model.segments))


def friction_needed(record: GaitRecord) -> float:
    """Friction coefficient that the forces of a `record`, in the ground's axes, ask for: the most
    shear over normal force of a foot that carries at least `LOADED`.
    """
    needed = 0.0
    for side in SIDES:
        x, y, z = record.ground_reaction(side, _PHASE).T
        carries = z > LOADED
        needed = max(needed, float((np.hypot(x, y)[carries] / z[carries]).max(initial=0.0)))
    return needed


def _flatter(settings: RecordSettings, share: float) -> RecordSettings:
    """The `settings` with a `share` of their slopes."""
    return settings.model_copy(
        update={"slope": share * settings.slope, "cross_slope": share * settings.cross_slope}
    )


def check_ground(
    record: GaitRecord,
    settings: RecordSettings,
    contact: ContactSettings,
    friction: float = NOMINAL_FRICTION,
) -> None:
    """Refuse ground on which the feet would slide, or nobody was measured. `record` is the level
    one, and `friction` the static coefficient between foot and ground. Raises ConfigurationError.
    """
    ground = ground_of(settings)
    sliding = friction * contact.dynamic_to_static
    steep = float(np.degrees(np.arctan(ground.steepness)))
    needed = friction_needed(on_ground(record, settings))
    if needed > sliding and not ground.level:
        less = [
            share
            for share in np.linspace(0.0, 1.0, 21)[:-1]
            if friction_needed(on_ground(record, _flatter(settings, float(share)))) <= sliding
            and share * ground.steepness <= np.tan(np.deg2rad(STEEPEST))
        ]
        mend = (
            f"Give a slope of at most {max(less) * settings.slope:+.1f} %, or a ground with more "
            "friction."
            if less
            else "On the level they would slide, too: give a ground with more friction."
        )
        raise ConfigurationError(
            f"--slope {settings.slope:g}: to walk on {ground} ({steep:.1f} degrees) the feet need "
            f"a friction coefficient of {needed:.2f}, by this person's forces of level walking, "
            f"turned, but between foot and ground it is {sliding:.2f} (body parameter friction, "
            f"times contact.dynamic_to_static). They would slide. {mend}"
        )
    if steep > STEEPEST + 1e-9:
        most = 100.0 * np.tan(np.deg2rad(STEEPEST))
        raise ConfigurationError(
            f"--slope {settings.slope:g}: {steep:.1f} degrees, and how people's angles change is "
            f"known for slopes up to {STEEPEST:g} degrees ({most:.1f} %), up and down "
            "(gaitval/subjects/prediction/slope_angles.csv), so beyond it there is nothing to "
            "predict from. "
            f"Give a slope between -{most:.1f} and {most:.1f} %."
        )


def on_ground(record: GaitRecord, settings: RecordSettings) -> GaitRecord:
    """The level `record` of a person as it is expected on the ground of `settings`, in the axes of
    that ground; the same one where that is level.
    """
    ground = ground_of(settings)
    if ground.level:
        return record
    slope = float(np.rad2deg(ground.angles[0]))
    angles = dict(record.angles)
    for side in SIDES:
        s = side[0]
        for name, joint in _SAGITTAL.items():
            key = f"{joint}_{s}"
            angles[key] = weighted_sum([angles[key], angle_change(name, slope)], [1.0, 1.0])
        # What is upright in the room leans in the ground's axes; of the left side seen in a mirror.
        seen = ground if side == "right" else ground.mirrored()
        keys = [f"pelvis_{name}_{s}" for name in ("tilt", "list", "rotation")]
        pelvis = pelvis_rotation(*(angles[key](_PHASE) for key in keys))
        turned = pelvis_angles(seen.from_level @ pelvis)
        for key, values in zip(keys, turned.T, strict=True):
            angles[key] = periodic_through(values, _SERIES)
    turn = ground.from_level
    forces: dict[Side, tuple[PeriodicCurve, PeriodicCurve, PeriodicCurve]] = {}
    for side in SIDES:
        x, y, z = (weighted_sum(record.forces[side], row) for row in turn.tolist())
        forces[side] = (x, y, z)
    factor = stride_time_factor(record.speed, slope)
    return replace(
        record, angles=angles, forces=forces, stride_time=record.stride_time * factor, steps=None
    )
