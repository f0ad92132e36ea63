"""The report of a cohort: `cohort.html`, with its tables as CSV and Parquet beside it."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

import numpy as np
import pandas as pd

from gaitval import __version__
from gaitval.apps.cohort.figures import IDENTIFIED, by_speed_age_sex, parameter_distributions
from gaitval.apps.cohort.results import (
    PROFILE_SCORES,
    mean_of_measure,
    people_of,
    records_of,
    tables_of,
    with_people,
    write_tables,
)
from gaitval.apps.cohort.statistics import (
    FAR,
    FEWEST_FOR_OUTLIERS,
    FEWEST_PEOPLE,
    mixed_model,
    one_of_each_record,
    outliers,
)
from gaitval.apps.cohort.store import LOG, Store
from gaitval.reporting.page import write_html

PAGE: Final = "cohort"
_DIGITS: Final = {"Nm/kg": 3}


def write_report(folder: Path, store: Store, outcomes: Sequence[Mapping[str, Any]]) -> Path:
    """Write the page and the tables of a cohort into `folder`; the page.

    `outcomes` says what became of each study in `store` (`engine.run_cohort`).
    """
    tables = tables_of(store, outcomes)
    write_tables(folder, tables)
    return write_html(
        folder, PAGE, "gaitval.apps.cohort:cohort.html.j2", context_of(folder, store, tables)
    )


def context_of(folder: Path, store: Store, tables: Mapping[str, pd.DataFrame]) -> dict[str, Any]:
    """What the page in `folder` shows of `tables` and the files in `store`, for its template."""
    studies = tables["studies"]
    done = studies[studies["status"] == "finished"]
    values = values_of(tables)
    # Seeds of one record are no independent observations: their mean is one.
    means = one_of_each_record(values, "name", "settings")
    seeds = values.groupby(["name", "record", "settings"])["study"].agg(list)
    errors = list(dict.fromkeys(values.loc[values["kind"] == "error", "name"]))
    skills = list(dict.fromkeys(values.loc[values["kind"] == "skill", "name"]))
    links = {name: _link(folder, store, name, "report.html") for name in done["study"]}
    failing = done["refused"] > 0
    unjudged = ~failing & (done["not_judged"].fillna("") != "")
    return {
        "title": _title(folder.resolve().name),
        "version": __version__,
        "total": len(studies),
        "finished": len(done),
        "records": records_of(done).nunique(),
        "people": people_of(done).nunique(),
        "clean": int((~failing & ~unjudged).sum()),
        "failing": int(failing.sum()),
        "unjudged": int(unjudged.sum()),
        "ages": _range(done["age"], 0, "years"),
        "speeds": _range(done["speed"], 2, "m/s"),
        "seconds": _range(done["seconds"], 0, "s"),
        "memory": _range(done["peak_memory"].nlargest(1) / 1e6, 0, "MB"),
        "failures": _failures(folder, store, studies),
        "distributions": _distributions(means),
        "errors": _against(means, errors, "errors"),
        "skills": _against(means, skills, "skill"),
        "fewest_people": FEWEST_PEOPLE,
        "models": [
            mixed_model(values[values["name"] == name], name, _unit(values, name))
            for name in errors
        ],
        "far": FAR,
        "fewest_for_outliers": FEWEST_FOR_OUTLIERS,
        "most_values": means["name"].value_counts().max() if len(means) else 0,
        "outliers": [
            {
                **row,
                "studies": [
                    (name, links[name])
                    for name in seeds[row["name"], row["record"], row["settings"]]
                ],
                "digits": _digits(row["unit"]),
            }
            for row in outliers(means).to_dict("records")
        ],
        "parameters": _parameters(tables["parameters"]),
        "determined": _determined(tables["parameters"]),
        "strategies": strategies(tables["devices"]),
        "rows": [
            {**row, "report": links[row["study"]], "megabytes": row["peak_memory"] / 1e6}
            for row in done.astype({"accepted": int, "refused": int}).to_dict("records")
        ],
    }


def strategies(devices: pd.DataFrame) -> list[dict[str, Any]]:
    """What each study's searches found: `study`, `quantity`, `unit`, and its value `without` the
    device and `found` with it.
    """
    found = devices[devices["of"] == "strategy found"]
    keys = ["study", "quantity", "unit"]
    plain = devices[devices["of"] == "without"]
    rows = found.merge(plain, on=keys, suffixes=("_found", "_without"))
    named = rows.rename(columns={"value_found": "found", "value_without": "without"})
    return [
        {str(key): value for key, value in row.items()}
        for row in named[[*keys, "without", "found"]].to_dict("records")
    ]


def values_of(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """The values of `tables` that the page shows the distribution of: study, name, kind (error,
    skill), unit, value, and who walked; a row for each study.
    """
    groups = tables["groups"]
    errors = groups.assign(name=groups["group"], kind="error", value=groups["rmse"])
    skills = groups.assign(
        name="skill, " + groups["group"].astype(str), kind="skill", unit="", value=groups["skill"]
    )
    scores = mean_of_measure(tables["measures"], PROFILE_SCORES)
    scores = scores.assign(name=scores["measure"].str.replace("_", " "), kind="error")
    columns = ["study", "name", "kind", "unit", "value"]
    parts = [part[columns] for part in (errors, scores, skills) if not part.empty]
    found = pd.concat(parts) if parts else pd.DataFrame(columns=columns)
    found["value"] = found["value"].astype(float)
    return with_people(found, tables["studies"])


def _title(name: str) -> str:
    """The name of the folder, unless it only says what the page says anyway."""
    return "" if name.lower() == "cohort" else name


def _against(values: pd.DataFrame, names: Sequence[str], figure_name: str) -> str:
    """Values against speed, age and sex; nothing for fewer people than a model needs, with whom a
    panel shows no more than the table does.
    """
    if not names or values["person"].nunique() < FEWEST_PEOPLE:
        return ""
    return by_speed_age_sex(values, names, figure_name=figure_name)


def _link(folder: Path, store: Store, name: str, file: str) -> str:
    """Where a study's file is, relative to the page if both are on this disk."""
    where = store.where(name, file)
    if store.local is None:
        return where
    try:
        return quote(Path(os.path.relpath(where, folder)).as_posix())
    except ValueError:  # another drive of Windows
        return Path(where).resolve().as_uri()


def _failures(folder: Path, store: Store, studies: pd.DataFrame) -> list[dict[str, Any]]:
    failed = studies[studies["status"] != "finished"]
    return [
        {"study": name, "status": status, "reason": why, "log": _link(folder, store, name, LOG)}
        for name, status, why in failed[["study", "status", "reason"]].itertuples(index=False)
    ]


def _range(values: pd.Series, digits: int, unit: str) -> str:
    known = values.dropna().astype(float)
    if known.empty:
        return "not known"
    low, high = f"{known.min():.{digits}f}", f"{known.max():.{digits}f}"
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"


def _distributions(values: pd.DataFrame) -> list[dict[str, Any]]:
    rows = []
    for name, some in values.groupby("name", sort=False):
        known = some["value"].dropna().to_numpy(dtype=float)
        if not len(known):
            continue
        low, median, high = np.percentile(known, [25, 50, 75])
        unit, count = str(some["unit"].iloc[0]), some.dropna(subset=["value"])["record"].nunique()
        worst = known.min() if some["kind"].iloc[0] == "skill" else known.max()
        rows.append(
            {"name": name, "unit": unit, "count": count, "low": low, "median": median,
             "high": high, "worst": worst, "digits": _digits(unit)}
        )  # fmt: skip
    return rows


def _digits(unit: str) -> int:
    return _DIGITS.get(unit, 2)


def _unit(values: pd.DataFrame, name: str) -> str:
    return str(values.loc[values["name"] == name, "unit"].iloc[0])


def _parameters(parameters: pd.DataFrame) -> str:
    known = _known(parameters)
    if not (known["verdict"] == IDENTIFIED).any():
        return ""
    return parameter_distributions(known, figure_name="parameters")


def _determined(parameters: pd.DataFrame) -> tuple[int, int]:
    """How many parameters of studies their records determine, and how many there are."""
    known = _known(parameters)
    return int((known["verdict"] == IDENTIFIED).sum()), len(known)


def _known(parameters: pd.DataFrame) -> pd.DataFrame:
    """Those of `parameters` that a record could say something of."""
    return parameters[parameters["prior_sd"].astype(float) > 0.0]
