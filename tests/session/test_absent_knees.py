"""A walk without markers on the knees: clusters carry them; pelvis and foot alone do not."""

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.session.absent_knees import absent_knees

SET = load_marker_set("rajagopal")
THIGH = [name for name, each in SET.markers.items() if each.segment == "thigh_r"]
SHANK = [name for name, each in SET.markers.items() if each.segment == "shank_r"]
KNEES = [SET.landmarks[f"{side}.Knee{end}"] for side in "RL" for end in ("", ".Medial")]
ANKLES = [SET.landmarks[f"R.Ankle{end}"] for end in ("", ".Medial")]
CLUSTER = [name for name in THIGH if name not in KNEES]


def walk(without):
    names = [name for name in SET.markers if name not in without]
    return Recording("walk.trc", "project", tuple(names), np.zeros((10, len(names), 3)), 100.0)


def test_a_knee_with_a_marker_needs_nothing_else():
    others = [n for n in (*THIGH, *SHANK) if n not in (*KNEES, *ANKLES)]
    assert not list(absent_knees(walk(others), SET))


def test_a_cluster_carries_the_knee():
    assert len(CLUSTER) >= 3
    assert not list(absent_knees(walk(KNEES[:2]), SET))


def test_one_marker_beside_is_said_with_what_is_left():
    gone = [n for n in (*THIGH, *SHANK) if n not in ANKLES and n != CLUSTER[0]]
    (flag,) = absent_knees(walk(gone), SET)
    assert flag.where == KNEES[0]
    assert CLUSTER[0] in flag.message


def test_pelvis_and_foot_alone_are_refused_with_the_markers_that_are_missing():
    gone = [n for n in (*THIGH, *SHANK) if n not in ANKLES]
    with pytest.raises(RecordError, match=rf"walk\.trc.*right knee.*{KNEES[0]}"):
        list(absent_knees(walk(gone), SET))


def test_a_marker_that_is_never_seen_is_not_there():
    gone = [n for n in (*THIGH, *SHANK) if n not in (*ANKLES, KNEES[0])]
    recording = walk(gone)
    assert not list(absent_knees(recording, SET))
    recording.markers[:, recording.names.index(KNEES[0])] = np.nan
    with pytest.raises(RecordError, match=KNEES[0]):
        list(absent_knees(recording, SET))
