"""Joint centres that come with a recording, beside ours and in their place."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_session import SHORT, made_up_session

from gaitval.configuration import ContactSettings, ProcessingSettings
from gaitval.errors import ScalingError
from gaitval.model.markers import ModelMarker
from gaitval.scaling.given_centres import GivenCentre
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.session.given_centres import (
    CHECK,
    CentreDifference,
    given_centres,
    given_warnings,
)
from gaitval.session.importing.results import GivenCentreResult
from gaitval.session.opensim.osim import write_osim
from gaitval.session.read import read_session
from gaitval.session.session import work_out_trials
from gaitval.session.standing import standing_places

PROCESSING = ProcessingSettings()
SET = load_marker_set("wbds")
MOVED = {
    "thigh_r": (-0.030, -0.010, 0.005),
    "thigh_l": (-0.030, 0.010, 0.005),
    "shank_r": (-0.010, 0.0, 0.0),
    "shank_l": (-0.010, 0.0, 0.0),
}
"""m in the segment above: hips 30 mm behind, 10 mm outwards and 5 mm up, knees 10 mm behind."""


def session_with_model(folder, *, larger=1.0, moved=MOVED):
    """A session, and the person's model with `moved` joints, `larger` by a factor."""
    session = made_up_session(folder, noise=0.0, **SHORT)
    _, local = session.person.markers(SET)
    body = replace(
        session.person.model,
        segments=tuple(
            replace(s, joint_position=s.joint_position + np.array(moved.get(s.name, (0, 0, 0))))
            for s in session.person.model.segments
        ),
    )
    markers = [ModelMarker(name, SET.segments[name], larger * at) for name, at in local.items()]
    write_osim(folder / "own.osim", body, markers, ContactSettings(), 0.8)
    return session.request.model_copy(update={"scaled_model": folder / "own.osim"})


@pytest.fixture(scope="module")
def imports(tmp_path_factory):
    """Imports of a session with a model, which is shown, and which is used."""
    request = session_with_model(tmp_path_factory.mktemp("given"))
    used = request.model_copy(update={"joint_centres": "given"})
    return [work_out_trials(each, PROCESSING) for each in (request, used)]


def test_the_model_s_joints_are_shown_beside_ours(imports):
    shown, _ = imports
    by_title = {row.title: row for row in shown.given}
    assert list(by_title) == [
        f"{s} {j}" for j in ("hip", "knee", "ankle") for s in ("right", "left")
    ]
    for side in ("right", "left"):
        hip, knee, ankle = (by_title[f"{side} {joint}"] for joint in ("hip", "knee", "ankle"))
        # Outwards is the same sign on both sides; 3 mm are the joint fit's.
        np.testing.assert_allclose(1000 * hip.difference, [-30.0, 10.0, 5.0], atol=3.0)
        np.testing.assert_allclose(1000 * knee.difference, [-10.0, 0.0, 0.0], atol=3.0)
        assert np.abs(ankle.difference).max() < 0.003
        assert hip.flexion > knee.flexion > 0.05
        assert not hip.used
        assert "back, 10 mm outwards" in str(hip)
    assert not [warning for _, warning in shown.warnings if warning.check == CHECK]


def test_the_model_s_joints_are_ours_if_asked_for(imports):
    _, used = imports
    for row in used.given:
        # 3 mm sideways: a knee of the model is a hinge, and the leg is not quite in its plane.
        assert np.abs(row.difference).max() < 0.003
        assert row.flexion < 0.02
        assert row.used
    assert not [warning for _, warning in used.warnings if warning.check == CHECK]
    assert used.body.chosen.sources["hips"] == "markers, hip of own.osim"


def test_the_moments_differ_by_what_was_said(imports):
    """Of hips and knees: the moment about the moved joint less that about ours, RMS over stance."""
    shown, used = imports
    for row in shown.given[:4]:
        name = {"hip": "hip_flexion", "knee": "knee_angle"}[row.joint] + f"_{row.side[0]}"
        apart = []
        for before, after in zip(shown.trials, used.trials, strict=True):
            column = 0 if row.side == "right" else 1
            stance = np.isfinite(before.loads.centre_of_pressure[:, column, 0])
            stance &= before.dynamics.leg_known(row.side)
            moments = [walk.dynamics.recorded_moments()[name][stance] for walk in (before, after)]
            apart.append(moments[1] - moments[0])
        found = np.sqrt(np.mean(np.concatenate(apart) ** 2)) / shown.body.model.mass
        assert found == pytest.approx(row.flexion, abs=0.04)


def test_the_rows_are_in_the_record_and_on_the_page(imports):
    shown, _ = imports
    results = [GivenCentreResult.model_validate(row.record()) for row in shown.given]
    assert results[0].source == "own.osim"
    assert results[0].difference_m == shown.given[0].difference.tolist()
    row = shown.given[0].row()
    assert (row.side, row.joint, row.source) == ("right", "hip", "own.osim")
    assert row.forward == pytest.approx(1000 * results[0].difference_m[0])


def test_another_person_s_model_is_told_and_refused_where_it_is_to_be_used(tmp_path):
    request = session_with_model(tmp_path, larger=1.3)
    said = []
    found = work_out_trials(request, PROCESSING, lambda step, text: said.append((step, text)))
    assert found.given == ()
    (warning,) = [warning for _, warning in found.warnings if warning.check == CHECK]
    assert "not compared" in str(warning)
    assert any(step == "warnings" and "not this person's model" in text for step, text in said)
    with pytest.raises(ScalingError, match="not this person's model"):
        work_out_trials(request.model_copy(update={"joint_centres": "given"}), PROCESSING)


def test_a_model_whose_markers_were_not_moved_to_the_standing_trial_is_told(tmp_path, imports):
    assert not [text for _, text in imports[1].decisions if "another trial" in text]
    request = session_with_model(tmp_path, larger=1.1)
    found = given_centres(request, read_session(request, PROCESSING))
    assert len(found.centres) == 6
    (flag,) = found.flags
    assert "by another trial, or for another person" in str(flag)


def test_centres_that_nobody_gave_are_refused(tmp_path):
    request = made_up_session(tmp_path, noise=0.0, **SHORT).request
    with pytest.raises(ScalingError, match="no joint centres came with the recording"):
        work_out_trials(request.model_copy(update={"joint_centres": "given"}), PROCESSING)


def test_points_beside_exchanged_markers_are_not_taken(tmp_path):
    """The walk that has the points shows other places of the markers than the standing trial."""
    request = made_up_session(tmp_path, noise=0.0, **SHORT).request
    session = read_session(request, PROCESSING)
    standing = standing_places(session.standing)
    names = [name for name, segment in SET.segments.items() if segment == "pelvis"]
    there = {name: standing[name][None] for name in names if name in standing}
    first, second, *_ = there
    wrong = {**there, first: there[second], second: there[first]}
    centre = standing[first][None]
    said = list[str]()
    for markers, count in ((there, 1), (wrong, 0)):
        point = GivenCentre("R.Hip.Centre", "Nexus", markers, centre, one_frame=True)
        said.clear()
        found = given_centres(
            request, replace(session, points=(point,)), lambda _, text: said.append(text)
        )
        assert len(found.centres) == count
        assert any("exchanged, or were moved" in text for text in said) == (count == 0)
    used = request.model_copy(update={"joint_centres": "given"})
    with pytest.raises(ScalingError, match="exchanged, or were moved"):
        given_centres(used, replace(session, points=(point,)))


def test_knees_that_are_given_leave_the_hips_by_regression(imports):
    _, used = imports
    assert used.given_hips == "own.osim"
    assert imports[0].given_hips == ""
    knees = tuple(row for row in used.given if row.joint == "knee")
    assert replace(used, given=knees).given_hips == ""


def row(flexion, abduction=0.0, *, used=False, side="right"):
    return CentreDifference(
        "Nexus", side, "hip", np.array([0.013, -0.012, 0.0]), flexion, abduction, used
    )


def test_one_sentence_of_the_largest_change_and_none_of_small_ones():
    assert not [*given_warnings([row(0.09, used=True), row(np.nan, np.nan, used=True), row(0.3)])]
    (warning,) = given_warnings([row(0.12, used=True), row(0.05, 0.2, side="left", used=True)])
    assert warning.where == "left hip"
    assert "13 mm forward, 12 mm inwards" in warning.message
    assert "cannot take it" in warning.message
    assert (warning.value, warning.limit) == (0.2, 0.1)
