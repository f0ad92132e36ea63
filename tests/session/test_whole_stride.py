"""A trial that is one stride of a periodic walk, cut anywhere, shows a whole cycle of each side."""

from dataclasses import replace

import numpy as np
import pytest
from known_walk import _subject
from made_up_session import made_up_session

from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError
from gaitval.session.read import read_session
from gaitval.session.scale import scale_body
from gaitval.session.trial import WalkingTrial, require_cycles, valid_cycles, work_out_trial
from gaitval.session.whole_stride import joined

PROCESSING = ProcessingSettings()
FRAMES = 160
"""Of a stride: the rate of the markers is such that it has no part of one."""
PER_FRAME = 2


def cut(recording, first, frames):
    """A part of a recording."""
    samples = slice(first * PER_FRAME, (first + frames) * PER_FRAME)
    return replace(
        recording,
        markers=recording.markers[first : first + frames],
        start=float(recording.time[first]),
        plates=tuple(
            replace(
                plate,
                force=plate.force[samples],
                centre_of_pressure=plate.centre_of_pressure[samples],
                free_moment=plate.free_moment[samples],
            )
            for plate in recording.plates
        ),
    )


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    rate = FRAMES / _subject()[1].stride_time
    made = made_up_session(
        tmp_path_factory.mktemp("session"),
        noise=0.0, seconds=4.5 * FRAMES / rate, rate=rate, per_frame=PER_FRAME, standing_frames=60,
    )  # fmt: skip
    recordings = read_session(made.request, PROCESSING)
    return made, recordings, scale_body(made.request, PROCESSING, recordings)


@pytest.fixture(scope="module")
def whole(session) -> WalkingTrial:
    made, recordings, body = session
    return work_out_trial(
        made.request, PROCESSING, recordings, body, "whole", recordings.walking[0]
    )


@pytest.mark.parametrize(
    ("first", "frames"), [(210, FRAMES), (300, FRAMES + 1), (310, FRAMES + 20)]
)
def test_both_sides_are_those_of_the_longer_trial(session, whole, first, frames):
    """From any moment on, with and without the first frame once more at the end, and where the
    right cycle is in it and the left is not."""
    made, recordings, body = session
    stride = cut(recordings.walking[0], first, frames)
    messages = []
    walk = work_out_trial(
        made.request,
        PROCESSING,
        recordings,
        body,
        "stride",
        stride,
        lambda *what: messages.append(what),
    )
    assert any(step == "events" and "joined to itself" in text for step, text in messages)
    for i, side in enumerate(SIDES):
        (cycle,) = valid_cycles(walk, side, kinetics=True)
        known = min(
            valid_cycles(whole, side, kinetics=True),
            key=lambda each: abs(each.start - cycle.start),
        )
        offset = round((cycle.start - known.start) / cycle.duration) * cycle.duration
        assert cycle.start - offset == pytest.approx(known.start, abs=2e-3)
        assert cycle.duration == pytest.approx(known.duration, abs=2e-3)
        times = np.linspace(known.start, known.end, 60)
        for name in ("hip_flexion", "knee_angle", "ankle_angle"):
            ours, theirs = (
                np.interp(
                    at, each.recording.time, each.moments.recorded_moments()[f"{name}_{side[0]}"]
                )
                for each, at in ((walk, times + offset), (whole, times))
            )
            assert np.abs(ours - theirs).max() < 0.01 * made.person.model.mass
        assert walk.gait[side].speed.mean() == pytest.approx(
            whole.gait[side].speed.mean(), rel=0.01
        )
        assert walk.forces.valid[:, i].all()


@pytest.mark.parametrize(
    "frames", [FRAMES - 6, 2 * FRAMES - 20, FRAMES // 2, 2 * FRAMES, 2 * FRAMES + 1, 3 * FRAMES]
)
def test_what_is_no_whole_stride_is_not_joined(session, frames):
    _, recordings, _ = session
    assert joined(cut(recordings.walking[0], 210, frames)) is None


def test_a_stride_that_ends_in_another_pose_is_not_joined(session):
    """A person's strides differ by a centimetre, which would be a jump."""
    _, recordings, _ = session
    stride = cut(recordings.walking[0], 210, FRAMES)
    assert joined(stride) is not None
    markers = stride.markers.copy()
    along = np.linspace(-0.5, 0.5, len(markers))[:, None]
    markers[:, ::2, 2] += 0.02 * along
    assert joined(replace(stride, markers=markers)) is None


def test_a_stride_that_does_not_close_is_refused_as_before(session):
    made, recordings, body = session
    short = cut(recordings.walking[0], 210, FRAMES - 6)
    walk = work_out_trial(made.request, PROCESSING, recordings, body, "short", short)
    with pytest.raises(RecordError, match="no complete right gait cycle"):
        require_cycles([walk])


def test_a_plates_moment_about_the_origin_goes_with_the_walk(session):
    _, recordings, _ = session
    stride = cut(recordings.walking[0], 210, FRAMES)

    def about_origin(plate):
        return np.cross(np.nan_to_num(plate.centre_of_pressure), plate.force) + plate.free_moment

    plates = tuple(replace(each, moment=about_origin(each)) for each in stride.plates)
    for plate in joined(replace(stride, plates=plates)).recording.plates:
        loaded = np.isfinite(plate.centre_of_pressure).all(axis=1)
        np.testing.assert_allclose(plate.moment[loaded], about_origin(plate)[loaded], atol=1e-6)
        assert np.nanmax(plate.centre_of_pressure[:, 0]) > 2.0, "three strides along the way"
