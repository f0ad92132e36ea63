"""Results of devices on people, which `gaitval check` and `compare` take as they take walks.

What they are, another wing knows: it is asked for as the part `device_results`.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from gaitval import wings
from gaitval.errors import ArtefactError
from gaitval_gate.regression import Row

RESULT: Final = "device.json"
"""A folder with this file holds such a result."""


def is_result(folder: Path) -> bool:
    """Whether a folder holds the result of devices on a person."""
    return (folder / RESULT).is_file()


def part() -> Any:
    """What knows of such results. Raises ConfigurationError without it."""
    return wings.load(wings.PARTS, "device_results")


def rows(before: Sequence[Any], now: Sequence[Any]) -> list[Row]:
    """A row for every figure before or now. One that moved by more than its margin, in either
    direction, is another result, and so lost; so is one that is there in one of both only.
    """
    margins = part().MARGINS
    was = {(each.quantity, each.of, each.unit): each.value for each in before}
    new = {(each.quantity, each.of, each.unit): each.value for each in now}
    found = []
    for key in dict.fromkeys([*was, *new]):
        quantity, of, unit = key
        old, current, margin = was.get(key), new.get(key), margins[unit]
        kept = old is current if old is None or current is None else abs(current - old) <= margin
        found.append(
            Row(quantity, of, unit, old, current, margin, change="kept" if kept else "lost")
        )
    return found


def check(folder: Path) -> list[Row]:
    """The rows of a stored result, walked again. Raises GaitvalError."""
    from gaitval.cli import display

    known = part()
    stored = known.stored(folder)
    with display.live_view() as live:
        live.started("device", folder.name)
        now = known.walk_again(
            folder, lambda line: display.messages.print(line, highlight=False, markup=False)
        )
    return rows(stored, now)


def compare(out: Path, folders: Sequence[Path], before: Sequence[Path]) -> list[Row]:
    """Write results side by side into `out`; the rows of what moved since those `before`, matched
    by the names of their folders. Raises ArtefactError.
    """
    known = part()
    results = {_name(folder): known.stored(folder) for folder in folders}
    known.write_side_by_side(out, "devices", results)
    then = {_name(folder): folder for folder in before}
    if before and not set(then) & set(results):
        raise ArtefactError(
            f"{', '.join(map(str, before))}: none of the results {', '.join(results)} is there, so "
            "nothing can be compared. Give folders of the same names with --before."
        )
    return [
        row
        for name, now in results.items()
        if name in then
        for row in rows(known.stored(then[name]), now)
    ]


def _name(folder: Path) -> str:
    return folder.resolve().name
