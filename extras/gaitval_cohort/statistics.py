"""What age, sex and speed have to do with a cohort's errors, and which studies stand out."""

import warnings
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

FEWEST_PEOPLE: Final = 5
"""Fewest people for a random effect of the person; with fewer levels its variance is not to be
estimated (Gelman and Hill 2007, Data Analysis Using Regression and Multilevel Models, 12.9)."""
ROWS_PER_TERM: Final = 5
"""Fewest studies for each coefficient. Ten are the usual rule (Harrell 2015, Regression Modeling
Strategies, 4.4: ten to twenty); below five nothing is fitted, below ten the page says so."""
FAR: Final = 3.5
"""Modified z-score above which a value stands out (Iglewicz and Hoaglin 1993, How to Detect and
Handle Outliers)."""
FEWEST_FOR_OUTLIERS: Final = 10
"""Fewest studies among which one is said to stand out: the smallest sample with which Iglewicz and
Hoaglin tried `FAR`. With 10 normal values 1.7 % of them lie beyond it; with 3, where the median
absolute deviation is the smaller of two gaps, 9.6 % do (tests/cohort/test_statistics.py)."""
_MAD_TO_SD: Final = 0.6745
"""Median absolute deviation of a normal distribution with unit SD."""


@dataclass(frozen=True)
class Effect:
    """A coefficient: its estimate and 95 % interval, in the unit of the outcome per unit."""

    term: str
    estimate: float
    low: float
    high: float
    p: float


@dataclass(frozen=True)
class MixedModel:
    """What a mixed-effects model says of an outcome.

    Attributes
    ----------
    outcome, unit : what was fitted.
    studies, people : that it was fitted to.
    effects : fixed effects; empty if nothing was fitted.
    person_sd, residual_sd : between people, and within a person.
    remark : why nothing was fitted, or what to be careful about; empty if there is nothing.
    """

    outcome: str
    unit: str
    studies: int
    people: int
    effects: tuple[Effect, ...] = ()
    person_sd: float | None = None
    residual_sd: float | None = None
    remark: str = ""


def mixed_model(rows: pd.DataFrame, outcome: str, unit: str) -> MixedModel:
    """Fit `value ~ speed + age + sex` with a random intercept of the person, by REML; `outcome` and
    `unit` name the value.

    Speed and age are about their means, so that the intercept is of a mean study. A term that does
    not vary over the studies, is unknown for some of them, or for which there are fewer than
    `ROWS_PER_TERM` studies, is left out. `rows` has columns value, speed (m/s), age (years), sex
    ("F", "M") and person; a row for each study.
    """
    known = rows.dropna(subset=["value", "speed", "person"])
    count, people = len(known), known["person"].nunique()
    few = _too_few(count, people)
    if few:
        return MixedModel(outcome, unit, count, people, remark=few)
    design, left_out = _design(known)
    remarks = list(left_out)
    if count < 2 * ROWS_PER_TERM * len(design.columns):
        remarks.append(f"{count} studies are few for {len(design.columns)} coefficients")
    return _fitted(known, design, MixedModel(outcome, unit, count, people), remarks)


def _too_few(count: int, people: int) -> str:
    if people < FEWEST_PEOPLE:
        return f"not fitted: {people} people, and a random effect needs {FEWEST_PEOPLE}"
    if people == count:
        return "not fitted: one study of each person, so person and error are the same"
    if count < 2 * ROWS_PER_TERM:
        return f"not fitted: {count} studies are too few, {2 * ROWS_PER_TERM} are needed"
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
        if values.isna().any():
            left_out.append(f"{name.partition(',')[0]} is not known of every study, so left out")
        elif values.nunique() < 2:
            left_out.append(f"{name.partition(',')[0]} does not vary, so left out")
        elif len(rows) < ROWS_PER_TERM * (len(design.columns) + 1):
            left_out.append(f"too few studies for {name.partition(',')[0]}, so left out")
        else:
            centred = name != "man, against woman"
            design[name] = values - values.mean() if centred else values
    return design, left_out


def _fitted(
    rows: pd.DataFrame, design: pd.DataFrame, of: MixedModel, remarks: list[str]
) -> MixedModel:
    from statsmodels.regression.mixed_linear_model import MixedLM

    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            found = MixedLM(rows["value"].astype(float), design, rows["person"]).fit(reml=True)
        except (np.linalg.LinAlgError, ValueError) as error:
            remark = f"not fitted: the numbers cannot be solved ({error})"
            return MixedModel(of.outcome, of.unit, of.studies, of.people, remark=remark)
    if not found.converged:
        remarks.insert(0, "did not converge: do not use these figures")
    variance = float(np.asarray(found.cov_re)[0, 0])
    # statsmodels only warns when the variance between people lies on its bound, zero.
    if variance < 1e-8 * float(found.scale) or any("boundary" in str(w.message) for w in heard):
        remarks.append("no difference between people could be distinguished from error")
    intervals = found.conf_int()
    effects = tuple(
        Effect(
            name,
            float(found.fe_params[name]),
            float(intervals.loc[name, 0]),
            float(intervals.loc[name, 1]),
            float(found.pvalues[name]),
        )
        for name in design.columns
    )
    return MixedModel(
        of.outcome,
        of.unit,
        of.studies,
        of.people,
        effects,
        float(np.sqrt(max(variance, 0.0))),
        float(np.sqrt(found.scale)),
        "; ".join(remarks),
    )


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
