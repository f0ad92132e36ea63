"""The verdict in words: which rows fail, which is the worst, and what is not judged."""

from pathlib import Path

import pytest

from gaitval.metrics.baselines import predictions
from gaitval.metrics.origin import everything
from gaitval.metrics.results import read_metrics
from gaitval.metrics.tolerances import Verdict
from gaitval.metrics.verdicts import (
    GUESSES,
    LimitVerdict,
    bound_text,
    close_text,
    counted_limits,
    failed_limits,
    limit_verdicts,
    reason_text,
    sentence,
    spread_text,
    target_text,
    unit_text,
    unjudged_text,
    value_text,
)
from gaitval.subjects.subject_file import builtin_subjects, load_subject

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def metrics():
    return read_metrics(ROOT / "reports" / "S05" / "baseline")


def row(metrics, **changes):
    """A verdict with other values."""
    values = metrics.tolerances[0].model_dump() | {"spread": None} | changes
    return Verdict.model_validate(values)


def of(metrics, limit, *values, tolerance=2.0):
    return LimitVerdict(
        tuple(
            row(
                metrics, limit=limit, value=value, target=f"t{i}", tolerance=tolerance, unit="deg",
                passed=value is not None
                and (value >= tolerance if limit == "at_least" else value <= tolerance),
            )
            for i, value in enumerate(values)
        ),
        "do this",
    )  # fmt: skip


def test_the_worst_row_is_on_the_wrong_side_of_its_limit(metrics):
    assert of(metrics, "at_most", 1.0, 3.0, 2.0).worst.target == "t1"
    assert of(metrics, "at_least", 3.0, 1.0, 2.0).worst.target == "t1"
    assert of(metrics, "at_least", 3.0, None, 1.0).worst.target == "t1", "not measured is worse"
    assert of(metrics, "at_most", 3.0, None).value_text() == "not measured"
    two = of(metrics, "at_most", 1.0, 3.0)
    assert not two.passed
    assert [each.target for each in two.failed] == ["t1"]
    assert two.first.target == "t0"
    assert of(metrics, "at_most", 1.0, 2.0).passed
    assert (two.value_text(), two.limit_text()) == ("3°", "≤ 2°")
    assert of(metrics, "at_least", 3.0).limit_text() == "≥ 2°"


def test_numbers_have_three_digits_and_units_as_one_writes_them(metrics):
    assert [unit_text(each) for each in ("deg", "1", "N", "% BW")] == ["°", "", " N", " % BW"]
    assert value_text(row(metrics, value=12.3456, unit="mm")) == "12.3 mm"
    assert bound_text(row(metrics, limit="exactly", unit="1"), 0.0) == "= 0"
    assert bound_text(row(metrics), None) == ""


def spread(**values):
    return {"repeats": 8, "kept": 8, "low": None, "high": None, "close": True, **values}


def test_what_repeats_said(metrics):
    assert spread_text(row(metrics)) == ""
    walks = row(metrics, measure="falls", unit="deg", spread=spread(kept=7))
    assert spread_text(walks) == "7 of 8 walks"
    known = row(metrics, measure="falls", unit="deg", spread=spread(low=0.8712, high=1.1234))
    assert spread_text(known) == "0.871–1.12°, 8 of 8 walks"
    pushes = row(metrics, measure="push_survival", unit="%", spread=spread(kept=6))
    assert spread_text(pushes) == "6 of 8 pushes"
    assert close_text(pushes) == "passes, but one push less survived would fail it"
    assert close_text(walks) == "passes, but not in every repeated walk"
    assert close_text(known) == "passes, but one more walk may fail it"
    assert close_text(row(metrics, measure="falls")) == "passes, but one more walk may fail it"


def test_close_are_rows_that_pass_but_might_not_again(metrics):
    rows = [
        row(metrics, passed=passed, target=f"{passed} {close}", spread=spread(close=close))
        for passed in (True, False)
        for close in (True, False)
    ]
    found = LimitVerdict((*rows, row(metrics, passed=True)), "").close
    assert [each.target for each in found] == ["True True"]


def test_targets_in_the_words_of_gait_analysis():
    assert target_text("walk") == ""
    assert target_text("knee_angle_l") == "left knee flexion"
    assert target_text("medial_r") == "right mediolateral force"
    assert target_text("toe_clearance_r") == "right toe clearance"
    assert target_text("hip_adduction") == "hip adduction"
    assert target_text("lumbar_bending") == "lumbar bending"
    assert target_text("start phase 0.5") == "start phase 0.5"


def with_rows(metrics, change):
    return metrics.model_copy(update={"tolerances": [change(each) for each in metrics.tolerances]})


def test_the_sentence_counts_what_failed_by_role_and_what_passes_narrowly(metrics):
    def passed(each):
        return each.model_copy(update={"passed": True, "spread": None})

    good = with_rows(metrics, passed)
    counts = {role: len(counted_limits(good, role)) for role in ("acceptance", "context")}
    assert sentence(good).startswith(
        f"All {counts['acceptance']} acceptance limits passed; all {counts['context']} context "
        "limits passed."
    )
    assert failed_limits(good) == []
    first = {role: counted_limits(good, role)[0].first.id for role in counts}

    def failing(role):
        return with_rows(
            good, lambda each: each.model_copy(update={"passed": each.id != first[role]})
        )

    for role in counts:
        message = sentence(failing(role))
        assert f"1 of {counts[role]} {role} limits failed" in message.replace("All", "all")
        assert [each.first.id for each in failed_limits(failing(role))] == [first[role]]
    assert sentence(failing("acceptance"))[0].isdigit()
    both = with_rows(good, lambda each: each.model_copy(update={"passed": False}))
    roles = [each.first.role for each in failed_limits(both)]
    assert roles == [role for role, count in counts.items() for _ in range(count)]
    narrow = spread(low=0.1, high=0.2)
    accepted = [each for each in good.tolerances if each.role == "acceptance"]
    for number, words in ((1, " 1 accepted value passes narrowly."),
                          (2, " 2 accepted values pass narrowly.")):  # fmt: skip
        chosen = {(each.id, each.target) for each in accepted[:number]}
        close = with_rows(
            good,
            lambda each, chosen=chosen: Verdict.model_validate(
                each.model_dump() | {"spread": narrow if (each.id, each.target) in chosen else None}
            ),
        )
        assert words in sentence(close)
    assert "narrowly" not in sentence(good)


def test_what_is_counted_is_what_is_listed(metrics):
    """A limit whose source nobody read in full is neither, whatever its verdict."""
    unread = {each.id for each in metrics.tolerances if each.status == "unread"}
    assert unread
    failing = with_rows(
        metrics,
        lambda each: each.model_copy(update={"passed": each.id not in unread, "spread": None}),
    )
    counted = len(limit_verdicts(metrics, "context")) - len(unread)
    assert failed_limits(failing) == []
    assert f"; all {counted} context limits passed." in sentence(failing)


def test_nothing_recorded_is_not_judged(metrics, monkeypatch):
    monkeypatch.setattr(type(metrics), "is_recorded_at_all", False)
    message = sentence(metrics)
    every = counted_limits(metrics)
    kept = sum(each.passed for each in every)
    speed = metrics.record.spatiotemporal.walking_speed
    assert message == (
        f"Nothing was recorded at {speed:.3g} m/s: accuracy is not judged. The walk itself: "
        f"{kept} of {len(every)} limits kept."
    )
    assert "slope +5 %" in sentence(metrics, ", slope +5 %")


def test_a_limit_of_ones_own_says_itself_what_to_do(metrics):
    """Else the registry of limits does."""
    (usual,) = [
        each for each in limit_verdicts(metrics) if each.first.id == metrics.tolerances[0].id
    ]
    assert usual.remedy
    own = [
        each.model_copy(update={"remedy": "do that"}) if each.id == usual.first.id else each
        for each in metrics.tolerances
    ]
    changed = metrics.model_copy(update={"tolerances": own})
    (found,) = [each for each in limit_verdicts(changed) if each.first.id == usual.first.id]
    assert found.remedy == "do that"


def test_what_was_not_recorded_is_listed_by_reason_with_its_side():
    found = everything("recorded")
    assert unjudged_text(found) == ""
    found["moments"] = {"right": "mirrored", "left": "mirrored"}
    found["forces"]["left"] = "mirrored"
    found["stance"]["right"] = "expected"
    assert unjudged_text(found) == (
        " Not recorded, so not judged: moments and left forces (mirrored from the other side); "
        "right stance (only expected)."
    )
    found["angles"]["left"] = "mirrored"
    assert "left angles, moments and left forces (mirrored" in unjudged_text(found)


def test_why_a_curve_is_not_accepted(metrics):
    against = {"guess": "expected of anybody", "error": 0.25, "walk": 0.5}
    changes = {"passed": False, "failed_by": ["limit"], "guess": against, "measure": "force_skill"}
    failed = row(metrics, **changes, state="failed")
    assert reason_text(failed) == "not nearer than what is expected of anybody"
    assert value_text(failed) == "0.5 % BW, prediction 0.25 % BW"
    unshown = row(metrics, **changes, state="not shown")
    assert "not shown" in reason_text(unshown)
    assert reason_text(row(metrics, passed=False, failed_by=["limit"])) == "", "its value says it"
    record = row(metrics, **changes | {"failed_by": ["record"], "known": 0.123})
    assert "±0.12 % BW" in reason_text(record)
    assert LimitVerdict((unshown, row(metrics, passed=True)), "").state == "not shown"
    assert LimitVerdict((unshown, failed), "").state == "failed"
    assert LimitVerdict((row(metrics, passed=True),), "").state == "passed"


def test_the_prediction_in_the_place_of_the_walk_is_counted_where_it_can_be(metrics):
    def limit(*within):
        return LimitVerdict(tuple(row(metrics, guess_within=each) for each in within), "")

    assert limit(True, False, None).guess == (1, 2)
    assert limit(None, None).guess is None


def test_every_guess_has_words():
    person = load_subject("S05")
    assert {each.name for each in predictions(person, builtin_subjects())} <= set(GUESSES)
