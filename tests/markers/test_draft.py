"""A marker set drafted from names, as its file has it."""

import tomllib
from pathlib import Path

import pytest

from gaitval.scaling.marker_sets import builtin_marker_sets, load_marker_set
from gaitval.scaling.markers.draft import Draft, draft_of


@pytest.mark.parametrize("marker_set", builtin_marker_sets(), ids=lambda each: each.name)
def test_names_of_the_built_in_sets_are_drafted_as_the_sets_have_them(
    marker_set, tmp_path: Path
) -> None:
    draft = draft_of(list(marker_set.markers))
    assert len(draft.sure) >= 0.7 * len(marker_set.markers)
    for name, drafted in draft.sure.items():
        known = marker_set.markers[name]
        assert drafted.segment == known.segment, name
        assert (
            None in (drafted.landmark, known.landmark)
            or drafted.landmark == known.landmark
            or (known.landmark.endswith((".Thigh", ".Shank")))
        ), name
    path = tmp_path / "drafted.toml"
    path.write_text(draft.as_toml('A "title"', "drafted"), encoding="utf-8")
    assert load_marker_set(path).markers == draft.sure


def test_what_names_do_not_say_is_left_to_the_user_as_comments() -> None:
    draft = draft_of(["RHEE", "LHEE", "RTOE", "ASIS", "R.Knee", "RKNE", "M17", "RFIN"])
    assert set(draft.sure) == {"RHEE", "LHEE"}
    comments = [line for line in draft.as_toml("t", "s").splitlines() if line.startswith('# "')]
    assert comments == [
        '# "RTOE" = { segment = "foot_r", landmark = "R.MT2", weight = 2.0 }  # or R.Toe, R.MT1',
        '# "ASIS" = { segment = "pelvis", landmark = "R.ASIS", weight = 5.0 }  # or L.ASIS',
        '# "R.Knee" = { segment = "thigh_r", landmark = "R.Knee" }',
        '# "RKNE" = { segment = "thigh_r", landmark = "R.Knee" }',
        '# "M17" = { segment = "?" }',
        '# "RFIN" = { segment = "?" }',
    ]


def test_names_of_files_and_markers_cannot_write_lines_of_their_own() -> None:
    """A C3D label and a file's name may have anything in them."""
    name = 'HJC\n"RASI" = { segment = "thigh_r" }\n#JC'
    draft = Draft({}, {name: ()})
    for title in ("walk😀.c3d", "a\x7f.c3d", 'b"\n[markers]'):
        found = tomllib.loads(draft.as_toml(title, title))
        assert found == {"title": title, "source": title, "markers": {}}
