"""What a gap is filled with: the rigid motion of other markers, or a cubic; at known motions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaitval.mocap.gaps import FLATTEST_CLUSTER, LARGEST_DEFORMATION, bridge, rebuilt

BODY = np.array([[0.1, 0.0, 0.0], [-0.1, 0.05, 0.0], [0.0, -0.1, 0.1], [0.05, 0.1, -0.05]])
"""m, markers on a segment; the first is the one that is lost."""
BEGIN, END, FRAMES = 20, 31, 60


def moving(body=BODY):
    """Markers (T, M, 3) of a segment that turns and moves."""
    turn = Rotation.from_rotvec(np.outer(np.linspace(0.0, 1.2, FRAMES), [0.3, 0.9, -0.2]))
    path = np.column_stack([np.linspace(0, 1, FRAMES), np.sin(np.linspace(0, 3, FRAMES)),
                            np.full(FRAMES, 0.9)])  # fmt: skip
    return np.stack([turn.apply(each) + path for each in body], axis=1)


def filled(markers, *, begin=BEGIN, end=END, unseen=()):
    seen = np.ones(markers.shape[:2], dtype=bool)
    seen[begin:end, 0] = False
    for frames, column in unseen:
        seen[frames, column] = False
    return rebuilt(markers, seen, 0, np.array([1, 2, 3]), begin, end)


@pytest.mark.parametrize(("begin", "end"), [(20, 31), (0, 11), (50, 60)])
def test_a_marker_moves_with_its_segment(begin, end):
    """Also where the trial begins or ends in the gap, with one edge only."""
    markers = moving()
    path, used, deformation = filled(markers, begin=begin, end=end)
    np.testing.assert_allclose(path, markers[begin:end, 0], atol=1e-9)
    assert used == [1, 2, 3]
    assert deformation == pytest.approx(0.0, abs=1e-7)


def test_what_the_skin_moves_is_spread_over_the_gap_and_both_edges_join():
    """The marker slips by 11 mm in the gap, a millimetre a frame."""
    markers = moving()
    slip = np.clip(np.arange(FRAMES) - BEGIN + 1, 0, END - BEGIN + 1) * 0.001
    slipped = markers.copy()
    slipped[:, 0, 2] += slip
    path, _, _ = filled(slipped)
    expected = markers[BEGIN:END, 0] + slip[BEGIN:END, None] * [0.0, 0.0, 1.0]
    np.testing.assert_allclose(path, expected, atol=1e-9)


def test_markers_that_move_against_each_other_or_lie_on_a_line_cannot_say():
    """The root of the mean square over the cluster, after the best fit."""
    for size, kept in ((0.9, True), (1.1, False)):
        markers = moving(np.array([[0.1, 0, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float))
        middle = (BEGIN + END) // 2
        flat = markers.copy()
        # a uniform stretch s of the triangle about its middle moves each by s times its distance
        inner = flat[middle, 1:].mean(axis=0)
        spread = np.sqrt(((flat[middle, 1:] - inner) ** 2).sum(axis=1).mean())
        factor = 1.0 + size * LARGEST_DEFORMATION / spread
        flat[middle, 1:] = inner + factor * (flat[middle, 1:] - inner)
        found = filled(flat)
        assert (found is not None) == kept
        if kept:
            assert found[2] == pytest.approx(size * LARGEST_DEFORMATION, rel=1e-6)
    for width, kept in ((1.2, True), (0.8, False)):
        # along one axis, and across by so much that the singular values have the ratio
        across = width * FLATTEST_CLUSTER
        body = np.array([[0.1, 0, 0], [-1, 0, 0], [1, 0, 0], [0, 0, 0]], dtype=float)
        body[1:, 1] = np.array([1.0, 1.0, -2.0]) / np.sqrt(6.0) * across * np.sqrt(2.0)
        assert (filled(moving(body)) is not None) == kept


def test_a_marker_unseen_at_any_frame_of_the_gap_or_its_edges_does_not_help():
    markers = moving(np.vstack([BODY, [[0.2, 0.2, 0.1]]]))
    seen = np.ones(markers.shape[:2], dtype=bool)
    seen[BEGIN:END, 0] = False
    for frame, used in ((BEGIN - 1, [1, 3, 4]), (END, [1, 3, 4]), (BEGIN - 2, [1, 2, 3, 4]),
                        (END + 1, [1, 2, 3, 4]), (BEGIN + 3, [1, 3, 4])):  # fmt: skip
        some = seen.copy()
        some[frame, 2] = False
        found = rebuilt(markers, some, 0, np.array([1, 2, 3, 4]), BEGIN, END)
        assert found is not None
        assert found[1] == used, frame
    seen[BEGIN, 1:3] = False
    assert rebuilt(markers, seen, 0, np.array([1, 2, 3, 4]), BEGIN, END) is None


def cubic(time):
    return np.column_stack([time, 1.0 + 2 * time - 3 * time**2, 0.5 * time**2])


@pytest.mark.parametrize(("rate", "bent"), [(50.0, 0.0), (100.0, 1.0), (250.0, 1.0)])
def test_a_parabola_is_bridged_exactly(rate, bent):
    """Position and velocity at both edges are those of parabolas through the frames beside them;
    of three frames, as within 40 ms at 50 Hz, those of a line."""
    time = np.arange(FRAMES) / rate
    path = bent * cubic(time) + time[:, None]
    gappy = path.copy()
    gappy[BEGIN:END] = np.nan
    np.testing.assert_allclose(bridge(gappy, BEGIN, END, rate), path[BEGIN:END], atol=1e-9)


def test_the_noise_of_single_frames_does_not_bulge_the_bridge():
    """Velocities are fitted over 40 ms, here ten frames, on each side."""
    path = np.zeros((FRAMES, 3))
    path[BEGIN - 2] = 0.001
    path[BEGIN:END] = np.nan
    bulge = np.abs(bridge(path, BEGIN, END, 250.0)).max()
    steps = np.array([0.0, 0.001])  # as two frames alone would have it
    alone = np.abs(np.diff(steps))[0] * (END - BEGIN + 1) * 4.0 / 27.0
    assert 0.0 < bulge < 0.5 * alone


def test_fewer_than_two_frames_at_an_edge_are_no_bridge():
    path = cubic(np.arange(FRAMES) / 100.0)
    path[BEGIN:END] = np.nan
    for lost, found in ((BEGIN - 2, False), (BEGIN - 3, True), (END + 1, False), (END + 2, True)):
        part = path.copy()
        part[lost] = np.nan
        assert (bridge(part, BEGIN, END, 100.0) is not None) == found, lost
    assert bridge(path[BEGIN - 1 :], 1, 1 + END - BEGIN, 100.0) is None
    assert bridge(path[BEGIN - 2 :], 2, 2 + END - BEGIN, 100.0) is not None
