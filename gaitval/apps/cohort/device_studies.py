"""Devices that the person of a study wears."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gaitval.apps.cohort.table import Study
from gaitval.apps.devices import of_subject
from gaitval.apps.devices.results import summary
from gaitval.datasets.subject import Subject
from gaitval.study.stage_versions import STAGE_VERSIONS

DevicesSetting = str | dict[str, Any]
"""A device: its name or file, or its table."""


def identity_of(devices: Sequence[DevicesSetting]) -> dict[str, Any]:
    """What walks with `devices` depend on. Raises ConfigurationError if there is no such device."""
    return {"tables": of_subject.tables(devices), "version": STAGE_VERSIONS["device"]}


def wearing(study: Study, subject: Subject) -> Subject:
    """The `subject` with the devices of a `study`."""
    if not study.devices:
        return subject
    return of_subject.wearing(subject, study.devices)


def figures(folder: Path, subject: Subject) -> list[dict[str, Any]]:
    """The figures of a run `folder` with the devices of its `subject`, and what their searches
    found; none without devices.
    """
    if not subject.devices:
        return []
    return summary(folder / of_subject.folder_of(subject))
