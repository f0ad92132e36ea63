"""Mixed models against planted effects, and what stands out."""

import numpy as np
import pandas as pd
import pytest

from gaitval.apps.cohort import statistics
from gaitval.apps.cohort.statistics import mixed_model, outliers

SPEED, AGE, MAN, BETWEEN, WITHIN = 2.0, 0.3, -0.5, 0.4, 0.2
"""Planted: per m/s, per 10 years, of men; SD between people, and within a person."""


def cohort(people, trials, seed=0):
    random = np.random.default_rng(seed)
    rows = []
    for person in range(people):
        own, age, sex = BETWEEN * random.standard_normal(), random.uniform(20, 80), "FM"[person % 2]
        for trial in range(trials):
            speed = random.uniform(0.6, 1.6)
            value = 1.0 + SPEED * speed + AGE * age / 10 + MAN * (sex == "M") + own
            value += WITHIN * random.standard_normal()
            rows.append({"value": value, "speed": speed, "age": age, "sex": sex,
                         "person": f"P{person}", "record": f"P{person} T{trial}",
                         "settings": ""})  # fmt: skip
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


@pytest.mark.slow
@pytest.mark.parametrize(("people", "trials"), [(5, 4), (10, 3)])
def test_intervals_of_few_people_cover_at_their_rate(people, trials):
    """95 % of 80 intervals of each coefficient: 72 and more but for three tries in a hundred. By z,
    and with age and sex of 5 people, that of age covered 76 %. In few of these cohorts speeds
    differ by people, so that theirs is left out."""
    truth = {"speed, per m/s": SPEED, "age, per 10 years": AGE, "man, against woman": MAN}
    inside = {}
    for seed in range(80):
        for each in mixed_model(cohort(people, trials, seed), "error", "deg").effects[1:]:
            covered = each.low < truth[each.term] < each.high
            inside.setdefault(each.term, []).append(covered)
    assert list(inside) == list(truth)[: 1 if people < 10 else 2]
    for covered in inside.values():
        assert len(covered) >= 75
        assert np.mean(covered) >= 0.9


def test_degrees_of_freedom_are_of_people_and_of_records():
    """Pinheiro and Bates 2000, 2.4.2; by hand, of 20 people with 4 records each."""
    from scipy.stats import t

    effects = {each.term: each for each in mixed_model(cohort(20, 4), "error", "deg").effects}
    assert {name: each.freedom for name, each in effects.items()} == {
        "intercept": 20 - 3,
        "speed, per m/s": 80 - 20 - 1,
        "age, per 10 years": 20 - 3,
        "man, against woman": 20 - 3,
    }
    for each in effects.values():
        half = (each.high - each.low) / 2
        error = half / t.ppf(0.975, each.freedom)
        assert each.p == pytest.approx(2 * t.sf(abs(each.estimate) / error, each.freedom))


def test_speed_of_people_who_each_have_their_own_is_told_by_people():
    rows = cohort(20, 4)
    own = rows.groupby("person")["speed"].transform("first") + 0.02 * (rows.index % 4)
    found = {e.term: e for e in mixed_model(rows.assign(speed=own), "error", "deg").effects}
    assert found["speed, per m/s"].freedom == 20 - 4
    few = cohort(7, 4)
    own = few.groupby("person")["speed"].transform("first")
    assert "too few people for speed" in mixed_model(few.assign(speed=own), "error", "deg").remark


def test_copies_of_a_record_say_nothing_more():
    """Three seeds of each record: the same intervals as of their means, not narrower ones."""
    random = np.random.default_rng(1)
    records = cohort(12, 3)
    scatter = 0.05 * random.standard_normal((3, len(records)))
    seeds = pd.concat([records.assign(value=records["value"] + each) for each in scatter])
    means = records.assign(value=records["value"] + scatter.mean(axis=0))
    several, one = (mixed_model(rows, "error", "deg") for rows in (seeds, means))
    assert (several.studies, several.records, several.people) == (108, 36, 12)
    for many, few in zip(several.effects, one.effects, strict=True):
        assert many.low == pytest.approx(few.low)
        assert many.high == pytest.approx(few.high)
    others = seeds.assign(settings=np.repeat(["a", "b", "b"], len(records)))
    remark = "studies of one record with different settings are averaged"
    assert remark in mixed_model(others, "error", "deg").remark
    assert remark not in several.remark
    one_each = cohort(12, 1)
    copies = mixed_model(pd.concat([one_each, one_each]), "error", "deg")
    assert "one record of each person" in copies.remark


@pytest.mark.parametrize("between", [0.0, BETWEEN])
@pytest.mark.parametrize("factor", [1000.0, 0.001])
def test_the_unit_makes_no_difference(factor, between):
    rows = cohort(20, 4)
    own = rows.groupby("person").ngroup().map(np.random.default_rng(2).standard_normal(20).item)
    noise = np.random.default_rng(3).standard_normal(len(rows))
    rows = rows.assign(value=SPEED * rows["speed"] + between * own + WITHIN * noise)
    found = mixed_model(rows, "error", "deg")
    other = mixed_model(rows.assign(value=factor * rows["value"]), "error", "mdeg")
    assert other.remark == found.remark
    message = "no difference between people could be distinguished from error"
    assert (message in found.remark) == (between == 0.0)
    assert other.person_sd == pytest.approx(factor * found.person_sd, rel=1e-4)
    assert other.residual_sd == pytest.approx(factor * found.residual_sd, rel=1e-4)
    for scaled, plain in zip(other.effects, found.effects, strict=True):
        for name in ("estimate", "low", "high"):
            assert getattr(scaled, name) == pytest.approx(factor * getattr(plain, name), rel=1e-4)
        assert scaled.p == pytest.approx(plain.p, rel=1e-3)


def test_standard_errors_are_those_of_statsmodels():
    """Where its Hessian is not singular, with a variance between people that is no boundary."""
    from statsmodels.regression.mixed_linear_model import MixedLM

    rows = cohort(20, 4)
    design, _ = statistics._design(rows)
    peer = MixedLM(rows["value"], design, rows["person"]).fit(reml=True)
    found = mixed_model(rows, "error", "deg")
    for each in found.effects:
        assert each.estimate == pytest.approx(peer.fe_params[each.term], rel=1e-3)
        half = statistics_t(each.freedom) * peer.bse_fe[each.term]
        assert each.high - each.estimate == pytest.approx(half, rel=1e-3)


def statistics_t(freedom):
    from scipy.stats import t

    return float(t.ppf(0.975, freedom))


def test_equal_values_are_not_fitted():
    assert "all values are equal" in mixed_model(cohort(8, 3).assign(value=0.1), "e", "deg").remark


@pytest.mark.parametrize(
    ("people", "trials", "message"),
    [
        (1, 5, "1 person, and a random effect needs 5"),
        (4, 5, "4 people, and a random effect needs 5"),
        (12, 1, "one record of each person"),
        (5, 1, "one record of each person"),
    ],
)
def test_too_few_are_not_fitted(people, trials, message):
    found = mixed_model(cohort(people, trials), "error", "deg")
    assert message in found.remark
    assert not found.effects


def test_terms_for_which_there_are_too_few_records_or_people_are_left_out():
    found = mixed_model(cohort(7, 2), "error", "deg")
    assert "too few records for age" in found.remark
    assert "too few records for man" in found.remark
    assert [each.term for each in found.effects] == ["intercept", "speed, per m/s"]
    assert "too few people for age" in mixed_model(cohort(9, 8), "error", "deg").remark
    ten = mixed_model(cohort(10, 8), "error", "deg")
    assert ten.remark == "too few people for man, so left out"
    assert mixed_model(cohort(15, 8), "error", "deg").remark == ""


def test_a_term_that_does_not_vary_or_is_unknown_is_left_out():
    rows = cohort(20, 4).assign(sex="F")
    rows.loc[0, "age"] = np.nan
    found = mixed_model(rows, "error", "deg")
    assert "man does not vary" in found.remark
    assert "age is not known of every record" in found.remark


def test_people_who_do_not_differ_are_told():
    rows = cohort(20, 4)
    random = np.random.default_rng(1)
    found = mixed_model(rows.assign(value=random.standard_normal(len(rows))), "error", "deg")
    assert found.person_sd is not None
    # with no difference planted, half of such cohorts end on the bound; this seed does
    assert found.person_sd < 0.35
    assert "no difference between people could be distinguished from error" in found.remark


def test_people_who_do_not_differ_are_said_to_at_the_level_of_the_test():
    """p is uniform if people do not differ; the tolerances are two standard errors."""
    p, rows = [], cohort(12, 3)
    design, _ = statistics._design(rows)
    for seed in range(400):
        values = pd.Series(np.random.default_rng(seed).standard_normal(len(rows)), rows.index)
        p.append(statistics._people_p(values, design, rows["person"]))
    assert np.mean(np.array(p) < 0.05) == pytest.approx(0.05, abs=0.022)
    assert np.mean(p) == pytest.approx(0.5, abs=0.03)


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
