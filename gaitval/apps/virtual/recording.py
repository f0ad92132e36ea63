"""A laboratory's recording of a virtual person: markers and force plates, with a known truth.

The person has a built-in subject's body with other lengths of foot, shank and thigh, and walks with
the general policy on a treadmill with a plate under each foot. The markers (those of the ISB's
recommendation) lie on its landmarks and move with its bones; cameras and plates have noise. Soft
tissue does not move, and the landmarks are palpated without an error, so an import can find the
lengths, angles and forces that are known here.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gaitval.apps.virtual.person import VirtualError, drawn_parameters, walked
from gaitval.apps.virtual.standing import landmarks_on, standing_pose
from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.datasets.subject import Subject
from gaitval.gait.cycle_curves import PELVIS_ANGLES
from gaitval.identification.prior import prior_sd
from gaitval.inverse.marked_body import marker_positions
from gaitval.inverse.motion_rates import cardan_coordinates
from gaitval.metrics.cycles import find_cycles
from gaitval.mocap.force_plates import UNLOADED_N, make_plate, plate_axes
from gaitval.mocap.pressed_plates import plate_under
from gaitval.mocap.recording import Plate, Recording
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.model.tree import segment_frames
from gaitval.policy.storage import Policy
from gaitval.scaling.anthropometry import mean_length
from gaitval.scaling.marker_set import MarkerSet
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.scaling.measurements import Measurements
from gaitval.scaling.scaling import measurements_of, scale_subject
from gaitval.simulation.rollout import Rollout
from gaitval.simulation.walker import WalkingTask

MARKER_SET: Final = "isb"
CAMERA_STEPS: Final = 5
"""Physics steps in a frame of the cameras: 100 Hz at the default step."""
SECONDS: Final = 4.0
"""Of walking: three strides and more."""
STANDING_FRAMES: Final = 50
CAMERA_NOISE: Final = 0.5e-3
"""SD of each coordinate of a marker, m: an optical system in a laboratory, 0.1 to 1 mm."""
FORCE_NOISE: Final = 1.0
"""SD of each component of a plate's force, N."""
MOMENT_NOISE: Final = 0.3
"""SD of each component of a plate's moment about its middle, Nm."""
BELT: Final = (2.0, 0.6)
"""Length and width of a belt, m."""
_TRUE: Final = ("pelvis_r", "hip_", "knee_", "ankle_", "subtalar_")
"""Prefixes of the coordinates whose truth is written; the others depend on how arms and trunk are
defined."""
_LENGTHS: Final = slice(PARAMETERS.index("foot_length"), PARAMETERS.index("thigh_length") + 1)
_TO_LABORATORY: Final = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Rotation to axes that are common in laboratories: x to the right, y forward, z up."""
_TRACKING: Final = {
    "RICR": (0.03, -0.14, 0.09),
    "LICR": (0.03, 0.14, 0.09),
    "C7": (-0.06, 0.0, 0.42),
    "T10": (-0.10, 0.0, 0.20),
    "STER": (0.08, 0.0, 0.35),
    "XPRO": (0.10, 0.0, 0.20),
}
"""m forward, left, up in their segments' frames: markers on no landmark of scaling (iliac crests,
seventh cervical and tenth thoracic vertebra, upper and lower end of the breastbone)."""


@dataclass(frozen=True)
class RecordedPerson:
    """A virtual person in a laboratory.

    Attributes
    ----------
    subject : whose mass, height and sex they have.
    mu : (14,) of the body, relative to the subject's; its joints have no offsets.
    body : that walked.
    standing, walking : what the laboratory recorded, in its own axes.
    time : (T,) s, of the frames of the walk.
    positions : (T, 31) the true motion in them, on the belt, see `simulation.rollout.Rollout`.
    moments : (T, 25) Nm, the true joint moments in them, the passive ones included.
    belt : m/s, its speed, that of the walk. Flat feet move 3 % less: in the contact law they creep
        forward while they brake.
    """

    subject: Subject
    mu: Array
    body: BodyModel
    standing: Recording
    walking: Recording
    time: Array
    positions: Array
    moments: Array
    belt: float

    def truth(self) -> list[list[str]]:
        """Header and rows of the truth: time s, angles of pelvis and legs in degrees, moments of
        the legs in Nm/kg (names and signs as in `coordinates`), a row a frame.
        """
        angles = np.degrees(cardan_coordinates(self.positions))
        shown = [i for i, name in enumerate(COORDINATES) if name.startswith(_TRUE)]
        acting = [i for i, name in enumerate(ACTUATED) if name.startswith(_TRUE)]
        pelvis = dict(zip(COORDINATES, PELVIS_ANGLES, strict=False))
        names = [pelvis.get(COORDINATES[i], COORDINATES[i]) for i in shown]
        header = ["time_s", *(f"angle_{name}_deg" for name in names)]
        header += [f"moment_{ACTUATED[i]}_nm_kg" for i in acting]
        rows = [
            [f"{at:.2f}", *(f"{value:.2f}" for value in angle), *(f"{value:.3f}" for value in load)]
            for at, angle, load in zip(
                self.time, angles[:, shown], self.moments[:, acting] / self.body.mass, strict=True
            )
        ]
        return [header, *rows]

    def lengths(self) -> dict[str, float]:
        """True distances between joint centres, m."""
        joints = segment_frames(self.body, np.zeros((1, len(COORDINATES))))[0, :, :3, 3]
        hip, knee, ankle, other = (
            joints[SEGMENTS.index(name)] for name in ("thigh_r", "shank_r", "foot_r", "thigh_l")
        )
        pairs = {"thigh_m": (hip, knee), "shank_m": (knee, ankle), "hips_m": (hip, other)}
        return {name: float(np.linalg.norm(a - b)) for name, (a, b) in pairs.items()}


def recorded_person(
    number: int, seed: int, person: Subject, policy: Policy, configuration: Configuration
) -> RecordedPerson:
    """The recording of the virtual person of this `number` and `seed`, which are together the seed
    of all random numbers, drawn around the scaled body and record of `person`. `policy`,
    `reports/general`, walks it; `configuration` has settings of contact, simulation and validation.
    Raises VirtualError if they fall, or a foot steps on the other foot's belt.
    """
    random = np.random.default_rng([seed, number])
    drawn, mu = drawn_parameters(prior_sd(person), random), nominal_parameters()
    mu[:2], mu[_LENGTHS] = drawn[:2], drawn[_LENGTHS]
    task, walk = walked(number, seed, person, mu, policy, configuration, random)
    symmetric = configuration.scaling.symmetric
    body = apply_parameters(scale_subject(person, symmetric=symmetric).model, mu)
    measured = _measured(person, mu, symmetric=symmetric)
    marker_set = load_marker_set(MARKER_SET)
    standing, attached = _standing(body, measured, marker_set, random)
    rows = _part(walk, task)
    plates, positions, belt = _on_belts(walk, task, rows)
    shown = positions[::CAMERA_STEPS]
    rate = 1.0 / (CAMERA_STEPS * float(walk.time[1] - walk.time[0]))
    markers = marker_positions(body, attached, shown)
    walking = Recording(
        source=f"virtual person {number} of seed {seed}",
        axes="laboratory",
        names=tuple(marker.name for marker in attached),
        markers=markers + CAMERA_NOISE * random.standard_normal(markers.shape),
        marker_rate=rate,
        plates=tuple(_with_noise(plate, random) for plate in plates),
        force_rate=CAMERA_STEPS * rate,
    )
    standing = replace(standing, marker_rate=rate)
    return RecordedPerson(
        subject=person,
        mu=mu,
        body=body,
        standing=_in_laboratory(standing),
        walking=_in_laboratory(walking),
        time=np.arange(len(shown)) / rate,
        positions=shown,
        moments=walk.moments[rows][::CAMERA_STEPS],
        belt=belt,
    )


def _in_laboratory(recording: Recording) -> Recording:
    return replace(recording.turned(_TO_LABORATORY), axes="laboratory")


def _measured(person: Subject, mu: Array, *, symmetric: bool) -> Measurements:
    """The lengths of the body, both legs as in the model; what mu stretches is stretched."""
    own = replace(measurements_of(person), symmetric=symmetric)
    foot = np.array([mu[PARAMETERS.index("foot_length")], 1.0, 1.0])
    right, left = (
        replace(
            limbs,
            heel=limbs.heel * foot,
            metatarsals=limbs.metatarsals * foot,
            foot=None,
            forearm=limbs.forearm or mean_length(person.sex, "forearm", person.height_m),
        )
        for limbs in own.modelled.values()
    )
    return replace(own, right=right, left=left)


def _standing(
    body: BodyModel, measured: Measurements, marker_set: MarkerSet, random: np.random.Generator
) -> tuple[Recording, list[ModelMarker]]:
    """The standing trial in the project's axes, and the markers that stay on for walking."""
    tilt = float(np.degrees(measured.pelvic_tilt))
    pose = standing_pose(body, measured.right.ankle_height, tilt=tilt)
    pose[3:5] = 0.0
    frames = segment_frames(body, pose[None])[0]
    landmarks = landmarks_on(measured, frames)
    places: dict[str, Array] = {}
    attached: list[ModelMarker] = []
    for name, marker in marker_set.markers.items():
        frame = frames[SEGMENTS.index(marker.segment)]
        if marker.landmark is not None and marker.landmark not in landmarks:
            continue  # a crest, which stands for spines that this person shows
        if marker.landmark is not None:
            places[name] = landmarks[marker.landmark]
        else:
            places[name] = frame[:3, 3] + frame[:3, :3] @ np.array(_TRACKING[name])
        if not marker.static_only:
            # A row vector times R is Rᵀ times the vector: from world axes to the segment's.
            local = (places[name] - frame[:3, 3]) @ frame[:3, :3]
            attached.append(ModelMarker(name, marker.segment, local))
    markers = np.tile(np.array(list(places.values())), (STANDING_FRAMES, 1, 1))
    markers = markers + CAMERA_NOISE * random.standard_normal(markers.shape)
    return Recording("standing", "project", tuple(places), markers, 1.0), attached


def _part(walk: Rollout, task: WalkingTask) -> slice:
    """`SECONDS` of the walk after it has settled, a whole number of the cameras' frames."""
    step = float(walk.time[1] - walk.time[0])
    start = int(find_cycles(walk, task.configuration).starts["right"][0])
    return slice(start, start + round(SECONDS / (step * CAMERA_STEPS)) * CAMERA_STEPS)


def _on_belts(
    walk: Rollout, task: WalkingTask, rows: slice
) -> tuple[tuple[Plate, ...], Array, float]:
    """The plates under both belts, right first, the positions (T, 31) on the treadmill, in the
    project's axes, and the belts' speed, the mean one of the walk.
    """
    time = walk.time[rows] - walk.time[rows.start]
    positions = walk.positions[rows].copy()
    # A straight line through the pelvis's position, so that the person neither drifts nor starts
    # off the middle of the treadmill.
    speed, start = np.polyfit(time, positions[:, 3], 1)
    away = np.zeros((len(time), 3))
    away[:, 0], away[:, 1] = start + speed * time, positions[:, 4].mean()
    positions[:, 3:6] -= away
    wrenches = walk.wrenches()[rows]
    # the smooth contact law acts a centimetre above the ground already, which no plate feels
    wrenches[wrenches[..., 2] < UNLOADED_N] = 0.0
    plates = []
    for side in range(2):
        corners = _belt(side)
        force, moment = wrenches[:, side, :3], wrenches[:, side, 3:]
        # The moment is about the world's origin, away from which the treadmill has moved.
        plate = plate_under(str(side + 1), corners, force, moment, moved=away)
        off = (
            np.abs((plate.centre_of_pressure - corners.mean(axis=0))[:, :2]) > np.array(BELT) / 2.0
        )
        if off.any():
            raise VirtualError("a foot leaves its own belt. Take another number or seed.")
        plates.append(plate)
    return tuple(plates), positions, float(speed)


def _belt(side: int) -> Array:
    """Corners (4, 3) m of the right or left belt; its third axis points down."""
    length, width = BELT
    outer = -width if side == 0 else width
    right, left = min(outer, 0.0), max(outer, 0.0)
    # Counted clockwise from above, so that the third axis of the plate points down, as plates have
    # it.
    front, back = length / 2.0, -length / 2.0
    return np.array([[front, right, 0], [back, right, 0], [back, left, 0], [front, left, 0]])


def _with_noise(plate: Plate, random: np.random.Generator) -> Plate:
    axes, middle = plate_axes(plate.corners), plate.corners.mean(axis=0)
    assert plate.moment is not None
    force = plate.force + FORCE_NOISE * random.standard_normal(plate.force.shape)
    # Noise is that of the plate's own channels, which measure about its middle.
    moment = plate.moment - np.cross(middle, plate.force)
    moment = moment + MOMENT_NOISE * random.standard_normal(moment.shape)
    return make_plate(plate.name, plate.corners, force @ axes, moment @ axes)
