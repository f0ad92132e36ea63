"""What age, sex and speed have to do with a cohort's errors, and which studies stand out."""

import warnings
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pandas as pd

from gaitval.errors import count_of

FEWEST_PEOPLE: Final = 5
"""Fewest people for a random effect of the person; with fewer levels its variance is not to be
estimated (Gelman and Hill 2007, Data Analysis Using Regression and Multilevel Models, 12.9)."""
ROWS_PER_TERM: Final = 5
"""Fewest records for each coefficient, and fewest people for each that is of a person. Ten are the
usual rule (Harrell 2015, Regression Modeling Strategies, 4.4: ten to twenty); below five nothing is
fitted, below ten the page says so."""
WITHIN: Final = 0.5
"""Variance of speed within a person, of that of all records, from which on a person's records say
what speed does. Where it is less, people do: with speeds of SD 0.29 m/s between 5 or 6 people and
0.05 to 0.2 m/s within, intervals with the records' degrees of freedom covered 91 to 92 %."""
NOTHING: Final = 1e-8
"""Variance between people, of that within a person, below which it is zero: the optimiser comes
near the bound, and no two times as near."""
LEVEL: Final = 0.05
"""p above which people are not told from error."""
FAR: Final = 3.5
"""Modified z-score above which a value stands out (Iglewicz and Hoaglin 1993, How to Detect and
Handle Outliers)."""
FEWEST_FOR_OUTLIERS: Final = 10
"""Fewest records among which one is said to stand out: the smallest sample with which Iglewicz and
Hoaglin tried `FAR`. With 10 normal values 1.7 % of them lie beyond it; with 3, where the median
absolute deviation is the smaller of two gaps, 9.6 % do (tests/cohort/test_statistics.py)."""
_MAD_TO_SD: Final = 0.6745
"""Median absolute deviation of a normal distribution with unit SD."""


@dataclass(frozen=True)
class Effect:
    """A coefficient: its estimate and 95 % interval, in the unit of the outcome per unit, with the
    degrees of freedom of its Student's t.
    """

    term: str
    estimate: float
    low: float
    high: float
    p: float
    freedom: int


@dataclass(frozen=True)
class MixedModel:
    """What a mixed-effects model says of an outcome.

    Attributes
    ----------
    outcome, unit : what was fitted.
    studies, records, people : that it was fitted to.
    effects : fixed effects; empty if nothing was fitted.
    person_sd, residual_sd : between people, and within a person.
    remark : why nothing was fitted, or what to be careful about; empty if there is nothing.
    """

    outcome: str
    unit: str
    studies: int
    records: int
    people: int
    effects: tuple[Effect, ...] = ()
    person_sd: float | None = None
    residual_sd: float | None = None
    remark: str = ""


def mixed_model(rows: pd.DataFrame, outcome: str, unit: str) -> MixedModel:
    """Fit `value ~ speed + age + sex` with a random intercept of the person, by REML, to the mean
    value of each record; `outcome` and `unit` name the value.

    Speed and age are about their means, so that the intercept is of a mean record. A term that does
    not vary over the records, is unknown for some of them, or for which there are fewer than
    `ROWS_PER_TERM` records, or people, is left out. `rows` has columns value, speed (m/s), age
    (years), sex ("F", "M"), person, record and settings; a row for each study.

    Intervals and p are of Student's t, with the degrees of freedom of Pinheiro and Bates 2000,
    Mixed-Effects Models in S and S-PLUS, 2.4.2: what does not vary within a person has as many as
    there are people less such coefficients, the others records less people less such coefficients.
    """
    known = rows.dropna(subset=["value", "speed", "person"])
    records = one_of_each_record(known)
    people = records["person"].nunique()
    of = MixedModel(outcome, unit, len(known), len(records), people)
    few = _too_few(records)
    if few:
        return replace(of, remark=few)
    design, left_out = _design(records)
    remarks = list(left_out)
    if (known.groupby("record")["settings"].nunique() > 1).any():
        remarks.append("studies of one record with different settings are averaged")
    if len(records) < 2 * ROWS_PER_TERM * len(design.columns):
        remarks.append(f"{len(records)} records are few for {len(design.columns)} coefficients")
    return _fitted(records, design, of, remarks)


def one_of_each_record(rows: pd.DataFrame, *also: str) -> pd.DataFrame:
    """`rows` with one for each record, and each of the columns `also`: the mean value of its
    studies, which are no independent observations, and the other columns of the first.
    """
    keys = ["record", *also]
    means = rows.groupby(keys, sort=False)["value"].transform("mean")
    return rows.assign(value=means).drop_duplicates(keys)


def _too_few(records: pd.DataFrame) -> str:
    count, people = len(records), records["person"].nunique()
    if people < FEWEST_PEOPLE:
        seen = count_of(people, "person", "people")
        return f"not fitted: {seen}, and a random effect needs {FEWEST_PEOPLE}"
    if people == count:
        return "not fitted: one record of each person, so person and error are the same"
    if count < 2 * ROWS_PER_TERM:
        return f"not fitted: {count} records are too few, {2 * ROWS_PER_TERM} are needed"
    values = records["value"].astype(float)
    # equal but for the last digits of the arithmetic
    if np.ptp(values) <= 1e-12 * values.abs().max():
        return "not fitted: all values are equal"
    return ""


def _design(rows: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """The fixed effects of `mixed_model`, and what was left out and why."""
    design = pd.DataFrame({"intercept": np.ones(len(rows))}, index=rows.index)
    left_out = []
    candidates = {
        "speed, per m/s": rows["speed"].astype(float),
        "age, per 10 years": rows["age"].astype(float) / 10.0,
        "man, against woman": (rows["sex"] == "M").astype(float),
    }
    for name, values in candidates.items():
        short = name.partition(",")[0]
        wider = design.assign(**{name: values})
        of_people = _of_person(wider, rows["person"])
        if values.isna().any():
            left_out.append(f"{short} is not known of every record, so left out")
        elif values.nunique() < 2:
            left_out.append(f"{short} does not vary, so left out")
        elif len(rows) < ROWS_PER_TERM * len(wider.columns):
            left_out.append(f"too few records for {short}, so left out")
        elif of_people[name] and rows["person"].nunique() < ROWS_PER_TERM * of_people.sum():
            left_out.append(f"too few people for {short}, so left out")
        else:
            centred = name != "man, against woman"
            design[name] = values - values.mean() if centred else values
    return design, left_out


def _of_person(design: pd.DataFrame, person: "pd.Series[str]") -> "pd.Series[bool]":
    """Which columns of `design` tell people apart and not a person's records: all but a speed that
    varies within a person, by `WITHIN`.
    """
    inside = design - design.groupby(person).transform("mean")
    freedom = max(len(design) - person.nunique(), 1)
    within = (inside**2).sum() / freedom >= WITHIN * design.var()
    return ~(within & design.columns.str.startswith("speed"))


def _fitted(
    rows: pd.DataFrame, design: pd.DataFrame, of: MixedModel, remarks: list[str]
) -> MixedModel:
    from scipy.stats import t
    from statsmodels.regression.mixed_linear_model import MixedLM

    values = rows["value"].astype(float)
    # The optimiser has absolute tolerances: without the SD, its answer would depend on the unit.
    middle, unit = float(values.mean()), float(values.std())
    standard = (values - middle) / unit
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what they say is looked at below, whatever the unit
        try:
            # Where people do not differ, methods that follow the gradient stop on the way to zero.
            found = MixedLM(standard, design, rows["person"]).fit(reml=True, method=["powell"])
        except (np.linalg.LinAlgError, ValueError) as error:
            return replace(of, remark=f"not fitted: the numbers cannot be solved ({error})")
    if not found.converged:
        remarks.insert(0, "did not converge: do not use these figures")
    if _people_p(standard, design, rows["person"]) > LEVEL:
        remarks.append("no difference between people could be distinguished from error")
    variance, scale = float(np.asarray(found.cov_re)[0, 0]), float(found.scale)
    if variance < NOTHING * scale:
        variance = 0.0
    standard_errors = _standard_errors(design, rows["person"], variance, scale)
    between = _of_person(design, rows["person"])
    effects = []
    for name, spread in zip(design.columns, standard_errors, strict=True):
        if between[name]:
            freedom = of.people - int(between.sum())
        else:
            freedom = max(of.records - of.people - int((~between).sum()), 1)
        estimate = float(found.fe_params[name])
        half = float(t.ppf(0.975, freedom)) * spread
        start = middle if name == "intercept" else 0.0
        p = 2.0 * float(t.sf(abs(start / unit + estimate) / spread, freedom))
        low, high = start + unit * (estimate - half), start + unit * (estimate + half)
        effects.append(Effect(name, start + unit * estimate, low, high, p, freedom))
    return replace(
        of,
        effects=tuple(effects),
        person_sd=unit * float(np.sqrt(variance)),
        residual_sd=unit * float(np.sqrt(scale)),
        remark="; ".join(remarks),
    )


def _standard_errors(
    design: pd.DataFrame, person: "pd.Series[str]", variance: float, scale: float
) -> list[float]:
    """Of the coefficients, given the variances between people and within a person. statsmodels has
    them from its Hessian, which is singular where people do not differ.
    """
    fixed = design.to_numpy(dtype=float)
    of_person = pd.get_dummies(person).to_numpy(dtype=float)
    covariance = scale * np.eye(len(fixed)) + variance * of_person @ of_person.T
    information = fixed.T @ np.linalg.solve(covariance, fixed)
    return [float(each) for each in np.sqrt(np.diag(np.linalg.inv(information)))]


def _people_p(values: "pd.Series[float]", design: pd.DataFrame, person: "pd.Series[str]") -> float:
    """p of people who do not differ but by `design`: the exact F-test of their variance (Wald 1947,
    Ann Math Stat 18:586); 1 if there are too few records of a person to tell error.
    """
    from scipy.stats import f

    fixed = design.to_numpy(dtype=float)
    each = np.column_stack([fixed, pd.get_dummies(person).to_numpy(dtype=float)])
    rss, rank = np.zeros(2), np.zeros(2)
    for place, columns in enumerate((fixed, each)):
        solved, _, rank[place], _ = np.linalg.lstsq(columns, values, rcond=None)
        rss[place] = np.sum((values - columns @ solved) ** 2)
    more, left = rank[1] - rank[0], len(values) - rank[1]
    if more < 1 or left < 1:
        return 1.0
    return float(f.sf((rss[0] - rss[1]) / more / (rss[1] / left), more, left))


def outliers(rows: pd.DataFrame) -> pd.DataFrame:
    """Those of `rows` (columns study, name, unit, value) whose value is far from the others of the
    same `name`, of which there must be `FEWEST_FOR_OUTLIERS`; with the columns median and z, the
    modified z-score, the farthest first.
    """
    known = rows.dropna(subset=["value"])
    groups = known.groupby("name")["value"]
    median = groups.transform("median")
    # Median absolute deviation: one far study does not widen the scale that it is judged by.
    spread = (known["value"] - median).abs().groupby(known["name"]).transform("median")
    z = _MAD_TO_SD * (known["value"] - median) / spread.where(spread > 0.0)
    found = known.assign(median=median, z=z)
    enough = groups.transform("size") >= FEWEST_FOR_OUTLIERS
    far = found[enough & (found["z"].abs() > FAR)]
    return far.reindex(far["z"].abs().sort_values(ascending=False).index)
