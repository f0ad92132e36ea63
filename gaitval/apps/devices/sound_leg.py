"""A prosthesis replaces nothing of the sound leg."""

from collections.abc import Sequence

from gaitval.coordinates import SIDES
from gaitval.errors import ConfigurationError
from gaitval.model.devices.device import Device
from gaitval.subjects.subject import Subject


def check_side(subject: Subject, fitted: Sequence[Device]) -> None:
    """Raise ConfigurationError if one of the devices `fitted` replaces a part of the leg on another
    side than the `prosthesis` of the `subject`.
    """
    for device in fitted:
        if device.stumps and subject.prosthesis in SIDES and device.sides != (subject.prosthesis,):
            raise ConfigurationError(
                f"{subject.identifier}: the prosthesis is on the {subject.prosthesis}, but the "
                f"device {device.name} replaces a part of the {' and '.join(device.sides)} leg. "
                f'Write sides = ["{subject.prosthesis}"] beside its name in [[devices]].'
            )
