"""What a cohort asks of the wing that reads WBDS."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Protocol

from gaitval.datasets.subject import Subject


class Held(Protocol):
    """What a folder holds of WBDS (`gaitval.datasets.wbds_archive.Holdings`)."""

    @property
    def trials(self) -> Mapping[tuple[str, str], Mapping[str, Path]]:
        """By person and trial, the files by kind."""

    @property
    def standing(self) -> Mapping[str, Path]:
        """The standing trial of each person."""

    def missing(self, person: str, trial: str) -> list[str]:
        """What is not there of a trial to make a subject of its mean curves."""


class Archive(Protocol):
    """Reads a folder of WBDS; a wing registers it as "wbds" in `wings.PARTS`."""

    PEOPLE: tuple[str, ...]
    TREADMILL: tuple[str, ...]
    FURTHER_TRIALS: Mapping[str, tuple[str, ...]]
    CITATION: str
    LICENCE: str

    def holdings(self, folder: Path) -> Held:
        """The files of WBDS in a folder."""

    def person_values(self, held: Held, person: str) -> dict[str, Any]:
        """Sex, age, mass (kg), height and leg length (m), by the names of `Subject`."""

    def subject_of(self, held: Held, person: str, trials: Iterable[str]) -> Subject:
        """A person with the mean curves of some trials."""
