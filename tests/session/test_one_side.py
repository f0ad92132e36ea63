"""A side that no trial shows, curves that do not close, and markers that come into view late."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_session import SHORT, made_up_session

from gaitval.configuration import Configuration, ProcessingSettings
from gaitval.coordinates import COORDINATES, SIDES
from gaitval.errors import RecordError, SubjectError
from gaitval.findings import look
from gaitval.findings.means import MeanGait, usual_drift
from gaitval.gait.record import REQUIRED_ANGLES, REQUIRED_MOMENTS
from gaitval.kinetics.inverse.inverse_kinematics import InverseKinematics
from gaitval.session.average import largest_drift
from gaitval.session.importing import importing
from gaitval.session.importing.importing import work_out
from gaitval.session.importing.summary import trial_residuals
from gaitval.session.importing.write import write_subject
from gaitval.session.one_side import one_side_warnings
from gaitval.session.subject import subject_of
from gaitval.session.trial import smoothed
from gaitval.subjects.subject import make_subject
from gaitval.subjects.subject_file import load_subject


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    session = made_up_session(tmp_path_factory.mktemp("lab"), noise=0.0)
    return work_out(session.request, Configuration().processing)


def only(found, side):
    """The same import, of trials that show whole cycles of one side only."""
    keep = f"_{side[0]}"
    other = next(one for one in SIDES if one != side)
    trials = tuple(replace(w, cycles=dict(w.cycles) | {other: ()}) for w in found.trials)
    return replace(
        found,
        trials=trials,
        angles={n: c for n, c in found.angles.items() if n.endswith(keep)},
        moments={n: c for n, c in found.moments.items() if n.endswith(keep)},
        forces={side: found.forces[side]},
    )


def said_of_sides(found):
    return [str(warning) for warning in one_side_warnings(found.trials, found.angles, found.forces)]


@pytest.mark.parametrize(("prosthesis", "mean"), [(None, True), ("none", True), ("left", False)])
def test_an_import_with_a_prosthesis_keeps_both_lengths(prosthesis, mean, tmp_path, monkeypatch):
    """As the subject that it makes is scaled, in every command after it."""
    request = made_up_session(tmp_path, noise=0.0, **SHORT).request
    given = request.model_copy(update={"prosthesis": prosthesis})
    wanted, message = [], []

    def worked_out(*_, symmetric):
        wanted.append(symmetric)
        raise RecordError("enough")

    monkeypatch.setattr(importing, "work_out", worked_out)
    with pytest.raises(RecordError, match="enough"):
        importing.import_files(
            given,
            tmp_path / "out",
            configuration=Configuration(),
            notify=lambda *output: message.append(output),
        )
    assert wanted == [mean]
    about = "" if prosthesis is None else f", prosthesis {prosthesis}"  # on the page's decisions
    assert any(step == "person" and about in text for step, text in message)


def test_the_subject_has_what_was_said_of_a_prosthesis(found):
    given = found.request.model_copy(update={"prosthesis": "left"})
    assert subject_of(replace(found, request=given)).prosthesis == "left"
    assert subject_of(found).prosthesis is None


def test_the_subject_has_the_steps_that_were_measured(found, tmp_path):
    """Of each foot, not half a stride each: a person may step further with one."""
    gait = {
        side: replace(walk.gait[side], step_length=walk.gait[side].step_length + longer)
        for walk in found.trials
        for side, longer in (("right", 0.05), ("left", -0.05))
    }
    uneven = replace(found, trials=tuple(replace(walk, gait=gait) for walk in found.trials))
    write_subject(tmp_path, subject_of(uneven))
    steps = load_subject(str(tmp_path / "subject.toml")).record().steps
    for side, longer in (("right", 0.05), ("left", -0.05)):
        mean = np.nanmean(found.trials[0].gait[side].step_length)
        assert getattr(steps, side) == pytest.approx(mean + longer, abs=1e-5)
    stride = found.trials[0].gait["right"].stride_length
    assert steps.right + steps.left == pytest.approx(np.nanmean(stride), abs=0.02)
    width = [np.nanmean(found.trials[0].gait[side].step_width) for side in SIDES]
    assert steps.width == pytest.approx(np.mean(width), abs=1e-5)


@pytest.mark.parametrize("side", SIDES)
def test_a_side_that_is_not_seen_is_absent(found, side, tmp_path):
    """Nothing of it is in the file, and the file says so; the walker is asked to be symmetric."""
    part = only(found, side)
    hidden = next(one for one in SIDES if one != side)
    subject = subject_of(part)
    assert subject.gait.not_recorded == {"angles": hidden, "kinetics": hidden}
    assert not [n for n in (*subject.gait.angles, *subject.gait.moments) if n[-1] == hidden[0]]
    assert subject.gait.forces.of(hidden) is None
    assert subject.stance_fraction.of(hidden) is None
    assert subject.mean_vertical_force is None
    assert subject.gait.steps is None
    for kind in ("angles", "kinetics", "stance"):
        assert subject.origin(hidden, kind) == "expected"
        assert subject.origin(side, kind) == "recorded"
    assert f"the {hidden} angles were not recorded" in subject.described
    write_subject(tmp_path, subject)
    again = load_subject(str(tmp_path / "subject.toml"))
    assert again.gait.not_recorded == subject.gait.not_recorded
    assert again.stance_fraction.of(hidden) is None
    text = (tmp_path / "subject.toml").read_text()
    assert f'not_recorded = {{ "angles" = "{hidden}", "kinetics" = "{hidden}" }}' in text
    record, phase = again.record(), np.linspace(0.0, 1.0, 101)
    for name in (*REQUIRED_ANGLES, *REQUIRED_MOMENTS):
        kind = record.angles if name in REQUIRED_ANGLES else record.moments
        own, other = (kind[f"{name[:-2]}_{each[0]}"](phase) for each in (side, hidden))
        np.testing.assert_allclose(own, other, atol=1e-5)
    right, left = (record.ground_reaction(each, phase) for each in SIDES)
    np.testing.assert_allclose(right, left * [1, -1, 1], atol=1e-5)
    table = load_subject(tmp_path / "subject.toml").to_frame()
    assert set(table.side) == {side}
    (message,) = said_of_sides(part)
    assert message.startswith(f"{hidden} leg: its angles, moments and forces were not recorded: no")


def one_plate(found):
    """The import of a walk whose right foot was not on a plate of its own."""
    return replace(
        found,
        moments={n: c for n, c in found.moments.items() if n.endswith("_l")},
        forces={"left": found.forces["left"]},
    )


def test_a_foot_beside_the_plates_keeps_its_angles_and_its_own_stance(found, tmp_path):
    part = one_plate(found)
    subject = subject_of(part)
    assert subject.gait.not_recorded == {"kinetics": "right"}
    assert subject.gait.angles == subject_of(found).gait.angles
    assert subject.origin("right", "angles") == "recorded"
    assert subject.origin("right", "kinetics") == "expected"
    assert subject.origin("right", "stance") == "recorded"
    measured = np.concatenate([walk.gait["right"].stance_fraction for walk in part.trials])
    assert subject.stance_fraction.right == pytest.approx(np.nanmean(measured))
    (message,) = said_of_sides(part)
    assert message.startswith("right foot: its moments and forces were not recorded: no trial")


def test_an_expected_force_lasts_as_long_as_the_foot_stood(found):
    """Otherwise it would be cut off in push-off, or go on where nothing was fitted."""
    subject = subject_of(one_plate(found))
    later = subject.stance_fraction.left + 0.04
    late = subject.stance_fraction.model_copy(update={"right": later})
    record = subject.model_copy(update={"stance_fraction": late}).record()
    ends = record.stance_fraction
    phase = np.linspace(0.02, 0.98, 40)
    right, left = (record.ground_reaction(side, phase * ends[side]) for side in SIDES)
    np.testing.assert_allclose(right, left * [1, -1, 1], atol=0.03)
    assert not record.ground_reaction("right", ends["right"] + 0.01).any()


def test_both_sides_recorded_leave_no_trace_in_the_file(found):
    text = subject_of(found).to_toml()
    assert "not_recorded" not in text
    assert said_of_sides(found) == []


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda g: g.pop("not_recorded"), r"gait\.angles: missing: hip_flexion_l"),
        (lambda g: g["not_recorded"].pop("kinetics"), r"gait\.moments: missing: hip_flexion_l"),
        (lambda g: g["not_recorded"].update(angles="right"), "not_recorded. names the right side"),
        (lambda g: g["forces"].update(left=g["forces"]["right"]), "names the left side"),
    ],
)
def test_a_file_whose_sides_contradict_each_other_is_refused(found, change, match):
    values = subject_of(only(found, "right")).model_dump()
    change(values["gait"])
    with pytest.raises(SubjectError, match=match):
        make_subject(values, "test")


def drifting(found, name, degrees):
    """The import with a mean angle that ends elsewhere than it began."""
    curve = found.angles[name]
    drift = np.radians(degrees) * np.linspace(-0.5, 0.5, 101)
    return replace(found, angles=found.angles | {name: replace(curve, mean=curve.mean + drift)})


def test_a_curve_that_does_not_close_is_closed_and_told(found):
    assert not look(MeanGait(found.angles, found.moments, {"a": 1.0, "b": 1.1})).flags
    part = drifting(found, "knee_angle_l", 7.0)
    (warning, speeds) = look(MeanGait(part.angles, {}, {"a": 0.49, "b": 1.26})).flags
    assert (warning.check, warning.where) == ("drift", "knee_angle_l")
    assert "drifts by +7." in warning.message or "drifts by +6." in warning.message
    assert "a 0.49 m/s, b 1.26 m/s" in speeds.message
    phase = np.linspace(0.0, 1.0, 101)
    before, after = (
        subject_of(one).gait.angles["knee_angle_l"].periodic()(phase) for one in (found, part)
    )
    np.testing.assert_allclose(after, before, atol=np.radians(0.3))


def test_an_angle_that_does_not_close_at_all_is_refused_or_left_out(found):
    most = np.degrees(largest_drift("knee_angle_l", "angle"))
    with pytest.raises(RecordError, match=r"knee_angle_l ends 1\d\.\d° .*more than 10°"):
        subject_of(drifting(found, "knee_angle_l", most + 1.5))
    part = drifting(found, "foot_progression_l", most + 1.5)
    subject = subject_of(part)
    assert "foot_progression_l" not in subject.gait.angles
    assert "foot_progression_r" in subject.gait.angles


def test_a_mean_of_more_strides_drifts_less_and_a_turned_foot_more():
    one, two, hundred = (usual_drift("knee_angle_r", "angle", strides) for strides in (1, 2, 100))
    assert one == pytest.approx(min(np.sqrt(2.0) * two, np.radians(5.7)))
    assert hundred == pytest.approx(np.radians(4.0))
    assert usual_drift("foot_list_l", "angle", 1) == pytest.approx(2.0 * one)


def test_motion_before_its_markers_come_into_view_does_not_leak_into_it():
    """The pose held before the markers are seen must not be smeared into the seen ones."""
    frames, seen_from, rate = 200, 80, 100.0
    knee = COORDINATES.index("knee_angle_l")
    truth = 0.5 + 0.4 * np.sin(2 * np.pi * np.arange(frames) / 100)
    positions = np.zeros((frames, 31))
    positions[:, knee] = truth
    determined = np.ones((frames, 31), dtype=bool)
    determined[:seen_from, knee] = False
    late = positions.copy()
    late[:seen_from, knee] = 0.0
    nothing = np.zeros((frames, 1))
    poses = InverseKinematics(
        positions=late,
        determined=determined,
        **{
            field: nothing
            for field in InverseKinematics.__dataclass_fields__
            if field not in ("positions", "determined")
        },
    )
    found = smoothed(poses, rate, ProcessingSettings())
    np.testing.assert_allclose(found[seen_from:, knee], truth[seen_from:], atol=0.02)
    np.testing.assert_array_equal(found[:seen_from, knee], 0.0)


def test_residual_moments_are_compared_with_the_height_above_the_plates(found):
    """A laboratory whose floor is half a metre above the origin of its axes."""
    (walk, *_) = found.trials
    up = np.array([0.0, 0.0, 0.5])
    dynamics, loads = walk.dynamics, walk.loads
    raised = replace(
        walk,
        dynamics=replace(dynamics, centre_of_mass=dynamics.centre_of_mass + up),
        loads=replace(loads, centre_of_pressure=loads.centre_of_pressure + up),
        consistent=None,
    )
    ((_, here), *_), ((_, there),) = trial_residuals(walk), trial_residuals(raised)
    assert there.moment_share == pytest.approx(here.moment_share, rel=1e-9)


def test_the_stride_time_is_that_of_both_sides(found):
    def one_of_each(walk):
        right, left = walk.cycles["right"][0], walk.cycles["left"][1]
        late = replace(left, end=left.end + 0.02)
        return replace(walk, cycles={"right": (right,), "left": (late,)})

    late = tuple(map(one_of_each, found.trials))
    lasted = [c.duration for w in late for side in SIDES for c in w.cycles[side]]
    assert len(lasted) == 2
    assert subject_of(replace(found, trials=late)).stride_time_s == pytest.approx(np.mean(lasted))
