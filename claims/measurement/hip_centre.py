"""Hip moments against OpenSim's, whose hips are elsewhere, on two public sessions.

Rajagopal's walk goes through OpenSim's own tools by his set-ups (`experiments.opensim_pipeline`);
that of gait1992 (mitkof6/OpenSimRT, OpenSim's subject01) through the inverse kinematics of its
scaled model, and inverse dynamics. Neither is the truth. Once with the hips that an import takes
if nothing is said, and once with those of the model.
"""

import tempfile
from collections.abc import Callable, Mapping
from contextlib import chdir
from pathlib import Path
from typing import Any, Final

import numpy as np

import claims
from claims import Claim
from experiments.opensim_pipeline import run_pipeline
from gaitval.configuration import load_configuration
from gaitval.gait.cycles import normalise
from gaitval.gait.filters import low_pass
from gaitval.importing.importing import request_of, work_out
from gaitval.measurement.measured import measurement_of
from gaitval.mocap.mot import read_storage
from gaitval.mocap.mot_writing import StorageTable
from gaitval.session.request import ImportOptions, checked
from gaitval.session.trial import valid_cycles

CUTOFF_HZ: Final = 8.0
FOLDER: Final = "mitkof6+OpenSimRT/data/gait1992"


def of_gait1992(folder: Path, work: Path) -> StorageTable:
    """Moments of gait1992 by OpenSim's tools."""
    import opensim

    data = folder / "experimental_data"
    model = opensim.Model(str(folder / "scale/model_scaled.osim"))
    model.initSystem()
    loads = (data / "setup_grf.xml").read_text(encoding="utf-8")
    # Its paths are relative to its own folder.
    loads = loads.replace("task_grf.mot", str(data / "task_grf.mot"))
    loads = loads.replace("../inverse_kinematics/", f"{folder / 'inverse_kinematics'}/")
    (work / "loads.xml").write_text(loads, encoding="utf-8")
    tool = opensim.InverseDynamicsTool()
    tool.setModel(model)
    muscles = opensim.ArrayStr()
    muscles.append("Muscles")
    tool.setExcludedForces(muscles)
    motion = folder / "inverse_kinematics/task_InverseKinematics.mot"
    tool.setCoordinatesFileName(str(motion))
    tool.setExternalLoadsFileName(str(work / "loads.xml"))
    tool.setLowpassCutoffFrequency(CUTOFF_HZ)
    time = read_storage(motion).time
    tool.setStartTime(float(time[0]))
    tool.setEndTime(float(time[-1]))
    tool.setOutputGenForceFileName("id.sto")
    tool.setResultsDir(str(work))
    with chdir(work):
        if not tool.run():
            raise RuntimeError("OpenSim failed on gait1992")
    return read_storage(work / "id.sto")


def inside(options: dict[str, Any], theirs: StorageTable, hips: str) -> float:
    """Share of both hip flexion moments of `theirs` inside our bands with hip centres by `hips`."""
    with tempfile.TemporaryDirectory() as name:
        asked = checked(ImportOptions, options | {"hip_centre": hips})
        request = request_of(asked, Path(name).resolve() / "out", lambda *_: None)
        found = work_out(request, load_configuration().processing)
    rate, held = 1.0 / float(np.diff(theirs.time).mean()), []
    for side in ("right", "left"):
        name = f"hip_flexion_{side[0]}"
        moment = theirs.column(f"{name}_moment")[:, None] / request.mass_kg
        smooth = low_pass(moment, rate=rate, cutoff_hz=CUTOFF_HZ)[:, 0]
        cycles = [
            cycle
            for cycle in valid_cycles(found.trials[0], side, kinetics=True)
            if theirs.time[0] <= cycle.start and cycle.end <= theirs.time[-1]
        ]
        mean = np.mean([normalise(theirs.time, smooth, cycle) for cycle in cycles], axis=0)
        half = measurement_of(found).bands.half[f"moment_{name}"]
        held += list(np.abs(found.moments[name].mean - mean) <= half)
    return 100.0 * float(np.mean(held))


def asked_of(
    folder: Path, files: tuple[str, str, str], mass: float, height: float
) -> dict[str, Any]:
    """What an import is told of a session of a man of `mass` kg and `height` m: `files` of the
    standing trial, of the walk and of its forces, in a `folder`.
    """
    static, trial, forces = (folder / name for name in files)
    return {
        "static": static, "trials": [trial], "forces": [forces],
        "mass": mass, "height": height, "sex": "M",
    }  # fmt: skip


@claims.measured("public", "data")
def hip_centre(given: claims.Given) -> list[Claim]:
    """Hip moments of OpenSim, with its own hips, inside our bands."""
    walk, other = given.data / "opensim_rajagopal", given.public / FOLDER
    his = ("static_walk_1.trc", "motion_capture_walk.trc", "grf_walk.mot")
    theirs = ("static.trc", "task.trc", "task_grf.mot")
    sessions: Mapping[str, tuple[dict[str, Any], str, Callable[[Path], StorageTable]]] = {
        "Rajagopal's walk": (
            asked_of(walk / "ExpData", his, 85.07, 1.829),
            "rajagopal2016",
            lambda work: read_storage(run_pipeline(walk, "Rajagopal2016.osim", work).moments),
        ),
        "gait1992": (
            asked_of(other / "experimental_data", theirs, 72.6, 1.803),
            "gait2392",
            lambda work: of_gait1992(other, work),
        ),
    }
    rows = []
    for title, (options, own, moments) in sessions.items():
        with tempfile.TemporaryDirectory() as name:
            found = moments(Path(name).resolve())
        for hips, what in (("harrington", "hips by Harrington"), (own, "hips of its model")):
            share = inside(options, found, hips)
            rows.append(
                Claim(
                    f"{title}: hip moments of OpenSim inside bands of 90 %, {what}", share, "%", 2
                )
            )
            print(rows[-1], flush=True)
    return rows
