"""Cleaning of marker trajectories: what is put right, what is refused, and that all is reported."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_recording import LANDMARKS, SEGMENTS, WIDTH, Y_UP, walk

from gaitval.configuration import ProcessingSettings
from gaitval.errors import RecordError
from gaitval.mocap.c3d import read_c3d
from gaitval.mocap.cleaning import clean
from gaitval.mocap.recording import Recording
from gaitval.mocap.repairs import Repair
from gaitval.mocap.trc import read_trc
from gaitval.mocap.wbds_text import read_wbds_markers

PROCESSING = ProcessingSettings()
"""Turns x forward, y up, z right into x forward, y left, z up."""


def cleaned(recording: Recording, **segments: str) -> tuple[Recording, tuple[Repair, ...]]:
    return clean(recording, segments or SEGMENTS, PROCESSING, landmarks=LANDMARKS)


def changed(recording: Recording, name: str, frames: slice, value: float) -> Recording:
    """The same trial with a marker set to a value (NaN), or moved by it (m, upwards)."""
    markers = recording.markers.copy()
    column = recording.names.index(name)
    if np.isnan(value):
        markers[frames, column] = np.nan
    else:
        markers[frames, column, 2] += value
    return recording.with_markers(recording.names, markers)


def exchanged(recording: Recording, first: str, second: str, frames: slice) -> Recording:
    markers = recording.markers.copy()
    pair = [recording.names.index(first), recording.names.index(second)]
    markers[frames, pair] = markers[frames, pair[::-1]]
    return recording.with_markers(recording.names, markers)


# -- gaps ---------------------------------------------------------------------------------------


def test_a_faultless_trial_is_not_changed() -> None:
    recording = walk()
    result, findings = cleaned(recording)
    assert np.array_equal(result.markers, recording.markers)
    assert findings == ()


def test_a_short_gap_is_filled_and_reported() -> None:
    recording = walk()
    gap = slice(200, 208)  # 0.08 s of 100 Hz
    result, findings = cleaned(changed(recording, "R.Knee", gap, np.nan))
    np.testing.assert_allclose(
        result.marker("R.Knee")[gap], recording.marker("R.Knee")[gap], atol=1e-3
    )
    (finding,) = findings
    assert (finding.kind, finding.names) == ("gap", ("R.Knee",))
    assert (finding.first, finding.last, finding.start) == (200, 207, pytest.approx(2.0))
    assert "spline" in finding.action


def test_a_gap_longer_than_allowed_stays_and_says_why() -> None:
    result, findings = cleaned(changed(walk(), "R.Knee", slice(200, 215), np.nan))
    assert np.isnan(result.marker("R.Knee")[200:215]).all()
    assert "too long" in findings[0].action


def _cluster(points: np.ndarray) -> Recording:
    """A walk with four markers more, on a segment that turns and moves."""
    recording = walk()
    turn = Rotation.from_rotvec(np.outer(np.sin(4.0 * recording.time), [0.3, 1.0, -0.2]))
    moved = np.stack([turn.apply(point) for point in points], axis=1)
    moved += np.stack([1.2 * recording.time, 0.0 * recording.time, np.cos(recording.time)], axis=1)[
        :, None
    ]
    names = (*recording.names, *(f"C{number}" for number in range(len(points))))
    return recording.with_markers(names, np.concatenate([recording.markers, moved], axis=1))


CLUSTER = np.array([[0.1, 0.0, 0.0], [0.0, 0.12, 0.0], [0.0, 0.0, -0.1], [0.1, 0.1, 0.1]])
ON_CLUSTER = {f"C{number}": "thigh_r" for number in range(4)}


@pytest.mark.parametrize("gap", [slice(200, 250), slice(0, 30), slice(580, 600)])
def test_a_long_gap_is_rebuilt_exactly_from_the_rest_of_a_rigid_segment(gap: slice) -> None:
    recording = _cluster(CLUSTER)
    result, findings = cleaned(changed(recording, "C0", gap, np.nan), **ON_CLUSTER)
    np.testing.assert_allclose(result.marker("C0"), recording.marker("C0"), atol=1e-9)
    assert "rebuilt from C1, C2, C3" in findings[0].action


@pytest.mark.parametrize(
    ("points", "gap"),
    [
        (CLUSTER, slice(200, 251)),  # more than five times the 0.1 s of a spline
        (np.outer([1, 2, 3, 4], [0.0, 0.1, 0.0]), slice(200, 220)),  # on a line
        (CLUSTER[:3], slice(200, 220)),  # two others
    ],
)
def test_a_gap_is_not_rebuilt_from_what_does_not_fix_it(points: np.ndarray, gap: slice) -> None:
    result, findings = cleaned(changed(_cluster(points), "C0", gap, np.nan), **ON_CLUSTER)
    assert np.isnan(result.marker("C0")[gap]).all()
    assert "left open" in findings[0].action


def test_a_sample_at_exactly_the_origin_is_a_gap() -> None:
    recording = walk()
    markers = recording.markers.copy()
    markers[300, 4] = 0.0
    result, findings = cleaned(recording.with_markers(recording.names, markers))
    np.testing.assert_allclose(result.markers[300, 4], recording.markers[300, 4], atol=1e-3)
    assert [finding.kind for finding in findings] == ["gap"]


def test_a_marker_that_is_never_seen_is_listed() -> None:
    _, findings = cleaned(changed(walk(), "L.Knee", slice(None), np.nan))
    assert [(each.kind, each.names) for each in findings] == [("missing", ("L.Knee",))]


# -- spikes -------------------------------------------------------------------------------------


@pytest.mark.parametrize("height", [0.03, 0.5, -5.0])
@pytest.mark.parametrize("frames", [slice(300, 301), slice(300, 304), slice(2, 3), slice(597, 600)])
def test_a_spike_is_taken_out_and_reported(frames: slice, height: float) -> None:
    recording = walk()
    result, findings = cleaned(changed(recording, "R.ASIS", frames, height))
    missed = np.linalg.norm(result.marker("R.ASIS") - recording.marker("R.ASIS"), axis=1)
    assert missed.max() < 1e-3  # filled from the other three of the pelvis at the trial's end
    spike = next(finding for finding in findings if finding.kind == "spike")
    assert spike.names == ("R.ASIS",)
    assert (spike.first, spike.last) == (frames.start, frames.stop - 1)
    assert f"{1000 * abs(height):.0f} mm" in spike.action


def test_noise_is_not_taken_for_spikes_or_exchanges() -> None:
    recording = walk(20.0, marker_rate=150.0)
    noise = np.random.default_rng(0).normal(scale=0.003, size=recording.markers.shape)
    noisy = recording.with_markers(recording.names, recording.markers + noise)
    result, findings = cleaned(noisy)
    assert findings == ()
    np.testing.assert_array_equal(result.markers, noisy.markers)


def test_a_marker_that_jumps_and_stays_is_reported_and_left() -> None:
    moved = changed(walk(), "R.ASIS", slice(300, None), 0.1)
    result, findings = cleaned(moved)
    np.testing.assert_array_equal(result.markers, moved.markers)
    assert [(f.kind, f.names) for f in findings] == [("jump", ("R.ASIS",))]
    assert "100 mm" in findings[0].action


# -- exchanged markers ----------------------------------------------------------------------------


@pytest.mark.parametrize("frames", [slice(200, 260), slice(500, None), slice(90), slice(300, 450)])
@pytest.mark.parametrize("pair", [("R.MT1", "R.MT5"), ("L.ASIS", "L.PSIS"), ("R.ASIS", "L.ASIS")])
def test_an_exchange_within_a_trial_is_one_jump(frames: slice, pair: tuple[str, str]) -> None:
    _, findings = cleaned(exchanged(walk(), *pair, frames))
    (finding,) = (each for each in findings if each.kind == "jump")
    assert set(finding.names) == set(pair)
    assert finding.first == (frames.start or frames.stop)
    assert "another marker has the label from there on" in finding.action


def test_an_exchange_hidden_by_a_gap_is_a_jump() -> None:
    hidden = exchanged(walk(), "R.MT1", "R.MT5", slice(205, None))
    for name in ("R.MT1", "R.MT5"):
        hidden = changed(hidden, name, slice(200, 205), np.nan)
    _, findings = cleaned(hidden)
    (finding,) = (each for each in findings if each.kind == "jump")
    assert (finding.names, finding.first) == (("R.MT1", "R.MT5"), 205)


@pytest.mark.parametrize("lost", [-10, 10])
def test_frames_that_are_missing_or_too_many_are_jumps_of_most_markers(lost: int) -> None:
    recording = walk(8.0, marker_rate=150.0)
    frames = np.arange(len(recording.markers))
    kept = np.r_[frames[:400], frames[400 + lost :]]
    other = recording.with_markers(recording.names, recording.markers[kept])
    first = next(each for each in cleaned(other)[1] if each.kind == "jump")
    assert (first.first, len(first.names) > 5) == (400, True)
    assert "frames are missing or are there twice" in first.action


def test_one_pair_with_left_and_right_exchanged_all_along_is_refused() -> None:
    with pytest.raises(RecordError, match=r"left and right are exchanged for L.Knee and R.Knee:"):
        cleaned(exchanged(walk(), "L.Knee", "R.Knee", slice(None)))


def medial(recording: Recording, inwards: float) -> tuple[Recording, dict[str, str]]:
    """A trial with a marker inside of each ankle, m, on the segment of heel and forefoot."""
    names, columns = {}, []
    for side, sign in (("L", -1.0), ("R", 1.0)):
        names[f"{side}.Ankle.Medial"] = SEGMENTS[f"{side}.Heel"]
        columns.append(recording.marker(f"{side}.Heel") + np.array([0.0, sign * inwards, 0.02]))
    markers = np.concatenate([recording.markers, np.stack(columns, axis=1)], axis=1)
    return recording.with_markers((*recording.names, *names), markers), SEGMENTS | names


def test_markers_inside_of_feet_on_one_line_are_not_exchanged() -> None:
    narrow, segments = medial(walk(), WIDTH + 0.03)  # each beyond the middle line
    left, right = (narrow.marker(f"{side}.Ankle.Medial")[:, 1] for side in "LR")
    assert np.median(left - right) < -0.05
    ankles = {f"{side}.Ankle.Medial": f"{side}.Ankle.Medial" for side in "LR"}
    result, _ = clean(narrow, segments, PROCESSING, landmarks=LANDMARKS | ankles)
    assert np.array_equal(result.markers, narrow.markers)


def test_arms_that_are_crossed_or_exchanged_are_left_as_they_are() -> None:
    """No leg needs them."""
    recording = walk()
    wrists = {"L.Wrist": 0.5, "R.Wrist": 0.45}
    sides = [
        recording.marker(f"{name[0]}.ASIS") + np.array([0, 0, up]) for name, up in wrists.items()
    ]
    recording = recording.with_markers(
        (*recording.names, *wrists),
        np.concatenate([recording.markers, np.stack(sides, axis=1)], axis=1),
    )
    wrong = exchanged(recording, "L.Wrist", "R.Wrist", slice(None))
    places = LANDMARKS | {name: name for name in wrists}
    arms = {name: f"forearm_{name[0].lower()}" for name in wrists}
    result, _ = clean(wrong, arms, PROCESSING, landmarks=places)
    np.testing.assert_array_equal(result.markers, wrong.markers)
    with pytest.raises(RecordError, match=r"exchanged for L.Wrist and R.Wrist:"):
        clean(wrong, dict.fromkeys(wrists, "torso"), PROCESSING, landmarks=places)


def test_all_labels_with_left_and_right_exchanged_are_refused() -> None:
    recording = walk()
    names = tuple({"R": "L", "L": "R"}[name[0]] + name[1:] for name in recording.names)
    with pytest.raises(RecordError, match=r"(?s)L.ASIS and R.ASIS.*L.Ankle and R.Ankle"):
        cleaned(recording.with_markers(names, recording.markers))


# -- real trials ----------------------------------------------------------------------------------


def test_wbds01_t01_has_two_samples_at_the_origin_and_nothing_else(gait_data: Path) -> None:
    # R.Iliac.Crest at frame 0 and R.ASIS at frame 3329 are (0, 0, 0) in the file
    recording = read_c3d(gait_data / "wbds" / "raw" / "WBDS01walkT01.c3d").turned(Y_UP)
    places = ("ASIS", "PSIS", "Iliac.Crest")
    pelvis = {name: "pelvis" for name in recording.names if name[2:] in places}
    landmarks = {name: name for name in recording.names}
    result, findings = clean(recording, pelvis, PROCESSING, landmarks=landmarks)
    assert [(f.kind, f.names, f.first, f.last) for f in findings] == [
        ("gap", ("R.Iliac.Crest",), 0, 0),
        ("gap", ("R.ASIS",), 3329, 3329),
    ]
    assert np.isfinite(result.markers).all()
    steps = np.linalg.norm(np.diff(result.markers, axis=0), axis=2)
    assert steps.max() < 5.0 / recording.marker_rate  # nothing walks at 5 m/s here


@pytest.mark.parametrize(
    "path",
    ["wbds/raw/WBDS01walkO01Cmkr.txt", "opensim_rajagopal/ExpData/motion_capture_walk.trc"],
)
def test_no_false_findings_in_clean_recorded_walks(gait_data: Path, path: str) -> None:
    read = read_trc if path.endswith(".trc") else read_wbds_markers
    recording = read(gait_data / path).turned(Y_UP)
    landmarks = {name: name for name in recording.names}
    result, findings = clean(recording, {}, PROCESSING, landmarks=landmarks)
    assert findings == ()
    np.testing.assert_array_equal(result.markers, recording.markers)


def test_gaps_cut_into_a_recorded_walk_are_filled_within_millimetres(gait_data: Path) -> None:
    """Mean of the largest errors over many gaps, beside the filter's own 1 to 3 mm of skin."""
    path = gait_data / "opensim_rajagopal" / "ExpData" / "motion_capture_walk.trc"
    recording = read_trc(path).turned(Y_UP)
    landmarks = {name: name for name in recording.names}
    shank = [f"R.SH{number}" for number in (1, 2, 3, 4)]
    segments = dict.fromkeys([*shank, "R.Ankle"], "shank_r")
    random = np.random.default_rng(0)
    for frames, largest in ((5, 2e-3), (10, 3e-3), (20, 5e-3)):
        errors = []
        for _ in range(20):
            name = str(random.choice(shank))
            begin = int(random.integers(10, len(recording.markers) - 10 - frames))
            gap = slice(begin, begin + frames)
            broken = changed(recording, name, gap, np.nan)
            result, _ = clean(broken, segments, PROCESSING, landmarks=landmarks)
            missed = result.marker(name)[gap] - recording.marker(name)[gap]
            errors.append(np.linalg.norm(missed, axis=1).max())
        assert np.mean(errors) < largest
