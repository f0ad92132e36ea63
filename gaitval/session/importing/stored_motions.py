"""The motions of an imported session, and their moments, read from its folder.

They are worked out again from the files that the import wrote: pose, ground reaction and body. A
refused import has them too, of the trials that were worked out before it.
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import read_json
from gaitval._internal.io.text_tables import plain_cell, without_unit
from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES, SIDES, Side
from gaitval.errors import ArtefactError, RecordError
from gaitval.kinetics.inverse.inverse_dynamics import inverse_dynamics
from gaitval.kinetics.musculature.gait import LoadedMotion
from gaitval.mocap.mot import read_storage
from gaitval.mocap.mot_writing import StorageTable
from gaitval.model.body import BodyModel
from gaitval.model.markers import MARKERS
from gaitval.model.safe_xml import parse_xml
from gaitval.model.urdf import read_urdf
from gaitval.session.importing.files import FOLDER, RECORD, SUBJECT
from gaitval.session.loaded import known_spans, lost_leg
from gaitval.session.opensim.coordinates import (
    OPENSIM_COORDINATES,
    PELVIS_TRANSLATIONS,
    TO_OPENSIM,
    from_opensim,
)
from gaitval.session.opensim.osim import BODIES

_LOADED = 1e-3
"""N, below which a written force is of a foot in the air."""


def is_import(folder: Path) -> bool:
    """Whether `folder` has the trials of an import, refused or not."""
    return any((folder / FOLDER).glob("trial*_ik.mot"))


def stored_motions(folder: Path, *, height: float | None = None) -> list[LoadedMotion]:
    """Every trial with moments in the `folder` of an import. `height` m is asked for where the
    import was refused, for then nothing stored says it.

    Raises ArtefactError or RecordError if there is none, or a file is damaged.
    """
    target = folder / FOLDER
    paths = sorted(target.glob("trial*_ik.mot"), key=lambda path: _number(path))
    if not paths:
        raise ArtefactError(
            f"{target}: no trial{{N}}_ik.mot, so no import got as far as a motion here. Give the "
            "folder that `gaitval import --out` wrote."
        )
    record: Mapping[str, Any] = {}
    if (target / RECORD).is_file():
        record = read_json(target / RECORD)
        height = float(record["person"]["height_m"]) if height is None else height
    if height is None:
        raise RecordError(
            f"{folder}: this import was refused, and its files do not say how tall the person is. "
            "Give it with --height, in m: strength follows from mass and stature."
        )
    names = [str(each["trial"]) for each in record.get("trials", ())]
    prosthesis = None
    if (folder / SUBJECT).is_file():
        from gaitval.subjects.subject_file import load_subject

        prosthesis = load_subject(folder / SUBJECT).prosthesis
    table = file_gate.csv_frame(target / "cycles.csv", ArtefactError).rename(
        columns=lambda name: without_unit(name)[0]
    )
    found = []
    for path in paths:
        number = _number(path)
        forces = target / f"trial{number}_grf.mot"
        if not forces.is_file():
            continue
        # a refused import has no list of names, and its motions no gait cycles
        called = names[number - 1] if number <= len(names) else f"trial{number}"
        motion = _motion(target, number, called, table, height=height, prosthesis=prosthesis)
        found.append(replace(motion, speed=record.get("walking_speed_m_s")))
    if not found:
        raise RecordError(
            f"{target}: none of {len(paths)} trials has a ground reaction, so there are no moments "
            "to share to muscles. Import the trials with their force plates (--forces), or walk "
            "the subject: `gaitval subject` predicts them."
        )
    return found


def _number(path: Path) -> int:
    found = re.match(r"trial(\d+)_", path.name)
    return int(found.group(1)) if found else 0


def _motion(
    target: Path, number: int, name: str, table: Any, *, height: float, prosthesis: str | None
) -> LoadedMotion:
    model = read_urdf(target / "model.urdf")
    own = target / f"trial{number}_model.osim"
    if own.is_file():  # the trial was made consistent: its masses are those of this model
        model = _with_masses(model, own)
    motion = read_storage(target / f"trial{number}_ik.mot")
    positions = _positions(motion)
    ground = read_storage(target / f"trial{number}_grf.mot")
    force, point, free = (
        _vectors(ground, kind) for kind in ("force_{}_v", "force_{}_p", "torque_{}_")
    )
    loaded = np.abs(force[..., 2]) > _LOADED
    point[~loaded] = np.nan
    dynamics = inverse_dynamics(model, motion.time, positions, force, point, free)
    moments = read_storage(target / f"trial{number}_id.sto")
    valid = np.stack(
        [np.isfinite(moments.column(f"hip_flexion_{side[0]}_moment")) for side in SIDES], axis=1
    )
    sides: list[Side] = [side for side in SIDES if side != prosthesis]
    of_trial = table["trial"].astype(str).isin((name, str(plain_cell(name))))
    rows = table[of_trial & table["kinetics_valid"].astype(bool)]
    cycles = {
        side: [
            (float(a), float(b))
            for a, b in rows.loc[rows["side"] == side, ["start", "end"]].to_numpy()
            if motion.time[0] <= a and b <= motion.time[-1]
        ]
        for side in sides
    }
    markers = target / MARKERS
    return LoadedMotion(
        name=name,
        model=model,
        height=height,
        positions=positions,
        dynamics=replace(dynamics, foot_known=valid),
        cycles=cycles,
        spans=known_spans(motion.time, valid, force[..., 2], model.mass, cycles),
        lost=lost_leg(prosthesis),
        knees=_knees(markers) if markers.is_file() else {},
    )


def _knees(path: Path) -> dict[Side, float]:
    """Of the markers in `path`; none of a folder that an older version wrote."""
    values = read_json(path).get("knees", {})
    try:
        return {side: float(values[side]) for side in SIDES if side in values}
    except (TypeError, ValueError):
        raise ArtefactError(
            f'{path}: "knees" is {values!r}, where the distance of each knee\'s middle from the '
            "body's knee centre belongs, in m, by side. Import the session again."
        ) from None


def _with_masses(model: BodyModel, path: Path) -> BodyModel:
    """`model` with masses, centres and inertias of the OpenSim model in `path`, which is ours."""
    content = file_gate.read_bytes(path, ArtefactError, largest=file_gate.SIZES.values)
    root = parse_xml(path, content, root="OpenSimDocument", kind="an OpenSim model")
    bodies = {each.get("name"): each for each in root.iter("Body")}

    def numbers(body: Element, tag: str) -> Array:
        return np.array([float(each) for each in (body.findtext(tag) or "").split()])

    segments = []
    try:
        for segment in model.segments:
            body = bodies[BODIES[segment.name]]
            xx, yy, zz, xy, xz, yz = numbers(body, "inertia")
            inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            segments.append(
                replace(
                    segment,
                    mass=float(numbers(body, "mass")[0]),
                    centre_of_mass=numbers(body, "mass_center") @ TO_OPENSIM,
                    inertia=TO_OPENSIM.T @ inertia @ TO_OPENSIM,
                )
            )
    except (KeyError, ValueError, IndexError) as error:
        raise ArtefactError(
            f"{path}: not the model that the import wrote ({error}). Import the session again."
        ) from None
    return replace(model, segments=tuple(segments))


def _positions(motion: StorageTable) -> Array:
    values = np.column_stack([motion.column(name) for name in OPENSIM_COORDINATES])
    if motion.in_degrees:
        angles = [name not in PELVIS_TRANSLATIONS for name in OPENSIM_COORDINATES]
        values[:, angles] = np.deg2rad(values[:, angles])
    found = from_opensim(values)
    assert found.shape[1] == len(COORDINATES)
    return found


def _vectors(table: StorageTable, kind: str) -> Array:
    """(T, 2, 3) of both feet, right first, in the project's axes."""
    return np.stack(
        [
            np.column_stack([table.column(f"ground_{kind.format(side[0])}{a}") for a in "xyz"])
            @ TO_OPENSIM
            for side in SIDES
        ],
        axis=1,
    )
