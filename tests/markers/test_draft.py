"""Markers are found by their places, whatever they are called, and by names where these agree."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawn_markers import LEGS, NAMES, drawn_person

from gaitval.datasets.subject_file import load_subject
from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording
from gaitval.mocap.trc import read_trc
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.scaling.markers.body import Site, sites
from gaitval.scaling.markers.draft import Draft, Guess, draft_markers
from gaitval.scaling.markers.files import as_toml
from gaitval.scaling.markers.spines import CRESTS


@pytest.mark.slow
def test_a_person_without_names_is_recognised_in_any_axes() -> None:
    found = draft_markers(drawn_person(np.random.default_rng(3), named=False))
    assert not found.names_count
    assert np.isnan(found.names_agree)
    assert [guess.site.label for guess in found.guesses if guess.site] == LEGS


@pytest.mark.slow
def test_names_are_used_where_they_agree_and_make_it_more_certain(
    stander: Recording, drafted: Draft
) -> None:
    unnamed = replace(stander, names=tuple(f"M{k}" for k in range(len(LEGS))))
    alone = draft_markers(unnamed)
    assert drafted.names_count
    assert sum(guess.used for guess in drafted.guesses) > sum(guess.used for guess in alone.guesses)
    places = {guess.name: guess.site and guess.site.label for guess in drafted.guesses}
    assert places == {NAMES[label]: label for label in LEGS}


@pytest.mark.slow
def test_exchanged_labels_are_seen_and_the_places_count(stander: Recording) -> None:
    mixed = np.random.default_rng(1).permutation(np.array(stander.names, dtype=object))
    found = draft_markers(replace(stander, names=tuple(mixed)))
    assert not found.names_count
    assert found.names_agree < 0.6
    assert [guess.site.label for guess in found.guesses if guess.site] == LEGS


@pytest.mark.slow
@pytest.mark.parametrize("how", ["mirror image", "sides exchanged in the names"])
def test_a_mirror_image_and_exchanged_sides_are_not_told_apart(
    stander: Recording, how: str
) -> None:
    if how == "mirror image":
        found = draft_markers(replace(stander, markers=stander.markers * [1.0, 1.0, -1.0]))
    else:
        other = {"R": "L", "L": "R"}
        names = tuple(other.get(name[0], name[0]) + name[1:] for name in stander.names)
        found = draft_markers(replace(stander, names=names))
    assert found.mirrored
    assert not any(guess.used for guess in found.guesses)


@pytest.mark.slow
def test_two_exchanged_labels_are_never_used_unseen(stander: Recording) -> None:
    names = list(stander.names)
    one, other = names.index("RKNE"), names.index("LKNE")
    names[one], names[other] = names[other], names[one]
    found = {
        guess.name: guess for guess in draft_markers(replace(stander, names=tuple(names))).guesses
    }
    for name, place in (("RKNE", "L.Knee"), ("LKNE", "R.Knee")):
        assert found[name].site is not None
        assert found[name].site.label == place
        assert found[name].named is False
        assert not found[name].used
    assert found["RANK"].used


def test_a_marker_on_no_known_place_is_left_to_the_user() -> None:
    assert not Guess("X", None, None, 1.0, None, np.zeros(3)).used


def test_the_file_is_a_marker_set_that_the_import_reads(drafted: Draft, tmp_path: Path) -> None:
    path = tmp_path / "drafted.toml"
    path.write_text(as_toml(drafted, 'A "title"', "drafted"), encoding="utf-8")
    read = load_marker_set(path)
    used = [guess for guess in drafted.guesses if guess.used]
    assert set(read.markers) == {guess.name for guess in used}
    for guess in used:
        assert guess.site is not None
        assert read.markers[guess.name].segment == guess.site.segment
        assert read.markers[guess.name].landmark == guess.site.landmark
    commented = [
        line for line in path.read_text(encoding="utf-8").splitlines() if "= { seg" in line
    ]
    assert len(commented) == len(drafted.guesses)


def test_too_few_markers_are_refused(stander: Recording) -> None:
    with pytest.raises(RecordError, match="5 markers are seen, which is too few"):
        draft_markers(stander.with_markers(stander.names[:5], stander.markers[:, :5]))


@pytest.mark.slow
def test_a_standing_trial_of_wbds_is_drafted_without_its_names(wbds_static: Path) -> None:
    standing = read_trc(wbds_static)
    known = load_marker_set("wbds")
    names = known.renamed(standing.names)
    kept = [i for i, name in enumerate(standing.names) if name in names]
    markers = standing.with_markers([f"M{i}" for i in kept], standing.markers[:, kept])
    right = 0
    for i, guess in zip(kept, draft_markers(markers).guesses, strict=True):
        definition = known.markers[names[standing.names[i]]]
        site = guess.site
        # Crests are landmarks where nothing else shows the spines.
        landmark = None if definition.landmark in CRESTS else definition.landmark
        same = site is not None and (site.segment, site.landmark) == (definition.segment, landmark)
        right += same
        assert same or not guess.used
    assert right >= 0.92 * len(kept)


def test_names_of_files_and_markers_cannot_write_lines_of_their_own() -> None:
    """A C3D label and a file's name may have anything in them."""
    name = 'HJC\n"RASI" = { segment = "thigh_r" }\n#JC'
    draft = Draft((), (name,), 1.0, 1.7, moved=False)
    for title in ("walk😀.c3d", "a\x7f.c3d", 'b"\n[markers]'):
        found = tomllib.loads(as_toml(draft, title, title))
        assert found == {"title": title, "source": title, "markers": {}}


@pytest.mark.slow
def test_a_pelvis_without_spines_is_drafted_by_its_crests(tmp_path: Path) -> None:
    """Of a real person; the file has the crests as landmarks, which an import reads."""
    known = load_subject("S05").markers
    kept = [name for name in known if "ASIS" not in name]
    points = np.tile([known[name] for name in kept], (50, 1, 1))
    found = draft_markers(Recording("stand.trc", "project", tuple(kept), points, 100.0))
    assert found.by_crests
    assert found.recognised
    file = tmp_path / "set.toml"
    file.write_text(as_toml(found, "title", "source"))
    landmarks = load_marker_set(str(file)).landmarks
    assert landmarks["R.Crest"] == "R.Iliac.Crest"
    assert landmarks["L.Crest"] == "L.Iliac.Crest"
    # With spines the crests only track, as ever.
    whole = replace(found, guesses=(*found.guesses, replace(found.guesses[0], site=_spine())))
    assert not whole.by_crests
    assert "R.Crest" not in as_toml(whole, "title", "source").replace("# R.Crest", "")


def _spine() -> Site:
    return next(site for site in sites() if site.label == "R.ASIS")
