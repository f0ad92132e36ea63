"""Write what `gaitval perturb` found: `perturb.json` and a page."""

from pathlib import Path
from typing import Any

from gaitval.apps.balance.compared import Pushes
from gaitval.apps.balance.experiment import TestedWalker
from gaitval.apps.balance.figures import DrawnSteps
from gaitval.apps.balance.study import Recoveries


def write_recoveries(found: Recoveries, walker: TestedWalker, folder: Path) -> None:
    """Write `perturb.json`, `.html` and `.pdf` of what was `found` of a `walker` into `folder`."""
    result = found.result
    drawn = None
    if found.walks:
        seconds = walker.task.configuration.environment.push_seconds
        along, aside = (
            Pushes.of(found.plain, found.pushed_along(axis), seconds) for axis in (0, 1)
        )
        drawn = DrawnSteps.of(aside, along, walker.task.reference.stride_time)
    offset = next((row for row in result.quantities if row.name == "offset_change"), None)
    shown: dict[str, Any] = {
        "offset": None if offset is None else offset.walker,
        "steps": 0 if drawn is None else len(drawn.aside),
        "drawn": drawn is not None,
        "drawings": {} if drawn is None else {"placement": drawn.placement},
        "data": {} if drawn is None else drawn.tables(),
    }
    result.write(folder, **shown)
