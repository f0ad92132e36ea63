"""Markers of pelvis and heels that are taken off after standing, or that no trial has."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from made_up_session import SHORT, made_up_session

from gaitval.configuration import ProcessingSettings
from gaitval.errors import GaitvalError
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.scaling.rigid import carried
from gaitval.session.pelvis_markers import completed
from gaitval.session.session import work_out_trials

SPINES = ("R.ASIS", "L.ASIS")


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return made_up_session(tmp_path_factory.mktemp("session"), noise=1e-4, **SHORT)


def without(recording: Recording, *names: str) -> Recording:
    kept = [name for name in recording.names if name not in names]
    return recording.with_markers(kept, recording.columns(kept))


def read(session) -> tuple[Recording, Recording]:
    return read_recording(Path(session.standing)), read_recording(Path(session.walking))


def without_spines(folder: Path) -> Path:
    """A file of the set of WBDS without its anterior spines."""
    given = (files("gaitval.scaling") / "markersets/wbds.toml").read_text()
    file = folder / "mine.toml"
    file.write_text("\n".join(line for line in given.splitlines() if '.ASIS"' not in line))
    return file


def distance(recording: Recording, other: Recording, name: str) -> float:
    return float(np.nanmax(np.linalg.norm(recording.marker(name) - other.marker(name), axis=1)))


def test_spines_that_one_trial_lacks_are_carried(session):
    """A set does not say of every marker that somebody may take off that it stays on."""
    stand, walk = read(session)
    walks, flags = completed(load_marker_set("wbds"), stand, [walk, without(walk, *SPINES)])
    assert not flags
    assert walks[0] is walk
    for name in SPINES:
        assert distance(walks[1], walk, name) < 0.002


@pytest.mark.parametrize("set_name", ["wbds", "wbds without spines"])
def test_spines_that_no_trial_has_are_asked_for(session, tmp_path, set_name):
    """Crests show where they are to some degrees of tilt only, so they stand for nothing."""
    stand, walk = read(session)
    write_trc(tmp_path / "stand.trc", without(stand, *SPINES))
    write_trc(tmp_path / "walk.trc", without(walk, *SPINES))
    request = session.request.model_copy(
        update={
            "static": tmp_path / "stand.trc",
            "trials": (tmp_path / "walk.trc",),
            "marker_set": "wbds" if set_name == "wbds" else str(without_spines(tmp_path)),
        }
    )
    with pytest.raises(GaitvalError, match="ASIS"):
        work_out_trials(request, ProcessingSettings())


def test_two_markers_carry_nothing(session):
    stand, _ = read(session)
    shape = {name: stand.marker(name)[0] for name in ("R.PSIS", "L.PSIS")}
    found = carried(stand, shape, {"R.ASIS": stand.marker("R.ASIS")[0]})
    assert np.isnan(found["R.ASIS"]).all()


HEELS = ("R.Heel", "L.Heel")


@pytest.mark.parametrize("empty", [False, True], ids=["absent", "never seen"])
def test_heels_that_are_taken_off_after_standing_are_carried_by_their_feet(session, empty):
    """The ankle turns the malleoli against the foot, so they are millimetres off."""
    stand, walk = read(session)
    markers = walk.markers.copy()
    markers[:, [walk.names.index(name) for name in HEELS]] = np.nan
    given = walk.with_markers(walk.names, markers) if empty else without(walk, *HEELS)
    walks, flags = completed(load_marker_set("wbds"), stand, [given])
    assert [(flag.check, flag.where) for flag in flags] == [
        ("heel taken off", name) for name in HEELS
    ]
    for name in HEELS:
        assert 0.0 < distance(walks[0], walk, name) < 0.015
    assert completed(load_marker_set("wbds"), stand, [walk])[1] == []
