"""OpenSim as the peer that the tests and benchmarks of OpenSim's files compare with."""

from collections.abc import Mapping, Sequence
from contextlib import chdir
from pathlib import Path

import numpy as np
import opensim

from gaitval.model.body import SEGMENTS
from gaitval.model.markers import ModelMarker
from gaitval.session.opensim.coordinates import (
    OPENSIM_COORDINATES,
    TO_OPENSIM,
    forces_to_opensim,
    to_opensim,
)
from gaitval.session.opensim.osim import BODIES

opensim.Logger.setLevelString("Off")
opensim.Logger.removeFileSink()  # it writes opensim.log into the current folder


class OpenSimModel:
    """A model file in OpenSim, posed by the project's positions and velocities."""

    def __init__(self, path: Path, *, contact: bool = False) -> None:
        self.model = opensim.Model(str(path))
        forces = self.model.updForceSet()
        for i in range(forces.getSize()):
            forces.get(i).set_appliesForce(contact)
        self.coordinates = self.model.updCoordinateSet()
        for name in OPENSIM_COORDINATES:  # any pose
            self.coordinates.get(name).set_clamped(False)
            self.coordinates.get(name).set_locked(False)
        self.state = self.model.initSystem()

    def pose(self, q: np.ndarray, qd: np.ndarray | None = None) -> None:
        """Put the model into a state (31,) of the project."""
        qd = np.zeros(31) if qd is None else qd
        values = to_opensim(q[None])[0]
        speeds = qd.copy()
        # The power of a root moment is the same in both: for unit moments, the pelvis's rates.
        unit = np.hstack([np.eye(3), np.zeros((3, 28))])
        along = forces_to_opensim(np.tile(q, (3, 1)), unit)[:, :3]
        speeds[:3] = np.linalg.solve(along, qd[:3])
        speeds[3:6] = TO_OPENSIM @ qd[3:6]
        for name, value, speed in zip(OPENSIM_COORDINATES, values, speeds, strict=True):
            coordinate = self.coordinates.get(name)
            coordinate.setValue(self.state, float(value), False)
            coordinate.setSpeedValue(self.state, float(speed))
        self.model.realizeDynamics(self.state)

    def frames(self) -> np.ndarray:
        """Poses (14, 4, 4) of the bodies in the project's axes, in the order of `SEGMENTS`."""
        found = np.tile(np.eye(4), (len(SEGMENTS), 1, 1))
        for frame, segment in zip(found, SEGMENTS, strict=True):
            transform = (
                self.model.getBodySet().get(BODIES[segment]).getTransformInGround(self.state)
            )
            turn = transform.R()
            rotation = np.array([[turn.get(i, j) for j in range(3)] for i in range(3)])
            frame[:3, :3] = TO_OPENSIM.T @ rotation @ TO_OPENSIM
            frame[:3, 3] = TO_OPENSIM.T @ transform.p().to_numpy()
        return found

    def sphere_forces(self) -> np.ndarray:
        """Force and moment about the body's origin (K, 2, 3) of the ground on each sphere."""
        forces = self.model.getForceSet()
        found = np.empty((forces.getSize(), 2, 3))
        for i in range(forces.getSize()):
            values = forces.get(i).getRecordValues(self.state)
            six = np.array([values.get(j) for j in range(6)])
            found[i] = six.reshape(2, 3) @ TO_OPENSIM
        return found

    def markers(self) -> np.ndarray:
        """Positions (M, 3) m of the markers, in the project's axes."""
        set_ = self.model.getMarkerSet()
        places = [
            set_.get(i).getLocationInGround(self.state).to_numpy() for i in range(set_.getSize())
        ]
        return np.array(places) @ TO_OPENSIM


Tool = opensim.InverseKinematicsTool | opensim.InverseDynamicsTool


def _set_up(tool: Tool, model: Path, result: Path) -> None:
    """The model, the whole of the trial, and the folder of the result."""
    loaded = opensim.Model(str(model))
    loaded.initSystem()
    tool.setModel(loaded)
    tool.model_in_use = loaded  # the tool does not own it
    tool.setStartTime(-np.inf)
    tool.setEndTime(np.inf)
    tool.setResultsDir(str(result.parent))


def inverse_kinematics_tool(
    model: Path, markers: Sequence[ModelMarker], trc: Path, result: Path, *, accuracy: float
) -> opensim.InverseKinematicsTool:
    """OpenSim's tool with the markers' weights, ready to run."""
    tool = opensim.InverseKinematicsTool()
    _set_up(tool, model, result)
    tool.setMarkerDataFileName(str(trc))
    tool.setOutputMotionFileName(str(result))
    tool.set_report_errors(False)
    tool.set_accuracy(accuracy)
    for marker in markers:
        task = opensim.IKMarkerTask()
        task.setName(marker.name)
        task.setApply(True)
        task.setWeight(marker.weight)
        tool.getIKTaskSet().cloneAndAppend(task)
    return tool


def inverse_dynamics_tool(
    model: Path, motion: Path, loads: Path, result: Path
) -> opensim.InverseDynamicsTool:
    """OpenSim's tool without filters, ready to run."""
    tool = opensim.InverseDynamicsTool()
    _set_up(tool, model, result)
    tool.setCoordinatesFileName(str(motion))
    tool.setExternalLoadsFileName(str(loads))
    tool.setLowpassCutoffFrequency(-1.0)
    tool.setOutputGenForceFileName(result.name)
    return tool


def run(tool: Tool, folder: Path) -> None:
    """Run a tool inside `folder`: relative paths are from there."""
    with chdir(folder):
        assert tool.run()


def read_table(path: Path) -> Mapping[str, np.ndarray]:
    """Columns of a storage file as OpenSim writes them, by name."""
    lines = path.read_text(encoding="utf-8").split("endheader\n", 1)[1].splitlines()
    values = np.array([line.split() for line in lines[1:]], dtype=float)
    return dict(zip(lines[0].split(), values.T, strict=True))
