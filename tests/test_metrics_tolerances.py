import pytest
from pydantic import ValidationError

from gaitval.metrics.tolerances import WALK_UNITS, Measure, Tolerance, evaluate, load_registry


def _verdict(measure: Measure, tolerance: str):
    (found,) = [v for v in evaluate([measure]) if v.tolerance.id == tolerance]
    return found


@pytest.mark.parametrize(
    ("measure", "target", "tolerance", "limit", "worse"),
    [
        ("angle_rmse", "knee_angle_l", "sagittal-angles", 5.0, 5.001),
        ("moment_rmse", "ankle_angle_r", "sagittal-moments", 0.25, 0.2501),
        ("force_rmse", "forward_r", "force-forward", 5.0, 5.01),
        ("force_rmse", "medial_l", "force-medial", 5.0, 5.01),
        ("force_rmse", "vertical_r", "force-vertical", 15.0, 15.01),
        ("speed_error", "walk", "walking-speed", 5.0, 5.01),
        ("consecutive_cycles", "start phase 0.25", "consecutive-cycles", 20.0, 19.0),
        ("falls", "walk", "falls", 0.0, 1.0),
        ("root_force", "walk", "external-root-force", 0.0, 1e-9),
    ],
)
def test_the_acceptance_limits_are_those_of_the_issue(measure, target, tolerance, limit, worse):
    at_limit = _verdict(Measure(measure, target, limit), tolerance)
    assert at_limit.passed
    assert at_limit.tolerance.role == "acceptance"
    assert at_limit.tolerance.value == limit
    assert not _verdict(Measure(measure, target, worse), tolerance).passed


@pytest.mark.parametrize("value", [None, float("nan")])
def test_what_was_not_measured_has_not_passed(value):
    assert not any(v.passed for v in evaluate([Measure("falls", "walk", value)]))


def test_a_tolerance_is_only_for_the_curves_it_names():
    found = {v.tolerance.id for v in evaluate([Measure("angle_rmse", "pelvis_tilt_r", 3.0)])}
    assert "sagittal-angles" not in found
    assert "angles-mcginley-good" in found


def test_every_entry_is_cited_and_unverified_ones_say_so():
    registry = load_registry()
    assert len({entry.id for entry in registry.tolerance}) == len(registry.tolerance)
    for entry in registry.tolerance:
        assert entry.verified or "nverified" in entry.note or "secondary" in entry.note
        assert (entry.status == "convention") == (entry.citation == "gaitval")
    opensim = next(e for e in registry.tolerance if e.id == "residual-moment-opensim")
    assert all(share in opensim.note for share in ("1 %", "2 %", "0.1 body weight"))


def test_every_measure_of_a_walk_has_one_margin():
    assert sorted(margin.measure for margin in load_registry().margin) == sorted(WALK_UNITS)


def test_an_entry_in_another_unit_is_refused():
    entry = load_registry().tolerance[0].model_dump() | {"unit": "rad"}
    with pytest.raises(ValidationError, match="angle_rmse in deg"):
        Tolerance.model_validate(entry)
