"""What OpenSim says of a session with planted faults: Rajagopal's walk, whose forces are changed.

OpenSim scales and finds the motion once; inverse dynamics then gets forces with a fault. Counted is
what its log says that it does not say of the forces as recorded, at the level "Info", and by how
much a moment changes. `planted` has what gaitval says of the same kinds of faults of this walk.
"""

import os
import tempfile
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np

import evidence
from experiments.opensim_pipeline import Results, _inverse_dynamics, run_pipeline
from gaitval.arrays import Array
from gaitval.gait.filters import low_pass
from gaitval.mocap.mot import read_storage

GENERIC: Final = "Rajagopal2016.osim"
MEASURES = {
    "*": {"code": ("evidence/measurement/peers.py", "experiments/opensim_pipeline.py")},
}
"""What the row depends on; see evidence/stale.py."""
Columns = dict[str, Array]


def _scaled(factor: float) -> Callable[[Columns], Columns]:
    return lambda of: {
        name: factor * values if "_r_v" in name or "torque_r" in name else values
        for name, values in of.items()
    }


def _late(seconds: float) -> Callable[[Columns], Columns]:
    return lambda of: {
        name: values if name == "time" else np.interp(of["time"] - seconds, of["time"], values)
        for name, values in of.items()
    }


def _added(column: str, by: Callable[[Columns], Array]) -> Callable[[Columns], Columns]:
    return lambda of: of | {column: of[column] + by(of)}


def _slow(hertz: float) -> Callable[[Columns], Columns]:
    def change(of: Columns) -> Columns:
        rate = 1.0 / float(np.median(np.diff(of["time"])))
        return {
            name: low_pass(values[:, None], rate=rate, cutoff_hz=hertz)[:, 0]
            if "_v" in name
            else values
            for name, values in of.items()
        }

    return change


FAULTS: Final = {
    "forces 35 ms late": _late(0.035),
    "forces 35 ms early": _late(-0.035),
    "right plate gain +10 %": _scaled(1.1),
    "right plate gain -10 %": _scaled(0.9),
    "right plate 30 mm forward": _added("ground_force_r_px", lambda of: 0.03 + 0 * of["time"]),
    "right plate 30 mm to the right": _added("ground_force_r_pz", lambda of: 0.03 + 0 * of["time"]),
    "cross-talk 5 %": _added("ground_force_r_vx", lambda of: 0.05 * of["ground_force_r_vy"]),
    "forces low-passed at 5 Hz": _slow(5.0),
}


def _said(results: Results, folder: Path) -> tuple[set[str], dict[str, Array]]:
    """Lines of the log of inverse dynamics, and its moments."""
    import opensim

    log = folder / "again.log"
    log.unlink(missing_ok=True)
    opensim.Logger.addFileSink(str(log))
    opensim.Logger.setLevelString("Info")
    try:
        _inverse_dynamics(folder)
    finally:
        opensim.Logger.removeFileSink()
    table = read_storage(results.moments)
    moments = {name: table.column(name) for name in table.columns if name.endswith("_moment")}
    # times of day and of the processor differ from run to run
    lines = log.read_text(encoding="utf-8").splitlines()
    return {line.partition("] ")[2] for line in lines if " time" not in line}, moments


def _write(path: Path, head: str, columns: Columns) -> None:
    rows = "\n".join(
        "\t".join(f"{value:.6f}" for value in row) for row in np.column_stack([*columns.values()])
    )
    path.write_text(f"{head}endheader\n{chr(9).join(columns)}\n{rows}\n", encoding="utf-8")


@evidence.measurement()
def peers(_: Namespace) -> evidence.Row:
    """Planted faults of forces of which OpenSim says something."""
    data = Path(os.environ["GAITVAL_DATA"]) / "opensim_rajagopal"
    told = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name).resolve()
        results = run_pipeline(data, GENERIC, folder)
        forces = folder / "ExpData/grf_walk.mot"
        head, _, body = forces.read_text(encoding="utf-8").partition("endheader\n")
        names, *rows = body.splitlines()
        values = np.array([row.split() for row in rows], dtype=float)
        columns = dict(zip(names.split(), values.T, strict=True))
        before, right = _said(results, folder)
        for fault, change in FAULTS.items():
            _write(forces, head, change(dict(columns)))
            said, moments = _said(results, folder)
            off = max(
                float(np.abs(moments[n] - right[n]).max()) for n in right if n.startswith(
                    ("hip_flexion", "knee_angle", "ankle_angle")
                )
            )  # fmt: skip
            print(f"{fault} | {off:.0f} Nm | {sorted(said - before)}", flush=True)
            told += bool(said - before)
    return evidence.Row(
        "planted faults of forces of which OpenSim 4.6 says something (for comparison)",
        100 * told / len(FAULTS), "%", ">=", 0, 0, len(FAULTS),
    )  # fmt: skip
