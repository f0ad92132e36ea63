"""What rows of evidence depend on: the `MEASURES` of each file that makes some; see
`evidence/stale.py` for what they say.

Here are the groups of modules that several scripts name.

A group is what computes one kind of number, not a whole package because it is near: a row of skills
need not be measured anew because a table is drawn in another way.
"""

import ast
import fnmatch
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).resolve().parent.parent
FOLDERS: Final = (
    *("gaitval", "extras", "evidence", "experiments", "docs", "scripts"),
    *("tests", "benchmarks", "reports", "models", "."),
)
KEYS: Final = {"code", "data", "results", "allowed", "why"}

GROUPS: Final[dict[str, tuple[str, ...]]] = {
    "body": (
        "gaitval/coordinates.py",
        "gaitval/model/[!m]*.py",  # all but markers
    ),
    "physics": (
        "@body",
        "gaitval/compiled.py",
        "gaitval/lanes.py",
        "gaitval/simulation/*.py",
    ),
    "scaled": ("gaitval/scaling/*.py",),
    "reference": ("gaitval/reference/*.py",),
    "identified": ("gaitval/identification/*.py",),
    "learned": (
        "gaitval/policy/*.py",
        "experiments/general_policy.py:train_general",
        "gaitval/learning_control/*.py",
        "gaitval/metrics/reference_curves.py",
        "gaitval/learning_control/centring.py",
    ),
    "walk": ("@physics", "@scaled", "@reference", "@learned"),
    "device walk": (
        "@physics",
        "@reference",
        "gaitval/model/devices/composite.py",
        "gaitval/model/devices/controllers.py",
        "gaitval/model/devices/device.py",
        "gaitval/apps/devices/hinge_step.py",
        "gaitval/apps/devices/learning.py",
        "gaitval/apps/devices/phase_estimate.py",
        "gaitval/apps/devices/walking.py",
    ),
    "body with shared errors": (
        "@body",
        "@scaled",
        "@reference",
        "gaitval/identification/body_fit.py",
        "gaitval/identification/prior.py",
        "gaitval/identification/verdicts.py",
        "gaitval/identification/shared_errors.py",
    ),
    "errors": (
        "gaitval/gait/cycle_curves.py",
        "gaitval/gait/cycles.py",
        "gaitval/gait/sampling.py",
        "gaitval/metrics/baselines.py",
        "gaitval/metrics/comparison.py",
        "gaitval/metrics/cycles.py",
        "gaitval/metrics/recorded.py",
    ),
    "accepted": (
        "@errors",
        "gaitval/metrics/epsilon.py",
        "gaitval/metrics/push_recovery.py",
        "gaitval/metrics/tolerances.py",
        "gaitval/metrics/validation.py",
    ),
    "study": (
        "@walk",
        "@identified",
        "@accepted",
        "gaitval/configuration.py",
        "gaitval/study/run.py",
        "gaitval/study/stage.py",
        "gaitval/study/stages.py",
    ),
    "read": (
        "gaitval/datasets/wbds.py",
        "gaitval/datasets/wbds_files.py",
        "gaitval/mocap/*.py",
        "gaitval/session/read.py",
    ),
    "motion": (
        "@body",
        "@read",
        "@scaled",
        "gaitval/inverse/*.py",
        "gaitval/measurement/*_checks.py",
        "gaitval/gait/*.py",
        "gaitval/inverse/*.py",
        "gaitval/session/average.py",
        "gaitval/session/functional.py",
        "gaitval/session/scale.py",
        "gaitval/session/standing*.py",
        "gaitval/session/trial.py",
    ),
    "warnings": (
        "@read",
        "gaitval/measurement/*checks.py",
        "gaitval/gait/agreement.py",
        "gaitval/gait/*_checks.py",
        "gaitval/gait/quality_flags.py",
        "gaitval/scaling/same_person.py",
    ),
    "page": (
        "gaitval/reporting/drawing.py",
        "gaitval/reporting/figures.py",
        "gaitval/reporting/page.py",
        "gaitval/reporting/report.py",
        "gaitval/reporting/tables.py",
    ),
    "judged": (
        "@body",
        "gaitval/inverse/newton_euler.py",
        "gaitval/apps/judge/[!cmw]*.py",  # all but command, write and the bands of moments
        "gaitval/apps/judge/markers.py",
        "gaitval/mocap/mot*.py",
        "gaitval/apps/export/opensim/[!_]*[!t].py",  # all but of an import
    ),
    "checked": (
        "gaitval/apps/regression/regression.py",
        "gaitval/apps/regression/baseline.py",
        "gaitval/apps/regression/seal.py",
        "gaitval/study/inputs.py:STORED_FILES",
    ),
    "cohort": (
        "gaitval/apps/cohort/[!cfrw]*.py",  # not command, figures, report, results, wbds
        "gaitval/apps/cohort/cluster.py",
    ),
}


@dataclass(frozen=True)
class Dependence:
    """What some rows of a script depend on; see `evidence/stale.py`."""

    code: tuple[str, ...] = ()
    data: tuple[str, ...] = ()
    results: tuple[str, ...] = ()
    allowed: int = 0
    why: str = field(default="", compare=False)


def dependence(script: str, what: str) -> Dependence | None:
    """What a row depends on: the first pattern of the script's `MEASURES` that its `what` fits."""
    for pattern, found in declarations(script).items():
        if fnmatch.fnmatchcase(what, pattern):
            return found
    return None


@cache
def declarations(script: str) -> dict[str, Dependence]:
    """`MEASURES` of a script, read from its text: some scripts import what few machines have."""
    tree = ast.parse((ROOT / script).read_text(encoding="utf-8"))
    for statement in tree.body:
        if "MEASURES" in targets(statement) and isinstance(statement, ast.Assign | ast.AnnAssign):
            assert statement.value is not None
            return {
                pattern: _declared(script, pattern, given)
                for pattern, given in ast.literal_eval(statement.value).items()
            }
    return {}


def _declared(script: str, pattern: str, given: dict[str, Any]) -> Dependence:
    if unknown := set(given) - KEYS:
        raise ValueError(f"{script}, MEASURES[{pattern!r}]: {', '.join(unknown)} is no key.")
    if given.get("allowed", 0) and not given.get("why"):
        raise ValueError(f"{script}, MEASURES[{pattern!r}]: say why a change is allowed.")
    code = [each for name in given.get("code", ()) for each in _group(name)]
    return Dependence(
        tuple(code), tuple(given.get("data", ())), tuple(given.get("results", ())),
        given.get("allowed", 0), given.get("why", ""),
    )  # fmt: skip


def _group(name: str) -> Iterator[str]:
    """The patterns of a group, and of the groups in it."""
    if not name.startswith("@"):
        yield name
        return
    for each in GROUPS[name[1:]]:
        yield from _group(each)


def named_but_missing(script: str) -> list[str]:
    """Patterns and names of a script's `MEASURES` that nothing in the project is."""
    files = [
        path.relative_to(ROOT).as_posix()
        for folder in FOLDERS
        for path in (ROOT.glob("*") if folder == "." else (ROOT / folder).rglob("*"))
        if path.is_file()
    ]
    missing = []
    for declared in declarations(script).values():
        for pattern in (*declared.code, *declared.data, *declared.results):
            path, _, names = pattern.partition(":")
            if not any(fnmatch.fnmatchcase(file, path) for file in files):
                missing.append(pattern)
            elif names:
                tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
                defined = {name for each in tree.body for name in targets(each)}
                missing += [f"{path}:{name}" for name in names.split(",") if name not in defined]
    return missing


def targets(statement: ast.stmt) -> tuple[str, ...]:
    """Names that a statement of a module defines."""
    match statement:
        case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
            return (name,)
        case ast.Assign(targets=targets):
            return tuple(node.id for node in targets if isinstance(node, ast.Name))
        case ast.AnnAssign(target=ast.Name(id=name)):
            return (name,)
    return ()
