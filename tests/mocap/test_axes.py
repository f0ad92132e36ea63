"""The laboratory's axes are found from who stands and walks in it, or refused with a reason."""

from itertools import permutations, product

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.mocap.axes import detect_axes, turn_to_walking_direction
from gaitval.mocap.given_axes import parse_axes
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Plate, Recording

# A person of 1.75 m who stands in the project's axes, m.
RIGHT = {
    "ASIS": (0.10, -0.13, 0.98),
    "PSIS": (-0.10, -0.05, 1.00),
    "Knee": (0.02, -0.16, 0.50),
    "Ankle": (-0.03, -0.15, 0.08),
    "Heel": (-0.10, -0.12, 0.04),
    "MT1": (0.12, -0.11, 0.04),
    "MT5": (0.09, -0.20, 0.03),
}
PERSON = {f"R.{name}": np.array(place) for name, place in RIGHT.items()}
PERSON |= {f"L.{name}": np.array((x, -y, z)) for name, (x, y, z) in RIGHT.items()}
LANDMARKS = {name: name.replace(".", "_") for name in PERSON}

# The 24 ways in which axes of a right-handed laboratory can lie.
ROTATIONS = [
    matrix
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(matrix := np.diag(signs)[list(order)]) > 0
]


def about_z(degrees: float) -> np.ndarray:
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])


def about_y(degrees: float) -> np.ndarray:
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])


def standing(
    rotation: np.ndarray | None = None, points: dict = PERSON, scale: float = 1.0
) -> Recording:
    """The person as a laboratory records it whose axes `rotation` takes to the project's."""
    places = np.array(list(points.values())) * scale @ (np.eye(3) if rotation is None else rotation)
    markers = np.tile(places, (5, 1, 1))
    names = tuple(LANDMARKS[name] for name in points)
    return Recording("standing.c3d", "laboratory", names, markers, 100.0)


def walking(speed: float, *, belt: bool, drift: float = 0.0) -> Recording:
    """Ten seconds of a walk along +x in the project's axes: stance 60 %, swing 40 % of 1 s."""
    time = np.arange(1000) / 100.0
    markers = np.tile(np.array(list(PERSON.values())), (len(time), 1, 1))
    for i, name in enumerate(PERSON):
        if name[2:] in ("Heel", "MT1", "MT5", "Ankle"):
            phase = (time + (0.5 if name[0] == "L" else 0.0)) % 1.0
            swing = np.clip((phase - 0.6) / 0.4, 0, 1)
            # On the ground it stays behind; in swing it catches up and is lifted.
            behind = speed * (0.5 * (1 - np.cos(np.pi * swing)) - phase)
            markers[:, i, 0] += behind + 0.3 * speed
            markers[:, i, 2] += 0.12 * np.sin(np.pi * swing)
    travel = (drift if belt else speed) * time
    markers[:, :, 0] += travel[:, None]
    names = tuple(LANDMARKS[name] for name in PERSON)
    return Recording("walk.c3d", "project", names, markers, 100.0)


def turned(recording: Recording, degrees: float) -> Recording:
    return recording.turned(about_z(degrees))


class TestDetect:
    @pytest.mark.parametrize("rotation", ROTATIONS)
    def test_any_laboratory(self, rotation):
        axes = detect_axes(standing(rotation), LANDMARKS)
        np.testing.assert_array_equal(axes.rotation, rotation)
        np.testing.assert_array_equal(parse_axes(axes.option).rotation, rotation)

    @pytest.mark.parametrize(
        ("rotation", "words"), [(about_z(20), "20.0° off +x"), (about_y(10), "0.0° off +x")]
    )
    def test_turned_or_leaning_a_little(self, rotation, words):
        axes = detect_axes(standing(rotation), LANDMARKS)
        np.testing.assert_array_equal(axes.rotation, np.eye(3))
        assert "+x forward, +y to the left, +z up" in axes.description
        assert words in axes.description

    def test_one_foot_and_few_markers_suffice(self):
        few = {name: PERSON[name] for name in ("R.ASIS", "L.ASIS", "R.Ankle", "R.Heel", "R.MT5")}
        np.testing.assert_array_equal(
            detect_axes(standing(points=few), LANDMARKS).rotation, np.eye(3)
        )

    @pytest.mark.parametrize(
        ("recording", "words"),
        [
            (standing(about_y(35)), "not a standing trial"),
            (standing(scale=1e3), "wrong unit, millimetres that are called metres"),
            (standing(scale=1e-3), "wrong unit, metres that are called millimetres"),
            (standing(scale=10.0), "wrong unit, millimetres that are called centimetres"),
            (standing(scale=2.0), "names are wrong"),
        ],
        ids=["lying", "mm as m", "m as mm", "cm as mm", "giant"],
    )
    def test_refusals(self, recording, words):
        with pytest.raises(RecordError) as caught:
            detect_axes(recording, LANDMARKS)
        assert "standing.c3d" in str(caught.value)
        assert words in str(caught.value)

    def test_a_person_who_turns_has_no_axes(self):
        """Medians over a person who turns mix what is forward with what is left."""
        still = standing()
        turning = [about_z(angle) @ still.markers[0].T for angle in np.linspace(0, 300, 60)]
        turns = still.with_markers(still.names, np.array(turning).transpose(0, 2, 1))
        with pytest.raises(RecordError, match="the person turns"):
            detect_axes(turns, LANDMARKS)

    def test_front_and_rear_of_the_pelvis_exchanged(self):
        points = dict(PERSON)
        for side in "RL":
            points[f"{side}.ASIS"], points[f"{side}.PSIS"] = (
                PERSON[f"{side}.PSIS"],
                PERSON[f"{side}.ASIS"],
            )
        with pytest.raises(
            RecordError, match=r"faces away from the pelvis: front and rear markers"
        ):
            detect_axes(standing(points=points), LANDMARKS)

    @pytest.mark.parametrize(
        ("lost", "words"),
        [
            (("ASIS", "PSIS"), "markers of the pelvis"),
            (("Ankle", "Knee", "Heel", "MT1", "MT5"), "no marker on the ankles, the heels"),
            (("PSIS", "MT1", "MT5"), "unknown which way the person faces"),
        ],
    )
    def test_markers_that_are_needed(self, lost, words):
        points = {name: place for name, place in PERSON.items() if name[2:] not in lost}
        with pytest.raises(RecordError, match=words):
            detect_axes(standing(points=points), LANDMARKS)


class TestGiven:
    @pytest.mark.parametrize(
        ("text", "rotation"),
        [
            ("forward=+x up=+z", np.eye(3)),
            ("forward=x  up=z", np.eye(3)),
            ("Forward=+X Up=+Z", np.eye(3)),
            ("forward=+x up=+y", [[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
            ("forward=-y up=z", [[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
        ],
    )
    def test_forms(self, text, rotation):
        axes = parse_axes(text)
        np.testing.assert_array_equal(axes.rotation, rotation)
        np.testing.assert_array_equal(parse_axes(axes.option).rotation, rotation)

    @pytest.mark.parametrize(
        "text",
        [
            *("", "forward=x", "forward=+x up=+x", "forward=x up=-x", "forward=+w up=+z"),
            *("ahead=+x up=+z", "xyz", "up=z forward=x", "up=+z up=-y", "forward=x left=z up=y"),
        ],
    )
    def test_refusals_show_the_form(self, text):
        with pytest.raises(RecordError, match=r"is not understood.*forward=\+x up=\+y"):
            parse_axes(text)

    @pytest.mark.parametrize(("side", "foot"), [("R", "right"), ("L", "left")])
    def test_one_foot_whose_heel_and_toes_are_exchanged(self, side, foot):
        recording = standing()
        heel = recording.names.index(LANDMARKS[f"{side}.Heel"])
        toes = [recording.names.index(LANDMARKS[f"{side}.{name}"]) for name in ("MT1", "MT5")]
        middle = recording.markers[:, toes].mean(axis=1)
        recording.markers[:, toes] = recording.markers[:, [heel]]
        recording.markers[:, heel] = middle
        with pytest.raises(RecordError, match=f"the {foot} foot faces away"):
            detect_axes(recording, LANDMARKS)

    def test_a_person_who_stands_diagonally(self):
        recording = standing(about_z(40))
        np.testing.assert_array_equal(detect_axes(recording, LANDMARKS).rotation, np.eye(3))


class TestWalkingDirection:
    @pytest.mark.parametrize("belt", [False, True], ids=["overground", "treadmill"])
    @pytest.mark.parametrize("quarter", [0, 90, 180, 270])
    @pytest.mark.parametrize("off", [0.0, 4.0])
    def test_multiples_of_a_right_angle(self, belt, quarter, off):
        straight = turned(walking(1.2, belt=belt), off)
        found, text = turn_to_walking_direction(turned(straight, quarter), LANDMARKS)
        np.testing.assert_allclose(found.markers, straight.markers, atol=1e-12)
        assert ("treadmill" if belt else "overground") in text
        assert "at 1.20 m/s by a first estimate" in text

    @pytest.mark.parametrize("belt", [False, True], ids=["overground", "treadmill"])
    def test_a_path_across_the_axes(self, belt):
        straight = walking(1.2, belt=belt)
        found, _ = turn_to_walking_direction(turned(straight, 37.0), LANDMARKS)
        np.testing.assert_allclose(found.markers, straight.markers, atol=1e-3)

    @pytest.mark.parametrize("drift", [-0.15, 0.15])
    def test_drifting_on_a_slow_treadmill(self, drift):
        """1.5 m along the belt in ten seconds do not make it a walk overground."""
        straight = walking(0.4, belt=True, drift=drift)
        found, text = turn_to_walking_direction(turned(straight, 180), LANDMARKS)
        np.testing.assert_allclose(found.markers, straight.markers, atol=1e-12)
        assert "treadmill" in text

    @pytest.mark.parametrize("belt", [False, True], ids=["overground", "treadmill"])
    def test_what_is_not_on_the_body_decides_nothing(self, belt):
        """A marker of the pelvis that lies on the floor turned the pelvis, and kept it back."""
        recording = walking(1.2, belt=belt)
        fell = recording.names.index(LANDMARKS["L.ASIS"])
        shown = recording.with_markers(recording.names, recording.markers.copy())
        recording.markers[500:, fell] = recording.markers[499, fell]
        recording.markers[500:, fell] -= (1.5, 0.0, recording.markers[499, fell, 2])
        shown.markers[500:, fell] = np.nan
        with pytest.raises(RecordError, match=r"turns|backwards|faces away"):
            turn_to_walking_direction(turned(recording, 90), LANDMARKS)
        found, _ = turn_to_walking_direction(turned(recording, 90), LANDMARKS, turned(shown, 90))
        np.testing.assert_allclose(found.markers, recording.markers, atol=1e-12)

    def test_forces_are_turned_too(self):
        straight = walking(1.2, belt=False)
        vectors = np.tile([1.0, 2.0, 3.0], (1000, 1))
        plate = Plate("1", np.eye(4, 3), vectors, vectors, vectors, vectors)
        recording = Recording(
            "walk.c3d", "project", straight.names, straight.markers, 100.0, 0.0, (plate,), 100.0
        )
        found, _ = turn_to_walking_direction(turned(recording, 90), LANDMARKS)
        np.testing.assert_allclose(found.plates[0].force, vectors, atol=1e-12)
        np.testing.assert_allclose(found.plates[0].moment, vectors, atol=1e-12)

    def test_a_person_who_is_in_view_for_a_third_of_the_trial(self):
        """Cameras run before somebody comes in, and after."""
        recording = walking(1.2, belt=False)
        recording.markers[:400] = np.nan
        recording.markers[730:] = np.nan
        recording.markers[400:600, 0] = np.nan
        found, _ = turn_to_walking_direction(turned(recording, 90), LANDMARKS)
        np.testing.assert_allclose(found.markers, recording.markers, atol=1e-12)
        recording.markers[..., [recording.names.index(LANDMARKS[f"{s}.{p}"]) for s in "RL"
                                for p in ("ASIS", "PSIS")], :] = np.nan  # fmt: skip
        with pytest.raises(RecordError, match="--trial-time"):
            turn_to_walking_direction(recording, LANDMARKS)

    def test_walking_backwards(self):
        recording = walking(-1.2, belt=False)
        with pytest.raises(RecordError, match=r"person faces 180° .*backwards"):
            turn_to_walking_direction(recording, LANDMARKS)
        names = [name for name in recording.names if not name.endswith("_ASIS")]
        fewer = recording.with_markers(names, recording.columns(names))
        with pytest.raises(RecordError, match=r"person faces 180° .*backwards"):
            turn_to_walking_direction(fewer, LANDMARKS)

    @pytest.mark.parametrize(
        "lost", [("Ankle",), ("Ankle", "Heel"), ("Ankle", "Heel", "MT1", "MT5")]
    )
    def test_other_axes_are_seen_without_ankles(self, lost):
        recording = walking(1.2, belt=False)
        names = [name for name in recording.names if name[2:] not in lost]
        fewer = recording.with_markers(names, recording.columns(names))
        turn_to_walking_direction(fewer, LANDMARKS)
        for axes in (np.diag([1.0, -1, -1]), about_y(90)):
            with pytest.raises(RecordError, match="other axes than the standing trial"):
                turn_to_walking_direction(fewer.turned(axes), LANDMARKS)

    def test_stairs_are_no_level_ground(self):
        recording = walking(0.6, belt=False)
        markers = recording.markers.copy()
        time = recording.time
        for i, name in enumerate(recording.names):
            # Half a stride apart each foot comes up by two steps of 0.17 m, in its swing.
            late = 0.5 if name[0] == "L" else 0.0
            if name[2:] in ("Heel", "MT1", "MT5", "Ankle"):
                cycles = time + late
                done = np.floor(cycles) + np.clip((cycles % 1.0 - 0.6) / 0.4, 0, 1)
                markers[:, i, 2] += 0.34 * done
            else:
                markers[:, i, 2] += 0.34 * time
        with pytest.raises(RecordError, match=r"both feet are off the ground at once.*stairs"):
            turn_to_walking_direction(recording.with_markers(recording.names, markers), LANDMARKS)

    @pytest.mark.parametrize("belt", [False, True], ids=["overground", "treadmill"])
    def test_who_leaves_the_ground_with_both_feet_does_not_walk(self, belt):
        """Whoever runs slowly, hops or jumps ahead, at any speed."""
        recording = walking(1.2, belt=belt)
        markers = recording.markers.copy()
        markers[..., 2] += 0.12 * np.maximum(0.0, np.sin(2 * np.pi * 2 * recording.time))[:, None]
        with pytest.raises(RecordError, match="both feet are off the ground at once"):
            turn_to_walking_direction(recording.with_markers(recording.names, markers), LANDMARKS)

    @pytest.mark.parametrize("drop", [-0.3, 0.25])
    def test_a_box_is_no_level_ground(self, drop):
        recording = walking(0.6, belt=False)
        markers = recording.markers.copy()
        for i, name in enumerate(recording.names):
            # In the swing of each foot that begins after the first stride.
            late = 0.5 if name[0] == "L" else 0.0
            begin = 1.0 + (0.6 - late) % 1.0
            markers[:, i, 2] += drop * np.clip((recording.time - begin) / 0.4, 0, 1)
        with pytest.raises(RecordError, match="both feet are off the ground at once"):
            turn_to_walking_direction(recording.with_markers(recording.names, markers), LANDMARKS)

    def test_still_in_the_laboratorys_axes(self):
        with pytest.raises(RecordError, match="still in the laboratory's axes"):
            turn_to_walking_direction(standing(), LANDMARKS)

    @pytest.mark.parametrize(
        ("folder", "static", "trial", "mode", "speed"),
        [
            ("wbds/raw", "WBDS01static1.c3d", "WBDS01walkT01.c3d", "treadmill", 0.49),
            ("wbds/raw", "WBDS01static1.c3d", "WBDS01walkO01Cmkr.txt", "overground", 1.26),
            (
                "opensim_rajagopal/ExpData",
                "static_walk_1.trc",
                "motion_capture_walk.trc",
                "overground",
                1.26,
            ),
        ],
    )
    def test_recorded_trials(self, gait_data, folder, static, trial, mode, speed):
        """Speeds of the two WBDS trials are those of the dataset; the third is the pelvis' travel
        in the file over its time. Rajagopal's person stands across the walkway.
        """
        same = {landmark: landmark for landmark in PERSON} | {"R.Toe": "R.Toe", "L.Toe": "L.Toe"}
        axes = detect_axes(read_recording(gait_data / folder / static), same)
        recording = read_recording(gait_data / folder / trial).turned(axes.rotation)
        found, text = turn_to_walking_direction(recording, same)
        assert mode in text
        shown = float(text.split(" m/s")[0].split()[-1])
        assert shown == pytest.approx(speed, abs=0.015)
        pelvis = found.marker("R.ASIS") - found.marker("R.PSIS")
        assert np.nanmean(pelvis[:, 0]) > 0.1  # faces where it goes
        sides = found.marker("L.ASIS") - found.marker("R.ASIS")
        assert np.nanmean(sides[:, 1]) > 0.2  # left is left
        assert np.nanmean(found.marker("R.ASIS")[:, 2]) > 0.8  # up is up
