"""Words of messages that every part uses."""

import pytest

from gaitval.errors import count_of


@pytest.mark.parametrize(
    ("number", "said"), [(0, "0 studies"), (1, "1 study"), (2, "2 studies"), (21, "21 studies")]
)
def test_one_thing_and_many(number: int, said: str) -> None:
    assert count_of(number, "study", "studies") == said
    assert count_of(number, "step") == said.replace("study", "step").replace("studies", "steps")
