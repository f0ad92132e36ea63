from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gaitval.errors import ScalingError
from gaitval.model.body import SEGMENTS
from gaitval.scaling.anthropometry import DE_LEVA, mass_fractions, shifted_inertia
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.measurements import Limbs, Measurements
from gaitval.scaling.scaling import build_body, measurements_of, scale_subject
from gaitval.subjects.subject_file import BUILTIN, load_subject

MIRROR = np.diag([1.0, -1.0, 1.0])


def person(identifier="S05", **changes):
    """A built-in subject with some attributes changed."""
    subject = load_subject(identifier)
    values = {
        name: getattr(subject, name)
        for name in ("identifier", "sex", "age_years", "mass_kg", "height_m", "markers")
    }
    return SimpleNamespace(**(values | changes))


@pytest.fixture(scope="module")
def model():
    return scale_subject(load_subject("S05")).model


@pytest.mark.parametrize("identifier", list(BUILTIN))
def test_every_built_in_subject_scales_to_a_physical_body(identifier):
    subject = load_subject(identifier)
    model = scale_subject(subject).model
    assert model.name == identifier
    assert tuple(segment.name for segment in model.segments) == SEGMENTS
    # The sum of 14 rounded numbers; one unit in the last place of 75 is 1.4e-14.
    assert model.mass == pytest.approx(subject.mass_kg, abs=1e-13)
    for segment in model.segments:
        moments = np.linalg.eigvalsh(segment.inertia)
        assert segment.mass > 0
        assert moments[0] > 0
        assert moments[0] + moments[1] > moments[2]


def test_left_side_mirrors_the_right_one(model):
    for segment in model.segments:
        if segment.name.endswith("_r"):
            other = model[segment.name[:-1] + "l"]
            assert other.mass == segment.mass
            np.testing.assert_array_equal(other.joint_position, MIRROR @ segment.joint_position)
            np.testing.assert_array_equal(other.centre_of_mass, MIRROR @ segment.centre_of_mass)
            np.testing.assert_array_equal(other.inertia, MIRROR @ segment.inertia @ MIRROR)
    for right, left in zip(model.spheres[:6], model.spheres[6:], strict=True):
        assert (left.name, left.segment) == (right.name[:-1] + "l", right.segment[:-1] + "l")
        np.testing.assert_array_equal(left.position, MIRROR @ right.position)


@pytest.mark.parametrize("identifier", ["S01", "S05"])
def test_foot_and_toes_together_are_de_levas_foot(identifier):
    subject = load_subject(identifier)
    scaled = scale_subject(subject)
    foot, toes = scaled.model["foot_r"], scaled.model["toes_r"]
    length = next(row.length_m for row in scaled.table if row.segment == "foot")
    table = DE_LEVA[subject.sex]["foot"]

    mass = foot.mass + toes.mass
    toes_centre = toes.joint_position + toes.centre_of_mass
    centre = (foot.mass * foot.centre_of_mass + toes.mass * toes_centre) / mass
    inertia = sum(
        part.inertia + shifted_inertia(part.mass, place - centre)
        for part, place in ((foot, foot.centre_of_mass), (toes, toes_centre))
    )
    measured = measure(subject.markers)
    heel = (measured.right.heel + measured.left.heel) / 2
    radii = np.array([table.longitudinal, table.transverse, table.sagittal])
    assert mass == pytest.approx(mass_fractions(subject.sex)["foot"] * subject.mass_kg)
    assert centre[0] - heel[0] == pytest.approx(table.centre_of_mass * length)
    np.testing.assert_allclose(inertia, np.diag(mass * (radii * length) ** 2), atol=1e-15)


def test_standing_body_is_as_tall_as_the_person():
    for identifier in BUILTIN:
        subject = load_subject(identifier)
        lengths = {row.segment: row.length_m for row in scale_subject(subject).table}
        names = (
            *("ankle height", "shank", "thigh"),
            *("lower trunk", "middle trunk", "upper trunk", "head"),
        )
        # The person's legs are not quite straight and vertical as the model's are.
        assert sum(lengths[name] for name in names) == pytest.approx(subject.height_m, abs=0.015)


_BALL = ("medial", "lateral")


@pytest.mark.parametrize("markers", [True, False])
def test_the_ball_of_the_foot_is_under_the_persons_metatarsal_heads(markers):
    """Toes that turn about an axis ahead of the ball carry what the ball should, and brake. A ball
    ahead of it goes down as the heel comes up, and the toes carry nothing."""
    subject = person("S02") if markers else person("S02", markers={})
    measured, model = measurements_of(subject), scale_subject(subject).model
    spheres = {sphere.name: sphere for sphere in model.spheres}
    for side, limbs in measured.modelled.items():
        axis = model[f"toes_{side[0]}"].joint_position[0]
        ahead = limbs.metatarsals[0, 0] - axis
        assert ahead > 0.005  # the first head: else this would not see it
        medial, lateral = (spheres[f"contact_ball_{part}_{side[0]}"] for part in _BALL)
        # the sesamoids under the first head go with the toe
        assert (medial.segment, lateral.segment) == (f"toes_{side[0]}", f"foot_{side[0]}")
        assert medial.position[0] == pytest.approx(0.0)
        assert lateral.position[0] == pytest.approx(limbs.metatarsals[1, 0])
        assert lateral.position[0] < axis


def test_table_can_be_written_as_csv():
    frame = scale_subject(load_subject("S05")).frame()
    assert list(frame.columns[:4]) == ["segment", "right_m", "left_m", "length_m"]
    assert frame["mass_kg"].notna().sum() == 10


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"height_m": 1.20}, ["lower trunk", "upper trunk", "head"]),
        ({"height_m": 2.10}, ["thigh", "shank", "foot"]),
    ],
)
def test_implausible_stature_names_the_segments(changes, named):
    with pytest.raises(ScalingError) as error:
        scale_subject(person(**changes))
    assert "S05" in str(error.value)
    for name in named:
        assert name in str(error.value)


def test_a_stature_that_does_not_fit_is_one_problem():
    with pytest.raises(ScalingError) as error:
        scale_subject(person(height_m=2.10))
    message = str(error.value).split("\n")
    assert len(message) == 3  # what, where, and what to check
    assert "thigh, shank and foot are" in message[1]
    # 2.10 m times 0.68; subject 5 has short legs for 1.53 m.
    assert "of a person of about 1.42 m" in message[1]


def test_unequal_legs_are_refused():
    markers = dict(load_subject("S05").markers)
    for name in ("L.Ankle", "L.Ankle.Medial"):
        x, y, z = markers[name]
        markers[name] = (x, y, z + 0.065)
    with pytest.raises(ScalingError, match=r"shank: right 0\.351 m and left 0\.28. m differ"):
        scale_subject(person(markers=markers))


def test_floor_far_from_zero_is_refused():
    markers = {name: (x, y, z + 0.3) for name, (x, y, z) in load_subject("S05").markers.items()}
    with pytest.raises(ScalingError, match="ankle height"):
        scale_subject(person(markers=markers))


def gyration(table, mass, length, axes):
    """Inertia (3, 3) about the centre of mass with these of de Leva's radii along x, y, z."""
    return np.diag([mass * (getattr(table, axis) * length) ** 2 for axis in axes])


@pytest.mark.parametrize("identifier", ["S01", "S05"])
@pytest.mark.parametrize("side", ["right", "left"])
def test_forearm_and_hand_turn_about_their_common_centre(identifier, side):
    """By the theorem of parallel axes. The palm faces the thigh, so what the hand's table calls
    sagittal, from back to front, lies sideways here."""
    subject = load_subject(identifier)
    scaled = scale_subject(subject)
    rows = {row.segment: row for row in scaled.table if row.side in (None, side)}
    forearm, hand = rows["forearm"], rows["hand"]
    tables = DE_LEVA[subject.sex]
    places = [
        -tables["forearm"].centre_of_mass * forearm.length_m,
        -forearm.length_m - tables["hand"].centre_of_mass * hand.length_m,
    ]
    masses = [forearm.mass_kg, hand.mass_kg]
    centre = float(np.dot(masses, places)) / sum(masses)
    inertia = gyration(
        tables["forearm"], masses[0], forearm.length_m, ("sagittal", "transverse", "longitudinal")
    )
    inertia += gyration(
        tables["hand"], masses[1], hand.length_m, ("transverse", "sagittal", "longitudinal")
    )
    for mass, place in zip(masses, places, strict=True):
        inertia += mass * (place - centre) ** 2 * np.diag([1.0, 1.0, 0.0])
    segment = scaled.model[f"forearm_{side[0]}"]
    assert segment.mass == pytest.approx(sum(masses))
    np.testing.assert_allclose(segment.centre_of_mass, [0.0, 0.0, centre], atol=1e-12)
    np.testing.assert_allclose(segment.inertia, inertia, atol=1e-12)


def test_middle_and_upper_trunk_and_head_are_stacked_on_the_lumbar_joint():
    """Each from its own end points, as one rigid body."""
    subject = load_subject("S05")
    scaled = scale_subject(subject)
    rows = {row.segment: row for row in scaled.table}
    top, parts = 0.0, []
    for name in ("middle trunk", "upper trunk", "head"):
        table, row = DE_LEVA[subject.sex][name], rows[name]
        top += row.length_m
        own = gyration(table, row.mass_kg, row.length_m, ("sagittal", "transverse", "longitudinal"))
        parts.append((row.mass_kg, top - table.centre_of_mass * row.length_m, own))
    mass = sum(part[0] for part in parts)
    centre = sum(part[0] * part[1] for part in parts) / mass
    expected = sum(
        own + each * (place - centre) ** 2 * np.diag([1.0, 1.0, 0.0]) for each, place, own in parts
    )
    torso = scaled.model["torso"]
    assert torso.mass == pytest.approx(mass)
    np.testing.assert_allclose(torso.centre_of_mass, [0.0, 0.0, centre], atol=1e-12)
    np.testing.assert_allclose(torso.inertia, expected, atol=1e-12)


@pytest.mark.parametrize("identifier", ["S01", "S05"])
def test_the_pelvis_is_de_levas_lower_trunk_counted_from_its_upper_end(identifier):
    """His centre is a share of the way from OMPH down to MIDH, here the hips."""
    subject = load_subject(identifier)
    scaled = scale_subject(subject)
    row = next(row for row in scaled.table if row.segment == "lower trunk")
    table, tilt = DE_LEVA[subject.sex]["lower trunk"], measure(subject.markers).pelvic_tilt
    up = np.array([-np.sin(tilt), 0.0, np.cos(tilt)])  # of standing, in the pelvis
    ahead = np.array([np.cos(tilt), 0.0, np.sin(tilt)])
    pelvis = scaled.model["pelvis"]
    above_hips = row.length_m - table.centre_of_mass * row.length_m
    np.testing.assert_allclose(pelvis.centre_of_mass, above_hips * up, atol=1e-12)
    np.testing.assert_allclose(scaled.model["torso"].joint_position, row.length_m * up, atol=1e-12)
    axes = np.column_stack([ahead, [0.0, 1.0, 0.0], up])
    own = gyration(table, row.mass_kg, row.length_m, ("sagittal", "transverse", "longitudinal"))
    np.testing.assert_allclose(pelvis.inertia, axes @ own @ axes.T, atol=1e-12)


@pytest.mark.parametrize("side", ["right", "left"])
def test_thigh_and_shank_hang_from_their_upper_end(side):
    subject = load_subject("S01")
    scaled = scale_subject(subject)
    rows = {row.segment: row for row in scaled.table if row.side in (None, side)}
    for name in ("thigh", "shank"):
        table, row = DE_LEVA[subject.sex][name], rows[name]
        segment = scaled.model[f"{name}_{side[0]}"]
        expected = [0.0, 0.0, -table.centre_of_mass * row.length_m]
        np.testing.assert_allclose(segment.centre_of_mass, expected, atol=1e-12)
        own = gyration(table, row.mass_kg, row.length_m, ("sagittal", "transverse", "longitudinal"))
        np.testing.assert_allclose(segment.inertia, own, atol=1e-12)


def made_up(**changes):
    """The lengths of a person with round numbers: both feet 0.24 m long, heel and heads not in
    line."""
    limbs = Limbs(
        thigh=0.40,
        shank=0.40,
        ankle_height=0.08,
        heel=np.array([-0.05, 0.004, -0.05]),
        metatarsals=np.array([[0.13, 0.03, -0.05], [0.11, -0.07, -0.06]]),
        foot=0.24,
    )
    return Measurements(
        right=limbs, left=limbs, hip_half_width=0.08, hip_height=0.88, pelvic_tilt=0.2, **changes
    )


ADULT = SimpleNamespace(identifier="made up", sex="M", age_years=30.0, mass_kg=70.0, height_m=1.70)


@pytest.mark.parametrize(("tilt", "crests"), [(-0.46, True), (0.8, False)])
def test_front_markers_of_a_pelvis_that_are_too_high_may_be_on_its_crests(tilt, crests):
    with pytest.raises(ScalingError, match=f"tilted forward by {np.degrees(tilt):.0f} ") as caught:
        build_body(ADULT, replace(made_up(), pelvic_tilt=tilt))
    assert ("R.Crest" in str(caught.value)) == crests


def test_toes_are_an_ellipsoid_from_between_the_heads_to_the_tip():
    """By hand: the joint is at (0.12, -0.02) m, half as high as the heads' 0.025 m; the tip at
    0.24 - 0.05 = 0.19 m. The toes are 0.07 m long, 0.10 m wide and 0.025 m high."""
    model = build_body(ADULT, made_up()).model
    toes = model["toes_r"]
    np.testing.assert_allclose(toes.joint_position, [0.12, -0.02, -0.08 + 0.0125], atol=1e-12)
    np.testing.assert_allclose(toes.centre_of_mass, [0.035, 0.0, 0.0], atol=1e-12)
    assert toes.mass == pytest.approx(0.138 * 0.0137 * 70.0)
    # Of a solid ellipsoid with the axes (whole ones) a, b and c: Ixx = m (b² + c²) / 20.
    a, b, c = 0.07**2, 0.10**2, 0.025**2
    expected = np.diag([b + c, a + c, a + b]) * toes.mass / 20.0
    np.testing.assert_allclose(toes.inertia, expected, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(("side", "mirror"), [("r", 1.0), ("l", -1.0)])
def test_the_centre_of_the_foot_is_on_the_line_from_the_heel_to_the_toe_joint(side, mirror):
    """0.4415 of 0.24 m ahead of the heel, and 0.62329 of the way from its 0.004 to the joint's
    -0.02 m aside, at half the height of the ankle."""
    model = build_body(ADULT, made_up()).model
    foot, toes = model[f"foot_{side}"], model[f"toes_{side}"]
    mass = foot.mass + toes.mass
    both = foot.mass * foot.centre_of_mass
    both = both + toes.mass * (toes.joint_position + toes.centre_of_mass)
    expected = [-0.05 + 0.10596, mirror * (0.004 - 0.10596 / 0.17 * 0.024), -0.04]
    np.testing.assert_allclose(both / mass, expected, atol=1e-12)


@pytest.mark.parametrize(("side", "mirror"), [("r", 1.0), ("l", -1.0)])
def test_spheres_are_the_published_ones_stretched_to_the_foot(side, mirror):
    """Positions of Falisse et al. 2022 from OpenSim's calcaneus, forward and to the right: along
    the foot the first and the last lie 20 mm inside its ends, and across they are spread by 100 of
    95.1 mm about the middle of the heads. The ball's lie as far forward as the heads, but not ahead
    of the toes' joint."""
    published = {
        "heel": (0.0019, -0.0038),
        "midfoot_lateral": (0.0662, 0.0264),
        "ball_medial": (None, -0.0287),
        "ball_lateral": (None, 0.0516),
        "toes_medial": (0.2388, -0.01772),
        "toes_lateral": (0.2238, 0.06298),
    }
    model = build_body(ADULT, made_up()).model
    places = {sphere.name: sphere for sphere in model.spheres}
    heads = made_up().right.metatarsals[:, 0]
    assert heads[0] != heads[1]
    for name, (ahead, lateral) in published.items():
        sphere = places[f"contact_{name}_{side}"]
        toes = sphere.segment.startswith("toes")
        origin = model[sphere.segment].joint_position if toes else np.zeros(3)
        expected = [
            min(heads[int(name == "ball_lateral")], heads.mean())
            if ahead is None
            else -0.03 + (ahead - 0.0019) * (0.24 - 0.04) / (0.2388 - 0.0019),
            mirror * (-0.02 - (lateral - 0.01145) * 0.100 / 0.0951),
            -0.06,
        ]
        np.testing.assert_allclose(sphere.position + origin, expected, atol=1e-12, err_msg=name)


def test_shoulders_that_no_marker_shows_are_de_levas_in_proportion_to_the_trunk():
    """His trunk and head of men are 0.8462 m long, with the shoulders 0.5155 m above the hips."""
    model = build_body(ADULT, made_up()).model
    factor = (1.70 - 0.88) / 0.8462
    lumbar = 0.1457 * factor
    expected = [0.0, -0.170, 0.5155 * factor - lumbar]
    np.testing.assert_allclose(model["upper_arm_r"].joint_position, expected, atol=1e-12)
