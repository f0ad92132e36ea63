"""Walks of the raw data with the body model and the markers of the person who walked."""

from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import ACTUATED
from gaitval.gait.filters import low_pass
from gaitval.gait.foot_forces import assign_forces, resample_forces
from gaitval.gait.plate_offset import zero_plates
from gaitval.kinetics.inverse.inverse_kinematics import inverse_kinematics
from gaitval.kinetics.inverse.marker_placement import place_markers
from gaitval.mocap.axes import detect_axes, turn_to_walking_direction
from gaitval.mocap.cleaning import clean
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import FootForces, Recording
from gaitval.model.body import BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.marker_sets import recognise
from gaitval.scaling.scaling import build_body

TOES = {"mtp_angle_r": 0.0, "mtp_angle_l": 0.0}
UPPER_BODY = {name: 0.0 for name in ACTUATED if name.startswith(("lumbar", "arm", "elbow"))}


@dataclass(frozen=True)
class RecordedWalk:
    """A trial in the project's axes with what inverse kinematics and dynamics need.

    Attributes
    ----------
    markers : on the model, those that the trial has.
    fixed : coordinates that the markers do not show, rad.
    trial : cleaned, its markers in the order of `markers`.
    positions : (T, 31) low-passed poses.
    forces : on both feet at the times of the markers.
    """

    model: BodyModel
    markers: tuple[ModelMarker, ...]
    fixed: dict[str, float]
    trial: Recording
    positions: np.ndarray
    forces: FootForces


def recorded_walk(
    standing: Path,
    walking: Path,
    forces: Path | None,
    *,
    fixed: dict[str, float],
    mass: float,
    height: float,
    start: float,
    frames: int,
) -> RecordedWalk:
    """The walk of a man from `start` (s) over so many frames."""
    processing = ProcessingSettings()
    static = read_recording(standing)
    marker_set = recognise(static.names)
    names = marker_set.renamed(static.names)
    landmarks = {
        definition: name
        for name, marker in names.items()
        if (definition := marker_set.markers[marker].landmark) is not None
    }
    axes = detect_axes(static, landmarks).rotation
    static = static.turned(axes)
    stand = {names[name]: np.nanmedian(static.marker(name), axis=0) for name in names}
    person = SimpleNamespace(
        identifier="walker", sex="M", mass_kg=mass, height_m=height, age_years=None
    )
    lengths = measure(marker_set.on_landmarks(stand))
    model = build_body(person, lengths).model

    trial = read_recording(walking, forces=forces).turned(axes)
    trial, _ = turn_to_walking_direction(trial, landmarks)
    segments = {name: marker_set.markers[marker].segment for name, marker in names.items()}
    trial, _ = clean(trial, segments, processing, landmarks=landmarks)
    trial, _ = zero_plates(trial, landmarks=landmarks)
    found, _ = assign_forces(
        trial,
        processing,
        landmarks=landmarks,
        cutoff_hz=processing.moment_force_cutoff_hz,
    )
    first = round((start - trial.start) * trial.marker_rate)
    window = slice(first, first + frames)
    time = trial.time[window]
    found = resample_forces(found, time)
    placed = {
        marker.name: marker for marker in place_markers(model, lengths, stand, marker_set).markers
    }
    chosen = [name for name in trial.names if names.get(name) in placed]
    markers = tuple(replace(placed[names[name]], name=name) for name in chosen)
    measured = np.stack([trial.marker(name)[window] for name in chosen], axis=1)
    trial = Recording(
        trial.source, "project", tuple(chosen), measured, trial.marker_rate, float(time[0])
    )
    poses = inverse_kinematics(model, markers, measured, fixed=fixed).positions
    positions = low_pass(poses, rate=trial.marker_rate, cutoff_hz=processing.marker_cutoff_hz)
    return RecordedWalk(model, markers, fixed, trial, positions, found)


def wbds_walk(gait_data: Path, frames: int = 300) -> RecordedWalk:
    """WBDS01 on the treadmill at 0.49 m/s (T01), from 10 s on; mass and height of the metadata."""
    raw = gait_data / "wbds" / "raw"
    return recorded_walk(
        raw / "WBDS01static1.c3d",
        raw / "WBDS01walkT01.c3d",
        None,
        fixed=TOES | UPPER_BODY,
        mass=74.3,
        height=1.725,
        start=10.0,
        frames=frames,
    )


def rajagopal_walk(gait_data: Path) -> RecordedWalk:
    """The walk over force plates that comes with OpenSim's full-body model, with trunk and arms."""
    data = gait_data / "opensim_rajagopal" / "ExpData"
    return recorded_walk(
        data / "static_walk_1.trc",
        data / "motion_capture_walk.trc",
        data / "grf_walk.mot",
        fixed=TOES,
        mass=85.0668,  # of the published scale set-up, as the height
        height=1.829,
        start=0.45,  # to 1.8 s, of the published inverse dynamics set-up
        frames=136,
    )
