"""Every finding says what was seen, once for the whole table: other tests ask for names only."""

import string

import numpy as np
import pytest

from gaitval.findings import FINDINGS, Finding, Seen
from gaitval.findings.finding import Figure

OWN = ("value", "limit", "low", "high")


def words_of(finding: Finding) -> dict[str, tuple[object, str]]:
    """A number for each word that is shown in a format, else a text; and how it is shown."""
    parts = string.Formatter().parse(f"{finding.sentence} {finding.remedy}")
    return {
        name: (0.123, format(Figure(0.123), spec)) if spec else (f"<{name}>", f"<{name}>")
        for _, name, spec, _ in parts
        if name and name not in OWN
    }


def beyond(finding: Finding) -> list[tuple[float, float]]:
    """A value below the least or above the largest, each with that limit."""
    sides = ((finding.low, -1.0), (finding.high, 1.0))
    return [(end + way * (abs(end) or 1.0), end) for end, way in sides if np.isfinite(end)]


@pytest.mark.parametrize("finding", FINDINGS, ids=lambda finding: finding.name)
def test_a_value_beyond_a_limit_is_said_with_all_that_was_seen(finding):
    words = words_of(finding)
    given = {name: value for name, (value, _) in words.items()}
    cases = beyond(finding)
    assert cases
    for value, limit in cases:
        flag = finding.flag(Seen(value, "somewhere", given))
        assert (flag.check, flag.where, flag.value) == (finding.name, "somewhere", value)
        assert (flag.limit, flag.unit) == (limit, finding.unit)
        assert all(shown in flag.message for _, shown in words.values())
        assert not {"{", "}"} & {*flag.message}
        assert flag.message[-1] not in ". "
        assert ".." not in flag.message
        least, most = finding.impossible
        assert flag.certain == (not least <= value <= most)
        assert finding.flag(Seen(limit, "somewhere", given)) is None
    assert finding.flag(Seen(float("nan"), "somewhere", given)) is None


def test_a_place_may_have_limits_of_its_own_and_be_certain_by_more_than_its_value():
    (finding,) = (each for each in FINDINGS if each.name == "weight")
    inside = Seen(1.3, "all plates", limits=(1.0, 1.5))
    assert finding.flag(inside) is None
    assert finding.flag(inside._replace(limits=(1.0, 1.25), certain=True)).certain


def test_no_two_findings_have_a_name_and_one_is_hidden_by_those_before_it():
    names = [finding.name for finding in FINDINGS]
    assert len({*names}) == len(names)
    for number, finding in enumerate(FINDINGS):
        assert {*finding.hidden_by} & {*names} <= {*names[:number]}
