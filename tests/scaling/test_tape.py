import numpy as np
import pytest
from standing_person import PERSON

from gaitval.errors import ScalingError
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.scaling import scale_subject
from gaitval.scaling.stature import FOOT, MEAN_BODY
from gaitval.scaling.tape import measure_by_tape
from gaitval.subjects.subject_file import builtin_subjects


def test_stature_alone_gives_winters_lengths():
    body = measure_by_tape(height_m=1.80)
    assert body.right is body.left
    assert body.right.thigh == pytest.approx(MEAN_BODY.thigh * 1.80)
    assert body.right.shank == pytest.approx(MEAN_BODY.shank * 1.80)
    assert body.right.foot_length == pytest.approx(0.152 * 1.80, rel=1e-3)
    leg = body.right.thigh + body.right.shank + body.right.ankle_height
    assert body.hip_height == pytest.approx(leg)
    # Harrington's regression on the width between the spines.
    assert body.hip_half_width == pytest.approx(0.33 * 0.158 * 1.80 + 0.0073)
    assert "14-21 mm" in body.sources["thigh"]


def test_taped_lengths_are_taken():
    taped = {"thigh": 0.41, "shank": 0.40, "foot": 0.25, "ankle_height": 0.08}
    body = measure_by_tape(height_m=1.70, pelvis_width=0.26, **taped)
    assert (body.left.thigh, body.left.shank, body.left.ankle_height) == (0.41, 0.40, 0.08)
    assert body.left.foot_length == pytest.approx(0.25, rel=1e-3)
    assert body.hip_half_width == pytest.approx(0.33 * 0.26 + 0.0073)
    assert {body.sources[n] for n in ("thigh", "shank", "foot", "ankle height")} == {"tape"}


def test_a_taped_hip_height_is_shared_by_what_was_not_measured():
    body = measure_by_tape(height_m=1.70, hip_height=0.92, ankle_height=0.08)
    assert body.right.thigh + body.right.shank == pytest.approx(0.84)
    assert body.right.thigh / body.right.shank == pytest.approx(MEAN_BODY.thigh / MEAN_BODY.shank)
    one = measure_by_tape(height_m=1.70, hip_height=0.92, ankle_height=0.08, thigh=0.43)
    assert one.right.shank == pytest.approx(0.41)
    assert one.sources["thigh"] == "tape"
    assert "shared" in one.sources["shank"]


def test_contradictions_are_refused():
    with pytest.raises(ScalingError, match=r"hip_height = 0\.990 m, but .* add up to 0\.8"):
        measure_by_tape(height_m=1.70, hip_height=0.99, thigh=0.40, shank=0.39, ankle_height=0.08)
    with pytest.raises(ScalingError, match=r"shank: only 0\.2.. m is left for it"):
        measure_by_tape(height_m=1.70, hip_height=0.80, thigh=0.47)


@pytest.mark.parametrize(
    ("lengths", "messages"),
    [
        (
            {"pelvis_width": 25.0, "thigh": 0.7},
            ["pelvis_width = 25 m: about 0.269 m", "thigh = 0.7 m: about 0.388 m is expected"],
        ),
        ({"foot": -0.25}, ["foot = -0.25 m"]),
        ({"foot": float("nan")}, ["foot = nan m"]),
    ],
)
def test_implausible_lengths_are_all_named(lengths, messages):
    with pytest.raises(ScalingError) as error:
        measure_by_tape(height_m=1.70, **lengths)
    for message in messages:
        assert message in str(error.value)


def test_a_person_without_markers_is_scaled_by_stature():
    scaled = scale_subject(PERSON)
    assert scaled.model.mass == pytest.approx(PERSON.mass_kg)
    thigh, shank, *_ = scaled.table
    assert thigh.length_m == pytest.approx(MEAN_BODY.thigh * PERSON.height_m)
    assert thigh.source.startswith("stature as in WBDS; SD 14-21 mm")
    assert shank.factor == pytest.approx(MEAN_BODY.shank / 0.246)  # of Winter's
    lengths = {row.segment: row.length_m for row in scaled.table}
    standing = ("ankle height", "shank", "thigh", "lower trunk", "middle trunk", "upper trunk")
    assert sum(lengths[name] for name in (*standing, "head")) == pytest.approx(PERSON.height_m)


def test_population_means_are_those_of_the_built_in_subjects():
    widths, ankles, tilts, feet = [], [], [], {name: [] for name in FOOT}
    thighs, shanks = [], []
    for subject in builtin_subjects():
        right, left = (np.array(subject.markers[f"{side}.ASIS"]) for side in "RL")
        widths.append(np.linalg.norm(right - left) / subject.height_m)
        body = measure(subject.markers)
        tilts.append(body.pelvic_tilt)
        for leg in (body.right, body.left):
            ankles.append(leg.ankle_height / subject.height_m / 0.039)
            thighs.append(leg.thigh / subject.height_m)
            shanks.append(leg.shank / subject.height_m)
            floor = [0.0, 0.0, leg.ankle_height]
            for name, place in (
                ("heel", leg.heel),
                *zip(("MT1", "MT5"), leg.metatarsals, strict=True),
            ):
                feet[name].append((place + floor) / leg.foot_length)
    assert np.mean(widths) == pytest.approx(MEAN_BODY.pelvis_width, abs=5e-4)
    assert np.mean(thighs) == pytest.approx(MEAN_BODY.thigh, abs=6e-5)
    assert np.mean(shanks) == pytest.approx(MEAN_BODY.shank, abs=6e-5)
    assert np.mean(ankles) == pytest.approx(MEAN_BODY.ankle_factor, abs=6e-3)
    assert np.mean(tilts) == pytest.approx(MEAN_BODY.pelvic_tilt, abs=np.radians(0.06))
    for name, places in feet.items():
        np.testing.assert_allclose(np.mean(places, axis=0), FOOT[name], atol=6e-4)
        assert np.std(places, axis=0, ddof=1).max() < 0.0285
