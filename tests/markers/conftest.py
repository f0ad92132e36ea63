"""Recordings of people whose markers' places are known: drawn, not measured."""

from pathlib import Path

import numpy as np
import pytest
from drawn_markers import drawn_person

from gaitval.mocap.recording import Recording
from gaitval.scaling.markers.draft import Draft, draft_markers


@pytest.fixture(scope="session")
def stander() -> Recording:
    """A person of 1.7 m who stands in a laboratory with y up and faces between two of its axes."""
    return drawn_person(np.random.default_rng(7))


@pytest.fixture(scope="session")
def drafted(stander: Recording) -> Draft:
    """What is drafted of that person, by places and names; it takes seconds."""
    return draft_markers(stander)


@pytest.fixture
def wbds_static(gait_data: Path) -> Path:
    """The standing trial of WBDS01."""
    return gait_data / "wbds" / "raw" / "WBDS01static1.trc"
