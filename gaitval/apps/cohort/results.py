"""The tables of a cohort, from the summaries of its studies: for its report and one's own analysis.

`studies`: a row for each study, finished or not. `measures`: a row for each measured value.
`groups`: a row for each group of curves. `parameters`: a row for each identified parameter.
`limits`: a row for each limit that an imported recording is held against. `devices`: a row for each
figure of walks with devices, and for what a search found. All are tidy (one row a
value) except `studies`, and every row names its study.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import pandas as pd

from gaitval.apps.cohort.store import Store
from gaitval.apps.cohort.task import summary_of
from gaitval.artefacts import replacing
from gaitval.text_tables import no_formula

TABLES: Final = ("studies", "measures", "groups", "parameters", "limits", "devices")

STUDY_COLUMNS: Final = (
    "study", "status", "reason", "identifier", "laboratory", "person", "trial", "source", "sex",
    "age", "mass", "height", "leg_length", "speed", "accepted", "refused", "goals", "goals_reached",
    "failed", "not_judged", "epsilon", "seconds", "peak_memory", "worker", "folder", "record",
    "settings",
)  # fmt: skip
"""Of `studies`: years, kg, m, m/s; limits met and failed; s and bytes; hashes of the record and of
how it was done but for the seed, empty if they are not known."""
COLUMNS: Final[Mapping[str, tuple[str, ...]]] = {
    "studies": STUDY_COLUMNS,
    "measures": ("study", "measure", "target", "unit", "value"),
    "groups": ("study", "group", "unit", "rmse", "skill"),
    "parameters": (
        "study", "parameter", "unit", "nominal", "prior_sd", "mean", "sd", "identified", "verdict",
    ),
    "limits": ("study", "quantity", "target", "value", "limit", "unit", "verdict"),
    "devices": ("study", "quantity", "of", "unit", "value"),
}  # fmt: skip
PROFILE_SCORES: Final = ("gait_profile_score", "gait_profile_score_of_the_record")
"""Measures of the walk and of its record, deg."""
VERDICTS: Final = ("accepted", "refused", "goals", "goals_reached")


def tables_of(store: Store, outcomes: Sequence[Mapping[str, Any]]) -> dict[str, pd.DataFrame]:
    """The tables of `TABLES` of the studies in `store`, in their order; `outcomes` says what became
    of each (`task.run_order`).
    """
    rows: dict[str, list[dict[str, Any]]] = {name: [] for name in TABLES}
    for outcome in outcomes:
        name = outcome["name"]
        summary = summary_of(store, name) if outcome["status"] == "finished" else None
        rows["studies"].append(_study_row(store, outcome, summary or {}))
        for table in TABLES[1:]:
            rows[table] += [{**row, "study": name} for row in (summary or {}).get(table, ())]
    return {name: pd.DataFrame(rows[name], columns=COLUMNS[name]) for name in TABLES}


def _study_row(
    store: Store, outcome: Mapping[str, Any], summary: Mapping[str, Any]
) -> dict[str, Any]:
    verdicts = summary.get("verdicts", {})
    return {
        "study": outcome["name"],
        "status": outcome["status"],
        "reason": outcome["reason"],
        **summary.get("subject", {}),
        **{name: verdicts.get(name) for name in VERDICTS},
        "failed": "; ".join(verdicts.get("failed", ())),
        "not_judged": verdicts.get("not_judged", ""),
        "epsilon": summary.get("epsilon"),
        "seconds": outcome["seconds"],
        "peak_memory": outcome["peak_memory"],
        "worker": outcome["worker"],
        "folder": store.where(outcome["name"]),
        "record": summary.get("record", ""),
        "settings": summary.get("settings", ""),
    }


def write_tables(folder: Path, tables: Mapping[str, pd.DataFrame]) -> list[Path]:
    """Write each of `tables` into `folder` as CSV and as Parquet; the files."""
    written = []
    for name, table in tables.items():
        for kind in ("csv", "parquet"):
            path = folder / f"{name}.{kind}"
            with replacing(path) as temporary:
                if kind == "csv":
                    table.map(no_formula).to_csv(temporary, index=False)
                else:
                    table.to_parquet(temporary, index=False)
            written.append(path)
    return written


def people_of(studies: pd.DataFrame) -> "pd.Series[str]":
    """Who walked in each of `studies`, by laboratory and person: no two people share both.

    A recording of nobody named is of a person of the study's name. Several seeds of it have several
    names: all are the person of the first.
    """
    named = studies["laboratory"].fillna("").astype(str) + " " + studies["person"].astype(str)
    if "record" not in studies:
        return named
    record = studies["record"].fillna("").astype(str)
    return named.where(record == "", named.groupby(record).transform("first"))


def records_of(studies: pd.DataFrame) -> "pd.Series[str]":
    """Which record each of `studies` is of: the person, the trial and the speed (m/s), because
    files of one name from two days may be two trials.
    """
    speed = studies["speed"].astype(float).round(6).astype(str)
    return people_of(studies) + " " + studies["trial"].astype(str) + " " + speed


def with_people(table: pd.DataFrame, studies: pd.DataFrame) -> pd.DataFrame:
    """A `table` with who walked in `studies` beside each row: `people_of`, sex, age, speed; and
    which record it was (`records_of`), with which settings.
    """
    done = studies[studies["status"] == "finished"]
    about = done[["study", "sex", "age", "speed", "settings"]].assign(
        person=people_of(done), record=records_of(done)
    )
    return table.merge(about, on="study")


def mean_of_measure(measures: pd.DataFrame, names: Iterable[str]) -> pd.DataFrame:
    """Mean over targets of each study's measures of these names."""
    chosen = measures[measures["measure"].isin(list(names))].dropna(subset=["value"])
    found = chosen.groupby(["study", "measure", "unit"], as_index=False)["value"].mean()
    return pd.DataFrame(found)
