"""`gaitval body` takes a session of the same person alone."""

from pathlib import Path

import pytest

from gaitval.cli.body import _check_same
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ArtefactError


def test_a_session_of_somebody_else_is_refused():
    person = load_subject(5)
    own = {"mass_kg": person.mass_kg, "height_m": person.height_m, "sex": person.sex}
    _check_same(person, own, Path("mine"))
    for change in ({"mass_kg": 80.0}, {"height_m": 1.8}, {"sex": "M"}):
        with pytest.raises(ArtefactError, match="mine is a session of somebody else than S05"):
            _check_same(person, own | change, Path("mine"))
