"""The sample recording that the tests of the measurement import."""

import pytest

from gaitval.session.request import Request
from gaitval.subjects.sample import copy_sample


@pytest.fixture(scope="module")
def sample_request(tmp_path_factory) -> Request:
    """The package's sample as an import gets it."""
    folder = tmp_path_factory.mktemp("sample")
    copy_sample(folder)
    return Request(
        static=folder / "standing.c3d",
        trials=(folder / "walking.c3d",),
        identifier="sample",
        mass=64.95,
        height=1.53,
        sex="F",
    )
