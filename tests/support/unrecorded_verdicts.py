"""Count the comparisons with what nobody recorded that carry a verdict, a goal or a skill.

The walks of a finished run are held against three other sides that were not recorded, as gaitval
meets them: predicted (no record at that speed), mirrored (one side is the other's) and expected (no
force plates). Every output is written from that and read: metrics.json, the report, what commands
print, Python, a cohort's rows, the comparison of walks and JUnit XML.
"""

import io
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from html import unescape
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pandas as pd
from html_page import both_pages
from rich.console import Console

from gaitval._internal.io.artefacts import read_json
from gaitval.apps.cohort.report import _groups
from gaitval.apps.regression.comparison_page import write_comparison
from gaitval.apps.regression.regression import compare, write_junit
from gaitval.apps.regression.versions import StoredWalk, matched
from gaitval.cli.predict import print_distances
from gaitval.cli.terminal import display
from gaitval.configuration import Configuration
from gaitval.metrics.baselines import group_rows
from gaitval.metrics.curve_results import OF_SKILL
from gaitval.metrics.origin import (
    curve_origin,
    is_judged,
    measure_origin,
)
from gaitval.metrics.results import Metrics, metrics_from
from gaitval.metrics.tolerances import evaluate, load_registry, measured
from gaitval.metrics.verdicts import target_text
from gaitval.reporting.report import write_report
from gaitval.subjects.subject import Subject

Json = Mapping[str, Any]

PREDICTED_SPEED = 0.9
"""Of the recorded speed: near enough to be predicted, and not recorded."""


def predicted(person: Subject, of: Configuration) -> tuple[Subject, Configuration]:
    """The run at a speed that nobody recorded."""
    speed = PREDICTED_SPEED * person.walking_speed_m_s
    record = of.record.model_copy(update={"speed": speed, "holdout": ""})
    return person, of.model_copy(update={"record": record})


def mirrored(person: Subject, of: Configuration) -> tuple[Subject, Configuration]:
    """The person whose left side is the right one's, mirrored."""
    gait = person.gait.model_copy(update={"mirrored": {"angles": "left", "kinetics": "left"}})
    return person.model_copy(update={"gait": gait}), of


def expected(person: Subject, of: Configuration) -> tuple[Subject, Configuration]:
    """The person without force plates."""
    gait = person.gait.model_copy(update={"moments": {}, "forces": None})
    without = {"gait": gait, "plates": None, "trials": (), "mean_vertical_force": None}
    return person.model_copy(update=without), of


def absent(person: Subject, of: Configuration) -> tuple[Subject, Configuration]:
    """The person of whom no cycle of the left side was recorded."""

    def right(curves: Mapping[str, Any]) -> dict[str, Any]:
        return {name: curve for name, curve in curves.items() if not name.endswith("_l")}

    gait = person.gait
    forces = None if gait.forces is None else gait.forces.model_copy(update={"left": None})
    parts = {
        "angles": right(gait.angles),
        "moments": right(gait.moments),
        "forces": forces,
        "not_recorded": {"angles": "left", "kinetics": "left"},
    }
    stance = person.stance_fraction.model_copy(update={"left": None})
    without = {"gait": gait.model_copy(update=parts), "stance_fraction": stance, "trials": ()}
    return person.model_copy(update=without), of


CASES: dict[str, Callable[[Subject, Configuration], tuple[Subject, Configuration]]] = {
    "predicted": predicted,
    "mirrored": mirrored,
    "expected": expected,
    "absent": absent,
}


def judged_in(folder: Path) -> dict[str, list[str]]:
    """What carries a verdict, goal or skill and was not recorded, by output of a run folder.

    Parameters
    ----------
    folder : with `metrics.json`, `subject.toml` and what the report needs. The report is written.
    """
    metrics = read_json(folder / "metrics.json")
    write_report(folder)
    return {
        "metrics.json": list(_in_metrics(metrics)),
        "report": list(_in_report(metrics, both_pages(folder))),
        "terminal": list(_in_terminal(metrics)),
        "Python": list(_in_python(metrics, folder)),
        "cohort": list(_in_cohort(metrics, folder)),
        "compare": list(_in_comparison(metrics, folder)),
        "check": list(_in_check(metrics)),
    }


def typed(metrics: Json) -> Metrics:
    """What a file holds, as the package uses it."""
    return metrics_from(metrics, "metrics.json")


def unjudgeable(metrics: Json) -> list[tuple[str, str, str]]:
    """Title, measure and target of every limit that would judge by what was not recorded."""
    origins = typed(metrics).origins
    rows = [measured(row["measure"], row["target"], row["value"]) for row in metrics["measures"]]
    return [
        (verdict.title, verdict.measure, verdict.target)
        for verdict in evaluate(rows)
        if not is_judged(measure_origin(verdict.measure, verdict.target, origins))
    ]


def never_judged(metrics: Json) -> set[str]:
    """Titles of limits of which no value at all may be judged."""
    allowed = {row["title"] for row in metrics["tolerances"]}
    return {title for title, _, _ in unjudgeable(metrics)} - allowed


def _in_metrics(metrics: Json) -> Iterator[str]:
    origins = typed(metrics).origins

    def judged(row: Json) -> bool:
        return is_judged(measure_origin(row["measure"], row["target"], origins))

    for row in metrics["tolerances"]:
        if not judged(row):
            yield f"verdict on {row['measure']} of {row['target']}"
    for row in metrics["measures"]:
        if row["measure"] in OF_SKILL and not judged(row):
            yield f"{row['measure']} of {row['target']}"
        if row["origin"] != measure_origin(row["measure"], row["target"], origins):
            yield f"origin of {row['measure']} of {row['target']}"
    deciding = [row for row in metrics["tolerances"] if row["role"] == "acceptance"]
    if sum(metrics["summary"][key] for key in ("accepted", "refused")) != len(deciding):
        yield "summary counts more than the verdicts"
    for guess in metrics["predictions"]:
        for kind, errors in guess["rmse"].items():
            for name, error in errors.items():
                if error is not None and curve_origin(kind, name, origins) != "recorded":
                    yield f"error of the guess {guess['name']} of {name}"
    yield from _in_statistics(metrics)
    if not typed(metrics).is_recorded_at_all and metrics["unseen"]:
        yield "unseen trials beside a prediction"
    second_engine = metrics.get("second_engine")
    if second_engine is not None:
        rows = [
            measured(row["measure"], row["target"], row["value"])
            for row in second_engine["measures"]
        ]
        limits = [
            verdict
            for verdict in evaluate(rows)
            if verdict.role == "acceptance"
            and is_judged(measure_origin(verdict.measure, verdict.target, origins))
        ]
        if second_engine["limits"] > len(limits):
            yield "limits in the second engine"


def _in_statistics(metrics: Json) -> Iterator[str]:
    found, origins = metrics["gait_profiles"], typed(metrics).origins
    if found is None:
        return
    if found["record"] and set(origins["angles"].values()) != {"recorded"}:
        yield "Gait Profile Score of the record"


def _in_report(metrics: Json, html: str) -> Iterator[str]:
    text = unescape(re.sub(r"<[^>]+>", " ", html))
    if not typed(metrics).is_recorded_at_all:
        for words in ("acceptance criteria passed", "Nearer than the best"):
            if words in text:
                yield f"the report says {words!r}"
        if "accuracy is not judged" not in text:
            yield "the report does not say that accuracy is not judged"
    forbidden = never_judged(metrics)
    for row in re.findall(r"<tr[^>]*>.*?</tr>", html, re.DOTALL):
        cells = unescape(re.sub(r"<[^>]+>", " ", row))
        for title in forbidden:
            if title in cells:
                yield f"a row of the report has {title!r}"
        # a row of errors: guess and skill have no figure where the curve was not recorded
        if ", not recorded</td>" in row and row.count('<td class="n">–</td>') < 2:
            yield f"a row of errors has a guess: {cells.split()}"
    for row in group_rows(typed(metrics)):
        if not is_judged(row.origin) and any(each is not None for each in row.skills().values()):
            yield f"skill of {row.group}"


def _printed(metrics: Json) -> str:
    """What the commands print of the metrics."""
    console, before = Console(file=io.StringIO(), width=400), display.output
    display.output = console
    try:
        if typed(metrics).is_recorded_at_all:
            display.print_errors(typed(metrics))
        else:
            print_distances(typed(metrics))
        display.print_tolerances(typed(metrics))
        display.print_verdict(typed(metrics))
    finally:
        display.output = before
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def _in_terminal(metrics: Json) -> Iterator[str]:
    lines = _printed(metrics).splitlines()
    for title, _, target in unjudgeable(metrics):
        words = target_text(target)
        for line in lines:
            cells = [cell.strip() for cell in line.split("│")]
            if title in cells and words in cells:
                yield f"the terminal judges {title}, {words}"
    forbidden = never_judged(metrics)
    for line in lines:
        if any(line.strip().startswith(f"{r} {t}:") for r in ("acceptance", "context")
               for t in forbidden):  # fmt: skip
            yield f"the terminal ends with {line.strip()}"
    last = lines[-12:]
    if not typed(metrics).is_recorded_at_all and not any("not judged" in line for line in lines):
        yield f"the terminal does not say that accuracy is not judged: {last}"


def _in_python(metrics: Json, folder: Path) -> Iterator[str]:
    study = typed(metrics)
    for title in sorted(never_judged(metrics) & set(study.overview()["quantity"])):
        yield f"the summary of a study has {title}"
    if not typed(metrics).is_recorded_at_all and "not judged" not in study.title():
        yield f"the title of a study is {study.title()!r}"


def _in_cohort(metrics: Json, folder: Path) -> Iterator[str]:
    known = {row.group for row in group_rows(typed(metrics)) if is_judged(row.origin)}
    for row in _groups(folder.name, typed(metrics)):
        if row["group"] not in known:
            yield f"a cohort has the error of {row['group']}"


def _in_comparison(metrics: Json, folder: Path) -> Iterator[str]:
    with tempfile.TemporaryDirectory() as place:
        walk = StoredWalk(folder, typed(metrics), None)
        write_comparison(Path(place), "page", [walk], matched([walk], [walk]))
        table = pd.read_csv(Path(place) / "page.csv")
        html = (Path(place) / "page.html").read_text("utf-8")
    skills = table[table["measure"].isin(list(OF_SKILL))]
    for row in skills[skills["compared_with"] != "recorded"].itertuples():
        yield f"the comparison has {row.measure} of {row.target}"
    if not typed(metrics).is_recorded_at_all and "not judged" not in html:
        yield "the comparison does not say that nothing was recorded"


def _in_check(metrics: Json) -> Iterator[str]:
    """Every measure gets worse, so that every one that is compared is in the XML as lost."""
    better = {margin.measure: margin.better for margin in load_registry().margin}
    worse = {
        **metrics,
        "measures": [
            {**row, "value": -1e6 if better[row["measure"]] == "higher" else 1e6}
            for row in metrics["measures"]
        ],
    }
    origins = typed(metrics).origins
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "check.xml"
        write_junit(compare(typed(metrics), typed(worse)), path, about={})
        cases = ElementTree.parse(path).getroot().iter("testcase")
    for case in cases:
        measure, target = case.attrib["classname"].removeprefix("gaitval."), case.attrib["name"]
        failure = case.find("failure")
        judged = is_judged(measure_origin(measure, target, origins))
        if failure is not None and failure.attrib["type"] == "accuracy" and not judged:
            yield f"a check calls {measure} of {target} accuracy"
