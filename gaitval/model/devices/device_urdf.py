"""A person with a device as URDF, in which each part is a link of its own, through Xacro.

For other programs, and as a check: they weld the links themselves, so what they make of the file
must be the body that `composite.fitted` computes.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import xacro

from gaitval.artefacts import scratch, write_text
from gaitval.model.body import BodyModel
from gaitval.model.devices.composite import part_place, stumps_only
from gaitval.model.devices.device import Device
from gaitval.model.urdf import beside, template_folder, write_urdf


def write_device_urdf(model: BodyModel, devices: Sequence[Device], path: Path) -> None:
    """Write the person `model` with `devices` to `path`, whole or not at all."""
    parts = []
    for device in devices:
        for part in device.parts:
            for name in device.places(part.segment):
                centre, inertia = part_place(part, model[name], model)
                axes = [(a, b) for i, a in enumerate("xyz") for b in "xyz"[i:]]
                parts.append(
                    {
                        "name": f"{device.name}_{part.name}_{name}",
                        "segment": name,
                        "mass": repr(float(part.mass)),
                        "centre": " ".join(repr(float(each)) for each in centre),
                    }
                    | {
                        f"i{a}{b}": repr(float(inertia["xyz".index(a), "xyz".index(b)]))
                        for a, b in axes
                    }
                )
    with scratch(beside(path)) as folder:
        person, table = folder / "person.urdf", folder / "parts.json"
        write_urdf(stumps_only(model, devices), person)
        table.write_text(json.dumps(parts), encoding="utf-8")
        document = xacro.process_file(
            str(template_folder() / "devices" / "device.xacro"),
            mappings={"name": model.name, "person": str(person), "parts": str(table)},
        )
    text = document.documentElement.toprettyxml(indent="  ")
    write_text(Path(path), '<?xml version="1.0" encoding="utf-8"?>\n' + text)
