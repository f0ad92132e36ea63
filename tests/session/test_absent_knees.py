"""A walk without markers on the knees: clusters carry them; pelvis and foot alone do not."""

import numpy as np
import pytest

from gaitval.mocap.recording import Recording
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.session.trial import shows_knee

SET = load_marker_set("rajagopal")
THIGH = [name for name, each in SET.markers.items() if each.segment == "thigh_r"]
SHANK = [name for name, each in SET.markers.items() if each.segment == "shank_r"]
KNEES = [SET.landmarks[f"R.Knee{end}"] for end in ("", ".Medial")]
ANKLES = [SET.landmarks[f"R.Ankle{end}"] for end in ("", ".Medial")]
CLUSTER = [name for name in THIGH if name not in KNEES]


@pytest.mark.parametrize(
    ("kept", "shown"),
    [
        ([KNEES[0], *ANKLES], True),
        ([*CLUSTER, *ANKLES], True),
        ([CLUSTER[0], *ANKLES], True),
        (ANKLES, False),
    ],
    ids=["knee", "cluster", "one beside", "ankles alone"],
)
def test_a_knee_is_shown_by_its_marker_or_by_a_cluster(kept, shown):
    names = [name for name in SET.markers if name not in (*THIGH, *SHANK) or name in kept]
    recording = Recording("walk.trc", "project", tuple(names), np.zeros((10, len(names), 3)), 100.0)
    assert shows_knee(recording, SET, "right") == shown
    if kept[0] == KNEES[0]:  # one that is never seen is not there
        recording.markers[:, names.index(KNEES[0])] = np.nan
        assert not shows_knee(recording, SET, "right")
