import copy
import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from synthetic_walk import MODEL, perfect_walk, sharp_filter, synthetic_record, walks_of

from gaitval.apps.regression.regression import (
    LONG_MEASURES,
    compare,
    lost,
    new,
    write_junit,
)
from gaitval.errors import ArtefactError
from gaitval.metrics.results import PushRecovery, metrics_from
from gaitval.metrics.tolerances import load_registry
from gaitval.metrics.validation import StageResults, validate
from gaitval.subjects.subject_file import builtin_subjects, load_subject


@pytest.fixture(scope="module")
def metrics():
    record = synthetic_record()
    configuration = sharp_filter()
    walks = walks_of([perfect_walk(record, cycles=6)], configuration)
    pushes = {
        "seconds": 0.05,
        "cycles": 5.0,
        "resolution": 25.0,
        "ceiling": 1200.0,
        "phases": [0.5],
        "directions": [0.0, 180.0],
        "largest": [[300.0, 300.0]],
        "force": 300.0,
        "criterion_directions": [0.0],
        "survived": [[True]],
    }
    found = validate(
        load_subject("S05"),
        record,
        MODEL,
        walks,
        None,
        configuration,
        StageResults(pushes=PushRecovery.model_validate(pushes)),
        others=builtin_subjects(),
    ).as_dict()
    # as if the person's own step width had been recorded too
    (other,) = [row for row in found["measures"] if row["measure"] == "step_width"]
    own = {"measure": "step_width_error", "unit": "cm", "value": 1.0, "origin": "recorded"}
    found["measures"].append(other | own)
    return found


def compared(baseline, current, **how):
    """`compare` of contents of files."""
    read = (
        metrics_from(each, f"the {which}")
        for each, which in ((baseline, "baseline"), (current, "current metrics"))
    )
    return compare(*read, **how)


def _changed(metrics, measure: str, target: str, by: float | None):
    changed = copy.deepcopy(metrics)
    for row in changed["measures"]:
        if (row["measure"], row["target"]) == (measure, target):
            row["value"] = None if by is None else row["value"] + by
    return changed


def _row(rows, measure: str, target: str):
    (row,) = [row for row in rows if (row.measure, row.target) == (measure, target)]
    return row


def test_a_run_against_itself_loses_nothing(metrics):
    rows = compared(metrics, metrics)
    assert len(rows) == len(metrics["measures"])
    assert {row.change for row in rows} == {"kept"}


TARGETS = {
    "angle_rmse": "knee_angle_r",
    "moment_rmse": "hip_flexion_l",
    "force_rmse": "vertical_r",
    "moment_rmse_as_measured": "knee_angle_l",
    "force_rmse_as_measured": "forward_r",
    "moment_rmse_own_hips": "hip_adduction_l",
    "angle_skill": "knee_angle_r",
    "moment_skill": "hip_flexion_l",
    "force_skill": "vertical_r",
    "unfiltered_force_rmse": "vertical_l",
    "force_ringing": "walk",
    "shoulder_moment_rms": "right",
    "shoulder_moment_peak": "left",
    "arm_work_share": "walk",
    "trunk_motion": "mean tilt",
    "lumbar_moment_peak": "walk",
    "toe_moment_peak": "right",
    "toe_work": "left",
    "moment_ringing": "knee_angle",
    "torque_rate": "hip_adduction",
    "free_moment_peak": "left",
    "foot_creep": "right",
    "knee_beyond_range": "left",
    "step_width": "walk",
    "step_width_error": "walk",
    "tendon_force_rmse": "achilles_r",
    "power_burst_error": "A2_r",
    "joint_work_error": "hip_flexion_l",
    "centre_of_mass_rmse": "up",
    "loading_peak_error": "right",
    "pressure_arm_rmse": "left",
    "speed_error": "walk",
    "stance_fraction_error": "left",
    "step_length_error": "right",
    "stride_time_error": "walk",
    "epsilon": "walk",
    "consecutive_cycles": "start phase 0",
    "falls": "walk",
    "push_survival": "phase 0.5",
}
"""Of each measure, a target."""


def test_every_margin_is_tried():
    assert sorted(TARGETS) == sorted(margin.measure for margin in load_registry().margin)


@pytest.mark.parametrize("margin", load_registry().margin, ids=lambda margin: margin.measure)
def test_a_loss_beyond_the_margin_fails_and_its_reverse_is_a_gain(metrics, margin):
    """A change for the worse that the margin allows, and one that it does not."""
    measure, target = margin.measure, TARGETS[margin.measure]
    sign = 1.0 if margin.better == "lower" else -1.0
    within, beyond = sign * 0.99 * margin.value, sign * (1.01 * margin.value or 1.0)
    kept = compared(metrics, _changed(metrics, measure, target, within))
    assert lost(kept) == []
    worse = _changed(metrics, measure, target, beyond)
    assert lost(compared(metrics, worse)) == [_row(compared(metrics, worse), measure, target)]
    assert _row(compared(worse, metrics), measure, target).change == "improved"


def test_what_can_no_longer_be_measured_is_lost(metrics):
    unmeasured = _changed(metrics, "angle_rmse", "knee_angle_r", None)
    assert [row.target for row in lost(compared(metrics, unmeasured))] == ["knee_angle_r"]
    assert lost(compared(unmeasured, metrics)) == []
    missing = copy.deepcopy(metrics)
    del missing["measures"][0]
    assert len(lost(compared(metrics, missing))) == 1


def test_a_quick_check_leaves_out_what_a_short_walk_does_not_show(metrics):
    shorter = _changed(metrics, "consecutive_cycles", "start phase 0", -1.0)
    assert len(lost(compared(metrics, shorter))) == 1
    rows = compared(metrics, shorter, leave_out=LONG_MEASURES)
    assert lost(rows) == []
    assert "consecutive_cycles" not in {row.measure for row in rows}


@pytest.mark.parametrize(
    ("start", "cycles", "falls_now", "change"),
    [
        (3, 50, 0, "kept"),  # from another start: nobody has got better
        (0, 50, 0, "kept"),  # later than the short walk ends
        (0, 3, 0, "improved"),
        (3, 50, 1, "lost"),  # not hidden by the fall of another walk
        (0, 3, 1, "kept"),
    ],
)
def test_falls_of_a_quick_check_are_those_of_the_same_start_and_cycles(
    start, cycles, falls_now, change
):
    path = Path(__file__).parents[2] / "reports" / "S05" / "baseline" / "metrics.json"
    contents = json.loads(path.read_text(encoding="utf-8"))
    stored = _changed(contents, "falls", "walk", 1.0)
    walk = stored["walks"]["identified"]["starts"][start]
    walk["fell"], walk["cycles"]["right"] = True, cycles
    quick = _changed(contents, "falls", "walk", float(falls_now))
    walks = quick["walks"]["identified"]
    walks["starts"] = walks["starts"][:1]
    walks["starts"][0]["fell"] = bool(falls_now)
    quick["method"]["consecutive_cycles"] = 22
    row = _row(compared(stored, quick, leave_out=LONG_MEASURES), "falls", "walk")
    assert row.change == change


def test_a_measure_that_the_baseline_lacks_is_new_and_no_gain(metrics):
    fewer = copy.deepcopy(metrics)
    gone = fewer["measures"].pop(0)
    rows = compared(fewer, metrics)
    (added,) = new(rows)
    assert (added.measure, added.target) == (gone["measure"], gone["target"])
    assert not lost(rows)
    assert not new(compared(metrics, metrics))
    # one that can no longer be measured is lost, not new
    assert [row.change for row in compared(metrics, fewer) if row.change != "kept"] == ["lost"]


def test_another_subject_is_refused(metrics):
    other = copy.deepcopy(metrics)
    other["subject"]["identifier"] = "S01"
    with pytest.raises(ArtefactError, match="of subject S01, but the run is of subject S05"):
        compared(other, metrics)


def test_a_damaged_baseline_is_refused(metrics):
    with pytest.raises(ArtefactError, match="the baseline: does not match the schema"):
        compared({}, metrics)


def test_junit_has_a_case_a_measure_and_a_failure_a_loss(metrics, tmp_path):
    worse = _changed(metrics, "angle_rmse", "knee_angle_r", 1.0)
    rows = compared(metrics, worse)
    write_junit(rows, tmp_path / "junit.xml", about={"inputs": "numpy 1, now 2"})
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot().find("testsuite")
    assert (suite.get("tests"), suite.get("failures")) == (str(len(rows)), "1")
    (message,) = suite.iter("property")
    assert (message.get("name"), message.get("value")) == ("inputs", "numpy 1, now 2")
    cases = suite.findall("testcase")
    assert len(cases) == len(rows)
    (failed,) = [case for case in cases if case.find("failure") is not None]
    assert (failed.get("classname"), failed.get("name")) == ("gaitval.angle_rmse", "knee_angle_r")
    (margin,) = [each.value for each in load_registry().margin if each.measure == "angle_rmse"]
    assert f"margin {margin:g}°" in failed.find("failure").get("message")
