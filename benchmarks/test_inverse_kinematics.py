"""Time of inverse kinematics; run with `make bench`.

The peer is OpenSim on the same model, markers and weights, with its default accuracy: its tool as a
user runs it, which reads the markers and writes the motion, and its solver only. The trial is 2 s
of WBDS01 T01 (22 markers, 150 Hz). Compare the ratios of one run, not times.
"""

import opensim
import pytest
from opensim_peer import inverse_kinematics_tool, run
from recorded_walks import wbds_walk
from speed_ratio import speed_ratio

from gaitval.configuration import ContactSettings
from gaitval.inverse.inverse_kinematics import inverse_kinematics
from gaitval.mocap.trc import read_trc
from gaitval.opensim.coordinates import TO_OPENSIM
from gaitval.opensim.motion import write_markers, write_motion
from gaitval.opensim.osim import write_osim

FRAMES = 300
SHIPPED_ACCURACY = 1e-5
GOAL = 15.0
"""Times OpenSim's tool, in frames per second, files included."""


class Trial:
    """The walk and its files in a folder."""

    def __init__(self, walk, folder):
        self.walk = walk
        self.folder = folder
        self.model = folder / "model.osim"
        self.markers = folder / "walk.trc"
        write_osim(self.model, walk.model, walk.markers, ContactSettings(), 0.8, held=walk.held)
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
            self.walk.model, self.walk.markers, markers, held=self.walk.held
        ).positions

    def with_files(self):
        recording = read_trc(self.markers).turned(TO_OPENSIM.T)
        write_motion(self.folder / "ours.mot", recording.time, self.solve(recording.markers))


@pytest.fixture(scope="module")
def trial(gait_data, tmp_path_factory):
    found = Trial(wbds_walk(gait_data, FRAMES), tmp_path_factory.mktemp("kinematics"))
    found.with_files()  # compiles
    return found


@pytest.mark.benchmark(group="inverse kinematics, 300 frames")
def test_opensim_tool(benchmark, trial):
    benchmark.pedantic(lambda tool: tool(), setup=lambda: ((trial.with_opensims_tool(),), {}))


@pytest.mark.benchmark(group="inverse kinematics, 300 frames")
def test_opensim_solver_alone(benchmark, trial):
    benchmark.pedantic(trial.with_opensims_solver(), rounds=1)


@pytest.mark.benchmark(group="inverse kinematics, 300 frames")
def test_gaitval_with_files(benchmark, trial):
    benchmark(trial.with_files)


@pytest.mark.benchmark(group="inverse kinematics, 300 frames")
def test_gaitval_alone(benchmark, trial):
    benchmark(lambda: trial.solve(trial.walk.trial.markers))


@pytest.mark.benchmark(group="inverse kinematics, both with files, once")
def test_the_goal(benchmark, trial):
    ratio = benchmark.pedantic(
        lambda: speed_ratio(trial.with_opensims_tool, trial.with_files, their_rounds=2)
    )
    assert ratio >= GOAL
