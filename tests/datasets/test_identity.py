"""Who a subject is: laboratory and person, whatever the files are called."""

import pytest

from gaitval.errors import SubjectError
from gaitval.subjects.identity import identity, with_identity
from gaitval.subjects.prediction.population import other_people
from gaitval.subjects.subject import Subject, make_subject
from gaitval.subjects.subject_file import builtin_subjects, load_subject, parse_subject

PERSON = load_subject("S05")
FIELDS = ("person =", "trial =", "laboratory =", "source =", "identifier =")


def old_file(identifier: str, source: str) -> Subject:
    """A subject file of a gaitval that had no person, trial and laboratory."""
    lines = PERSON.model_copy(update={"trials": ()}).to_toml().splitlines()
    kept = [line for line in lines if not line.startswith(FIELDS)]
    head = [f'identifier = "{identifier}"', f'source = "{source}"']
    return parse_subject("\n".join([*head, *kept]), "old.toml")


@pytest.mark.parametrize("sources", [("walk1.c3d", "walk2.c3d"), ("walk1.c3d", "walk1.c3d")])
def test_two_strangers_whose_files_have_common_names_are_two_people(sources):
    one, other = (old_file(name, source) for name, source in zip("AB", sources, strict=True))
    assert not one.is_person_of(other)
    assert len(other_people(one, [other, *builtin_subjects()])) == 11


def test_an_old_file_of_wbds_is_that_person_and_says_what_was_assumed():
    old = old_file("mine", "WBDS14 T05")
    assert (old.person, old.trial, old.laboratory) == ("WBDS14", "T05", "WBDS")
    assert old.is_person_of(PERSON)
    assert 'person "WBDS14", as WBDS14 T05 says' in old.guessed
    assert len(other_people(old, builtin_subjects())) == 9
    assert parse_subject(old.to_toml(), "again") == old


@pytest.mark.parametrize("source", ["WBDS01walkT01.c3d", "WBDS01walkT01.c3d, WBDS01walkT02.c3d"])
def test_an_old_import_of_wbds_under_its_file_name_is_not_among_its_other_people(source):
    old = old_file("wbds", source)
    assert old.is_person_of(load_subject("S01"))
    assert len(other_people(old, builtin_subjects())) == 9


def test_any_other_old_file_is_the_person_of_its_own_name():
    old = old_file("P07", "walk1.c3d, walk2.c3d odd")
    assert (old.person, old.trial, old.laboratory) == ("P07", "odd", "own")
    assert 'person "P07", the name of the subject; laboratory "own"' in old.guessed


def test_a_file_that_says_who_it_is_has_nothing_assumed():
    assert parse_subject(PERSON.to_toml(), "new").guessed is None
    assert "guessed" not in PERSON.to_toml()


@pytest.mark.parametrize(
    ("person", "laboratory", "sources", "recorded", "expected"),
    [
        ("P01", "Lyon", ["WBDS01walkT01.c3d"], ("x", "a.c3d"), ("P01", "Lyon", None)),
        (None, None, ["WBDS01walkT01.c3d"], ("IORlower_ISB", "a.c3d"), ("WBDS01", "WBDS", "as WB")),
        ("WBDS01", None, ["walk1.c3d"], ("", ""), ("WBDS01", "WBDS", "the dataset of that person")),
        (None, None, ["walk1.c3d"], ("HC002D", "a.c3d"), ("HC002D", "own", "the name in a.c3d")),
        (None, "Lyon", ["walk1.c3d"], ("", ""), ("mine", "Lyon", "the name of the subject")),
        (None, None, ["WBDS011.c3d"], ("", ""), ("mine", "own", "since none was given")),
    ],
)
def test_what_is_given_wins_and_what_is_not_is_assumed_and_said(
    person, laboratory, sources, recorded, expected
):
    found = identity(person, laboratory, sources=sources, name="mine", recorded=recorded)
    assert found[:2] == expected[:2]
    assert found.guessed is None if expected[2] is None else expected[2] in found.guessed


def test_a_trial_of_someone_else_is_refused_by_name_also_if_the_bodies_are_alike():
    alike = PERSON.on_trial("T03").model_copy(update={"trials": (), "person": "WBDS15"})
    alone = PERSON.model_copy(update={"trials": ()})
    with pytest.raises(SubjectError, match="WBDS14 of WBDS and WBDS15 of WBDS"):
        alone.with_trial(alike)
    assert alone.with_trial(alike.model_copy(update={"guessed": "person"})).trials


@pytest.mark.parametrize("person", ["wbds14", "WBDS 14", " WBDS14 ", "WBDS14"])
@pytest.mark.parametrize("laboratory", [None, "Wbds", " WBDS"])
def test_a_person_of_wbds_is_that_person_however_it_is_written(person, laboratory):
    found = identity(person, laboratory, sources=["walk.c3d"], name="mine")
    assert (found.person, found.laboratory) == ("WBDS14", "WBDS")


def test_capitals_and_blanks_make_no_other_person():
    one, same, other = (
        PERSON.model_copy(update={"laboratory": laboratory, "person": person})
        for laboratory, person in (("Lyon", "P 01"), ("lyon ", "p01"), ("Lyon", "P02"))
    )
    assert one.is_person_of(same)
    assert len(other_people(one, [same, other])) == 1


@pytest.mark.parametrize("person", [{"name": "WBDS14"}, 14, ["WBDS14"]])
@pytest.mark.parametrize("laboratory", ["WBDS", 3, None])
def test_a_person_that_is_no_text_is_refused_in_words(person, laboratory):
    values = PERSON.model_dump() | {"person": person, "laboratory": laboratory}
    with pytest.raises(SubjectError, match="person"):
        make_subject(with_identity(values), "own.toml")
