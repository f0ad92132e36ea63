"""Results of devices on people, which `gaitval check` and `compare` take as they take walks.

What they are, the application of devices knows (`gaitval.apps.devices.results`); the commands hand
it over.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple, Protocol, TypeVar

from gaitval.apps.regression.regression import Row
from gaitval.errors import ArtefactError

RESULT: Final = "device.json"
"""A folder with this file holds such a result."""


def is_result(folder: Path) -> bool:
    """Whether a folder holds the result of devices on a person."""
    return (folder / RESULT).is_file()


class ResultFigure(Protocol):
    """A figure of a result: `quantity` and `unit`, `of` side and assumption, and its `value`."""

    @property
    def quantity(self) -> str: ...  # noqa: D102
    @property
    def of(self) -> str: ...  # noqa: D102
    @property
    def unit(self) -> str: ...  # noqa: D102
    @property
    def value(self) -> float | None: ...  # noqa: D102


FigureOf = TypeVar("FigureOf", bound=ResultFigure)


class DeviceResults(Protocol[FigureOf]):
    """What is asked of results of devices; see `gaitval.apps.devices.results`."""

    @property
    def MARGINS(self) -> Mapping[str, float]:
        """By which a figure may move, by its unit."""

    def stored(self, folder: Path, /) -> Sequence[FigureOf]:
        """The figures of a stored result."""

    def walk_again(self, folder: Path, say: Callable[[str], None], /) -> Sequence[FigureOf]:
        """The figures of a stored result, walked again."""

    def person_of(self, folder: Path, /) -> str:
        """Who wears the devices of a stored result."""

    def write_side_by_side(
        self, folder: Path, name: str, results: Mapping[str, Sequence[FigureOf]], /
    ) -> None:
        """Write results side by side."""


def rows(
    before: Sequence[ResultFigure], now: Sequence[ResultFigure], margins: Mapping[str, float]
) -> list[Row]:
    """A row for every figure before or now. One that moved by more than its margin, in either
    direction, is another result, and so lost; so is one that is there in one of both only.
    """
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


def check(folder: Path, known: DeviceResults[FigureOf]) -> list[Row]:
    """The rows of a stored result, walked again as `known` does. Raises GaitvalError."""
    from gaitval.terminal import display

    stored = known.stored(folder)
    with display.live_view() as live:
        live.started("device", folder.name)
        now = known.walk_again(folder, display.messages.print)
    return rows(stored, now, known.MARGINS)


class ComparedResults(NamedTuple):
    """Results beside those before.

    Attributes
    ----------
    rows : what is in both versions.
    gone, added : results that only the version before, or only that of now, has.
    """

    rows: list[Row]
    gone: list[str]
    added: list[str]


def compare(
    out: Path, folders: Sequence[Path], before: Sequence[Path], known: DeviceResults[FigureOf]
) -> ComparedResults:
    """Write results side by side into `out`; what moved since those `before`, matched by person and
    name of the folder. Raises ArtefactError.
    """
    now, then = _by_name(folders), _by_name(before)
    results = {name: known.stored(folder) for name, folder in now.items()}
    known.write_side_by_side(out, "devices", results)
    if not then:
        return ComparedResults([], [], [])
    here, there = _by_key(now, "RUN", known), _by_key(then, "--before", known)
    both = [key for key in here if key in there]
    if not both:
        raise ArtefactError(
            f"{', '.join(map(str, before))}: none of the results {_listed(here)} is there, so "
            "nothing can be compared. Give folders of the same people and names with --before."
        )
    found = []
    for key in both:
        of = f"{here[key]}: " if len(both) > 1 else ""
        moved = rows(known.stored(then[there[key]]), results[here[key]], known.MARGINS)
        found += [replace(row, target=f"{of}{row.target}") for row in moved]
    return ComparedResults(
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


def _by_key(
    folders: Mapping[str, Path], which: str, known: DeviceResults[FigureOf]
) -> dict[tuple[str, str], str]:
    """The names of results by person and folder. Raises ArtefactError if two are of one."""
    found: dict[tuple[str, str], str] = {}
    for name, folder in folders.items():
        key = known.person_of(folder), folder.name
        if key in found:
            raise ArtefactError(
                f"{found[key]}, {name}: both are {key[1]} of {key[0]}, so it is not clear which of "
                f"them to compare. Give one of them with {which}."
            )
        found[key] = name
    return found


def _listed(results: Mapping[tuple[str, str], str]) -> str:
    return ", ".join(f"{name} (of {person})" for (person, _), name in results.items())
