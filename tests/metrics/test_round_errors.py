"""A body that the search found is used only if the record supports it."""

import pytest

from gaitval.metrics.round_errors import Epsilon, RoundErrors


def errors(nominal: float | None, identified: float | None) -> RoundErrors:
    """Of a round whose walks have these epsilons; None for one that fell."""
    first, second = (
        None if total is None else Epsilon(angles=0.1, moments=0.1, forces=0.1, total=total)
        for total in (nominal, identified)
    )
    return RoundErrors(nominal=first, identified=second, scatter=None, floor=0.1)


@pytest.mark.parametrize(
    ("nominal", "identified", "expected"),
    [(0.3, 0.2, True), (0.3, 0.3, False), (0.2, 0.3, False)],
)
def test_the_walk_must_come_nearer_to_the_record(nominal, identified, expected):
    assert errors(nominal, identified).supported == expected


def test_a_walk_that_falls_supports_nothing():
    assert not errors(0.5, None).supported
    assert errors(None, 0.5).supported


def test_a_walk_that_fell_is_infinitely_far_from_the_record():
    assert errors(0.5, None).total == float("inf")
