"""What names say: sides and places, in the words of several languages and systems."""

import numpy as np
import pytest

from gaitval.scaling.marker_sets import builtin_marker_sets
from gaitval.scaling.markers.body import sites
from gaitval.scaling.markers.names import computed, likelihoods, read_names


@pytest.mark.parametrize(
    ("right", "left", "place"),
    [
        ("RKNE", "LKNE", "R.Knee"),
        ("Knie_innen_re", "Knie_innen_li", "R.Knee.Medial"),
        ("Ferse rechts", "Ferse links", "R.Heel"),
        ("D_Genou_ext", "G_Genou_ext", "R.Knee"),
        ("Malléole_int_droite", "Malléole_int_gauche", "R.Ankle.Medial"),
        ("dx_Tallone", "sx_Tallone", "R.Heel"),
        ("Rodilla_ext_der", "Rodilla_ext_izq", "R.Knee"),
        ("D_Calcanhar", "E_Calcanhar", "R.Heel"),
        ("r.bar2", "l.bar2", "R.Shank"),
        ("R.EIAS", "L.EIAS", "R.ASIS"),
        ("FRTHI", "FLTHI", "R.Thigh"),
        ("Subject:RFMH", "Subject:LFMH", "R.MT1"),
        ("RIMH", "LIMH", "R.MT1"),
        ("RIIMH", "LIIMH", "R.MT2"),
        ("RIIT", "LIIT", "R.MT2"),
        ("RVMH", "LVMH", "R.MT5"),
        ("RA", "LA", "R.Acromion"),
        ("RMA", "LMA", "R.Ankle.Medial"),
        ("R.FM", "L.FM", "R.MT1"),
        ("R.VM", "L.VM", "R.MT5"),
        ("Großzehengrundgelenk_re", "Großzehengrundgelenk_li", "R.MT1"),
        ("Kleinzehe_Grundgelenk_re", "Kleinzehe_Grundgelenk_li", "R.MT5"),
    ],
)
def test_a_name_and_its_partner_say_a_place_on_both_sides(
    right: str, left: str, place: str
) -> None:
    first, second = read_names([right, left])
    name = place[2:]
    assert first.side == "R"
    assert second.side == "L"
    assert name in first.places
    assert name in second.places


def test_a_rear_spine_without_a_side_is_the_middle_of_both() -> None:
    """As LAMB has it."""
    middle, right = read_names(["Psis", "RPSIS"])
    assert middle.side == ""
    assert middle.places == ("Sacrum",)
    fitting = {site.label for site in sites() if right.fits(site)}
    assert fitting == {"R.PSIS"}


@pytest.mark.parametrize("marker_set", builtin_marker_sets(), ids=lambda each: each.name)
def test_names_of_the_built_in_sets_never_say_the_other_side_or_another_landmark(
    marker_set,
) -> None:
    landmarks = {site.landmark: site for site in sites() if site.landmark}
    messages = dict(zip(marker_set.markers, read_names(list(marker_set.markers)), strict=True))
    silent = 0
    for marker, definition in marker_set.markers.items():
        word = messages[marker]
        site = landmarks.get(definition.landmark)
        if site is None or not word.places:
            silent += site is not None and not word.places
            continue
        assert word.fits(site), (marker, word)
    assert silent <= 0.1 * len(marker_set.markers)


def test_a_name_that_says_nothing_is_equally_likely_everywhere() -> None:
    table = likelihoods(read_names(["M17", "RHEE", "LHEE"]), sites())
    assert np.ptp(table[0]) == 0.0
    assert sites()[int(np.argmax(table[1]))].label == "R.Heel"


def test_computed_points_are_known_and_markers_are_not() -> None:
    sums = [
        "LHJC",
        "RKJC",
        "RMJC",
        "LJC",
        "PELO",
        "PELA",
        "PELL",
        "PELP",
        "LHipAngles",
        "CentreOfMass",
        "midASIS",
        "MidHip",
    ]
    marks = ["RTOE", "LASI", "RFOO", "R.Midfoot.Sup", "RFEA", "Middenvoet_1_rechts", "MidThigh_R"]
    assert computed([*sums, *marks]) == set(sums)


def test_two_markers_of_one_name_on_a_joint_are_on_both_sides_of_it():
    names = ["RKNE#1", "RKNE#2", "LKNE#1", "LKNE#2", "RHEE", "LHEE", "RANK", "LANK"]
    parsed = dict(zip(names, read_names(names), strict=True))
    for name in names[:4]:
        assert parsed[name].side == name[0]
        assert set(parsed[name].places) == {"Knee", "Knee.Medial"}
    assert parsed["RHEE"].places == ("Heel",)
    assert "Ankle.Medial" not in parsed["LANK"].places
