"""A man with an instrumented knee (Fregly et al. 2012), as a laboratory would import his walks."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gaitval.mocap.reading import read_recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.session.importing.importing import request_of
from gaitval.session.request import ImportOptions, Request, checked, silent

MASS, HEIGHT = 75.0, 1.80
FLOOR = 0.02
"""Of the standing trial, m: where the markers on the edges of the soles then are."""


def marker_set() -> str:
    """What `gaitval markers` drafts, with the forefoot's markers taken for metatarsal heads."""
    pelvis = {"Asis": "ASIS", "Psis": "PSIS"}
    foot = {"Heel": "Heel", "MidfootMedial": "MT1", "MidfootLateral": "MT5"}
    lines = ['title = "instrumented knee"', 'source = "test"', "[markers]"]
    lines.append('"Sacral" = { segment = "pelvis", landmark = "Sacrum", weight = 5 }')
    for side, s in (("R", "r"), ("L", "l")):
        for name, mark in pelvis.items():
            lines.append(
                f'"{side}{name}" = {{ segment = "pelvis", landmark = "{side}.{mark}", weight = 5 }}'
            )
        for part, weight in (("Thigh", 0.5), ("Shank", 1)):
            for where in ("Superior", "Inferior", "Lateral"):
                segment = f"{part.lower()}_{s}"
                lines.append(
                    f'"{side}{part}{where}" = {{ segment = "{segment}", weight = {weight} }}'
                )
        ankle_medial = "RankleMedial" if side == "R" else "LAnkleMedial"
        for name, segment, mark in (
            (f"{side}KneeLateral", "thigh", "Knee"),
            (f"{side}KneeMedial", "thigh", "Knee.Medial"),
            (f"{side}AnkleLateral", "shank", "Ankle"),
            (ankle_medial, "shank", "Ankle.Medial"),
        ):
            lines.append(
                f'"{name}" = {{ segment = "{segment}_{s}", landmark = "{side}.{mark}", '
                "static_only = true }"
            )
        for name, mark in foot.items():
            lines.append(f'"{side}{name}" = {{ segment = "foot_{s}", landmark = "{side}.{mark}" }}')
        lines.append(f'"{side}MidfootSuperior" = {{ segment = "foot_{s}" }}')
        lines.append(
            f'"{side}Shoulder" = {{ segment = "torso", landmark = "{side}.Acromion", '
            "optional = true }"
        )
    for name in ("Sternum", "Neck", "Xiphoid"):
        lines.append(f'"{name}" = {{ segment = "torso", weight = 0.5, optional = true }}')
    return "\n".join(lines)


def knee_request(gait_data: Path, out: Path, trials: Sequence[str]) -> Request:
    """An import of some of his walks, with files of its own in `out`."""
    folder = gait_data / "knee_implant"
    (out / "markers.toml").write_text(marker_set())
    # The standing trial has y up and he faces +x; the walks are in the laboratory's axes, z up,
    # and he walks along -x.
    standing = read_recording(folder / "PS_static.trc")
    x, y, z = np.moveaxis(standing.markers, 2, 0)
    write_trc(out / "stand.trc", replace(standing, markers=np.stack([-x, z, y], axis=2)))
    options = checked(
        ImportOptions,
        {
            "static": str(out / "stand.trc"),
            "trials": [str(folder / f"PS_{name}.c3d") for name in trials],
            "mass": MASS,
            "height": HEIGHT,
            "sex": "M",
            "marker_set": str(out / "markers.toml"),
            "floor": FLOOR,
        },
    )
    return request_of(options, out, silent)
