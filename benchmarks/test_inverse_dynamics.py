"""Time of inverse dynamics; run with `make bench`.

The peer is OpenSim on the same model, motion and ground reaction: its tool as a user runs it, which
reads both and writes the moments, and its solver only. The trial is 10 s of WBDS01 T01 (150 Hz).
Compare the ratios of one run, not times.
"""

import numpy as np
import opensim
from against_opensim import AgainstOpenSim, Trial
from opensim_motion import read_motion
from opensim_peer import inverse_dynamics_tool, read_table, run

from gaitval.configuration import ContactSettings
from gaitval.kinetics.inverse.inverse_dynamics import inverse_dynamics
from gaitval.mocap.mot import read_storage
from gaitval.session.opensim.coordinates import TO_OPENSIM
from gaitval.session.opensim.motion import (
    write_external_loads,
    write_ground_reaction,
    write_moments,
    write_motion,
)
from gaitval.session.opensim.osim import write_osim


class Dynamics(Trial):
    """The walk and its files in a folder."""

    def __init__(self, walk, folder):
        super().__init__(walk, folder)
        self.model, self.loads = folder / "model.osim", folder / "loads.xml"
        self.motion, self.ground_reaction = folder / "walk.mot", folder / "grf.mot"
        write_osim(self.model, walk.model, walk.markers, ContactSettings(), 0.8)
        write_motion(self.motion, walk.trial.time, walk.positions)
        write_ground_reaction(self.ground_reaction, walk.forces)
        write_external_loads(self.loads, self.ground_reaction.name)

    def with_opensims_tool(self):
        tool = inverse_dynamics_tool(
            self.model, self.motion, self.loads, self.folder / "theirs.sto"
        )
        return lambda: run(tool, self.folder)

    def with_opensims_solver(self):
        model = opensim.Model(str(self.model))
        loads = opensim.ExternalLoads(str(self.loads), True)
        model.addModelComponent(loads)
        state = model.initSystem()
        motion = opensim.Storage(str(self.motion))
        model.getSimbodyEngine().convertDegreesToRadians(motion)
        splines = opensim.GCVSplineSet(5, motion)
        functions = opensim.FunctionSet()
        self.with_opensims_tool()()
        for name in list(read_table(self.folder / "theirs.sto"))[1:]:  # the solver's order
            functions.cloneAndAppend(splines.get(name.rpartition("_")[0]))
        solver = opensim.InverseDynamicsSolver(model)
        times = self.walk.trial.time

        def solve(kept=(model, loads, splines)):
            for time in times:
                solver.solve(state, functions, float(time))

        return solve

    def solve(self, time, positions, force, point, free_moment):
        return inverse_dynamics(self.walk.model, time, positions, force, point, free_moment)

    def alone(self):
        forces = self.walk.forces
        return self.solve(
            self.walk.trial.time,
            self.walk.positions,
            forces.force,
            forces.centre_of_pressure,
            forces.free_moment,
        )

    def with_files(self):
        time, positions = read_motion(self.motion)
        wrenches = read_storage(self.ground_reaction).values.reshape(len(time), 2, 3, 3)
        force, point, free_moment = np.moveaxis(wrenches @ TO_OPENSIM, 2, 0)
        dynamics = self.solve(time, positions, force, point, free_moment)
        write_moments(self.folder / "ours.sto", positions, dynamics)


class TestInverseDynamics(AgainstOpenSim):
    kind = Dynamics
    name = "inverse dynamics"
    frames = 1500
    tool_rounds, solver_rounds, goal_rounds = 3, 3, 3
    goal = 10.0
