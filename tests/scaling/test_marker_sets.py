import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.scaling.landmarks import LANDMARKS
from gaitval.scaling.marker_set import MarkerDefinition, MarkerSet
from gaitval.scaling.marker_sets import builtin_marker_sets, load_marker_set, problems_of, recognise
from gaitval.subjects.subject import MARKERS

TAKEN_OFF = ("Knee.Medial", "Ankle.Medial", "MT2")
WBDS_WALKING = [name for name in MARKERS if not name.endswith(TAKEN_OFF)]
LOWER = [
    side + name
    for side in "LR"
    for name in ("ASI", "PSI", "THI", "KNE", "TIB", "ANK", "HEE", "TOE")
]
UPPER = [
    *("C7", "T10", "CLAV", "STRN", "RBAK"),
    *(
        side + name
        for side in "LR"
        for name in ("FHD", "BHD", "SHO", "UPA", "ELB", "FRM", "WRA", "WRB", "FIN")
    ),
]


@pytest.mark.parametrize("marker_set", builtin_marker_sets(), ids=lambda s: s.name)
def test_a_built_in_set_has_no_problem(marker_set):
    assert problems_of(marker_set.markers) == []


@pytest.mark.parametrize("marker_set", builtin_marker_sets(), ids=lambda s: s.name)
def test_built_in_sets_have_the_same_landmarks_on_both_sides(marker_set):
    landmarks = set(marker_set.landmarks)
    paired = {name for name in landmarks if name[1] == "."}
    assert {"RL"[name[0] == "R"] + name[1:] for name in paired} == paired
    for side in "RL":
        assert {f"{side}.{name}" for name in ("ASIS", "Knee", "Ankle", "Heel")} <= landmarks
    for definition in marker_set.markers.values():
        side = definition.segment[-2:]
        if definition.landmark in paired and side in ("_r", "_l"):
            assert definition.landmark[0].lower() == side[1]
        assert definition.role == ("tracking" if definition.landmark is None else "anatomical")


def test_wbds_is_the_set_of_the_built_in_subjects():
    wbds = load_marker_set("wbds")
    assert set(wbds.markers) == set(MARKERS)
    # Its markers are named after the landmarks from which the legs are measured.
    for side in "RL":
        for name in LANDMARKS:
            assert wbds.landmarks[f"{side}.{name}"] == f"{side}.{name}"
    static = {name for name, d in wbds.markers.items() if d.static_only}
    assert static == set(MARKERS) - set(WBDS_WALKING)


def both_sides(*names):
    """Names with R and L for the first "*", as they are without one."""
    return [name.replace("*", side, 1) for name in names for side in "RL"[: 1 + ("*" in name)]]


# Names as a recording of walking has them, from the source that the set's file names.
WALKING = {
    "bts": [
        *("r.should", "l.should", "c7", "r.asis", "l.asis", "sacrum", "r.bar1", "l.bar1"),
        *("r.knee1", "l.knee1", "r.bar2", "r.mall", "l.bar2", "l.mall", "r.met", "r.heel"),
        *("l.heel", "l.met"),
    ],
    "cast": both_sides(
        *("*IAS", "*IPS", "*TH1", "*TH2", "*TH3", "*TH4", "*SK1", "*SK2", "*SK3", "*SK4"),
        *("*FCC", "*FM1", "*FM2", "*FM5"),
    ),
    "cgm2": both_sides(
        *("*ASI", "*PSI", "*THI", "*THAP", "*THAD", "*KNE", "*TIB", "*TIAP", "*TIAD", "*ANK"),
        *("*HEE", "*TOE", "*FMH", "*VMH"),
    ),
    "gait2354": both_sides(
        *("Sternum", "*.Acromium", "Top.Head", "*.ASIS", "V.Sacral"),
        *("*.Thigh.Upper", "*.Thigh.Front", "*.Thigh.Rear", "*.Knee.Lat"),
        *("*.Shank.Upper", "*.Shank.Front", "*.Shank.Rear", "*.Ankle.Lat"),
        *("*.Heel", "*.Midfoot.Sup", "*.Midfoot.Lat", "*.Toe.Lat", "*.Toe.Med", "*.Toe.Tip"),
    ),
    "hbm": both_sides(
        *("*HEAD", "THEAD", "FHEAD", "C7", "T10", "SACR", "NAVE", "XYPH", "STRN", "BBAC", "*SHO"),
        *("*DELT", "*LEE", "*MEE", "*FRM", "*MW", "*LW", "*FIN", "*ASIS", "*PSIS", "*GTRO"),
        *("F*THI", "*LEK", "*ATI", "*LM", "*HEE", "*TOE", "*MT5"),
    ),
    "helen_hayes": both_sides(
        *("*.Shoulder", "R.Offset", "*.Elbow", "*.Wrist", "*.ASIS", "V.Sacral", "*.Thigh"),
        *("*.Knee", "*.Shank", "*.Ankle", "*.Heel", "*.Toe", "C7", "IJ", "PX"),
    ),
    "ior": both_sides(
        *("*IAS", "*IPS", "*FTC", "*FLE", "*FAX", "*TTC", "*FAL", "*FCC", "*FM1", "*FM2", "*FM5"),
    ),
    "ior_foot": both_sides(
        *("*.ASIS", "*.PSIS", "*.HF", "*.TT", "*.LM", "*.MM", "*.LE", "*.CA", "*.ST", "*.PT"),
        *("*.TN", "*.FMB", "*.SMB", "*.VMB", "*.FMH", "*.SMH", "*.VMH", "*.PM"),
    ),
    "isb": both_sides(
        *(
            "*TEMP",
            "*HEAD",
            "*ACR",
            "*HLE",
            "*HME",
            "*RSP",
            "*USP",
            "*CAP",
            "*HMC2",
            "*FLE",
            "*FME",
        ),
        *("*TAM", "*FAL", "*FCC", "*FMT1", "*FMT5", "STER", "XPRO", "C7", "T10", "*ASIS", "*PSIS"),
    ),
    "opencap": [
        *("r_knee", "r_shank_antsup", "r_ankle", "r_calc", "r_5meta", "r_toe", "L_knee"),
        *("L_shank_antsup", "L_ankle", "L_calc", "L_5meta", "L_toe", "r_sh2", "r_sh3", "r_sh4"),
        *("L_sh2", "L_sh3", "r_thigh1", "r_thigh2", "r_thigh3", "r_thigh4", "r_thigh5"),
        *("L_thigh1", "L_thigh2", "L_thigh3", "L_thigh4", "r.ASIS", "r.PSIS", "L.ASIS", "L.PSIS"),
        *("C7", "R_Shoulder", "L_Shoulder", "R_HJC", "L_HJC", "R_HJC_reg", "L_HJC_reg"),
    ],
    "plug_in_gait": LOWER,
    "qualisys": both_sides(
        *("HeadFront", "Head*", "*ShoulderTop", "Chest", "*ElbowIn", "*ElbowOut", "*WristOut"),
        *("*WristIn", "Waist*Front", "*ThighFrontLow", "*KneeOut", "*ShinFrontHigh", "*AnkleOut"),
        *("*Forefoot5", "*Forefoot2", "SpineThoracic2", "SpineThoracic12", "*Arm", "Waist*"),
        *("WaistBack", "*Hand2", "*HeelBack"),
    ),
    "rajagopal": both_sides(
        *("*.Shoulder", "*.Clavicle", "*.Biceps", "*.Elbow", "*.Forearm", "*.Wrist", "*.ASIS"),
        *("*.PSIS", "S2", "*.TH1", "*.TH2", "*.TH3", "L.TH4", "*.Knee", "*.SH1", "*.SH2", "*.SH3"),
        *("R.SH4", "*.Ankle", "*.Heel", "*.MT5", "*.Toe"),
    ),
    "rajagopal2015": both_sides(
        *("CLAV", "C7", "*ACR", "*ASH", "*PSH", "*LEL", "*MEL", "*UA1", "*UA2", "*UA3", "*ASI"),
        *("*PSI", "*CAL", "*TOE", "*MT5", "*TH1", "*TH2", "*TH3", "*TB1", "*TB2", "*TB3"),
        *("*LFC", "*MFC", "*LMAL", "*MMAL"),
    ),
    "wbds": WBDS_WALKING,
}


@pytest.mark.parametrize("marker_set", builtin_marker_sets(), ids=lambda s: s.name)
def test_each_set_is_recognised_by_its_own_names_alone(marker_set):
    names = WALKING[marker_set.name]
    assert recognise(names) is marker_set
    score = marker_set.score(names)
    assert not score.missing
    assert score.share == 1.0
    # A few lost do not make it another set; half of the names are no set at all.
    required = [
        name for name in names if marker_set.renamed([name]).get(name) in marker_set.essential
    ]
    kept = [name for name in names if name not in required[2:4]]
    assert recognise(kept) is marker_set
    lost = marker_set.score(kept)
    assert set(lost.missing) == {marker_set.renamed([name])[name] for name in required[2:4]}
    assert f"{len(required) - 2} of {len(required)} required markers (without " in str(lost)
    with pytest.raises(RecordError, match="match no known marker set"):
        recognise(required[: len(required) // 2])


@pytest.mark.parametrize("marker_set", builtin_marker_sets(), ids=lambda s: s.name)
def test_no_set_is_taken_for_another_by_the_names_of_its_file(marker_set):
    assert recognise(marker_set.markers) is marker_set


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (MARKERS, "wbds"),
        ([name.replace(".", "_").lower() for name in WBDS_WALKING], "wbds"),
        (LOWER + UPPER + ["HEDO", "LHipAngles", "*12"], "plug_in_gait"),
        ([f"Anna Smith:{name}" for name in LOWER], "plug_in_gait"),
        ([n for n in LOWER if "PSI" not in n] + ["SACR"], "plug_in_gait"),
        # Four letters, as a C3D file of Motion Analysis has them.
        (
            both_sides("*ASI", "VSAC", "*THI", "*KNE", "*SHA", "*ANK", "*HEE", "*TOE"),
            "helen_hayes",
        ),
        # Camargo et al. (2021): PSIS, and underscores.
        (
            both_sides(
                *("*_ASIS", "*_PSIS", "*_Thigh_Upper", "*_Thigh_Front", "*_Thigh_Rear"),
                *("*_Knee_Lat", "*_Shank_Upper", "*_Shank_Front", "*_Shank_Rear", "*_Ankle_Lat"),
                *("*_Heel", "*_Toe_Lat", "*_Toe_Med", "*_Toe_Tip"),
            ),
            "gait2354",
        ),
        # Leardini's own abbreviations.
        (
            both_sides(
                *("*ASIS", "*PSIS", "*GT", "*LE", "*HF", "*TT", "*LM", "*CA", "*FM", "*SM", "*VM")
            ),
            "ior",
        ),
        # OpenCap's video-based markers.
        (
            [
                f"{side}{name}_study"
                for side in ("r", "L")
                for name in (
                    *(".ASIS", ".PSIS", "_knee", "_mknee", "_ankle", "_mankle", "_toe", "_5meta"),
                    *("_calc", "_thigh1", "_thigh2", "_thigh3", "_sh1", "_sh2", "_sh3"),
                )
            ],
            "opencap",
        ),
    ],
)
def test_sets_are_recognised_by_other_spellings(names, expected):
    assert recognise(names).name == expected


def test_two_sets_that_mean_different_places_are_not_guessed():
    def laboratory(name, toe):
        markers = {
            marker: MarkerDefinition(segment="pelvis", landmark=f"{marker[0]}.ASIS")
            for marker in ("RASI", "LASI")
        }
        markers["RTOE"] = MarkerDefinition(segment="foot_r", landmark=f"R.{toe}")
        return MarkerSet(name, name, "own", markers)

    one, other = laboratory("one", "MT2"), laboratory("other", "Toe")
    names = ["RASI", "LASI", "RTOE"]
    with pytest.raises(RecordError) as error:
        recognise(names, sets=(one, other))
    message = str(error.value)
    assert "one (one): 3 of 3 required markers" in message
    assert "They differ in RTOE." in message
    assert "--marker-set one or --marker-set other" in message
    # Where they mean the same places, either will do.
    assert recognise(names, sets=(one, laboratory("same", "MT2"))) is one


def test_medial_markers_of_madison_are_those_of_the_set():
    """Their standing trials call them Mkn and Man (opensim-jam, Lenhart et al. 2015)."""
    names = [
        name
        for name, marker in load_marker_set("rajagopal").markers.items()
        if not (marker.landmark or "").endswith(".Medial")
    ]
    standing = [*names, "R.Mkn", "R.Man", "L.Mkn", "L.Man"]
    marker_set = recognise(standing)
    assert marker_set.name == "rajagopal"
    renamed = marker_set.renamed(standing)
    found = {marker_set.markers[renamed[name]].landmark for name in standing[-4:]}
    assert found == {f"{s}.{joint}.Medial" for s in "RL" for joint in ("Knee", "Ankle")}


def test_names_are_mapped_to_the_set_and_others_listed():
    marker_set = load_marker_set("plug_in_gait")
    names = ["S1:rasi", "S1:LKNEE", "S1:SACR", "S1:LHipAngles"]
    assert marker_set.renamed(names) == {"S1:rasi": "RASI", "S1:LKNEE": "LKNE", "S1:SACR": "SACR"}
    assert marker_set.ignored(names) == ("S1:LHipAngles",)
    points = {"RASI": np.zeros(3), "RTIB": np.ones(3), "C7": np.ones(3)}
    assert set(marker_set.on_landmarks(points)) == {"R.ASIS", "R.Shank"}


def test_two_people_in_one_recording_are_refused():
    names = [f"{person}:{name}" for person in "AB" for name in LOWER]
    found = recognise(names)
    with pytest.raises(RecordError, match=r"'A:LASI' and 'B:LASI' are both LASI.*each alone"):
        found.renamed(names)


def test_a_copy_of_a_marker_under_another_name_is_left_out():
    """Vicon's models write the malleoli of walking into the standing trial, where they are."""
    found = recognise(LOWER)
    names = [*LOWER, "A:LASI"]
    kept = found.renamed(names, lambda one, other: {one, other} == {"LASI", "A:LASI"})
    assert "A:LASI" not in kept
    assert kept["LASI"] == "LASI"
    assert "A:LASI" not in found.ignored(names), "it is a marker of the set"


def test_of_two_names_of_one_marker_the_sets_own_spelling_counts():
    """OpenCap writes the key points of its video beside the markers that it makes of them."""
    found = load_marker_set("opencap")
    names = ["RKnee", "r_knee_study", "S:LAnkle", "S:L_ankle_study"]
    assert found.renamed(names) == {"r_knee_study": "r_knee", "S:L_ankle_study": "L_ankle"}
    assert found.renamed(names[::-1]) == found.renamed(names)
    with pytest.raises(RecordError, match="are both r_knee"):
        found.renamed(["RKnee", "rknee"])
    with pytest.raises(RecordError, match="are both r_knee"):  # of two people
        found.renamed(["A:r_knee_study", "B:RKnee"])
    assert found.renamed(["RKnee"]) == {"RKnee": "r_knee"}


@pytest.mark.parametrize(
    ("text", "problems"),
    [
        ("markers = 3", ["title: Field required", "source: Field required", "markers"]),
        ("[markers", ["not valid TOML"]),
        (
            'title = "x"\nsource = "x"\n[markers]\n'
            'A = { segment = "tigh_r" }\n'
            'B = { segment = "pelvis", landmark = "R.Asis" }\n'
            'C = { segment = "pelvis", aliases = ["b"] }\n'
            'D = { segment = "pelvis", landmark = "L.ASIS" }\n'
            'E = { segment = "pelvis", landmark = "L.ASIS" }\n',
            [
                "4 problems",
                "A: unknown segment 'tigh_r', did you mean thigh_r?",
                "B: unknown landmark 'R.Asis', did you mean R.ASIS?",
                "C: its name 'b' is also one of B",
                "E: its landmark L.ASIS is that of D",
            ],
        ),
        (
            'title = "x"\nsource = "x"\n[markers]\nA = { segment = "pelvis", weigth = 2 }',
            ["weigth"],
        ),
        (
            'title = "x"\nsource = "x"\n[markers]\nA = { segment = "pelvis", weight = -2 }',
            ["weight"],
        ),
        ('title = "x"\nsource = "x"\n[markers]\n', ["no markers"]),
    ],
)
def test_problems_of_a_file_are_all_listed(tmp_path, text, problems):
    file = tmp_path / "set.toml"
    file.write_text(text)
    with pytest.raises(RecordError) as error:
        load_marker_set(str(file))
    assert str(file) in str(error.value)
    for problem in problems:
        assert problem in str(error.value)


def test_unknown_and_unreadable_sets(tmp_path):
    with pytest.raises(RecordError, match="did you mean rajagopal"):
        load_marker_set("Rajagopl")
    with pytest.raises(RecordError, match="no such file"):
        load_marker_set(tmp_path / "missing.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RecordError, match="cannot be read"):
        load_marker_set(binary)
