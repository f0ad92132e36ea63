"""The first page has words for every reason of a light."""

from importlib import resources
from typing import get_args

from gaitval.metrics.curve_results import Reason


def test_every_reason_of_a_light_has_its_words():
    template = (resources.files("gaitval.reporting") / "sheet.html.j2").read_text(encoding="utf-8")
    (words,) = [line for line in template.splitlines() if line.startswith("{% set why = ")]
    lacking = [each for each in get_args(Reason) if f"'{each}': '" not in words]
    # what is believed needs no reason
    assert lacking == ["nearer"]
