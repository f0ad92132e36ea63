"""Time of inverse kinematics; run with `make bench`.

The peer is OpenSim on the same model, markers and weights, with its default accuracy: its tool as a
user runs it, which reads the markers and writes the motion, and its solver only. The trial is 2 s
of WBDS01 T01 (22 markers, 150 Hz). Compare the ratios of one run, not times.
"""

import opensim
from against_opensim import AgainstOpenSim, Trial
from opensim_peer import inverse_kinematics_tool, run

from gaitval.configuration import ContactSettings
from gaitval.kinetics.inverse.inverse_kinematics import inverse_kinematics
from gaitval.mocap.trc import read_trc
from gaitval.session.opensim.coordinates import TO_OPENSIM
from gaitval.session.opensim.motion import write_markers, write_motion
from gaitval.session.opensim.osim import write_osim

SHIPPED_ACCURACY = 1e-5


class Kinematics(Trial):
    """The walk and its files in a folder."""

    def __init__(self, walk, folder):
        super().__init__(walk, folder)
        self.model = folder / "model.osim"
        self.markers = folder / "walk.trc"
        write_osim(self.model, walk.model, walk.markers, ContactSettings(), 0.8, locked=walk.fixed)
        write_markers(self.markers, walk.trial)

    def with_opensims_tool(self):
        tool = inverse_kinematics_tool(
            self.model,
            self.walk.markers,
            self.markers,
            self.folder / "theirs.mot",
            accuracy=SHIPPED_ACCURACY,
        )
        return lambda: run(tool, self.folder)

    def with_opensims_solver(self):
        weights = opensim.SetMarkerWeights()
        for marker in self.walk.markers:
            weights.cloneAndAppend(opensim.MarkerWeight(marker.name, marker.weight))
        reference = opensim.MarkersReference(str(self.markers), weights)
        model = opensim.Model(str(self.model))
        state = model.initSystem()
        coordinates = opensim.SimTKArrayCoordinateReference()
        solver = opensim.InverseKinematicsSolver(model, reference, coordinates)
        solver.setAccuracy(SHIPPED_ACCURACY)
        times = reference.getMarkerTable().getIndependentColumn()

        def solve(kept=(model, reference, coordinates)):
            state.setTime(times[0])
            solver.assemble(state)
            for time in times[1:]:
                state.setTime(time)
                solver.track(state)

        return solve

    def solve(self, markers):
        return inverse_kinematics(
            self.walk.model, self.walk.markers, markers, fixed=self.walk.fixed
        ).positions

    def alone(self):
        return self.solve(self.walk.trial.markers)

    def with_files(self):
        recording = read_trc(self.markers).turned(TO_OPENSIM.T)
        write_motion(self.folder / "ours.mot", recording.time, self.solve(recording.markers))


class TestInverseKinematics(AgainstOpenSim):
    kind = Kinematics
    name = "inverse kinematics"
    frames = 300
    tool_rounds, solver_rounds, goal_rounds = 1, 1, 2
    goal = 15.0
