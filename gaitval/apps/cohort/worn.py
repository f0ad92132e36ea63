"""Devices that the person of a study wears, which another wing knows: the part `device_results`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gaitval import wings
from gaitval.datasets.subject import Subject
from gaitval.apps.cohort.table import Study

Worn = str | dict[str, Any]
"""A device: its name or file, or its table."""


def identity_of(devices: Sequence[Worn]) -> dict[str, Any]:
    """What walks with `devices` depend on. Raises ConfigurationError if there is no such device."""
    part = wings.load(wings.PARTS, "device_results")
    return {"tables": part.tables(devices), "code": part.code()}


def wearing(study: Study, subject: Subject) -> Subject:
    """The `subject` with the devices of a `study`."""
    if not study.devices:
        return subject
    worn: Subject = wings.load(wings.PARTS, "device_results").wearing(subject, study.devices)
    return worn


def figures(folder: Path, subject: Subject) -> list[dict[str, Any]]:
    """The figures of a run `folder` with the devices of its `subject`, and what their searches
    found; none without devices.
    """
    if not subject.devices:
        return []
    part = wings.load(wings.PARTS, "device_results")
    found: list[dict[str, Any]] = part.summary(folder / part.folder_of(subject))
    return found
