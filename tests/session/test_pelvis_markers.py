"""A pelvis with markers on crests and rear, and none on the anterior spines."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_up_session import SHORT, made_up_session

from gaitval.configuration import ProcessingSettings
from gaitval.errors import RecordError
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.scaling.marker_set import MarkerDefinition, MarkerSet
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.scaling.markers.spines import spines_of
from gaitval.scaling.rigid import carried
from gaitval.session.pelvis_markers import FROM_CRESTS, completed
from gaitval.session.session import work_out_trials
from gaitval.subjects.subject_file import load_subject

SPINES = ("R.ASIS", "L.ASIS")
CRESTS = {"R.Iliac.Crest": "R.Crest", "L.Iliac.Crest": "L.Crest"}


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return made_up_session(tmp_path_factory.mktemp("session"), noise=1e-4, **SHORT)


def of_crests(*, static_spines: bool = False, without: tuple[str, ...] = ()) -> MarkerSet:
    """The set of WBDS with its crests as landmarks, and without spines or with them in standing."""
    given = load_marker_set("wbds")
    markers = {
        name: each.model_copy(update={"landmark": CRESTS.get(name, each.landmark)})
        for name, each in given.markers.items()
        if name not in without and (static_spines or name not in SPINES)
    }
    for name in SPINES if static_spines else ():
        markers[name] = MarkerDefinition(segment="pelvis", landmark=name, static_only=True)
    return replace(given, markers=markers)


def without(recording: Recording, *names: str) -> Recording:
    kept = [name for name in recording.names if name not in names]
    return recording.with_markers(kept, recording.columns(kept))


def read(session) -> tuple[Recording, Recording]:
    """Standing and walking, with the crests where those of S05 are, on whom the body is made."""
    known = {n: np.asarray(at) for n, at in load_subject("S05").markers.items()}
    shape = {name: known[name] for name in (*SPINES, "R.PSIS", "L.PSIS")}
    found = []
    for file in (session.standing, session.walking):
        recording = read_recording(Path(file))
        crests = carried(recording, shape, {name: known[name] for name in CRESTS})
        markers = recording.markers.copy()
        for name, path in crests.items():
            markers[:, recording.names.index(name)] = path
        found.append(recording.with_markers(recording.names, markers))
    return found[0], found[1]


@pytest.mark.parametrize("rear", [("R.PSIS", "L.PSIS"), ("Sacrum",)])
def test_the_spines_of_ten_people_are_where_they_are_said_to_be(rear):
    """Real pelvises, of which the drawn ones know nothing."""
    off = []
    for number in range(1, 11):
        known = {
            CRESTS.get(name, name): np.asarray(at)
            for name, at in load_subject(f"S{number:02d}").markers.items()
        }
        known["Sacrum"] = (known["R.PSIS"] + known["L.PSIS"]) / 2
        found = spines_of({name: known[name] for name in (*CRESTS.values(), *rear)})
        assert found is not None
        assert found.rear == rear
        for name in SPINES:
            off.append(np.linalg.norm(found.places[name] - known[name]) / np.linalg.norm(found.sd))
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 1.2
    assert max(off) < 2.0


def distance(recording: Recording, other: Recording, name: str) -> float:
    return float(np.nanmax(np.linalg.norm(recording.marker(name) - other.marker(name), axis=1)))


def test_spines_from_crests_are_within_what_is_said(session):
    stand, walk = read(session)
    found = completed(of_crests(), without(stand, *SPINES), [without(walk, *SPINES)])
    (flag,) = found.flags
    assert flag.check == FROM_CRESTS
    assert 3.0 < flag.value < 12.0
    for name in SPINES:
        sd = found.placement_sd[name]
        assert 0.01 < sd < 0.03
        for made, true in ((found.standing, stand), (found.walking[0], walk)):
            assert 0.0 < distance(made, true, name) < 2.5 * sd
    # The crests only track: no model has a place for them.
    assert not {"R.Crest", "L.Crest"} & set(found.marker_set.landmarks)
    assert found.marker_set.landmarks["R.ASIS"] == "R.ASIS"


def test_a_set_whose_spines_nobody_marked_takes_its_crests(session):
    """As it is shipped: the set names the spines, and the trials have none."""
    stand, walk = read(session)
    found = completed(load_marker_set("wbds"), without(stand, *SPINES), [without(walk, *SPINES)])
    assert [flag.check for flag in found.flags] == [FROM_CRESTS]
    for name in SPINES:
        assert distance(found.walking[0], walk, name) < 2.5 * found.placement_sd[name]
    whole = completed(load_marker_set("wbds"), stand, [walk])
    assert not whole.flags
    assert whole.walking == (walk,)


def test_spines_that_one_trial_lacks_are_carried(session):
    """A set does not say of every marker that somebody may take off that it stays on."""
    stand, walk = read(session)
    found = completed(load_marker_set("wbds"), stand, [walk, without(walk, *SPINES)])
    assert not found.flags
    assert found.walking[0] is walk
    for name in SPINES:
        assert distance(found.walking[1], walk, name) < 0.002


def test_crests_beside_spines_change_nothing(session):
    stand, walk = read(session)
    given = of_crests(static_spines=True)
    spines = {n: d.model_copy(update={"static_only": False}) for n, d in given.markers.items()}
    found = completed(replace(given, markers=spines), stand, [walk])
    assert found.standing is stand
    assert found.walking == (walk,)
    assert not found.flags
    assert not {"R.Crest", "L.Crest"} & set(found.marker_set.landmarks)


def test_spines_that_are_taken_off_are_carried(session):
    """To the noise of the markers that stay, turned as the pelvis is."""
    stand, walk = read(session)
    found = completed(of_crests(static_spines=True), stand, [without(walk, *SPINES)])
    assert not found.flags
    for name in SPINES:
        assert distance(found.walking[0], walk, name) < 0.003


def test_crests_alone_are_refused(session):
    stand, walk = read(session)
    rear = ("R.PSIS", "L.PSIS")
    with pytest.raises(RecordError, match=r"Sacrum.*R\.Iliac\.Crest"):
        completed(of_crests(without=rear), without(stand, *SPINES), [without(walk, *SPINES)])


def test_two_markers_carry_nothing(session):
    stand, _ = read(session)
    shape = {name: stand.marker(name)[0] for name in ("R.PSIS", "L.PSIS")}
    found = carried(stand, shape, {"R.ASIS": stand.marker("R.ASIS")[0]})
    assert np.isnan(found["R.ASIS"]).all()


@pytest.mark.slow
def test_a_session_without_spines_is_worked_out(session, tmp_path):
    """Angles as with spines, but for the zero of the pelvis, which is told to be uncertain."""
    stand, walk = read(session)
    lines = "".join(
        f'"{name}" = {{ segment = "{each.segment}"'
        + (f', landmark = "{each.landmark}"' if each.landmark else "")
        + f", weight = {each.weight}"
        + (", static_only = true" if each.static_only else "")
        + (", optional = true" if each.optional else "")
        + " }\n"
        for name, each in of_crests().markers.items()
    )
    file = tmp_path / "crests.toml"
    file.write_text(f'title = "crests"\nsource = "test"\n[markers]\n{lines}')
    write_trc(tmp_path / "stand.trc", without(stand, *SPINES))
    write_trc(tmp_path / "walk.trc", without(walk, *SPINES))
    write_trc(tmp_path / "stand_whole.trc", stand)
    write_trc(tmp_path / "walk_whole.trc", walk)
    whole = session.request.model_copy(
        update={"static": tmp_path / "stand_whole.trc", "trials": (tmp_path / "walk_whole.trc",)}
    )
    less = session.request.model_copy(
        update={
            "static": tmp_path / "stand.trc",
            "trials": (tmp_path / "walk.trc",),
            "marker_set": str(file),
        }
    )
    known, found = (work_out_trials(each, ProcessingSettings()) for each in (whole, less))
    assert any(flag.check == FROM_CRESTS for _, flag in found.warnings)
    for name, curve in known.angles.items():
        off = np.degrees(found.angles[name].mean - curve.mean)
        assert np.abs(off - off.mean()).max() < 2.0, name


HEELS = ("R.Heel", "L.Heel")


@pytest.mark.parametrize("empty", [False, True], ids=["absent", "never seen"])
def test_heels_that_are_taken_off_after_standing_are_carried_by_their_feet(session, empty):
    """The ankle turns the malleoli against the foot, so they are millimetres off."""
    stand, walk = read(session)
    markers = walk.markers.copy()
    markers[:, [walk.names.index(name) for name in HEELS]] = np.nan
    given = walk.with_markers(walk.names, markers) if empty else without(walk, *HEELS)
    found = completed(load_marker_set("wbds"), stand, [given])
    assert [(flag.check, flag.where) for flag in found.flags] == [
        ("heel taken off", name) for name in HEELS
    ]
    for name in HEELS:
        assert 0.0 < distance(found.walking[0], walk, name) < 0.015
    assert completed(load_marker_set("wbds"), stand, [walk]).flags == ()
