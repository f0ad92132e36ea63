"""An audit that could not be made is not taken for one that found nothing."""

import audit
import pytest

CLEAN = {"name": "jinja2", "version": "3.1.6", "vulns": []}
WEAK = {
    "name": "jinja2",
    "version": "3.1.0",
    "vulns": [{"id": "CVE-2024-22195", "fix_versions": ["3.1.3"]}],
}
UNKNOWN = {"name": "torch", "skip_reason": "Dependency not found on PyPI"}


@pytest.mark.parametrize(
    ("packages", "code", "words"),
    [
        ([CLEAN, CLEAN], 0, "2 packages: no known weakness"),
        ([CLEAN, UNKNOWN], 2, "does not know 1 of 2 packages (torch)"),
        ([], 2, "the lock is empty"),
        ([UNKNOWN, WEAK], 1, "jinja2 3.1.0: CVE-2024-22195, mended in 3.1.3"),
    ],
)
def test_what_an_audit_says(packages, code, words):
    found, told = audit.verdict({"dependencies": packages})
    assert found == code
    assert words in told


def test_without_the_tool_it_says_so(monkeypatch):
    monkeypatch.setattr(audit.importlib.util, "find_spec", lambda name: None)
    assert audit.audited(audit.LOCK) == (
        2,
        "Not audited: pip-audit is not installed (python -m pip install pip-audit).",
    )
