"""Clean marker trajectories for kinematics: lost markers, spikes and gaps.

Nothing is changed silently: findings list every frame that `clean` replaced, and every frame that
it could not. It works in any axes with z up (the project's, REP-103), in metres.
"""

from collections.abc import Mapping

import numpy as np

from gaitval.configuration import ProcessingSettings
from gaitval.errors import RecordError
from gaitval.mocap.exchanges import check_sides
from gaitval.mocap.lost_markers import leave_out_lost
from gaitval.mocap.recording import Recording
from gaitval.mocap.repairs import Repair, repair, seen_frames
from gaitval.mocap.spikes import cut_spikes


def clean(
    recording: Recording,
    segments: Mapping[str, str],
    processing: ProcessingSettings,
    *,
    landmarks: Mapping[str, str],
) -> tuple[Recording, tuple[Repair, ...]]:
    """Correct what can be corrected in the marker trajectories of a trial; also returns what was
    found, in order of time.

    In this order: samples at exactly the origin, which some systems write for a marker that was not
    seen, become gaps; markers that are not on their segment, and spikes, become gaps; jumps from
    which a marker does not return are found; gaps are filled. Gaps up to half of `largest_gap_s`
    are filled with a cubic through position and velocity at the edges, which is the more accurate
    way for them. Longer gaps, up to five times `largest_gap_s`, are rebuilt from three or more
    other markers of the segment (their rigid motion by Kabsch's method, joined to the frames around
    the gap). Without these, the cubic fills gaps up to `largest_gap_s`. Longer gaps, and gaps at an
    end of the trial without such neighbours, stay NaN.

    Parameters
    ----------
    recording : z up, m.
    segments : marker -> segment of the body model; markers that are not listed are cleaned without
        neighbours.
    processing : `largest_gap_s`.
    landmarks : anatomical landmark -> marker, see `foot_markers`. They show where the person faces,
        and so which side is left.

    Raises
    ------
    RecordError : no marker is ever seen; left and right labels are exchanged in the whole trial.
    """
    markers = recording.markers.copy()
    # axes are turned about the origin, so a zero stays a zero
    markers[(markers == 0.0).all(axis=2)] = np.nan
    seen = seen_frames(markers)
    markers[~seen] = np.nan
    if not seen.any():
        raise RecordError(
            f"{recording.source}: none of the {len(recording.names)} markers is ever seen (all "
            "positions are empty, NaN or zero). Export the trial again with its reconstructed and "
            "labelled trajectories."
        )
    never = np.asarray(~seen.any(axis=0))
    findings = [
        repair(recording, "missing", [name], 0, len(markers), "never seen in this trial; left out")
        for name, gone in zip(recording.names, never, strict=True)
        if gone
    ]
    check_sides(recording.with_markers(recording.names, markers), segments, landmarks)
    findings += leave_out_lost(recording, markers, segments)
    found, spiked = cut_spikes(recording, markers, segments)
    findings += found
    if not (seen_frames(markers) | never).all():
        from gaitval.mocap.gaps import fill_gaps

        findings += fill_gaps(recording, markers, segments, processing, spiked)
    in_time = sorted(findings, key=lambda each: (each.start, each.names))
    return recording.with_markers(recording.names, markers), tuple(in_time)
