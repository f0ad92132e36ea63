"""The one declaration of an import's options: values as text, messages, what follows from it."""

from pathlib import Path

import pytest
import typer

from gaitval import cli
from gaitval.errors import ConfigurationError
from gaitval.session.importing.batch_person import below
from gaitval.session.request import ImportOptions, Request, checked
from gaitval.subjects.subject_file import load_subject

GIVEN = {"trials": ["walk1.c3d"], "sex": "F"}


def request_of(*trials: str, **about: object) -> Request:
    given = {"static": "stand.c3d", "mass": 60.0, "height": 1.7, "sex": "F", "identifier": "out"}
    return Request(**(given | {"trials": trials} | about))


def test_values_are_the_same_as_text_as_numbers_and_left_out():
    text = {"knee_width": "0.1,0.102", "ankle_width": "0.07", "static_time": "0.5:2"}
    numbers = {"knee_width": [0.1, 0.102], "ankle_width": 0.07, "static_time": [0.5, 2]}
    assert checked(ImportOptions, GIVEN | text) == checked(ImportOptions, GIVEN | numbers)
    assert checked(ImportOptions, GIVEN | {"forces": None, "marker_set": None}) == ImportOptions(
        **GIVEN
    )
    one = checked(ImportOptions, {"trials": "walk1.c3d", "sex": "F"})
    assert one.trials == (Path("walk1.c3d"),)


@pytest.mark.parametrize("text", ["2", "2:1", "nan:2", "a:b", "1:2:3", "0:inf"])
def test_a_window_is_two_times_the_second_later(text):
    with pytest.raises(ConfigurationError, match=f"static_time {text}: two times in s"):
        checked(ImportOptions, GIVEN | {"static_time": text})


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"knee_width": "1,2,3"}, r"^--knee_width 1,2,3: not a width\. Give metres"),
        ({"joint_centres": "best"}, r"^--joint_centres best: give harrington, .* or given\.$"),
        ({"prosthesis": "both"}, r"^--prosthesis both: give none, right or left\.$"),
        ({"floor": "low"}, r"^--floor = 'low': input should be a valid number"),
        ({"feet_flat": True}, r"^--feet_flat: unknown, did you mean --feet_not_flat\?$"),
        ({"sex": None}, r"^--sex: missing\. Give it: Selects the segment tables\.$"),
        ({"trials": []}, r"^--trials = .* at least 1 item"),
    ],
)
def test_a_message_names_the_option_what_was_seen_and_what_to_give(values, message):
    with pytest.raises(ConfigurationError, match=message):
        checked(ImportOptions, GIVEN | values, shown=lambda name: f"--{name}")


def test_parts_of_walks_are_the_same_as_text_and_as_numbers():
    one = checked(ImportOptions, GIVEN | {"trial_time": "0:2.5"})
    assert one.trial_time == ((0.0, 2.5),)
    assert checked(ImportOptions, GIVEN | {"trial_time": [0, 2.5]}) == one
    two = checked(ImportOptions, GIVEN | {"trial_time": ["0:2.5", "3:6"]})
    assert two.trial_time == ((0.0, 2.5), (3.0, 6.0))
    assert checked(ImportOptions, GIVEN | {"trial_time": [[0, 2.5], [3, 6]]}) == two
    with pytest.raises(ConfigurationError, match="trial_time 2:1: two times in s"):
        checked(ImportOptions, GIVEN | {"trial_time": "2:1"})


def test_a_part_is_of_its_trial():
    every = request_of("a.c3d", "b.c3d", trial_time=((0.0, 2.0),))
    assert [every.time_of(number) for number in (0, 1)] == [(0.0, 2.0)] * 2
    assert every.without_trial(0).time_of(0) == (0.0, 2.0)
    times = ((0.0, 2.0), (3.0, 5.5))
    own = request_of("a.c3d", "a.c3d", trial_time=times)
    assert [own.called(number) for number in (0, 1)] == ["a.c3d 0:2 s", "a.c3d 3:5.5 s"]
    assert own.without_trial(0).time_of(0) == (3.0, 5.5)
    assert request_of("a.c3d").time_of(0) is None


def test_every_option_has_a_help():
    assert not [name for name, each in ImportOptions.model_fields.items() if not each.description]


def test_what_is_seldom_needed_is_of_session_files_alone():
    options = typer.main.get_command(cli.app).commands["import"].params
    flags = {name for each in options for name in each.opts}
    assert {"--mass", "--plate", "--joint-centres"} <= flags
    assert not {"--aid", "--citation", "--floor"} & flags
    given = checked(ImportOptions, GIVEN | {"aid": "rail", "citation": "ours", "floor": 0.1})
    assert (given.aid, given.citation, given.floor) == ("rail", "ours", 0.1)


def test_paths_are_placed_and_nothing_else(tmp_path):
    options = ImportOptions(**GIVEN, static="stand.c3d", plate=("2=none",), marker_set="wbds")
    placed = below(tmp_path, options)
    assert placed.trials == (tmp_path / "walk1.c3d",)
    assert placed.static == tmp_path / "stand.c3d"
    assert (placed.plate, placed.marker_set) == ((("2", "none"),), "wbds")
    own = below(tmp_path, options.model_copy(update={"marker_set": "lab.toml"}))
    assert own.marker_set == str(tmp_path / "lab.toml")


def test_plates_and_feet_are_pairs_also_as_text():
    given = ImportOptions(**GIVEN, plate=["2=right", ("1", "left"), "3=none"])
    assert given.plate == (("2", "right"), ("1", "left"), ("3", "none"))
    with pytest.raises(ConfigurationError, match="plate"):
        checked(ImportOptions, GIVEN | {"plate": ["2=middle"]})


def test_a_session_without_one_of_its_trials():
    request = request_of("walk1.c3d", "walk2.c3d", identifier="A")
    forces = (Path("a"), Path("b"))
    request = request.model_copy(update={"static": request.trials[0], "forces": forces})
    left = request.without_trial(0)
    assert (left.trials, left.forces) == ((Path("walk2.c3d"),), (Path("b"),))
    assert left.stands_in_walk


@pytest.mark.parametrize(
    ("trials", "about", "assumed"),
    [
        (["WBDS01walkT01.c3d"], {}, "as WBDS01walkT01.c3d says"),
        (["walk.c3d"], {"person": "WBDS01"}, "the dataset of that person"),
        (["walk.c3d"], {"person": "WBDS01", "laboratory": "WBDS"}, None),
        (["walk.c3d"], {"recorded_name": ("WBDS01", "walk.c3d")}, "the name in walk.c3d"),
    ],
)
def test_a_recording_of_wbds_is_of_its_person_and_says_what_was_assumed(trials, about, assumed):
    subject = load_subject("S01")
    found = request_of(*trials, **about).who
    assert (found.person, found.laboratory) == (subject.person, subject.laboratory)
    assert found.guessed is None if assumed is None else assumed in found.guessed


@pytest.mark.parametrize(
    ("trials", "about", "name"),
    [
        (["WBDS01walkT03.c3d"], {}, "T03"),
        (["WBDS01walkO01Cmkr.txt"], {}, "O01C"),
        (["slow walk.c3d"], {}, "slowwalk"),
        (["walk1.c3d", "walk2.c3d"], {}, "walk1-and-1-more"),
    ],
)
def test_a_trial_is_called_as_its_file(trials, about, name):
    assert request_of(*trials, **about).trial == name


def test_trials_of_one_file_name_are_told_apart_by_their_folders():
    trials = (Path("walk1/c3dfile.c3d"), Path("walk2/c3dfile.c3d"), Path("walk2/other.c3d"))
    request = Request.model_construct(trials=trials)
    called = [request.called(number) for number in range(len(trials))]
    assert called == ["walk1/c3dfile.c3d", "walk2/c3dfile.c3d", "other.c3d"]
