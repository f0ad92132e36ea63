"""Ground reaction beside results of OpenSim: from a force file, or through its external loads."""

from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from gaitval.apps.judge.skeleton import Skeleton
from gaitval.coordinates import Side
from gaitval.errors import RecordError
from gaitval.mocap.mot import read_ground_reaction, read_storage
from gaitval.mocap.mot_writing import StorageTable
from gaitval.mocap.pressed_plates import pressed_plate
from gaitval.mocap.recording import Plate
from gaitval.mocap.text_table import XYZ, sample_rate
from gaitval.scaling.opensim.fields import child, flag, read_document, text
from gaitval.scaling.opensim.model import GROUND


@dataclass(frozen=True)
class Loads:
    """Measured forces, in the axes of the ground.

    Attributes
    ----------
    path : of the force file.
    rate, start : Hz and s.
    sides : "right" or "left" where external loads say on which foot a plate's force acts; empty
        without them.
    """

    path: Path
    rate: float
    start: float
    plates: tuple[Plate, ...]
    sides: tuple[Side, ...] = ()


def read_loads(grf: Path | None, external_loads: Path | None, skeleton: Skeleton) -> Loads | None:
    """The ground reaction on the feet of `skeleton` in a trial; None if neither file is given.

    The force file `grf` takes the place of the one named in `external_loads`. Raises RecordError or
    ModelError if a file cannot be used, or the forces are not those of two feet.
    """
    if external_loads is None:
        if grf is None:
            return None
        return Loads(grf, *read_ground_reaction(grf))
    loads = child(read_document(external_loads), "ExternalLoads", external_loads)
    if grf is None:
        named = text(loads, "datafile")
        if not named:
            raise RecordError(
                f"{external_loads}: names no <datafile>. Give the force file with --grf."
            )
        grf = external_loads.parent / named.replace("\\", "/")
    table = read_storage(grf)
    plates: list[Plate] = []
    sides: list[Side] = []
    for element in loads.iter("ExternalForce"):
        body = text(element, "applied_to_body").rsplit("/", 1)[-1]
        where = f"{external_loads}: {element.get('name', '')!r:.80}"
        for tag in ("force_expressed_in_body", "point_expressed_in_body"):
            if text(element, tag, GROUND).rsplit("/", 1)[-1] != GROUND:
                raise RecordError(
                    f"{where}: <{tag}> is not ground. Only forces of plates, in the axes of the "
                    "laboratory, are understood."
                )
        side = _side(body, skeleton)
        if side is None:
            raise RecordError(
                f"{where}: acts on the body {body!r:.80}, which is not part of a foot of the "
                "model. Give the external loads of the same model."
            )
        # What OpenSim 4 calls appliesForce was isDisabled, the other way round, in OpenSim 3.
        if flag(element, "appliesForce", default=True) and not flag(element, "isDisabled"):
            plates.append(_plate(grf, table, element, where))
            sides.append(side)
    if not plates:
        raise RecordError(f"{external_loads}: has no <ExternalForce> that acts. Give another file.")
    rate, start = sample_rate(grf, table.time), float(table.time[0])
    return Loads(grf, rate, start, tuple(plates), tuple(sides))


def _side(body: str, skeleton: Skeleton) -> Side | None:
    for segment, name in skeleton.bodies.items():
        part, _, side = segment.rpartition("_")
        if name == body and part in ("foot", "talus", "toes", "shank"):
            return "right" if side == "r" else "left"
    return None


def _plate(path: Path, table: StorageTable, element: Element, where: str) -> Plate:
    vectors = []
    for tag in ("force_identifier", "point_identifier", "torque_identifier"):
        prefix = text(element, tag)
        columns = [f"{prefix}{axis}" for axis in XYZ]
        missing = [name for name in columns if name not in table.columns]
        if not prefix and tag == "torque_identifier":
            vectors.append(np.zeros((len(table.time), 3)))
        elif missing:
            raise RecordError(
                f"{where}: <{tag}> names the columns {', '.join(columns)}, but {path} has "
                f"{', '.join(table.columns[:6])} …. Correct the identifiers."
            )
        else:
            vectors.append(np.column_stack([table.column(name) for name in columns]))
    name = element.get("name", "")
    return pressed_plate(path, name, *vectors)
