"""The tables and the page of a cohort."""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import quick_study
from verdict_words import plain, rows_of

from gaitval.apps.cohort.answers import StudySummary
from gaitval.apps.cohort.report import _distributions, context_of, strategies, write_report
from gaitval.apps.cohort.results import COLUMNS, people_of, records_of, tables_of
from gaitval.apps.cohort.store import SUMMARY, Store
from gaitval.apps.cohort.study import summary_of
from gaitval.datasets.subject_file import load_subject
from gaitval.metrics.results import metrics_from, read_metrics
from gaitval.reporting.page import write_html
from gaitval.study.stored_policy import stored_baseline


def outcome(name, status="finished", reason=""):
    return {"name": name, "status": status, "reason": reason, "seconds": 61.0,
            "peak_memory": 5e8, "worker": "here:1", "fingerprint": "f"}  # fmt: skip


@pytest.fixture
def cohort(tmp_path):
    """30 studies of 7 people, one of them far off, and two that failed."""
    store = Store(str(tmp_path / "studies"))
    outcomes = []
    for number in range(30):
        name = f"study{number}"
        found = quick_study.summary(name, f"{number * 7919 % 9973:08x}", 1.0, 1)
        # Far beyond the others' 1 to 3 degrees.
        if number == 4:
            found["groups"][0]["rmse"] = 60.0
        score = {"measure": "gait_profile_score", "target": "walk", "unit": "deg"}
        found["measures"].append({**score, "value": 5.0 + number / 30})
        path = tmp_path / "studies" / name
        path.mkdir(parents=True)
        (path / SUMMARY).write_text(json.dumps(found))
        outcomes.append(outcome(name))
    outcomes += [outcome("bad", "refused", "no <record>"), outcome("gone", "lost", "killed")]
    return tmp_path, store, outcomes


def test_tables_are_tidy_and_equal_in_both_formats(cohort):
    folder, store, outcomes = cohort
    write_report(folder, store, outcomes)
    studies = pd.read_csv(folder / "studies.csv")
    assert studies["study"].tolist() == [each["name"] for each in outcomes]
    assert studies["status"].value_counts().to_dict() == {"finished": 30, "refused": 1, "lost": 1}
    for name in ("studies", "measures", "groups", "parameters"):
        stored = pd.read_parquet(folder / f"{name}.parquet")
        text = pd.read_csv(folder / f"{name}.csv")
        assert list(stored.columns) == list(text.columns)
        numbers = stored.select_dtypes("number")
        np.testing.assert_allclose(text[numbers.columns], numbers, rtol=1e-12)
    assert len(pd.read_csv(folder / "measures.csv")) == 60


def test_the_page_shows_failures_outliers_and_models(cohort):
    folder, store, outcomes = cohort
    page = write_report(folder, store, outcomes).read_text()
    assert "30 of 32 studies finished" in page
    assert "no &lt;record&gt;" in page
    assert '<a href="studies/bad/study.log">bad</a>' in page
    # the list of contents at the top names both too
    stand_out = page[page.rindex("Studies that stand out") : page.rindex("Identified parameters")]
    assert '<a href="studies/study4/report.html">study4</a>' in stand_out
    assert stand_out.count("<tr>") == 2, "one outlier below the header"
    assert "sagittal angles, °" in page
    assert "30 studies of 30 records of 7 people" in page
    assert "30 of 32 studies finished, of 30 records of 7 people" in page
    assert page.count("<svg") == 3
    assert "gait profile score, °" in page


def test_each_study_says_how_many_limits_it_kept_and_which_failed(tmp_path):
    store, outcomes = Store(str(tmp_path / "studies")), []
    for name, refused in (("good", 0), ("bad", 3)):
        found = quick_study.summary(name, f"{refused:08x}", 1.0, 1)
        found["verdicts"] |= {"accepted": 10 - refused, "refused": refused}
        found["verdicts"]["failed"] = ["angles"] * bool(refused)
        (tmp_path / "studies" / name).mkdir(parents=True)
        (tmp_path / "studies" / name / SUMMARY).write_text(json.dumps(found))
        outcomes.append(outcome(name))
    tables = tables_of(store, outcomes)
    assert context_of(tmp_path, store, tables)["clean"] == 1
    page = write_report(tmp_path, store, outcomes).read_text()
    rows = {row.cells[0]: row for row in rows_of(page) if len(row.cells) == 10}
    messages = {name: (row.failed, row.cells[5], row.cells[-1]) for name, row in rows.items()}
    assert messages == {"good": (False, "10 of 10", ""), "bad": (True, "7 of 10", "angles")}
    # what decides is named as such: the others are not counted
    assert "1 of 2 finished studies fails an acceptance limit" in " ".join(plain(page).split())
    assert "Every limit" not in page


def test_who_is_not_judged_does_not_fail(tmp_path):
    """Nothing was recorded of the forces of one: that is no pass, and no failure."""
    store, outcomes = Store(str(tmp_path / "studies")), []
    for name, reason in (("good", ""), ("bare", "Not judged: forces.")):
        found = quick_study.summary(name, f"{len(reason):08x}", 1.0, 1)
        found["verdicts"] |= {"accepted": 10, "refused": 0, "failed": [], "not_judged": reason}
        (tmp_path / "studies" / name).mkdir(parents=True)
        (tmp_path / "studies" / name / SUMMARY).write_text(json.dumps(found))
        outcomes.append(outcome(name))
    text = " ".join(plain(write_report(tmp_path, store, outcomes).read_text()).split())
    assert "1 is not judged" in text
    assert "kept in 1 of 2 finished studies" in text
    assert "an acceptance limit" not in text
    assert "Not judged: forces." in text


@pytest.fixture
def seeded(tmp_path):
    """10 records of 6 people with 3 seeds each; the third one's are far off."""
    store = Store(str(tmp_path / "studies"))
    outcomes = []
    random = np.random.default_rng(0)
    for record in range(10):
        noise = 0.3 * random.standard_normal()
        for seed in range(3):
            name = f"r{record}-s{seed}"
            found = quick_study.summary(name, "0" * 8, 1.0, 1)
            person, speed = record % 6, 0.8 + 0.4 * (record // 6) + 0.03 * record
            found["subject"] |= {
                "person": f"P{person}", "speed": speed, "age": 30.0 + person, "source": "walk",
            }  # fmt: skip
            # the seeds of a record scatter little: taken as studies, speed would be near certain
            error = 60.0 + seed if record == 2 else 2.0 * speed + noise + 0.01 * seed
            found["groups"][0]["rmse"] = error
            found |= {"record": f"{record}", "settings": "same"}
            (tmp_path / "studies" / name).mkdir(parents=True)
            (tmp_path / "studies" / name / SUMMARY).write_text(json.dumps(found))
            outcomes.append(outcome(name))
    return tmp_path, store, outcomes


def test_seeds_of_a_record_are_one_value(seeded):
    folder, store, outcomes = seeded
    page = write_report(folder, store, outcomes).read_text()
    assert "30 of 30 studies finished, of 10 records of 6 people" in page
    assert "30 studies of 10 records of 6 people" in page
    tables = tables_of(store, outcomes)
    found = context_of(folder, store, tables)
    (errors,) = (row for row in found["distributions"] if row["name"] == "sagittal angles")
    assert (errors["count"], errors["worst"]) == (10, 61.0)
    (far,) = found["outliers"]
    assert far["value"] == pytest.approx(61.0)
    assert [name for name, _ in far["studies"]] == ["r2-s0", "r2-s1", "r2-s2"]
    assert page.count('<a href="studies/r2-s1/report.html">') == 2, "of the outlier, and of all"
    # other settings are another prediction, but no other record
    tables["studies"].loc[tables["studies"]["study"].str.endswith("s2"), "settings"] = "other"
    found = context_of(folder, store, tables)
    assert found["records"] == 10
    assert [[name for name, _ in row["studies"]] for row in found["outliers"]] == [
        ["r2-s2"],
        ["r2-s0", "r2-s1"],
    ]
    assert found["models"][0].records == 10


def test_seeds_of_a_recording_of_nobody_named_are_one_person():
    """Its person has the name of the study, which says the seed. Another trial of one name, at
    another speed, is another record."""
    studies = pd.DataFrame(
        {"laboratory": "own", "person": ["P01", "P01-s1", "P01", "P02"], "trial": "walk",
         "speed": [1.2, 1.2, 1.4, 1.2], "record": ["a", "a", "b", ""]}
    )  # fmt: skip
    assert people_of(studies).tolist() == ["own P01", "own P01", "own P01", "own P02"]
    assert records_of(studies).nunique() == 3


def test_a_small_p_is_no_zero(seeded):
    folder, store, outcomes = seeded
    tables = tables_of(store, outcomes)
    values = tables["groups"]["rmse"]
    tables["groups"]["rmse"] = 2.0 + 0.001 * values
    context = context_of(folder, store, tables)
    assert any(effect.p < 0.0005 for model in context["models"] for effect in model.effects)
    page = write_html(folder, "small", "gaitval.apps.cohort:cohort.html.j2", context).read_text()
    assert '<td class="n">&lt; 0.001</td>' in page
    assert all(f">{each}</th>" in page for each in ("Age, years", "Speed, m/s", "Memory, MB"))
    assert '<td class="n">0.000</td></tr>' not in page


def test_three_studies_have_no_outlier_and_no_panels(tmp_path):
    """The third is far from two that are nearly equal, as every third one is."""
    store, outcomes = Store(str(tmp_path / "studies")), []
    for number, rmse in enumerate((1.0, 1.1, 9.0)):
        found = quick_study.summary(f"s{number}", f"{number:08x}", 1.0, 1)
        found["groups"][0]["rmse"] = rmse
        (tmp_path / "studies" / f"s{number}").mkdir(parents=True)
        (tmp_path / "studies" / f"s{number}" / SUMMARY).write_text(json.dumps(found))
        outcomes.append(outcome(f"s{number}"))
    folder = tmp_path / "cohort"
    folder.mkdir()
    page = write_report(folder, store, outcomes).read_text()
    assert "<h1>Cohort of 1 person</h1>" in page
    # the rows of what was not fitted are one sentence
    assert page.count("a random effect needs 5") == 1
    assert "<th>Coefficient</th>" not in page
    assert "samples of 10 records and more" in page
    assert "that needs 5 people" in page
    assert 'aria-label="Errors by speed' not in page


def test_every_table_scrolls_in_a_frame_of_its_own(cohort):
    """The button that copies a table lies in the space below its frame, else on its last row."""
    folder, store, outcomes = cohort
    page = write_report(folder, store, outcomes).read_text()
    tables = re.findall(r"(<div[^>]*>)<table", page)
    assert len(tables) == page.count("<table") == 5
    assert all('class="scroll"' in each and 'tabindex="0"' in each for each in tables)


def test_equal_results_give_an_equal_page(cohort, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    folder, store, outcomes = cohort
    first = write_report(folder, store, outcomes).read_bytes()
    assert write_report(folder, store, outcomes).read_bytes() == first


def test_a_cohort_of_which_nothing_finished_has_a_page(tmp_path):
    page = write_report(tmp_path, Store(str(tmp_path)), [outcome("a", "fault", "E")]).read_text()
    assert "0 of 1 studies finished" in page


def test_the_summary_of_a_real_study_has_what_the_tables_need():
    baseline = stored_baseline(Path("nowhere"), "S05")
    subject = load_subject(5)
    metrics = json.loads((baseline / "metrics.json").read_text())
    found = summary_of(metrics_from(metrics, "here"), subject)
    # what a worker sends is read as this, and whatever else it holds fails the study
    assert StudySummary.model_validate(found).verdicts.guess_judged > 0
    assert found["subject"] | {"person": "WBDS14", "trial": "T05", "sex": "F"} == found["subject"]
    assert found["verdicts"]["accepted"] == metrics["summary"]["accepted"]
    assert len(found["parameters"]) == 14
    assert len(found["groups"]) == 7
    wanted = metrics["walks"][metrics["final"]]["errors"]["angles"]
    names = [
        f"{name}_{side}" for name in ("hip_flexion", "knee_angle", "ankle_angle") for side in "rl"
    ]
    mean = np.mean([wanted[name]["rmse"] for name in names])
    assert found["groups"][0]["rmse"] == pytest.approx(mean)


def test_a_summary_has_the_profile_scores_of_walk_and_record():
    metrics = read_metrics(stored_baseline(Path("nowhere"), "S05") / "metrics.json")
    without = metrics.model_copy(update={"curve_statistics": None})
    before = summary_of(without, load_subject(5))["measures"]
    profiles = metrics.curve_statistics.profiles
    added = summary_of(metrics, load_subject(5))["measures"][len(before) :]
    assert [(row["measure"], row["unit"], row["value"]) for row in added] == [
        ("gait_profile_score", "deg", profiles.walk.total),
        ("gait_profile_score_of_the_record", "deg", profiles.record.total),
    ]


def test_what_searches_found_is_listed_by_study():
    rows = [
        (study, "hip_exo: work", of, "J/kg a stride", value)
        for study, found in (("a", 0.2), ("b", 0.3))
        for of, value in (("without", 0.4), ("strategy found", found))
    ]
    rows.append(("a", "pushes survived", "without", "pushes", 24.0))
    found = strategies(pd.DataFrame(rows, columns=COLUMNS["devices"]))
    assert [(row["study"], row["without"], row["found"]) for row in found] == [
        ("a", 0.4, 0.2),
        ("b", 0.4, 0.3),
    ]
    assert strategies(pd.DataFrame([], columns=COLUMNS["devices"])) == []


def test_a_distribution_is_its_quartiles_by_hand():
    """Of 0, 1, 2, 3 and 9: quartiles 1, 2 and 3; worst is the largest error, the least skill."""
    rows = pd.DataFrame(
        {"name": ["a"] * 5 + ["b"] * 5, "unit": "deg", "kind": ["error"] * 5 + ["skill"] * 5,
         "record": list("pqrst") * 2, "value": [3.0, 0.0, 9.0, 2.0, 1.0] * 2}
    )  # fmt: skip
    first, second = _distributions(rows)
    for found, worst in ((first, 9.0), (second, 0.0)):
        assert (found["low"], found["median"], found["high"]) == (1.0, 2.0, 3.0)
        assert (found["count"], found["worst"]) == (5, worst)
