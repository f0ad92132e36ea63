"""Mixed models against planted effects, and what stands out."""

import numpy as np
import pandas as pd
import pytest

from gaitval_cohort import statistics
from gaitval_cohort.statistics import mixed_model, outliers

SPEED, AGE, MAN, BETWEEN, WITHIN = 2.0, 0.3, -0.5, 0.4, 0.2
"""Planted: per m/s, per 10 years, of men; SD between people, and within a person."""


def cohort(people, trials, seed=0):
    random = np.random.default_rng(seed)
    rows = []
    for person in range(people):
        own, age, sex = BETWEEN * random.standard_normal(), random.uniform(20, 80), "FM"[person % 2]
        for _ in range(trials):
            speed = random.uniform(0.6, 1.6)
            value = 1.0 + SPEED * speed + AGE * age / 10 + MAN * (sex == "M") + own
            value += WITHIN * random.standard_normal()
            rows.append({"value": value, "speed": speed, "age": age, "sex": sex,
                         "person": f"P{person}"})  # fmt: skip
    return pd.DataFrame(rows)


def test_planted_effects_are_found():
    found = mixed_model(cohort(60, 8), "error", "deg")
    assert found.remark == ""
    effects = {each.term: each for each in found.effects}
    for term, truth in (
        ("speed, per m/s", SPEED),
        ("age, per 10 years", AGE),
        ("man, against woman", MAN),
    ):
        assert effects[term].low < truth < effects[term].high
        assert effects[term].high - effects[term].low < 1.0
    # SDs of 60 people and 480 studies are known to 10 and 4 per cent.
    assert found.person_sd == pytest.approx(BETWEEN, rel=0.3)
    assert found.residual_sd == pytest.approx(WITHIN, rel=0.1)


def test_intervals_cover_at_their_rate():
    """95 % of 60 intervals: between 88 and 100 % but for one in a thousand tries."""
    inside = 0
    for seed in range(60):
        found = mixed_model(cohort(20, 4, seed), "error", "deg")
        (speed,) = (each for each in found.effects if each.term.startswith("speed"))
        inside += speed.low < SPEED < speed.high
    assert inside / 60 >= 0.85


@pytest.mark.parametrize(
    ("people", "trials", "told"),
    [
        (4, 5, "4 people, and a random effect needs 5"),
        (12, 1, "one study of each person"),
        (5, 1, "one study of each person"),
    ],
)
def test_too_few_are_not_fitted(people, trials, told):
    found = mixed_model(cohort(people, trials), "error", "deg")
    assert told in found.remark
    assert not found.effects


def test_terms_for_which_there_are_too_few_studies_are_left_out():
    found = mixed_model(cohort(7, 2), "error", "deg")
    assert "too few studies for age" in found.remark
    assert "too few studies for man" in found.remark
    assert [each.term for each in found.effects] == ["intercept", "speed, per m/s"]


def test_a_term_that_does_not_vary_or_is_unknown_is_left_out():
    rows = cohort(20, 4).assign(sex="F")
    rows.loc[0, "age"] = np.nan
    found = mixed_model(rows, "error", "deg")
    assert "man does not vary" in found.remark
    assert "age is not known of every study" in found.remark


def test_people_who_do_not_differ_are_told():
    rows = cohort(20, 4)
    random = np.random.default_rng(1)
    found = mixed_model(rows.assign(value=random.standard_normal(len(rows))), "error", "deg")
    assert found.person_sd is not None
    # with no difference planted, half of such cohorts end on the bound; this seed does
    assert found.person_sd < 0.35


def test_a_fit_that_does_not_converge_is_told(monkeypatch):
    from statsmodels.regression.mixed_linear_model import MixedLM

    fit = MixedLM.fit

    def unfinished(self, **options):
        found = fit(self, **options)
        found._results.converged = False
        return found

    monkeypatch.setattr(MixedLM, "fit", unfinished)
    assert "did not converge" in mixed_model(cohort(20, 4), "error", "deg").remark


def test_a_far_value_stands_out_and_a_near_one_does_not():
    random = np.random.default_rng(0)
    values = random.standard_normal(50)
    values[7] = 9.0
    rows = pd.DataFrame({"study": [f"s{i}" for i in range(50)], "name": "error", "unit": "deg",
                         "value": values})  # fmt: skip
    found = outliers(rows)
    assert found["study"].tolist() == ["s7"]
    assert found["z"].iloc[0] > statistics.FAR


@pytest.mark.parametrize(("count", "share"), [(3, 0.096), (10, 0.017)])
def test_the_fewest_for_outliers_are_where_normal_values_are_rarely_named(count, share):
    """`FEWEST_FOR_OUTLIERS` is from these: the rule names a tenth of what is usual among three."""
    values = np.random.default_rng(0).standard_normal((20_000, count))
    median = np.median(values, axis=1, keepdims=True)
    spread = np.median(np.abs(values - median), axis=1, keepdims=True)
    far = np.abs(0.6745 * (values - median) / spread) > statistics.FAR
    assert far.mean() == pytest.approx(share, abs=0.003)


def test_among_fewer_than_ten_none_stands_out():
    rows = pd.DataFrame({"study": [f"s{i}" for i in range(10)], "name": "error", "unit": "deg",
                         "value": [*range(9), 90.0]})  # fmt: skip
    assert outliers(rows)["study"].tolist() == ["s9"]
    assert outliers(rows.iloc[1:]).empty


def test_equal_values_have_no_outliers():
    rows = pd.DataFrame({"study": list("abc"), "name": "n", "unit": "", "value": [1.0, 1.0, 1.0]})
    assert outliers(rows).empty


def test_an_outlier_is_told_by_the_median_and_its_absolute_deviation():
    """By hand: of 0 to 9 and 90 the median is 5 and the median deviation 3. The farther of two
    comes first, and those on the other side count as well."""
    values = [*range(10), 90.0]
    rows = pd.DataFrame({"study": [f"s{i}" for i in range(11)], "name": "error", "unit": "deg",
                         "value": values})  # fmt: skip
    (found,) = outliers(rows).itertuples()
    assert (found.study, found.median) == ("s10", 5.0)
    assert found.z == pytest.approx(0.6745 * (90.0 - 5.0) / 3.0)
    both = pd.DataFrame({"study": [f"s{i}" for i in range(13)], "name": "error", "unit": "deg",
                         "value": [*range(10), 60.0, -90.0, np.nan]})  # fmt: skip
    found = outliers(both)
    assert found["study"].tolist() == ["s11", "s10"]
    assert set(found["median"]) == {4.5}
    assert found["z"].tolist() == pytest.approx([0.6745 * -94.5 / 3.0, 0.6745 * 55.5 / 3.0])
