"""The report of a cohort: `cohort.json`, `cohort.html`, and `studies.csv` and `groups.csv`."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal
from urllib.parse import quote

import pandas as pd

from gaitval.apps.cohort.run import LOG, Outcome
from gaitval.apps.cohort.table import Study
from gaitval.metrics.baselines import group_rows
from gaitval.metrics.origin import is_judged
from gaitval.metrics.results import Metrics, read_metrics
from gaitval.metrics.typed import Count, Number, Result, Size
from gaitval.metrics.verdicts import not_judged, target_text
from gaitval.reporting.written import Written
from gaitval.subjects.subject_file import load_subject


class StudyRow(Result):
    """What became of a study; what a study that is not finished lacks is empty."""

    study: str
    status: str
    reason: str
    subject: str | None = None
    trial: str | None = None
    sex: str | None = None
    age_years: Number | None = None
    mass_kg: Number | None = None
    height_m: Number | None = None
    speed_m_s: Number | None = None
    accepted: Count | None = None
    refused: Count | None = None
    failed: str | None = None
    """Acceptance limits that are not met."""
    not_judged: str | None = None
    epsilon: Number | None = None
    seconds: Size
    peak_memory: Count
    """Bytes of its largest process."""


class GroupRow(Result):
    """Mean RMSE of a recorded group of curves, both sides, and its skill against the first
    prediction without a model.
    """

    study: str
    group: str
    unit: str
    rmse: Number | None
    skill: Number | None


class CohortResult(Written):
    """What became of the studies of a cohort."""

    NAME: ClassVar[str] = "cohort"
    TEMPLATE: ClassVar[str] = "gaitval.apps.cohort:cohort.html.j2"
    TABLES: ClassVar[Mapping[str, tuple[str, type[Result]]]] = {
        "studies": ("studies", StudyRow),
        "groups": ("groups", GroupRow),
    }

    schema_version: Literal[1]
    studies: list[StudyRow]
    groups: list[GroupRow]


def write_report(out: Path, studies: Sequence[Study], outcomes: Sequence[Outcome]) -> Path:
    """Write `cohort.json`, the page and the tables of a cohort in `out`; the page's path."""
    rows: list[dict[str, Any]] = []
    groups: list[dict[str, Any]] = []
    became = {each.name: each for each in outcomes}
    for study in studies:
        outcome = became[study.name]
        row = {
            "study": study.name,
            "status": outcome.status,
            "reason": outcome.reason,
            "seconds": round(outcome.seconds, 1),
            "peak_memory": outcome.peak_memory,
        }
        if outcome.status == "finished":
            folder = out / "studies" / study.name
            metrics = read_metrics(folder)
            row |= _of_study(metrics, folder)
            groups += _groups(study.name, metrics)
        rows.append(row)
    result = CohortResult.made(studies=rows, groups=groups)
    done = [row for row in result.studies if row.status == "finished"]
    result.write(
        out,
        paper=False,
        rows=[(row, _link(row, "report.html")) for row in done],
        failures=[(row, _link(row, LOG)) for row in result.studies if row not in done],
        failing=sum(bool(row.refused) for row in done),
        unjudged=sum(bool(row.not_judged) for row in done),
        distributions=distributions(
            pd.DataFrame([dict(row) for row in result.groups], columns=list(GroupRow.model_fields))
        ),
    )
    return out / "cohort.html"


def unjudged(out: Path, outcomes: Sequence[Outcome]) -> dict[str, str]:
    """Why the verdict on a study is none, of those whose is none."""
    found = {
        each.name: not_judged(read_metrics(out / "studies" / each.name))
        for each in outcomes
        if each.status == "finished"
    }
    return {name: reason for name, reason in found.items() if reason}


def distributions(groups: pd.DataFrame) -> list[dict[str, Any]]:
    """Of each group of curves: how many studies have it, median, quartiles and the worst of its
    RMSE, and the median skill.
    """
    return [
        {
            "group": group,
            "unit": some["unit"].iloc[0],
            "count": len(some),
            "median": some["rmse"].median(),
            "low": some["rmse"].quantile(0.25),
            "high": some["rmse"].quantile(0.75),
            "worst": some["rmse"].max(),
            "skill": None if some["skill"].isna().all() else float(some["skill"].median()),
        }
        for group, some in groups.dropna(subset=["rmse"]).groupby("group", sort=False)
    ]


def _of_study(metrics: Metrics, folder: Path) -> dict[str, Any]:
    subject = load_subject(folder / "subject.toml")
    epsilon = metrics.walk.epsilon
    failed = [row for row in metrics.tolerances if row.role == "acceptance" and not row.passed]
    return {
        "subject": subject.identifier,
        "trial": subject.trial,
        "sex": subject.sex,
        "age_years": subject.age_years,
        "mass_kg": subject.mass_kg,
        "height_m": subject.height_m,
        "speed_m_s": subject.walking_speed_m_s,
        "accepted": metrics.summary.accepted,
        "refused": metrics.summary.refused,
        "failed": "; ".join(
            ", ".join(filter(None, (row.title, target_text(row.target)))) for row in failed
        ),
        "not_judged": not_judged(metrics),
        "epsilon": None if epsilon is None else epsilon.total,
    }


def _groups(name: str, metrics: Metrics) -> list[dict[str, Any]]:
    """Mean RMSE of each recorded group of curves, and its skill against the first prediction."""
    return [
        {
            "study": name,
            "group": row.group,
            "unit": row.unit,
            "rmse": row.walked,
            "skill": next(iter(row.skills().values()), None),
        }
        for row in group_rows(metrics)
        if is_judged(row.origin)  # a distance from no record is no error
    ]


def _link(row: StudyRow, file: str) -> str:
    return quote(f"studies/{row.study}/{file}")
