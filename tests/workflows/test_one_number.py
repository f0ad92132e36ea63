"""One rule for one number: terminal, page, Python, `judge`, table of imports."""

import one_number
import pytest
from made_up_session import SHORT

from gaitval.metrics.recording_limits import AFTER_REDUCTION, failure, remedy, state_of
from gaitval.metrics.tolerances import RECORDING_UNITS, load_registry


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> one_number.Compared:
    return one_number.compared(tmp_path_factory.mktemp("one") / "sessions", size=SHORT)


@pytest.mark.slow
def test_every_output_says_the_same_of_every_limit(found: one_number.Compared) -> None:
    assert not found.differences, "\n".join(found.differences)
    assert found.numbers >= 20
    assert found.outputs == ("terminal", "page", "Python", "judge", "table")
    assert found.failed >= 2


def test_only_limits_in_newtons_wait_for_residual_reduction() -> None:
    """And a failed limit is never said to be something else."""
    in_newtons = {
        row.id
        for row in load_registry().tolerance
        if row.measure in RECORDING_UNITS and row.unit in ("N", "Nm")
    }
    assert set(AFTER_REDUCTION) == in_newtons
    for row in load_registry().tolerance:
        if row.measure in RECORDING_UNITS:
            assert state_of(row.id, False, reduced=True) == "FAILED"
            waits = row.id in in_newtons
            assert state_of(row.id, False, reduced=False) == ("not judged" if waits else "FAILED")
            assert state_of(row.id, True, reduced=True) == "passed"
            assert remedy(row.id, reduced=False)


def test_what_failed_is_said_with_value_limit_and_what_to_do() -> None:
    assert failure("Residual force (walk)", 15.2077, 5.0, "%", "try this") == (
        "Residual force (walk): 15.2 %, limit 5 %: try this"
    )
    assert failure("Residual force", None, 5.0, "%") == "Residual force: not measured, limit 5 %"


@pytest.mark.parametrize("moved", ["Python", "page"])
def test_a_difference_is_found(monkeypatch: pytest.MonkeyPatch, moved: str) -> None:
    """Of verdict, limit or value; the comparison itself is tested."""
    same = one_number.Said("passed", 5.0, 3.0)
    outputs = {name: {"force": same} for name in ("terminal", "page", "Python", "judge")}
    assert list(one_number._differences("force", outputs)) == []
    for wrong in (
        same._replace(verdict="not judged"),
        same._replace(limit=4.0),
        same._replace(value=3.2),
    ):
        assert list(one_number._differences("force", outputs | {moved: {"force": wrong}}))
