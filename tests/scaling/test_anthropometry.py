import numpy as np
import pytest

from gaitval.scaling.anthropometry import (
    DE_LEVA,
    PAIRED,
    body_proportions,
    inertia_tensor,
    mass_fractions,
    mean_length,
    shifted_inertia,
)

# The same segment between other end points (de Leva 1996, Table 4, lower half): length in m,
# radii of gyration as fractions of it.
OTHER_END_POINTS = {
    ("F", "head"): (0.2002, 0.330, 0.359, 0.318),
    ("F", "upper trunk"): (0.1425, 0.746, 0.502, 0.718),
    ("F", "forearm"): (0.2624, 0.263, 0.259, 0.095),
    ("F", "hand"): (0.1701, 0.244, 0.208, 0.154),
    ("F", "shank"): (0.4323, 0.271, 0.267, 0.093),
    ("M", "head"): (0.2033, 0.362, 0.376, 0.312),
    ("M", "upper trunk"): (0.1707, 0.716, 0.454, 0.659),
    ("M", "forearm"): (0.2669, 0.278, 0.267, 0.122),
    ("M", "hand"): (0.1879, 0.288, 0.235, 0.184),
    ("M", "shank"): (0.4340, 0.255, 0.249, 0.103),
}


@pytest.mark.parametrize("sex", ["F", "M"])
def test_mass_fractions_of_a_whole_body_add_up_to_one(sex):
    fractions = mass_fractions(sex)
    total = sum(fraction * (2 if name in PAIRED else 1) for name, fraction in fractions.items())
    assert total == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("sex", ["F", "M"])
@pytest.mark.parametrize("age", [2.0, 4.0, 10.0, 15.9])
def test_a_child_has_jensens_proportions(sex, age):
    """Rows of his table at 10 years; a larger head and lighter legs than an adult's."""
    fractions = mass_fractions(sex, age)
    total = sum(fraction * (2 if name in PAIRED else 1) for name, fraction in fractions.items())
    assert total == pytest.approx(1.0, abs=1e-15)
    adult = mass_fractions(sex)
    assert fractions["head"] > adult["head"] - (age > 15.0)
    assert fractions["thigh"] < adult["thigh"]
    for name, each in body_proportions(sex, age).items():
        assert 0.2 < each.transverse < 0.6, name
        assert 0.3 < each.centre_of_mass < 0.8, name


def test_the_regressions_at_ten_years_are_those_of_the_paper():
    child = body_proportions("F", 10.0)
    assert child["head"].mass == pytest.approx(0.1236)
    assert child["thigh"].mass == pytest.approx(0.10274)
    assert child["thigh"].centre_of_mass == pytest.approx(0.4643)
    assert child["shank"].transverse == pytest.approx((0.5083**2 - 0.4226**2) ** 0.5)
    # What Jensen does not give keeps the adult's shape.
    adult = DE_LEVA["F"]["shank"]
    assert child["shank"].sagittal / child["shank"].transverse == pytest.approx(
        adult.sagittal / adult.transverse
    )
    assert adult.sagittal != adult.transverse
    assert body_proportions("F", 3.0) == body_proportions("F", 4.0)
    for age in (None, 16.0, 40.0):
        assert body_proportions("M", age) is DE_LEVA["M"]


@pytest.mark.parametrize(("sex", "segment"), list(OTHER_END_POINTS))
def test_radii_of_gyration_in_metres_do_not_depend_on_the_end_points(sex, segment):
    length, *radii = OTHER_END_POINTS[sex, segment]
    ours = DE_LEVA[sex][segment]
    # The table rounds fractions to 0.001, of lengths up to 0.44 m.
    np.testing.assert_allclose(
        np.array([ours.sagittal, ours.transverse, ours.longitudinal]) * ours.length,
        np.array(radii) * length,
        atol=0.5e-3,
    )


@pytest.mark.parametrize(("sex", "cervicale_to_hips"), [("F", 0.6148), ("M", 0.6033)])
def test_parts_of_the_trunk_add_up_to_the_trunk(sex, cervicale_to_hips):
    parts = ("upper trunk", "middle trunk", "lower trunk")
    assert sum(DE_LEVA[sex][name].length for name in parts) == pytest.approx(cervicale_to_hips)


def test_thigh_of_the_mean_man():
    # 73 kg and 1.741 m: mass 0.1416 x 73, radius 0.329 x 0.4222 m.
    assert mean_length("M", "thigh", 1.741) == pytest.approx(0.4222)
    mass = mass_fractions("M")["thigh"] * 73
    assert mass == pytest.approx(10.3368, rel=1e-9)
    inertia = inertia_tensor(DE_LEVA["M"]["thigh"], mass, 0.4222)
    np.testing.assert_allclose(np.diag(inertia), [0.199440, 0.199440, 0.040907], rtol=1e-4)


def test_trunk_turns_harder_sideways_than_forwards():
    # Wider than deep: more inertia about the axis from back to front (x) than about y.
    for sex in ("F", "M"):
        inertia = inertia_tensor(DE_LEVA[sex]["upper trunk"], 10.0, 0.2)
        assert inertia[0, 0] > inertia[1, 1]


def test_parallel_axis_theorem_for_a_point_mass():
    np.testing.assert_allclose(
        shifted_inertia(2.0, np.array([0.0, 3.0, 0.0])), np.diag([18.0, 0.0, 18.0])
    )


PUBLISHED = {
    "head": ("6.68 6.94", "48.41 50.02", "27.1 30.3", "29.5 31.5", "26.1 26.1"),
    "upper trunk": ("15.45 15.96", "50.50 50.66", "46.6 50.5", "31.4 32.0", "44.9 46.5"),
    "middle trunk": ("14.65 16.33", "45.12 45.02", "43.3 48.2", "35.4 38.3", "41.5 46.8"),
    "lower trunk": ("12.47 11.17", "49.20 61.15", "43.3 61.5", "40.2 55.1", "44.4 58.7"),
    "upper arm": ("2.55 2.71", "57.54 57.72", "27.8 28.5", "26.0 26.9", "14.8 15.8"),
    "forearm": ("1.38 1.62", "45.59 45.74", "26.1 27.6", "25.7 26.5", "9.4 12.1"),
    "hand": ("0.56 0.61", "74.74 79.00", "53.1 62.8", "45.4 51.3", "33.5 40.1"),
    "thigh": ("14.78 14.16", "36.12 40.95", "36.9 32.9", "36.4 32.9", "16.2 14.9"),
    "shank": ("4.81 4.33", "43.52 43.95", "26.7 25.1", "26.3 24.6", "9.2 10.2"),
    "foot": ("1.29 1.37", "40.14 44.15", "29.9 25.7", "27.9 24.5", "13.9 12.4"),
}
"""de Leva (1996), Table 4, as printed, women and men: mass, centre of mass and sagittal, transverse
and longitudinal radius of gyration, in % of the body's mass and of the segment's length."""


@pytest.mark.parametrize("segment", DE_LEVA["F"])
def test_the_table_has_the_digits_of_the_paper(segment):
    for column, sex in enumerate(("F", "M")):
        ours = DE_LEVA[sex][segment]
        mass, centre, *radii = (float(each.split()[column]) for each in PUBLISHED[segment])
        assert 100.0 * ours.mass == pytest.approx(mass)
        assert 100.0 * ours.centre_of_mass == pytest.approx(centre)
        seen = [100.0 * each for each in (ours.sagittal, ours.transverse, ours.longitudinal)]
        assert seen == pytest.approx(radii)
