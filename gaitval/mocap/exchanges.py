"""Labels with left and right exchanged."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.errors import RecordError
from gaitval.mocap.foot_markers import facing
from gaitval.mocap.recording import Recording

ON_ONE_LINE: Final = 0.02
"""m by which a left marker may be on the right of its partner in the median frame: runners' toes
are by 8 mm (Hamner et al. 2010). Exchanged labels are by the width of a step or a joint."""
ARMS: Final = frozenset(
    ("torso", *(f"{part}_{side}" for part in ("upper_arm", "forearm") for side in "rl"))
)
"""Segments whose markers no leg needs."""
INNER: Final = ("Medial", "MT1")
"""Landmarks at the inside of legs, which are on the other's side where steps are narrow."""


def check_sides(
    recording: Recording, segments: Mapping[str, str], landmarks: Mapping[str, str]
) -> None:
    """Refuse left and right markers that have each other's names throughout: of some pairs, or of
    all, where the file may be mirrored. Those of arms, which may be crossed, are not looked at.

    `recording` has z up, m; `segments` of the body model are by marker; `landmarks`, see
    `foot_markers`, show where the person faces. Raises RecordError also if that is unknown.
    """
    forward = facing(recording, landmarks)
    leftward = np.array([-forward[1], forward[0], 0.0])
    wrong = []
    for at, left in landmarks.items():
        right = landmarks.get(f"R.{at[2:]}", "")
        if not at.startswith("L.") or at.endswith(INNER) or not {left, right} <= {*recording.names}:
            continue
        if segments.get(left) in ARMS - {"torso"}:
            continue
        apart = (recording.marker(left) - recording.marker(right)) @ leftward
        apart = apart[np.isfinite(apart)]
        # Legs may cross for a moment, but not in the median of all frames; runners and people whose
        # legs scissor land on one line, where markers are a little across it.
        if len(apart) and np.median(apart) < -ON_ONE_LINE:
            wrong.append(f"{left} and {right}")
    if wrong:
        raise RecordError(
            f"{recording.source}: left and right are exchanged for {'; '.join(wrong)}: seen in the "
            "direction that the person faces, the markers labelled left are on the right in most "
            "frames. Exchange these labels in the recording program and export the trial again; if "
            "all markers are listed, the file is mirrored: its axes must be right-handed."
        )
