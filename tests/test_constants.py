"""Constants are those of others, who have them from elsewhere."""

import dartpy
import mujoco
import numpy as np
import pytest
import scipy.constants
import scipy.stats

from gaitval.apps.patients import estimates
from gaitval.configuration import ContactSettings
from gaitval.constants import GRAVITY, POUND, STANDARD_GRAVITY
from gaitval.findings.markers import MEDIAN_TO_SD
from gaitval.findings.motion import LEG_SHARE
from gaitval.identification import legs
from gaitval.metrics.gait_profile import SMALLEST_DIFFERENCE
from gaitval.model.parameters import NOMINAL_DAMPING, NOMINAL_FRICTION
from gaitval.quantities.joint_power import BURSTS
from gaitval.scaling.anthropometry import (
    DE_LEVA,
    JENSEN_MASS,
    JENSEN_RADII,
    JENSEN_YEARS,
    PAIRED,
    SHOULDER_HALF_WIDTH,
    SHOULDER_HEIGHT,
    STATURE,
    TOES_MASS,
    WINTER,
)
from gaitval.scaling.foot_shape import FOOT_SHAPE
from gaitval.scaling.hip_regressions import hip_joint_centre
from gaitval.scaling.joint_centres import SURFACE, locate
from gaitval.scaling.measurements import Measurements
from gaitval.scaling.scaling import measurements_of, scale_subject
from gaitval.scaling.segments import SPHERES
from gaitval.scaling.stature import FOOT, MEAN_BODY
from gaitval.session.measurement import sources
from gaitval.subjects.subject_file import BUILTIN, load_subject
from gaitval.walk.contact import hunt_crossley


def test_weight_is_that_of_both_engines_and_measured_weight_that_of_the_kilogram_force() -> None:
    engines = (dartpy.simulation.World().getGravity(), mujoco.MjOption().gravity)
    for gravity in engines:
        np.testing.assert_array_equal(np.asarray(gravity).ravel(), [0.0, 0.0, -GRAVITY])
    assert scipy.constants.g == STANDARD_GRAVITY
    assert pytest.approx(scipy.constants.pound, rel=1e-15) == POUND


# ---- Bodies. ----

MEAN_LENGTHS = {
    "head": (243.7, 242.9), "upper trunk": (228.0, 242.1), "middle trunk": (205.3, 215.5),
    "lower trunk": (181.5, 145.7), "upper arm": (275.1, 281.7), "forearm": (264.3, 268.9),
    "hand": (78.0, 86.2), "thigh": (368.5, 422.2), "shank": (438.6, 440.3),
    "foot": (228.3, 258.1),
}  # fmt: skip
"""de Leva (1996), Table 4, as printed: mm, women and men."""

JENSEN_PRINTED = {
    "head": "-.0114 .2376", "trunk": "-.0006 .4246", "upper arm": ".00084 .0220",
    "forearm": ".00018 .01469", "hand": "-.00003 .00898", "thigh": ".00364 .06634",
    "shank": ".00122 .03809", "foot": ".00015 .0187",
}  # fmt: skip
"""Jensen (1986), masses as printed: slope and intercept."""

CALCANEUS_SPHERES = {
    "heel": (0.00190115788407966, -0.00382630379623308),
    "ball_medial": (0.148386399942063, -0.0287134938847342),
    "ball_lateral": (0.133001170607051, 0.0516362473449566),
    "midfoot_lateral": (0.06623, 0.02636416067416981),
}
TOE_SPHERES = {
    "toes_medial": (0.06, -0.0187603084619177),
    "toes_lateral": (0.045, 0.0618569567549652),
}
"""m, forward and to the right, in the published model's own frames (Falisse et al. 2022)."""
TOE_JOINT = (0.1788, 0.00108)


@pytest.mark.parametrize("segment", MEAN_LENGTHS)
def test_mean_lengths_are_de_levas(segment: str) -> None:
    for sex, printed in zip("FM", MEAN_LENGTHS[segment], strict=True):
        assert pytest.approx(printed) == 1e3 * DE_LEVA[sex][segment].length


def test_statures_and_shoulders_are_de_levas() -> None:
    """Mean statures of 15 women and 100 men; MIDS to MIDH, mm."""
    assert STATURE == {"F": 1.7350, "M": 1.7410}
    assert SHOULDER_HEIGHT == {"F": 0.4979, "M": 0.5155}


@pytest.mark.parametrize("segment", JENSEN_MASS)
def test_masses_of_children_are_jensens(segment: str) -> None:
    assert JENSEN_MASS[segment] == tuple(map(float, JENSEN_PRINTED[segment].split()))


def test_jensens_masses_are_a_whole_body_at_every_age() -> None:
    slope, intercept = np.sum(
        [np.array(line) * (2 if name in PAIRED else 1) for name, line in JENSEN_MASS.items()],
        axis=0,
    )
    assert slope == pytest.approx(0.0, abs=1e-4)
    assert intercept == pytest.approx(1.0, abs=1e-3)


def test_jensens_radii_are_as_printed() -> None:
    """About the proximal end, so never less than the distance of the centre of mass."""
    assert JENSEN_RADII == {
        "upper arm": ((-0.00028, 0.557), (-0.00098, 0.640)),
        "thigh": ((-0.00115, 0.4758), (-0.00133, 0.5536)),
        "shank": ((-0.003, 0.4526), (-0.00224, 0.5307)),
        "foot": ((-0.00186, 0.4351), (-0.00203, 0.5022)),
    }
    assert JENSEN_YEARS == (4.0, 15.0)


def test_shares_of_stature_are_differences_of_winters_heights() -> None:
    """Winter (2009), figure 4.1: hip 0.530, knee 0.285 and ankle 0.039 of stature; foot 0.152."""
    hip, knee, ankle = 0.530, 0.285, 0.039
    expected = {"thigh": hip - knee, "shank": knee - ankle, "foot": 0.152, "ankle height": ankle}
    assert pytest.approx(expected) == WINTER
    assert hip == LEG_SHARE


def test_shoulders_and_toes_are_those_of_rajagopals_model() -> None:
    """Shoulders 0.170 m from the midline of 1.70 m; toes 0.2166 of a foot's 1.5666 kg."""
    assert pytest.approx(0.170 / 1.70) == SHOULDER_HALF_WIDTH
    assert pytest.approx(0.2166 / 1.5666, abs=5e-4) == TOES_MASS


def test_spheres_are_falisses() -> None:
    toes = {name: tuple(np.add(place, TOE_JOINT)) for name, place in TOE_SPHERES.items()}
    published = CALCANEUS_SPHERES | toes
    assert set(SPHERES) == set(published)
    for name, (segment, forward, lateral) in SPHERES.items():
        # the ball under the first metatarsal head goes with the toe (its sesamoids do)
        assert segment == ("toes" if name in (*TOE_SPHERES, "ball_medial") else "foot")
        assert lateral == pytest.approx(published[name][1], abs=6e-5), name
        if name.startswith("ball"):  # under the person's own metatarsal heads
            assert forward is None
        else:
            assert forward == pytest.approx(published[name][0], abs=6e-5), name


def test_hip_centres_are_harringtons() -> None:
    """(2007), mm: x = -0.24 PD - 9.9, y = -0.30 PW - 10.9, z = 0.33 PW + 7.3; her y is up, her z to
    the right, ours to the left."""
    width, depth = 251.0, 137.0
    found = 1e3 * hip_joint_centre(1e-3 * width, 1e-3 * depth)
    expected = -0.24 * depth - 9.9, -(0.33 * width + 7.3), -0.30 * width - 10.9
    assert found == pytest.approx(expected)


def test_shoulders_hang_below_the_acromia_as_rab_has_them() -> None:
    """Rab et al. (2002): 17 % of the distance between the acromia. The centre of a marker of 14 mm
    on a base of 3 mm is 10 mm from the skin."""
    assert SURFACE.acromion_to_shoulder == 0.17
    assert pytest.approx(0.014 / 2 + 0.003) == SURFACE.marker_offset


@pytest.fixture(scope="module")
def built_in() -> list[tuple[float, dict[str, np.ndarray], Measurements, float]]:
    """Of the ten: stature, places of landmarks, measurements, and length of the foot."""
    found = []
    for name in BUILTIN:
        subject = load_subject(name)
        (foot,) = (each for each in scale_subject(subject).table if each.segment == "foot")
        places = {mark: np.array(place) for mark, place in locate(subject.markers).items()}
        found.append((subject.height_m, places, measurements_of(subject), foot.length_m))
    return found


def test_the_mean_body_is_the_mean_of_the_built_in_people(built_in) -> None:
    """With the digits and the standard deviations (n - 1) that its constants state."""
    rows = []
    for height, places, of, _ in built_in:
        both = [(limb.thigh, limb.shank, limb.ankle_height / 0.039) for limb in (of.right, of.left)]
        width = np.linalg.norm(places["R.ASIS"] - places["L.ASIS"])
        rows.append([*np.mean(both, axis=0) / height, width / height, np.degrees(of.pelvic_tilt)])
    means, deviations = np.mean(rows, axis=0), np.std(rows, axis=0, ddof=1)
    assert np.round(means[:2], 4).tolist() == [MEAN_BODY.thigh, MEAN_BODY.shank]
    assert np.round(means[2], 2) == MEAN_BODY.ankle_factor
    assert np.round(means[3], 3) == MEAN_BODY.pelvis_width
    assert np.round(means[4], 1) == pytest.approx(np.degrees(MEAN_BODY.pelvic_tilt))
    np.testing.assert_allclose(deviations, [0.012, 0.008, 0.06, 0.019, 5.7], rtol=0.06)


def test_the_shape_of_a_foot_is_the_mean_of_the_built_in_feet(built_in) -> None:
    found = {pair: [] for pair in FOOT_SHAPE}
    whole = {name: [] for name in FOOT}
    for _, places, of, length in built_in:
        for side, limb in (("R", of.right), ("L", of.left)):
            inward = 1.0 if side == "R" else -1.0
            heel = places[f"{side}.Heel"]
            for head, other in found:
                along, away = (places[f"{side}.{name}"] - heel for name in (other, head))
                size = np.hypot(*along[:2])
                ahead = along[:2] / size
                medial = inward * np.array([-ahead[1], ahead[0]])
                up = (away - along)[2]
                found[head, other].append(
                    np.array([away[:2] @ ahead, away[:2] @ medial, up]) / size
                )
            feet = zip(whole, (limb.heel, *limb.metatarsals), strict=True)
            for name, place in feet:
                # the limbs' own axes are mirrored already: y towards the midline
                whole[name].append((place + np.array([0.0, 0.0, limb.ankle_height])) / length)
    for pair, each in found.items():
        np.testing.assert_allclose(np.mean(each, axis=0), FOOT_SHAPE[pair], atol=6e-5)
    for name, each in whole.items():
        np.testing.assert_allclose(np.mean(each, axis=0), FOOT[name], atol=0.002, err_msg=name)


# ---- Contact, statistics. ----


def test_the_smooth_contact_has_opensims_own_constants() -> None:
    import opensim

    force = opensim.SmoothSphereHalfSpaceForce()
    assert force.get_constant_contact_force() == hunt_crossley.SMOOTHING
    assert force.get_hertz_smoothing() == hunt_crossley.PENETRATION_SLOPE
    assert force.get_hunt_crossley_smoothing() == hunt_crossley.RATE_SLOPE


def test_friction_and_damping_are_predsims() -> None:
    """Falisse et al. (2022), D'Hondt et al.: 0.8 and 0.8 and 0.5, but 0.085 instead of 0.2 m/s;
    0.1 Nms/rad. Stiffness and dissipation are those of Moco's 2-D walking example."""
    assert (NOMINAL_FRICTION, NOMINAL_DAMPING) == (0.8, 0.1)
    found = ContactSettings()
    assert found.dynamic_to_static * NOMINAL_FRICTION == 0.8
    assert (found.viscous_friction, found.transition_velocity) == (0.5, 0.085)
    assert (found.stiffness, found.dissipation) == (3_067_776.0, 2.0)
    assert (found.cubic_stiffness, found.cubic_dissipation) == (5e7, 1.0)
    assert found.cubic_friction_velocity == 0.05


def test_factors_of_the_normal_distribution() -> None:
    """With the digits that they are written with."""
    quartile, ninety = scipy.stats.norm.ppf([0.75, 0.95])
    assert round(1.0 / quartile, 4) == MEDIAN_TO_SD
    for factor in (sources.NINETY, estimates.NINETY, legs.LEG_ODDS.seen):
        assert factor == round(ninety, 3)


def test_limits_are_those_of_their_papers() -> None:
    """Baker et al. (2012), degrees."""
    assert SMALLEST_DIFFERENCE == 1.6


def test_spreads_of_the_bursts_of_power_are_schwartzs() -> None:
    """W/kg at the peaks of the mean curves (2008), half the width of the bands."""
    assert {name: burst.spread for name, burst in BURSTS.items()} == {
        "H1": 0.34, "H2": 0.26, "H3": 0.41, "K1": 0.46, "K2": 0.27, "K3": 0.42, "K4": 0.40,
        "A1": 0.48, "A2": 1.01,
    }  # fmt: skip
    signs = {name: burst.sign for name, burst in BURSTS.items()}
    assert {name for name, sign in signs.items() if sign > 0} == {"H1", "H3", "K2", "A2"}
