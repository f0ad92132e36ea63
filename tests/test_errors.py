"""Words of messages that every part uses."""

import pytest

from gaitval.errors import count_of


@pytest.mark.parametrize(
    ("number", "message"), [(0, "0 studies"), (1, "1 study"), (2, "2 studies"), (21, "21 studies")]
)
def test_one_thing_and_many(number: int, message: str) -> None:
    assert count_of(number, "study", "studies") == message
    assert count_of(number, "step") == message.replace("study", "step").replace("studies", "steps")
