"""The word of a limit of a recording, which the terminal, pages, Python and `judge` all take."""

from gaitval.metrics.recording_limits import AFTER_REDUCTION, failure, remedy, state_of
from gaitval.metrics.tolerances import RECORDING_UNITS, load_registry


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
