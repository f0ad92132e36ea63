"""The body that an identification found, before the parameters mu."""

from pathlib import Path

from gaitval import wings
from gaitval.artefacts import read_json
from gaitval.model.body import BodyModel


def identified_model(model: BodyModel, identification: Path) -> BodyModel:
    """The scaled `model` with legs that differ by what an `identification` found beside mu."""
    found = read_json(identification)
    left = 0.0 if found["identified"] == found["nominal"] else found.get("left_leg", 0.0)
    return wings.load(wings.PARTS, "legs")(model, left) if left else model
