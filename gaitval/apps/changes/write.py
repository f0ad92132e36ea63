"""What changed, as the typed result that is written: `change.json`, tables, page."""

from pathlib import Path
from typing import Any

from gaitval.apps.changes.change import Change
from gaitval.apps.changes.page import shown
from gaitval.apps.changes.results import ChangedCurve, ChangeResult, SessionResult
from gaitval.apps.changes.visits import PARAMETERS, Visit
from gaitval.metrics.curve_statistics import ALPHA
from gaitval.metrics.gait_profile import SMALLEST_DIFFERENCE
from gaitval.reporting.written import taken


def write_change(found: Change, folder: Path) -> ChangeResult:
    """Write `change.json`, `.csv`, `_curves.csv`, `.html` and `.pdf` of what was `found` into
    `folder`; returns what is in the first.
    """
    result = result_of(found)
    result.write(folder, **shown(found, result))
    return result


def result_of(found: Change) -> ChangeResult:
    """What is written of what was `found`."""
    test = found.test
    return ChangeResult.made(
        before=_session(found.before),
        after=_session(found.after),
        same_markers=found.same_markers,
        speed=found.speed,
        notes=found.notes,
        alpha=ALPHA,
        threshold=None if test is None else test.threshold,
        permutations=0 if test is None else test.permutations,
        stride_correlation=None if test is None else test.correlation,
        at_once=found.at_once,
        curves={name: taken(ChangedCurve, curve) for name, curve in found.curves.items()},
        parameters=_parameters(found),
        profile=None
        if found.profiles is None
        else {
            "before": found.profiles[0],
            "after": found.profiles[1],
            "smallest_difference": SMALLEST_DIFFERENCE,
        },
        findings=[region.words for _, region in found.findings()],
    )


def _session(visit: Visit) -> dict[str, Any]:
    return taken(SessionResult, visit, walking_speed_m_s=visit.speed, cycles=visit.counts())


def _parameters(found: Change) -> list[dict[str, Any]]:
    before, after = found.before.parameters, found.after.parameters
    return [
        {
            "name": name,
            "unit": unit,
            "before": before[name].mean,
            "after": after[name].mean,
            "before_sd": before[name].sd,
            "after_sd": after[name].sd,
        }
        for plain, unit in PARAMETERS.items()
        for name in (plain, f"{plain}_r", f"{plain}_l")
        if name in before and name in after
    ]
