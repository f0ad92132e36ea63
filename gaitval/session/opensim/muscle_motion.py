"""Activations, muscle forces and contact forces over time as OpenSim's storage files."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.kinetics.musculature.forces import MuscleForces
from gaitval.kinetics.musculature.gait import CONTACTS, MuscleGait, contact_curve
from gaitval.mocap.mot_writing import StorageTable, write_storage


def write_storages(folder: Path, found: MuscleGait, *, start: float = 0.0) -> Iterator[Path]:
    """Activations, forces and contact forces over time as OpenSim's storage files, one for each
    stretch of a trial that was shared: both sides together where they cover the same times. Times
    are from `start` s.
    """
    stretches: dict[tuple[str, float, float], list[tuple[Side, MuscleForces]]] = {}
    for trial, side, piece in found.pieces:
        key = (trial, round(float(piece.time[0]), 4), round(float(piece.time[-1]), 4))
        stretches.setdefault(key, []).append((side, piece))
    several = len(stretches) > 1
    for number, ((trial, *_), parts) in enumerate(stretches.items(), start=1):
        stem = Path(trial).stem if trial else "trial"
        label = f"{stem}_{number}" if several else stem
        for kind in ("activation", "force", "contact"):
            path = folder / f"{label}_{kind}.sto"
            columns = list[str]()
            values = list[Array]()
            for side, piece in parts:
                names, own = _columns(kind, side, piece)
                columns += names
                values.append(own)
            title = {"activation": "StaticOptimization", "force": "StaticOptimization"}.get(
                kind, "Joint contact forces, N"
            )
            table = StorageTable(
                tuple(columns), parts[0][1].time - start, np.hstack(values), name=title
            )
            write_storage(path, table)
            yield path


def _columns(kind: str, side: Side, piece: MuscleForces) -> tuple[list[str], Array]:
    leg = piece.legs[side]
    end = f"_{side[0]}"
    if kind == "contact":
        return (
            [f"{name}{end}_contact" for name in CONTACTS],
            np.column_stack([contact_curve(leg, name) for name in CONTACTS]),
        )
    present = leg.muscles.present
    names = [f"{name}{end}" for name, kept in zip(leg.muscles.names, present, strict=True) if kept]
    values = leg.activation if kind == "activation" else leg.force
    return names, values[:, present]
