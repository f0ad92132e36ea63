"""Right and left from the measurements to the body and its table."""

from dataclasses import replace

import numpy as np
import pytest
from standing_person import PERSON, made_up_measurements, standing_person

from gaitval.errors import ScalingError
from gaitval.scaling.anthropometry import DE_LEVA
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.measurements import with_fitted_lengths
from gaitval.scaling.scaling import build_body, measurements_from, scale_subject
from gaitval.subjects.subject_file import load_subject

SHORTER, LIGHTER = 0.012, 0.5  # m and kg


def with_left(measured, **changes):
    """The measurements with another left side, which the model keeps."""
    return replace(measured, left=replace(measured.left, **changes), symmetric=False)


def rows(body, segment):
    return {row.side: row for row in body.table if row.segment == segment}


@pytest.fixture(scope="module")
def equal():
    return build_body(PERSON, replace(made_up_measurements(), symmetric=False))


@pytest.fixture(scope="module")
def unequal(equal):
    measured = made_up_measurements()
    mass = rows(equal, "thigh")["left"].mass_kg - LIGHTER
    return build_body(
        PERSON, with_left(measured, thigh=measured.left.thigh - SHORTER, thigh_mass=mass)
    )


@pytest.mark.parametrize(
    ("prosthesis", "lighter", "two"),
    [(None, 0.0, False), ("none", 0.0, False), ("left", 0.0, True), (None, LIGHTER, True)],
)
def test_only_a_prosthesis_or_given_masses_keep_the_sides_apart(prosthesis, lighter, two):
    """An error of a marker makes lengths differ, but nobody weighs two shanks by mistake."""
    measured = made_up_measurements()
    right = replace(measured.right, shank_mass=3.5)
    left = replace(measured.left, shank_mass=3.5 - lighter, thigh=measured.left.thigh - SHORTER)
    subject = load_subject("5").model_copy(
        update={
            "prosthesis": prosthesis,
            "height_m": PERSON.height_m,
            "mass_kg": PERSON.mass_kg,
            "measurements": replace(measured, right=right, left=left).to_dict(),
        }
    )
    model = scale_subject(subject).model
    assert model["shank_r"].mass - model["shank_l"].mass == pytest.approx(lighter)
    shorter = model["shank_l"].joint_position[2] - model["shank_r"].joint_position[2]
    assert shorter == pytest.approx(SHORTER if two else 0.0)


def test_equal_sides_give_the_same_body_averaged_or_not(equal):
    averaged = build_body(PERSON, made_up_measurements()).model
    for own, mean in zip(equal.model.segments, averaged.segments, strict=True):
        np.testing.assert_allclose(own.joint_position, mean.joint_position, rtol=1e-15)
        np.testing.assert_allclose(own.inertia, mean.inertia, rtol=1e-14)
        assert own.mass == mean.mass
    assert equal.model.spheres[0].name == averaged.spheres[0].name


def test_each_side_has_its_own_row_of_the_table(unequal):
    thighs = rows(unequal, "thigh")
    assert list(thighs) == ["right", "left"]
    assert thighs["left"].length_m == pytest.approx(thighs["right"].length_m - SHORTER)
    assert (thighs["left"].right_m, thighs["left"].left_m) == (None, thighs["left"].length_m)
    assert thighs["left"].name == "left thigh"
    assert list(rows(unequal, "head")) == [None]


def test_other_segments_share_what_a_lighter_thigh_leaves(equal, unequal):
    """In de Leva's proportions, so that the person's mass is exactly as it was."""
    assert unequal.model.mass == pytest.approx(PERSON.mass_kg, abs=1e-12)
    ratios = [
        new.mass / old.mass
        for new, old in zip(unequal.model.segments, equal.model.segments, strict=True)
        if new.name != "thigh_l"
    ]
    thigh = equal.model["thigh_l"].mass
    rest = (PERSON.mass_kg - thigh + LIGHTER) / (PERSON.mass_kg - thigh)
    np.testing.assert_allclose(ratios, rest, rtol=1e-12)


def test_inertia_follows_the_sides_own_length_and_mass(unequal):
    thigh, row = unequal.model["thigh_l"], rows(unequal, "thigh")["left"]
    radii = DE_LEVA[PERSON.sex]["thigh"]
    square = (np.array([radii.sagittal, radii.transverse, radii.longitudinal]) * row.length_m) ** 2
    np.testing.assert_allclose(np.diag(thigh.inertia), row.mass_kg * square, rtol=1e-12)


def test_sides_are_not_exchanged():
    """A longer left foot is on the left: its joint, its spheres and its mass."""
    measured = made_up_measurements()
    left = measured.left.metatarsals + np.array([0.012, 0.0, 0.0])
    model = build_body(PERSON, with_left(measured, metatarsals=left)).model
    assert model["toes_l"].joint_position[0] - model["toes_r"].joint_position[0] == pytest.approx(
        0.012
    )
    tip = {
        side: max(s.position[0] for s in model.spheres if s.segment == f"foot_{side}")
        for side in "rl"
    }
    assert tip["l"] > tip["r"] + 0.005


def test_a_length_of_one_side_serves_both_and_the_table_says_so():
    stored = made_up_measurements().to_dict()
    del stored["shank_left"], stored["forearm_right"], stored["first_metatarsal_left"]
    measured = measurements_from(stored)
    assert measured.left.shank == measured.right.shank
    assert measured.to_dict().keys() == stored.keys() - {"fifth_metatarsal_left"}
    table = {row.segment: row for row in build_body(PERSON, measured).table}
    assert table["shank"].left_m is None
    assert "; right side only, the other is taken as equal" in table["shank"].source
    assert "; left side only, the other is taken as equal" in table["forearm"].source
    assert "side only" not in table["thigh"].source


def test_an_arm_with_markers_on_one_side_serves_both():
    landmarks = standing_person().landmarks
    measured = measure(
        {name: at for name, at in landmarks.items() if not name.startswith("L.Wrist")}
    )
    assert measured.one_sided == {"forearm": "right"}
    assert measured.left.forearm == measured.right.forearm == pytest.approx(0.243, abs=1e-3)


def test_a_fit_of_the_mean_leaves_the_sides_their_ratio():
    measured = with_left(made_up_measurements(), thigh=0.40)
    fitted = with_fitted_lengths(measured, {"thigh": 0.41})
    assert (fitted.right.thigh + fitted.left.thigh) / 2 == pytest.approx(0.41)
    assert fitted.left.thigh / fitted.right.thigh == pytest.approx(
        measured.left.thigh / measured.right.thigh
    )
    averaged = with_fitted_lengths(replace(measured, symmetric=True), {"thigh": 0.41})
    assert averaged.right.thigh == averaged.left.thigh == 0.41


def test_masses_survive_toml(unequal):
    measured = with_left(made_up_measurements(), thigh_mass=7.5)
    stored = measured.to_dict()
    assert stored["thigh_mass_left"] == 7.5
    assert measurements_from(stored | {"thigh_mass_right": 8.0}).left.thigh_mass == 7.5


def test_segments_heavier_than_the_body_are_refused():
    with pytest.raises(ScalingError, match=r"more than the body's 61\.0 kg"):
        build_body(PERSON, with_left(made_up_measurements(), thigh_mass=62.0))
    with pytest.raises(ScalingError, match="thigh_mass_left = -1"):
        measurements_from(made_up_measurements().to_dict() | {"thigh_mass_left": -1.0})


def test_masses_add_up_whatever_is_known():
    known = {f"{name}_mass": 1.0 for name in ("shank", "foot", "hand")}
    body = build_body(PERSON, with_left(made_up_measurements(), **known))
    assert body.model.mass == pytest.approx(PERSON.mass_kg, abs=1e-12)


def test_what_remains_of_a_short_flat_foot_is_a_rigid_body():
    """A child's foot as markers showed it, as large as this person's."""
    measured, size = made_up_measurements(), PERSON.height_m / 1.32
    foot = {
        "foot": 0.172 * size,
        "ankle_height": 0.062 * size,
        "heel": size * np.array([-0.027, -0.006, -0.039]),
        "metatarsals": size * np.array([[0.101, 0.038, -0.038], [0.088, -0.050, -0.054]]),
    }
    left = {name: foot[name] * [1, -1, 1] for name in ("heel", "metatarsals")}
    flat = replace(
        measured,
        right=replace(measured.right, **foot),
        left=replace(measured.left, **foot | left),
    )
    for segment in build_body(PERSON, flat).model.segments:
        moments = np.linalg.eigvalsh(segment.inertia)
        assert moments[0] > 0.0
        assert moments[0] + moments[1] >= moments[2]
