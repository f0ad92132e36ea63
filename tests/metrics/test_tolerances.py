import pytest
from pydantic import ValidationError

from gaitval.metrics.tolerances import (
    WALK_UNITS,
    Measure,
    Tolerance,
    evaluate,
    load_registry,
    measured,
)


def _verdict(measure: Measure, tolerance: str):
    (found,) = [v for v in evaluate([measure]) if v.id == tolerance]
    return found


@pytest.mark.parametrize(
    ("measure", "target", "tolerance", "role", "must", "worse"),
    [
        ("angle_rmse", "knee_angle_l", "sagittal-angles", "acceptance", 2.0, 0.001),
        ("angle_rmse", "hip_adduction_r", "other-angles", "context", 5.0, 0.001),
        ("angle_rmse", "hip_rotation_l", "other-angles", "context", 5.0, 0.001),
        ("angle_rmse", "pelvis_list_r", "other-angles", "context", 5.0, 0.001),
        ("moment_rmse", "ankle_angle_r", "sagittal-moments", "context", 0.2, 0.001),
        ("moment_rmse", "hip_adduction_l", "frontal-moments", "context", 0.2, 0.001),
        ("force_rmse", "vertical_r", "force-vertical", "context", 8.0, 0.001),
        ("force_rmse", "forward_r", "force-forward", "context", 4.0, 0.001),
        ("force_rmse", "medial_l", "force-medial", "context", 3.0, 0.001),
        ("stance_fraction_error", "left", "stance-fraction", "context", 4.0, 0.001),
        ("step_length_error", "right", "step-length", "context", 4.0, 0.001),
        ("consecutive_cycles", "start phase 0.25", "consecutive-cycles", "acceptance", 50.0, -1.0),
        ("push_survival", "phase 0.25", "push-survival", "acceptance", 80.0, -0.001),
        ("speed_error", "walk", "walking-speed", "context", 5.0, 0.001),
        ("falls", "walk", "falls", "acceptance", 0.0, 1.0),
    ],
)
def test_the_limits_are_those_of_the_issue(measure, target, tolerance, role, must, worse):
    at_limit = _verdict(measured(measure, target, must), tolerance)
    assert at_limit.passed
    assert (at_limit.role, at_limit.tolerance) == (role, must)
    assert not _verdict(measured(measure, target, must + worse), tolerance).passed


@pytest.mark.parametrize("kind", ["angle", "moment", "force"])
def test_as_near_as_a_prediction_is_not_accepted(kind):
    target = {"force": "vertical_r"}.get(kind, "knee_angle_r")
    rows = [_verdict(measured(f"{kind}_skill", target, value), f"skill-{kind}s")
            for value in (-0.01, 0.0, 0.01)]  # fmt: skip
    assert [row.passed for row in rows] == [False, False, True]
    assert {row.role for row in rows} == {"acceptance"}


@pytest.mark.parametrize(
    "change", [{"verified": False}, {"status": "unread"}, {"status": "unread", "verified": True}]
)
def test_what_nobody_read_in_full_is_not_called_published(change):
    (entry,) = [e for e in load_registry().tolerance if e.id == "angles-opensim-tracking"]
    with pytest.raises(ValidationError, match="read in full"):
        Tolerance.model_validate(entry.model_dump() | change)


@pytest.mark.parametrize("value", [None, float("nan")])
def test_what_was_not_measured_has_not_passed(value):
    assert not any(v.passed for v in evaluate([measured("falls", "walk", value)]))


def test_a_tolerance_is_only_for_the_curves_it_names():
    found = {v.id for v in evaluate([measured("angle_rmse", "pelvis_tilt_r", 3.0)])}
    assert "sagittal-angles" not in found
    assert "angles-wilken-detectable" in found


def test_every_entry_is_cited_and_unverified_ones_say_so():
    registry = load_registry()
    assert len({entry.id for entry in registry.tolerance}) == len(registry.tolerance)
    for entry in registry.tolerance:
        assert entry.verified == (entry.status != "unread")
        assert "ecalled" not in entry.note + entry.locator, "what stands on memory is no limit"
        assert (entry.status == "convention") == (entry.citation == "gaitval")
    share = next(e for e in registry.tolerance if e.id == "residual-moment-share")
    assert all(quoted in share.note for quoted in ("1 %", "2 %", "0.1 body weight"))


def test_every_measure_of_a_walk_has_one_margin():
    assert sorted(margin.measure for margin in load_registry().margin) == sorted(WALK_UNITS)


def test_an_entry_in_another_unit_is_refused():
    entry = load_registry().tolerance[0].model_dump() | {"unit": "rad"}
    with pytest.raises(ValidationError, match="angle_rmse in deg"):
        Tolerance.model_validate(entry)


def test_limits_are_shown_as_a_table():
    registry = load_registry()
    table = registry.to_frame()
    assert len(table) == len(registry.tolerance)
    assert list(registry.overview().columns) == list(table.columns[[0, 2, 3, 4, 5]])
    assert f"{len(table)} limits" in str(registry)


@pytest.mark.parametrize("row", load_registry().tolerance, ids=lambda row: row.id)
def test_every_limit_can_be_met_and_missed(row):
    target = f"{row.applies_to[0]}_r" if row.applies_to else "walk"
    step = (-1e-3 if row.limit in ("at_least", "above") else 1e-3) * max(1.0, row.value)
    within = row.value - step if row.limit == "above" else row.value
    assert _verdict(measured(row.measure, target, within), row.id).passed
    assert not _verdict(measured(row.measure, target, row.value + step), row.id).passed
