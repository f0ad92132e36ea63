"""Results of devices on people, which `gaitval check` and `compare` take as they take walks.

What they are, another wing knows: it is asked for as the part `device_results`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

from gaitval import wings
from gaitval.errors import ArtefactError
from gaitval.apps.regression.regression import Row

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
    from gaitval.terminal import display

    known = part()
    stored = known.stored(folder)
    with display.live_view() as live:
        live.started("device", folder.name)
        now = known.walk_again(folder, display.messages.print)
    return rows(stored, now)


class Compared(NamedTuple):
    """Results beside those before.

    Attributes
    ----------
    rows : what is in both versions.
    gone, added : results that only the version before, or only that of now, has.
    """

    rows: list[Row]
    gone: list[str]
    added: list[str]


def compare(out: Path, folders: Sequence[Path], before: Sequence[Path]) -> Compared:
    """Write results side by side into `out`; what moved since those `before`, matched by person and
    name of the folder. Raises ArtefactError.
    """
    known = part()
    now, then = _by_name(folders), _by_name(before)
    results = {name: known.stored(folder) for name, folder in now.items()}
    known.write_side_by_side(out, "devices", results)
    if not then:
        return Compared([], [], [])
    here, there = _by_key(now, "RUN"), _by_key(then, "--before")
    both = [key for key in here if key in there]
    if not both:
        raise ArtefactError(
            f"{', '.join(map(str, before))}: none of the results {_listed(here)} is there, so "
            "nothing can be compared. Give folders of the same people and names with --before."
        )
    found = []
    for key in both:
        of = f"{here[key]}: " if len(both) > 1 else ""
        moved = rows(known.stored(then[there[key]]), results[here[key]])
        found += [replace(row, target=f"{of}{row.target}") for row in moved]
    return Compared(
        found,
        [name for key, name in there.items() if key not in here],
        [name for key, name in here.items() if key not in there],
    )


def _by_name(folders: Sequence[Path]) -> dict[str, Path]:
    """Folders, each once, by as much of the end of their paths as tells them apart."""
    places = list(dict.fromkeys(folder.resolve() for folder in folders))
    for length in range(1, max((len(place.parts) for place in places), default=0) + 1):
        names = ["/".join(place.parts[-length:]) for place in places]
        if len(set(names)) == len(names):
            return dict(zip(names, places, strict=True))
    return {}


def _by_key(folders: Mapping[str, Path], which: str) -> dict[tuple[str, str], str]:
    """The names of results by person and folder. Raises ArtefactError if two are of one."""
    found: dict[tuple[str, str], str] = {}
    for name, folder in folders.items():
        key = part().person_of(folder), folder.name
        if key in found:
            raise ArtefactError(
                f"{found[key]}, {name}: both are {key[1]} of {key[0]}, so it is not clear which of "
                f"them to compare. Give one of them with {which}."
            )
        found[key] = name
    return found


def _listed(results: Mapping[tuple[str, str], str]) -> str:
    return ", ".join(f"{name} (of {person})" for (person, _), name in results.items())
