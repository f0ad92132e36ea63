import numpy as np
import pytest

from gaitval.datasets.subject import MARKERS
from gaitval.errors import RecordError
from gaitval.mocap.c3d import read_c3d
from gaitval.mocap.trc import read_trc
from gaitval.scaling.landmarks import LANDMARKS
from gaitval.scaling.marker_sets import EXAMPLE, builtin_marker_sets, load_marker_set, recognise

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


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (MARKERS, "wbds"),
        (WBDS_WALKING, "wbds"),
        ([name.replace(".", "_").lower() for name in WBDS_WALKING], "wbds"),
        ([n for n in WBDS_WALKING if n not in ("R.TT", "L.Heel")], "wbds"),  # two lost
        (LOWER, "plug_in_gait"),
        (LOWER + UPPER + ["HEDO", "LHipAngles", "*12"], "plug_in_gait"),
        ([f"Anna Smith:{name}" for name in LOWER], "plug_in_gait"),
        ([n for n in LOWER if "PSI" not in n] + ["SACR"], "plug_in_gait"),
    ],
)
def test_sets_are_recognised_by_their_names(names, expected):
    assert recognise(names).name == expected


def test_recorded_trials_are_recognised(gait_data):
    for name, count in (("WBDS01static1.c3d", 28), ("WBDS01walkT01.c3d", 22)):
        names = read_c3d(gait_data / "wbds/raw" / name).names
        marker_set = recognise(names)
        assert (marker_set.name, len(marker_set.renamed(names))) == ("wbds", count)
        assert marker_set.ignored(names) == ()
    folder = gait_data / "opensim_rajagopal/ExpData"
    standing = read_trc(folder / "static_walk_1.trc").names
    walking = read_trc(folder / "motion_capture_walk.trc").names
    rajagopal = recognise(standing)
    assert recognise(walking) == rajagopal == load_marker_set("rajagopal")
    assert len(rajagopal.renamed(walking)) == 41
    # 64 names, of which 17 are points computed from markers.
    assert len(rajagopal.renamed(standing)) == 47
    assert {"R_HJC", "MidASIS", "L.AnkleJointGround"} <= set(rajagopal.ignored(standing))


def test_names_are_mapped_to_the_set_and_others_listed():
    marker_set = load_marker_set("plug_in_gait")
    names = ["S1:rasi", "S1:LKNEE", "S1:SACR", "S1:LHipAngles"]
    assert marker_set.renamed(names) == {"S1:rasi": "RASI", "S1:LKNEE": "LKNE", "S1:SACR": "SACR"}
    assert marker_set.ignored(names) == ("S1:LHipAngles",)
    points = {"RASI": np.zeros(3), "RTIB": np.ones(3), "C7": np.ones(3)}
    assert set(marker_set.on_landmarks(points)) == {"R.ASIS", "R.Shank"}


def test_two_people_in_one_recording_are_refused():
    with pytest.raises(RecordError, match=r"'A:LASI' and 'B:LASI' are both LASI.*keep one"):
        recognise([f"{person}:{name}" for person in "AB" for name in LOWER])


def test_an_unknown_set_says_what_to_do(tmp_path):
    names = ["R_ASI", "L_ASI", "R_Kne", "L_Kne", "Sternum"]
    with pytest.raises(RecordError) as error:
        recognise(names)
    message = str(error.value)
    assert "plug_in_gait, rajagopal, wbds" in message
    assert "found: R_ASI, L_ASI, R_Kne" in message
    assert "missing: RTHI, RTIB, RANK" in message  # of the nearest, by name
    assert "--marker-set FILE" in message
    # The file that it shows can be read.
    file = tmp_path / "own.toml"
    file.write_text(EXAMPLE)
    own = load_marker_set(file)
    assert own.markers["R.Knee.Medial"].static_only
    assert own.markers["R.Thigh.1"].weight == 1.0


def test_near_misses_are_named():
    misspelt = [name.replace("ANK", "ANKL").replace("HEE", "HELL") for name in LOWER]
    with pytest.raises(RecordError, match=r"perhaps: .*RANKL for RANK.*RHELL for RHEE"):
        recognise([*misspelt[:8], "RANKL", "RHELL", "LANKL", "LHELL"])


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
    with pytest.raises(RecordError, match="cannot be read"):
        load_marker_set(tmp_path / "missing.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RecordError, match="cannot be read"):
        load_marker_set(binary)
