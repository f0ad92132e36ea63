"""Devices of a subject: what `[[devices]]` of its file and `gaitval subject --device` ask for.

The main job is of the person without them, whom the record is of; then the person walks with them,
in a folder of the run. So a device can be changed without doing the main job
again.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from gaitval.apps.devices.sound_leg import check_side
from gaitval.model.devices.device import Device, devices_of, load_devices, tables_of
from gaitval.study.inputs import POLICY_FILES
from gaitval.study.stage import Run, Stage
from gaitval.study.stage_versions import STAGE_VERSIONS
from gaitval.subjects.subject import Subject

PAGE: Final = "device.html"


def wearing(subject: Subject, devices: Sequence[str | Mapping[str, Any]]) -> Subject:
    """A subject with further `devices`, each a shipped one's name, a file, or a table. Raises
    ConfigurationError, also for a prosthesis on the sound leg (`check_side`).
    """
    given = _all_of(devices)
    check_side(subject, given)
    return subject.model_copy(update={"devices": (*subject.devices, *given)})


def tables(devices: Sequence[str | Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The whole tables of `devices`, each a shipped one's name, a file, or a table. Raises
    ConfigurationError.
    """
    return tables_of(_all_of(devices))


def _all_of(devices: Sequence[str | Mapping[str, Any]]) -> list[Device]:
    return [each for device in devices for each in _devices(device)]


def _devices(device: str | Mapping[str, Any]) -> tuple[Device, ...]:
    if isinstance(device, str):
        return load_devices(device)
    name = str(device.get("name", ""))
    if name.endswith(".toml"):  # of a table's row, which adds a search
        whole = [tables_of([each])[0] | dict(device, name=each.name) for each in load_devices(name)]
        return devices_of({"devices": whole}, name)
    return devices_of({"devices": [dict(device)]}, f"device {name}".strip())


def afterwards(subject: Subject) -> tuple[Callable[[Run], Stage], ...]:
    """What the main job of `subject` does at its end: the walks with its devices, if it has any."""
    return (stage,) if subject.devices else ()


def folder_of(subject: Subject) -> str:
    """The folder of a run in which the devices of its `subject` are."""
    return "-".join(each.name for each in subject.devices)


def stage(run: Run) -> Stage:
    """Policy and body of `run`, and the devices of its subject → a page of the walks with them.
    Raises ConfigurationError.
    """
    name = folder_of(run.subject)
    fitted = run.subject.devices
    check_side(run.subject, fitted)
    return Stage(
        f"device-{name}",
        lambda: _walk(run, name),
        version=STAGE_VERSIONS["device"],
        inputs=(
            *("subject.toml", "model.urdf", "reference.npz", "identification.json"),
            *("correction.json", *(f"policy/{each}" for each in POLICY_FILES)),
        ),
        outputs=(f"{name}/{PAGE}", f"{name}/device.json"),
        values={
            **run.sections("environment", "contact", "record"),
            "devices": tables_of(fitted),
        },
    )


def _walk(run: Run, name: str) -> None:
    from gaitval.apps.devices.page import write_report
    from gaitval.apps.devices.study import Wearer, outcomes
    from gaitval.study.inputs import stored_policy, validated_task

    task, mu = validated_task(run)
    policy = stored_policy(run, run.folder / "policy")
    origin = str(run.folder.resolve())
    height = run.subject.height_m
    person = Wearer(run.subject.identifier, task, policy, mu, origin=origin, height=height)
    devices = run.subject.devices
    folder, say = run.folder / name, run.observer.say
    write_report(folder, person, devices, *outcomes(person, devices, say=say))
    say(f"With {name.replace('-', ', ')}: {folder / PAGE}")
