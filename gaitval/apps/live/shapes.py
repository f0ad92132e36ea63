"""The shapes that the URDF of a body shows to viewers."""

from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from gaitval import file_gate
from gaitval.arrays import Array
from gaitval.artefacts import scratch
from gaitval.errors import ModelError
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.safe_xml import parse_xml
from gaitval.model.urdf import LARGEST_FILE, write_urdf


@dataclass(frozen=True)
class ViewerShape:
    """A shape that viewers draw for a segment; it has no mass and touches nothing.

    Attributes
    ----------
    segment : one of `SEGMENTS`.
    kind : "box", "sphere" or "cylinder", which is along z.
    position : (3,) m, of its middle in the segment's frame, whose axes it has.
    size : m; box: length along x, y, z; sphere: radius; cylinder: radius, length.
    """

    segment: str
    kind: str
    position: Array
    size: tuple[float, ...]


def drawn_shapes(model: BodyModel, folder: Path) -> tuple[ViewerShape, ...]:
    """What the URDF of `model` shows, segment by segment; the URDF is in `folder` meanwhile."""
    with scratch(folder) as own:
        path = own / "model.urdf"
        write_urdf(model, path)
        content = file_gate.read_bytes(path, ModelError, largest=LARGEST_FILE)
        robot = parse_xml(path, content, root="robot", kind="a URDF")
    links = {link.get("name"): link for link in robot.iterfind("link")}
    return tuple(_shape(name, each) for name in SEGMENTS for each in links[name].iterfind("visual"))


def _shape(segment: str, visual: Element) -> ViewerShape:
    origin, geometry = visual.find("origin"), visual.find("geometry")
    if geometry is None:
        raise ModelError(f"link {segment}: a <visual> without a shape.")
    position = "0 0 0" if origin is None else origin.get("xyz", "0 0 0")
    (solid,) = geometry
    words = " ".join(solid.get(key, "") for key in ("size", "radius", "length"))
    size = tuple(float(word) for word in words.split())
    return ViewerShape(
        segment, solid.tag, np.array([float(each) for each in position.split()]), size
    )
