"""Events by plates, markers and file side by side; two feet on one plate are known as a sum."""

import errno
import warnings
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from seen_figures import figure_of
from typer.testing import CliRunner

from gaitval.checks.landings import Landings, disagreements, landings
from gaitval.cli.events import events
from gaitval.configuration import load_configuration
from gaitval.coordinates import SIDES
from gaitval.errors import ArtefactError, RecordError
from gaitval.mocap.axes import detect_axes
from gaitval.mocap.foot_markers import foot_markers
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Event, Plate
from gaitval.reporting.landings_picture import draw
from gaitval.scaling.marker_sets import recognise
from gaitval.session.read import named, prepared

PROCESSING = load_configuration().processing
MASS_KG = 64.95


@pytest.fixture(scope="module")
def walk(sample_request):
    """The sample's walk in the project's axes, and its landmarks."""
    still = read_recording(sample_request.static, plates=False)
    known = recognise(still.names)
    axes = detect_axes(named(still, known), dict(known.landmarks))
    file = sample_request.trials[0]
    turned = named(read_recording(file), known).turned(axes.rotation)
    return prepared(turned, known, PROCESSING, file), dict(known.landmarks)


@pytest.fixture(scope="module")
def found(walk):
    return landings(*walk, PROCESSING)


def on_one_plate(recording):
    """The same walk on one plate that is as large as both, and carries what both carry."""
    plates = recording.plates
    force = np.sum([plate.force for plate in plates], axis=0)
    moment = np.sum([plate.moment for plate in plates], axis=0)
    corners = np.vstack([plate.corners for plate in plates])
    (x0, y0, z0), (x1, y1, _) = corners.min(axis=0), corners.max(axis=0)
    vertical = np.where(force[:, 2] > 20.0, force[:, 2], np.nan)
    pressure = np.stack(
        [-moment[:, 1] / vertical, moment[:, 0] / vertical, 0.0 * vertical + z0], axis=1
    )
    square = np.array([[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0]])
    one = Plate("1", square, force, pressure, np.zeros_like(force), moment)
    return replace(recording, plates=(one,))


def test_plates_and_markers_of_a_sound_walk_agree(found):
    assert set(found.events) == {"plates", "markers"}
    assert list(disagreements(found)) == []
    assert not found.shared.any()


def test_the_sum_of_the_plates_is_the_bodys_weight(found):
    carried = found.carried()
    assert len(carried) >= 4
    assert np.allclose(carried, MASS_KG, rtol=0.02)


def test_both_feet_on_one_plate_are_known_as_a_sum(walk, found):
    """Nothing is known of either foot then, but all strides carry what they did."""
    recording, landmarks = walk
    one = landings(on_one_plate(recording), landmarks, PROCESSING)
    assert one.shared.mean() > 0.1
    assert np.allclose(one.total, found.total, atol=25.0)
    assert np.allclose(one.carried(), found.carried(), atol=1.0)


def test_a_foot_on_no_plate_makes_the_sum_incomplete(walk):
    recording, landmarks = walk
    half = landings(replace(recording, plates=recording.plates[:1]), landmarks, PROCESSING)
    assert 0.1 < half.complete.mean() < 0.5
    assert half.carried() == ()


def without_places(recording):
    """The same plates as OpenSim's files have them: each sample's pressure, and no corners."""
    plates = [replace(each, corners=np.full((4, 3), np.nan)) for each in recording.plates]
    return replace(recording, plates=tuple(plates))


def test_plates_without_corners_carry_the_body_too(walk, found):
    recording, landmarks = walk
    nowhere = landings(without_places(recording), landmarks, PROCESSING)
    assert len(nowhere.carried()) >= len(found.carried())
    assert np.allclose(nowhere.carried(), MASS_KG, rtol=0.02)


def test_a_foot_on_no_plate_is_missed_without_corners_too(walk):
    recording, landmarks = walk
    half = without_places(replace(recording, plates=recording.plates[:1]))
    assert landings(half, landmarks, PROCESSING).carried() == ()


def test_a_picture_without_a_time_on_plates_alone_has_no_empty_legend(walk, found, tmp_path):
    nothing = np.zeros_like(found.complete)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        alone = replace(found, complete=nothing, shared=nothing)
        draw(alone, walk[1], tmp_path / "a.svg", "a walk")


@pytest.mark.parametrize("late", [0.07, -0.06])
def test_a_late_event_of_the_file_is_named_with_how_late_it_is(walk, found, late):
    recording, landmarks = walk
    events = list(found.events["markers"])
    (number,) = [i for i, e in enumerate(events) if 1.5 < e.time < 2.5 and e.side == "left"][:1]
    events[number] = replace(events[number], time=events[number].time + late)
    other = landings(replace(recording, events=tuple(events)), landmarks, PROCESSING)
    apart = [each for each in disagreements(other) if each.second == "file"]
    assert {each.side for each in apart} == {"left"}
    assert all(np.isclose(each.late, late, atol=0.03) for each in apart)
    assert ("later" if late > 0 else "earlier") in str(apart[0])


def test_an_event_that_the_markers_lack_is_named(walk, found):
    recording, landmarks = walk
    extra = Event(found.events["markers"][4].time + 0.3, SIDES[0], "heel_strike")
    events = (*found.events["markers"], extra)
    other = landings(replace(recording, events=events[:-2]), landmarks, PROCESSING)
    messages = [str(each) for each in disagreements(other)]
    assert messages
    assert all("by the file" in each or "the file shows nothing there" in each for each in messages)


def test_the_command_draws_and_says_what_it_saw(sample_request, tmp_path):
    picture = tmp_path / "events.svg"
    given = [str(sample_request.trials[0]), "--standing", str(sample_request.static)]
    done = CliRunner().invoke(events.app, [*given, "--out", str(picture)])
    assert done.exit_code == 0, done.output
    assert "0 on which two of them disagree" in done.output
    assert "these carry 64.9 kg" in done.output
    assert picture.stat().st_size > 10_000
    wrong = CliRunner().invoke(events.app, [*given, "--out", str(tmp_path / "events.jpg")])
    assert isinstance(wrong.exception, RecordError)


@pytest.mark.parametrize("disk", ["well", "full"])
def test_a_picture_replaces_a_link_whole_or_not_at_all(walk, found, tmp_path, monkeypatch, disk):
    theirs, picture = tmp_path / "theirs.svg", tmp_path / "e.svg"
    theirs.write_text("theirs")
    picture.symlink_to(theirs)
    if disk == "full":

        def half(_, path, **__):
            path.write_text("<svg")
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr(Figure, "savefig", half)
        with pytest.raises(ArtefactError, match=r"e\.svg: cannot be written: .* no space"):
            draw(found, walk[1], picture, "a walk")
        assert picture.readlink() == theirs
    else:
        draw(found, walk[1], picture, "a walk")
        assert picture.read_text().startswith("<?xml")
        assert not picture.is_symlink()
    assert theirs.read_text() == "theirs"
    assert {each.name for each in tmp_path.iterdir()} == {"theirs.svg", "e.svg"}


def test_the_command_says_that_it_knows_no_mass(sample_request, tmp_path, monkeypatch):
    monkeypatch.setattr(Landings, "carried", lambda _: ())
    given = [str(sample_request.trials[0]), "--standing", str(sample_request.static)]
    done = CliRunner().invoke(events.app, [*given, "--out", str(tmp_path / "a.svg")])
    assert "No stride is on plates as a whole" in done.output


def test_an_event_of_the_file_alone_is_named_once(walk, found):
    recording, landmarks = walk
    extra = Event(found.events["markers"][4].time + 0.3, SIDES[0], "heel_strike")
    other = landings(
        replace(recording, events=(*found.events["markers"], extra)), landmarks, PROCESSING
    )
    messages = [each for each in disagreements(other) if each.first == "file"]
    assert [(each.time, each.second) for each in messages] == [(extra.time, "markers")]
    assert "the markers show nothing there" in str(messages[0])


def test_the_picture_shows_the_events_of_each_method_under_their_own_foot(walk, found, tmp_path):
    recording, landmarks = walk
    figure = figure_of(lambda: draw(found, landmarks, tmp_path / "a.svg", "a walk"))
    for axes, side in zip(figure.axes, SIDES, strict=False):
        assert axes.get_title() == f"{side} foot"
        time = recording.start + np.arange(len(recording.markers)) / recording.marker_rate
        foot = foot_markers(recording, landmarks)[side]
        for name, values in (("heel", foot.heel), ("forefoot", foot.front)):
            (line,) = [each for each in axes.lines if each.get_label() == name]
            np.testing.assert_allclose(line.get_xdata(), time)
            height = 1000.0 * (values[:, 2] - np.nanmin(values[:, 2]))
            np.testing.assert_allclose(line.get_ydata(), height)
        rows = {
            each.get_text(): each.xy[1] for each in axes.texts if each.get_text() in found.events
        }
        for method, its in found.events.items():
            for word, kind in (("▼", "heel_strike"), ("▲", "toe_off")):
                shown = [
                    each.get_position()[0] for each in axes.texts
                    if each.get_text() == word and each.get_position()[1] == rows[method]
                ]  # fmt: skip
                expected = [each.time for each in its if (each.side, each.kind) == (side, kind)]
                np.testing.assert_allclose(sorted(shown), sorted(expected))
        assert axes.get_ylim()[0] < 0.0 < axes.get_ylim()[1]
        assert axes.get_xlim()[0] < axes.get_xlim()[1]
    total = next(each for each in figure.axes[2].lines if len(each.get_xdata()) == len(found.time))
    np.testing.assert_array_equal(total.get_ydata(), found.total[:, 2])
    assert figure.get_suptitle().splitlines()[1].startswith("▼ lands, ▲ leaves")
