"""An import names the fault that was planted, or none; a delay and a plate are put right."""

from dataclasses import replace

import numpy as np
import pytest
from planted_faults import faults
from scipy.spatial.transform import Rotation

from gaitval.configuration import ProcessingSettings
from gaitval.consistency import Verdict
from gaitval.errors import ConfigurationError
from gaitval.findings.markers import SMOOTHED
from gaitval.findings.motion import WEIGHT
from gaitval.findings.stances import EXCHANGED_AXES, INWARD
from gaitval.findings.trial import findings_of_trial
from gaitval.session import session as importing
from gaitval.session.importing.importing import work_out
from gaitval.session.importing.write import _record
from gaitval.session.measurement import correct
from gaitval.session.measurement.correct import wanted
from gaitval.session.measurement.estimate import FoundFault
from gaitval.session.measurement.fault_text import CHECK
from gaitval.session.measurement.kinds import Fault
from gaitval.session.measurement.measured import untold
from gaitval.session.read import read_session

PROCESSING = ProcessingSettings()


@pytest.fixture(scope="module")
def sample(sample_request):
    return sample_request, read_session(sample_request, PROCESSING)


@pytest.fixture(scope="module")
def kept():
    """Imports without options, by the name of their fault."""
    return {}


@pytest.fixture
def imported(sample, kept, monkeypatch):
    request, session = sample

    def work(name, read=session, **options):
        if read is not session or options:
            return worked_out(name, read, **options)
        if name not in kept:
            kept[name] = worked_out(name, session)
        return kept[name]

    def worked_out(name, read, **options):
        fault = faults()[name] if name else None
        changed = fault.change(read) if fault else read
        monkeypatch.setattr(importing, "read_session", lambda *_: changed)
        mass = request.mass * (fault.mass if fault else 1.0)
        return work_out(request.model_copy(update={"mass": mass, **options}), PROCESSING)

    return work


def named(found):
    return {flag.check for _, flag in found.warnings if flag.check.startswith(CHECK)}


def test_a_sound_recording_has_no_warning_and_a_table(imported):
    found = imported(None)
    assert named(found) == set()
    assert not any(flag.check == "place of a knee's marker" for _, flag in found.warnings)
    table = {row.name: row for row in found.measurement.faults}
    assert abs(table["delay of the forces"].value) < 6.0  # ms; the truth is 0
    assert abs(table["body mass"].value) < 4.0  # %
    assert all(row.deviation > 0.0 and row.limit > 0.0 for row in table.values())
    assert all(0.0 <= row.probability < 0.5 for row in table.values())
    assert len(_record(found)["measurement"]) == len(table)


def test_what_something_found_before_explains_is_no_fault_of_a_plate():
    some = [
        FoundFault(Fault(kind, "", 0.01), np.empty(0), np.empty(0), Verdict(()), matters=True)
        for kind in ("gain", "offset", "place", "delay", "markers low-passed", "sideways sign")
    ]
    other = FoundFault(None, np.empty(0), np.empty(0), Verdict(()), matters=True)

    def told(*checks):
        left = {each.fault.kind for each in untold(some, {*checks})}
        return {each.fault.kind for each in some} - left

    assert told() == set()
    assert told("weight") == told("saturated channel") == {"gain", "offset"}
    assert told("unloaded plate") == {"gain", "offset", "place"}
    assert told(INWARD.name) == {"sideways sign"}
    assert told(EXCHANGED_AXES.name) == {"gain", "offset", "place", "sideways sign"}
    assert told(SMOOTHED.name) == {"markers low-passed"}
    assert untold([other], {"build"}) == (other,)
    assert untold([other], {WEIGHT.name}) == ()


@pytest.mark.parametrize(
    ("along", "weight", "told"),
    [
        (1.0, 1.0, {INWARD.name}),
        (1.0, 0.7, {INWARD.name, WEIGHT.name}),
    ],
)
def test_a_sideways_sign_is_told_beside_what_it_does_not_explain(imported, along, weight, told):
    found = imported(None)
    (walk,) = found.trials
    right = np.array([[[along, -1.0, 1.0], [1.0, 1.0, 1.0]]])  # the right foot's sideways force
    needed = walk.loads.force.sum(axis=1) + walk.dynamics.residual_force
    loads = replace(walk.loads, force=walk.loads.force * right)
    left = needed * weight - loads.force.sum(axis=1)
    flags = findings_of_trial(
        walk.recording, found.session.marker_set.landmarks, walk.events, (),
        (
            replace(walk.forces, force=walk.forces.force * right), loads,
            replace(walk.dynamics, residual_force=left),
        ),
        height_m=found.request.height_m, mass_kg=weight * found.request.mass_kg,
    ).flags  # fmt: skip
    assert {flag.check for flag in flags} & {INWARD.name, WEIGHT.name} == told


@pytest.mark.parametrize(
    ("fault", "check"),
    [
        ("forces 35 ms late", "delay"),
        ("mass +10 %", "mass"),
        ("plate 1 40 mm forward", "place"),
        ("plate 2 gain -10 %", "gain"),
    ],
)
def test_a_planted_fault_is_named(imported, fault, check):
    assert named(imported(fault)) == {f"{CHECK}: {check}"}


def with_fore_aft_gain(recording, number, gain):
    """A walk of which one plate's channel along the walk is wrong; its surface is at its middle."""
    plate = recording.plates[number]
    force = plate.force * [gain, 1.0, 1.0]
    moment = plate.moment + np.cross(plate.corners.mean(axis=0), force - plate.force)
    changed = replace(plate, force=force, moment=moment)
    return replace(
        recording,
        plates=tuple(changed if each is plate else each for each in recording.plates),
    )


def with_marker_forward(recording, name, metres):
    """A walk with one marker further forward."""
    markers = recording.markers.copy()
    markers[:, recording.names.index(name), 0] += metres
    return replace(recording, markers=markers)


@pytest.mark.slow
@pytest.mark.parametrize(("number", "gain"), [(0, 1.2), (1, 0.8)])
def test_one_channel_of_a_plate_is_named(imported, sample, number, gain):
    _, session = sample
    walks = tuple(with_fore_aft_gain(walk, number, gain) for walk in session.walking)
    found = imported(None, replace(session, walking=walks))
    assert named(found) == {f"{CHECK}: fore-aft gain"}
    (flag,) = (flag for _, flag in found.warnings if flag.check.startswith(CHECK))
    assert flag.where == f"plate {number + 1}"
    assert flag.value == pytest.approx(20.0, abs=5.0)
    assert f"along the walk {flag.value:.0f} ±" in flag.message
    assert f"too {'large' if gain > 1.0 else 'small'}" in flag.message


@pytest.mark.slow
@pytest.mark.parametrize(("degrees", "way"), [(1.8, "right"), (-1.8, "left")])
def test_cameras_that_lean_aside_beside_the_plates(imported, sample, degrees, way):
    """Turned about the direction of the walk, what is up goes to the right."""
    _, session = sample
    turn = Rotation.from_rotvec([np.radians(degrees), 0.0, 0.0]).as_matrix()

    def leaning(recording):
        return replace(recording, markers=recording.markers @ turn.T)

    walks = tuple(map(leaning, session.walking))
    tilted = replace(session, standing=leaning(session.standing), walking=walks)
    found = imported(None, tilted)
    (flag,) = (flag for _, flag in found.warnings if flag.check.startswith(CHECK))
    assert flag.check == f"{CHECK}: camera tilt"
    assert flag.value == pytest.approx(1.8, abs=0.5)
    assert f"° {way}" in flag.message or f"deg {way}" in flag.message


@pytest.mark.slow
@pytest.mark.parametrize(
    ("side", "metres", "standing"), [("R", 0.03, False), ("L", -0.03, False), ("L", 0.018, True)]
)
def test_a_knee_marker_beside_the_knee_is_told(imported, sample, side, metres, standing):
    """Moved after the standing trial, or misplaced in it as well."""
    _, session = sample
    knees = [session.marker_set.landmarks[f"{each}.Knee"] for each in "RL"]
    name = knees["RL".index(side)]
    walks = tuple(with_marker_forward(walk, name, metres) for walk in session.walking)
    wrong = replace(session, walking=walks)
    if standing:
        wrong = replace(wrong, standing=with_marker_forward(session.standing, name, metres))
    warnings = [flag for _, flag in imported(None, wrong).warnings]
    (warning,) = (flag for flag in warnings if flag.check == "place of a knee's marker")
    assert warning.where == " and ".join(knees)
    assert 0.4 * abs(metres) < warning.value < 1.3 * abs(metres)
    # forward on the right is as back on the left
    right_is_back = (metres < 0.0) == (side == "R")
    back, forward = knees if right_is_back else knees[::-1]
    assert f"{back} is some {1000 * warning.value:.0f} mm too far back" in warning.message
    assert f"or {forward} too far forward" in warning.message


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "check"),
    [
        ("plate 1 rotated 8°", "rotation"),
        ("plate 2 cross-talk +5 % sideways", "cross-talk"),
        ("forces low-passed at 5 Hz", "forces low-passed"),
        ("all plates 30 mm forward", "place"),
        ("laboratory tilted 2.5° about x", "tilt"),
    ],
)
def test_other_planted_faults_are_named(imported, fault, check):
    assert f"{CHECK}: {check}" in named(imported(fault))


@pytest.mark.slow
def test_a_correction_brings_the_moments_back(imported):
    right, wrong = imported(None), imported("forces 35 ms late")
    corrected = imported("forces 35 ms late", correct=("delay",))

    def off(found):
        ankle = "ankle_angle_r"
        return np.abs(found.moments[ankle].mean - right.moments[ankle].mean).max()

    assert off(corrected) < 0.4 * off(wrong)
    before = corrected.measurement.uncorrected["ankle_angle_r"]
    np.testing.assert_allclose(before.mean, wrong.moments["ankle_angle_r"].mean)
    assert any(step == "correct" for step, _ in corrected.decisions)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "kind", "wrong", "sound"),
    [("plate 1 40 mm forward", "place", "_r", "_l"), ("plate 2 gain -10 %", "gain", "_l", "_r")],
)
def test_a_correction_leaves_the_sound_plate_as_it_is(imported, fault, kind, wrong, sound):
    right, corrected = imported(None), imported(fault, correct=(kind,))
    for name in ("hip_flexion", "knee_angle", "ankle_angle"):
        before = corrected.measurement.uncorrected[name + wrong].mean
        off, was = (
            np.abs(each - right.moments[name + wrong].mean).max()
            for each in (corrected.moments[name + wrong].mean, before)
        )
        assert off < 0.3 * was
        np.testing.assert_array_equal(
            corrected.moments[name + sound].mean, right.moments[name + sound].mean
        )
    found = corrected.measurement
    assert found.columns()[f"moment_knee_angle{wrong}_uncorrected"].shape == (101,)
    assert (
        len(found.corrected_rows({n: (c.mean, c.mean) for n, c in corrected.moments.items()})) == 6
    )
    # the bands are those of what is shown
    drawn, _ = found.curves[f"moment_knee_angle{wrong}"]
    np.testing.assert_allclose(drawn, corrected.moments[f"knee_angle{wrong}"].mean)
    for name, half in right.measurement.bands.half.items():
        assert np.median(found.bands.half[name]) < 1.3 * np.median(half), name


@pytest.mark.parametrize("number", [0, 1])
def test_plates_that_are_turned_as_one_block_are_turned_back_as_one(sample, number):
    """To one side and to the other."""
    _, session = sample
    (walk,) = session.walking
    fault = faults()["all plates rotated 4°"]
    assert fault.size is not None
    (wrong,) = fault.change(session).walking
    found = correct.without_faults(wrong, {"rotation all": fault.size})
    for plate, sound, turned in zip(found.plates, walk.plates, wrong.plates, strict=True):
        loaded = np.isfinite(sound.centre_of_pressure[:, 0]) & (sound.force[:, 2] > 200.0)
        np.testing.assert_allclose(plate.force, sound.force, atol=1e-6)
        np.testing.assert_allclose(
            plate.centre_of_pressure[loaded], sound.centre_of_pressure[loaded], atol=1e-6
        )
        # which foot is on which plate was found with the corners
        np.testing.assert_array_equal(plate.corners, turned.corners)


@pytest.mark.slow
def test_a_fault_that_is_not_sure_is_not_corrected(imported):
    right, same = imported(None), imported(None, correct=("place", "gain", "delay"))
    for name, curve in right.moments.items():
        np.testing.assert_array_equal(same.moments[name].mean, curve.mean)
    messages = [text for step, text in same.decisions if step == "correct"]
    assert len(messages) == 3
    assert all("nothing is changed" in text for text in messages)


@pytest.mark.parametrize("options", [{"kinematics_only": True}, {"aid": "support"}])
def test_angles_have_bands_without_forces_or_with_an_aid(imported, options):
    found, whole = imported(None, **options).measurement, imported(None).measurement
    assert found.seen is None
    assert found.faults == ()
    for name in ("angle_hip_flexion_r", "angle_knee_angle_l", "angle_ankle_angle_r"):
        mine, theirs = (np.median(each.bands.half[name]) for each in (found, whole))
        assert mine == pytest.approx(theirs, rel=0.05)
    assert found.uncertainty()["angle_knee_angle_l"] > 0.01


@pytest.mark.slow
def test_a_correction_of_a_fault_that_is_not_there_is_said_to_do_harm(imported, monkeypatch):
    messages = [
        text for step, text in imported(None, correct=("gain",)).decisions if step == "warnings"
    ]
    assert not any("--correct gain" in text for text in messages)
    monkeypatch.setattr(correct, "together", lambda *_: {"cross-talk x 1": 0.15})
    harmed = imported(None, correct=("cross-talk",))
    messages = [text for step, text in harmed.decisions if step == "warnings"]
    assert any("contradict each other more than before" in text for text in messages)


def test_what_cannot_be_corrected_is_refused_by_name():
    assert wanted(("delay,gain", "place")) == ("delay", "gain", "place")
    with pytest.raises(ConfigurationError, match="--correct mass: this fault cannot be corrected"):
        wanted(("mass",))
