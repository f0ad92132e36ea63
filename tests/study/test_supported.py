"""A body that the search found is used only if the record supports it."""

import pytest

from gaitval.study.stages import supported


@pytest.mark.parametrize(
    ("nominal", "identified", "expected"),
    [(0.3, 0.2, True), (0.3, 0.3, False), (0.2, 0.3, False)],
)
def test_the_walk_must_come_nearer_to_the_record(nominal, identified, expected):
    errors = {"nominal": {"total": nominal}, "identified": {"total": identified}}
    assert supported(errors) == expected


def test_a_walk_that_falls_supports_nothing():
    stands = {"total": 0.5}
    assert not supported({"nominal": stands, "identified": None})
    assert supported({"nominal": None, "identified": stands})
