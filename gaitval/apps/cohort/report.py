"""The report of a cohort: `cohort.html`, and `studies.csv` and `groups.csv` beside it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

import pandas as pd

from gaitval import __version__
from gaitval._internal.io.artefacts import write_text
from gaitval._internal.io.text_tables import csv_text
from gaitval.apps.cohort.run import LOG, Outcome
from gaitval.apps.cohort.table import Study
from gaitval.datasets.subject_file import load_subject
from gaitval.metrics.groups import group_rows
from gaitval.metrics.origin import is_judged
from gaitval.metrics.results import Metrics, read_metrics
from gaitval.metrics.verdicts import not_judged, target_text
from gaitval.reporting.page import write_html

STUDIES: Final = (
    *("study", "status", "reason", "subject", "trial", "sex", "age_years", "mass_kg", "height_m"),
    *("speed_m_s", "accepted", "refused", "failed", "not_judged", "epsilon", "seconds"),
    "peak_memory",
)
GROUPS: Final = ("study", "group", "unit", "rmse", "skill")


def write_report(out: Path, studies: Sequence[Study], outcomes: Sequence[Outcome]) -> Path:
    """Write the page and the tables of a cohort in `out`; the page's path."""
    rows: list[dict[str, Any]] = []
    groups: list[dict[str, Any]] = []
    became = {each.name: each for each in outcomes}
    for study in studies:
        outcome = became[study.name]
        row: dict[str, Any] = {"study": study.name, "status": outcome.status}
        row |= {"reason": outcome.reason, "seconds": round(outcome.seconds, 1)}
        row["peak_memory"] = outcome.peak_memory
        if outcome.status == "finished":
            folder = out / "studies" / study.name
            metrics = read_metrics(folder)
            row |= _of_study(metrics, folder)
            groups += _groups(study.name, metrics)
        rows.append(row)
    for name, columns, table in (("studies", STUDIES, rows), ("groups", GROUPS, groups)):
        cells = [[row.get(column) for column in columns] for row in table]
        write_text(out / f"{name}.csv", csv_text([columns, *cells]))
    done = [row for row in rows if row["status"] == "finished"]
    context = {
        "version": __version__,
        "total": len(studies),
        "rows": [row | {"report": _link(row, "report.html")} for row in done],
        "failures": [row | {"log": _link(row, LOG)} for row in rows if row not in done],
        "failing": sum(bool(row["refused"]) for row in done),
        "unjudged": sum(bool(row["not_judged"]) for row in done),
        "distributions": distributions(pd.DataFrame(groups, columns=list(GROUPS))),
    }
    return write_html(out, "cohort", "gaitval.apps.cohort:cohort.html.j2", context)


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


def _link(row: dict[str, Any], file: str) -> str:
    return quote(f"studies/{row['study']}/{file}")
