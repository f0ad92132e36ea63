"""A made-up session, and its walk as a laboratory with plates has it."""

from dataclasses import replace
from pathlib import Path

import pytest
from format_files import laboratory
from made_up_session import MadeUpSession, made_up_session

from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording


@pytest.fixture(scope="session")
def session(tmp_path_factory: pytest.TempPathFactory) -> MadeUpSession:
    return made_up_session(
        tmp_path_factory.mktemp("session"), noise=1e-4, seconds=3.0, rate=100.0, per_frame=5,
        standing_frames=20,
    )  # fmt: skip


@pytest.fixture(scope="session")
def trial(session: MadeUpSession) -> Recording:
    """In the laboratory's axes, with a gap in one marker."""
    found = laboratory(session.walking, session.forces)
    markers = found.markers.copy()
    markers[10:14, 2] = float("nan")
    return replace(found, markers=markers)


@pytest.fixture(scope="session")
def standing(session: MadeUpSession) -> Recording:
    """With y up, as it was written."""
    return read_recording(Path(session.standing))
