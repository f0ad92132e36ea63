"""Inverse kinematics and inverse dynamics of a walking trial from Python."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gaitval.configuration import ProcessingSettings, load_configuration
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError, ScalingError
from gaitval.gait.foot_forces import of_weight
from gaitval.interface.arguments import expect
from gaitval.kinetics.inverse import inverse_dynamics as dynamics
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics
from gaitval.kinetics.inverse.inverse_kinematics import InverseKinematics
from gaitval.kinetics.inverse.scaled_markers import MarkedBody
from gaitval.mocap.recording import Recording
from gaitval.scaling.marker_set import MarkerSet
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.session.read import named, prepared
from gaitval.session.trial import leg_shown, trial_loads, trial_motion


def inverse_kinematics(
    recording: Recording, body: MarkedBody, *, settings: Sequence[str] = ()
) -> InverseKinematics:
    """Joint angles of a walking trial, as `gaitval import` finds them.

    The trial is turned about the vertical so that the person walks along +x, its markers are
    cleaned, and poses of the body are fitted to them. Resting feet are kept from sliding.

    Parameters
    ----------
    recording : `markers` (T, M, 3) m, in the project's axes (x forward, y left, z up): give
        `read_recording` the `axes` of the laboratory.
    body : with `markers`: of `scale` for a subject with standing markers, or of `import_session`.
    settings : "section.key=value", as for `--set`; here those of `processing`.

    Returns
    -------
    InverseKinematics
        `positions` (T, 31): rotation of the pelvis (rad), its origin (m), joint angles (rad),
        low-passed, as inverse dynamics uses them, for a person who walks along +x;
        `marker_errors` are of the poses before the filter.

    Raises
    ------
    ScalingError
        The body has no markers.
    RecordError
        The trial is in the laboratory's axes, lacks markers, or shows nobody walking.

    References
    ----------
    Lu and O'Connor (1999), J. Biomech. 32:129: weighted least squares over all markers.

    Examples
    --------
    Markers as a motion-capture system would see them on a walk that is known:

    >>> import numpy as np
    >>> import gaitval as gv
    >>> from gaitval.kinetics.inverse.marked_body import marker_positions
    >>> from gaitval.mocap.recording import Recording
    >>> from gaitval.walk.reference.motion import build_reference
    >>> subject = gv.load_subject(5)
    >>> body = gv.scale(subject)
    >>> known = build_reference(subject.record(), body.model)
    >>> places = marker_positions(body.model, body.markers, known.positions[::8])
    >>> names = tuple(marker.name for marker in body.markers)
    >>> walk = Recording("walk", "project", names, places, 128 / known.stride_time)
    >>> motion = gv.inverse_kinematics(walk, body)
    >>> knee = motion.to_frame().query("quantity == 'knee_angle' and side == 'right'")
    >>> bool(abs(knee.value.max() - np.degrees(known.positions[:, 9].max())) < 0.5)  # deg
    True
    """
    processing = load_configuration(settings=settings).processing
    trial, _ = _prepared(recording, body, processing)
    found = trial_motion(body.model, body.markers, trial, processing)
    return replace(
        found.anchoring.kinematics,
        positions=found.positions,
        source=recording.source,
        time=trial.time,
    )


def inverse_dynamics(
    motion: InverseKinematics,
    recording: Recording,
    body: MarkedBody,
    *,
    settings: Sequence[str] = (),
) -> InverseDynamics:
    """Joint moments of a walking trial, as `gaitval import` finds them.

    The force plates are zeroed, and what they show is given to the feet that stand on them.

    Parameters
    ----------
    motion : of `inverse_kinematics` for the same recording and body.
    recording : with force plates; forces in N, moments in Nm, in the project's axes.
    body : whose motion it is.
    settings : "section.key=value", as for `--set`; here those of `processing`.

    Returns
    -------
    InverseDynamics
        `moments` (T, 25) Nm, positive where they would increase their angle; residual force (N)
        and moment (Nm) on the pelvis, (T, 3) each, x forward, y left, z up.

    Raises
    ------
    RecordError
        There are no plates, nobody stands on them, they are under the wrong feet, or the motion is
        of another trial.

    References
    ----------
    Winter (2009), Biomechanics and Motor Control of Human Movement, chapter 5; Hicks et al. (2015),
    J. Biomech. Eng. 137:020905: the residuals.

    Examples
    --------
    A walk on two long plates, the right foot on one, the left foot on the other:

    >>> import numpy as np
    >>> import gaitval as gv
    >>> from gaitval.kinetics.inverse.marked_body import marker_positions
    >>> from gaitval.mocap.recording import Plate, Recording
    >>> from gaitval.walk.reference.motion import build_reference
    >>> subject = gv.load_subject(5)
    >>> body = gv.scale(subject)
    >>> known = build_reference(subject.record(), body.model)
    >>> plates = []
    >>> for foot, (right, left) in enumerate([(-1, 0), (0, 1)]):
    ...     corners = [[-2, left, 0], [4, left, 0], [4, right, 0], [-2, right, 0]]
    ...     force = known.ground_reaction[::8, foot] * subject.mass_kg * 9.81
    ...     below = known.end_effectors[::8, foot] * [1, 1, 0] + [0.05, 0, 0]  # the ankle
    ...     plates.append(Plate("", np.array(corners, float), force, below, 0 * force))
    >>> places = marker_positions(body.model, body.markers, known.positions[::8])
    >>> names = tuple(marker.name for marker in body.markers)
    >>> rate = 128 / known.stride_time
    >>> walk = Recording("walk", "project", names, places, rate, 0.0, tuple(plates), rate)
    >>> moments = gv.inverse_dynamics(gv.inverse_kinematics(walk, body), walk, body)
    >>> moments.moments.shape
    (128, 25)
    """
    processing = load_configuration(settings=settings).processing
    trial, marker_set = _prepared(recording, body, processing)
    expect("motion", motion, InverseKinematics, "what inverse_kinematics(recording, body) returns")
    _check_of_one_trial(motion, trial)
    shown = {side: leg_shown(motion, side, trial, marker_set) for side in SIDES}
    processing = of_weight(processing, body.model.mass)
    carried = trial_loads(trial, processing, marker_set.landmarks, shown)
    found = dynamics.inverse_dynamics(body.model, trial.time, motion.positions, *carried.wrenches)
    return replace(carried.marked(found), source=recording.source)


def _check_of_one_trial(motion: InverseKinematics, trial: Recording) -> None:
    time = np.empty(0) if motion.time is None else motion.time
    if motion.source != trial.source or not np.array_equal(time, trial.time):
        start = f" from {time[0]:g} s" if len(time) else ""
        raise RecordError(
            f"{trial.source} has {len(trial.time)} frames from {trial.time[0]:g} s, but the "
            f"motion is of {motion.source}, with {len(motion.positions)} frames{start}. Give the "
            "recording that inverse kinematics was done for."
        )
    if not trial.plates:
        raise RecordError(
            f"{trial.source}: no force plates in the trial, so there are no moments. Give the "
            "file of its ground reaction to read_recording (`forces`)."
        )


def _prepared(
    recording: Recording, body: MarkedBody, processing: ProcessingSettings
) -> tuple[Recording, MarkerSet]:
    """The trial as an import uses it, with the markers of the body's set."""
    expect("recording", recording, Recording, 'what read_recording("walk.c3d") returns')
    expect("body", body, MarkedBody, "what scale(subject) returns, or the body of import_session")
    if not body.marker_set:
        raise ScalingError(
            f"The body model {body.model.name} has no markers on it. Scale a subject that has the "
            "markers of a standing trial, or take the body of import_session."
        )
    marker_set = load_marker_set(body.marker_set)
    trial = named(recording, marker_set)
    return prepared(trial, marker_set, processing, Path(recording.source)), marker_set
