"""What names say: sides and places, in the words of several languages and systems."""

import pytest

from gaitval.scaling.markers.names import read_names


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


def test_a_name_that_says_nothing_and_computed_points_have_no_place() -> None:
    """Joint centres, axes of segments and results of Plug-in Gait."""
    silent = ["M17", "LHJC", "RKJC", "PELO", "PELA", "TRXP", "LCLA", "LHipAngles", "CentreOfMass"]
    for name, parsed in zip(silent, read_names(silent), strict=True):
        assert parsed.places == (), name
    for parsed in read_names(["midASIS", "MidHip", "MidKnee", "midPSIS"]):
        assert parsed.places == ()
