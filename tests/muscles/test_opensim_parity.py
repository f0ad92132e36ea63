"""Sharing and contact forces against OpenSim's own tools, on its model, poses, moments and arms.

A person is held with bent knees, and forces of a known size press both feet. OpenSim's static
optimisation says what each muscle does, its joint reaction what joints carry.
"""

from pathlib import Path

import numpy as np
import pytest

from gaitval.kinetics.musculature.sharing import solve

opensim = pytest.importorskip("opensim")

RATE, SECONDS = 100.0, 0.20
FIRST, LAST = 0.08, 0.12
POSE = {"hip_flexion": 25.0, "hip_adduction": -4.0, "knee_angle": 40.0, "ankle_angle": 12.0}
UNDER = 420.0
"""N, upwards, under each foot."""
MOVED = tuple(f"{name}_{side}" for side in "rl" for name in (*POSE, "hip_rotation"))
BEYOND = {
    "hip": ("pelvis", "femur", ("femur", "tibia", "patella", "talus", "calcn", "toes")),
    "walker_knee": ("femur", "tibia", ("tibia", "talus", "calcn", "toes")),
    "ankle": ("tibia", "talus", ("talus", "calcn", "toes")),
}
LOWEST = 0.01


def _table(path: Path, names: list[str], rows: np.ndarray, *, degrees: str) -> None:
    head = [path.stem, "version=1", f"nRows={len(rows)}", f"nColumns={len(names)}"]
    body = ["\t".join(f"{x:.9f}" for x in row) for row in rows]
    path.write_text(
        "\n".join([*head, f"inDegrees={degrees}", "endheader", "\t".join(names), *body])
    )


def _strings(*names: str):
    found = opensim.ArrayStr()
    for name in names:
        found.append(name)
    return found


@pytest.fixture(scope="module")
def run(gait_data, tmp_path_factory):
    """Results of OpenSim, and the model at the first time."""
    opensim.Logger.setLevelString("Off")
    opensim.Logger.removeFileSink()
    file = gait_data / "opensim_rajagopal" / "RajagopalLaiUhlrich2023.osim"
    out = tmp_path_factory.mktemp("static_optimisation")
    time = np.arange(round(SECONDS * RATE) + 1) / RATE
    coordinates = {"pelvis_ty": 0.9 + 0 * time}
    for side in "rl":
        for name, angle in POSE.items():
            coordinates[f"{name}_{side}"] = angle + 0 * time
        coordinates[f"knee_angle_{side}_beta"] = coordinates[f"knee_angle_{side}"]
    _table(out / "pose.mot", ["time", *coordinates], np.column_stack([time, *coordinates.values()]),
           degrees="yes")  # fmt: skip
    names, columns = ["time"], [time]
    for number, side in enumerate((1, -1)):
        values = {"v": (0, UNDER, 0), "p": (0.05, 0.0, 0.09 * side), "t": (0, 0, 0)}
        for kind, value in values.items():
            for axis, x in zip("xyz", value, strict=True):
                names.append(f"f{number}_{kind}{axis}")
                columns.append(x + 0 * time)
    _table(out / "forces.mot", names, np.column_stack(columns), degrees="no")
    loads = opensim.ExternalLoads()
    for number, side in enumerate("rl"):
        force = opensim.ExternalForce()
        force.setName(f"under_{side}")
        force.set_applied_to_body(f"calcn_{side}")
        force.set_force_expressed_in_body("ground")
        force.set_point_expressed_in_body("ground")
        force.set_force_identifier(f"f{number}_v")
        force.set_point_identifier(f"f{number}_p")
        force.set_torque_identifier(f"f{number}_t")
        loads.cloneAndAppend(force)
    loads.setDataFileName(str(out / "forces.mot"))
    loads.printToXML(str(out / "loads.xml"))
    model = opensim.Model(str(file))
    model.initSystem()
    reserves = opensim.ForceSet()
    for coordinate in model.getCoordinateSet():
        name = coordinate.getName()
        if "beta" in name or coordinate.get_locked():
            continue
        actuator = opensim.CoordinateActuator()
        actuator.setName(f"reserve_{name}")
        actuator.set_coordinate(name)
        actuator.setOptimalForce(1.0 if name in MOVED else 100.0)
        actuator.setMinControl(-1e5)
        actuator.setMaxControl(1e5)
        reserves.cloneAndAppend(actuator)
    reserves.printToXML(str(out / "reserves.xml"))

    def tool(name: str, analysis) -> None:
        """Twice through a file: a tool made in Python runs no analyses."""
        made = opensim.AnalyzeTool()
        made.setName(name)
        made.setModelFilename(str(file))
        made.setCoordinatesFileName(str(out / "pose.mot"))
        made.setExternalLoadsFileName(str(out / "loads.xml"))
        made.setStartTime(FIRST)
        made.setFinalTime(LAST)
        made.setResultsDir(str(out))
        made.setForceSetFiles(_strings(str(out / "reserves.xml")))
        made.setReplaceForceSet(False)
        analysis.setStartTime(FIRST)
        analysis.setEndTime(LAST)
        made.getAnalysisSet().cloneAndAppend(analysis)
        made.printToXML(str(out / f"{name}.xml"))
        opensim.AnalyzeTool(str(out / f"{name}.xml")).run()

    optimisation = opensim.StaticOptimization()
    optimisation.setName("so")
    optimisation.setStepInterval(2)
    optimisation.setConvergenceCriterion(1e-7)
    optimisation.setMaxIterations(500)
    tool("found", optimisation)
    reaction = opensim.JointReaction()
    reaction.setName("jr")
    reaction.setForcesFileName(str(out / "found_so_force.sto"))
    reaction.setInFrame(_strings("parent"))
    reaction.setOnBody(_strings("child"))
    reaction.setJointNames(_strings("ALL"))
    tool("carried", reaction)
    return model, out


def _column(table, name: str) -> np.ndarray:
    return table.getDependentColumn(name).to_numpy()


def _at(model, angles: dict[str, float]):
    state = model.initSystem()
    for name, angle in angles.items():
        model.getCoordinateSet().get(name).setValue(state, np.radians(angle), False)
    model.realizeVelocity(state)
    return state


@pytest.mark.slow
def test_activations_and_contact_forces_are_opensims(run):
    model, out = run
    activations = opensim.TimeSeriesTable(str(out / "found_so_activation.sto"))
    forces = opensim.TimeSeriesTable(str(out / "found_so_force.sto"))
    carried = opensim.TimeSeriesTable(str(out / "carried_jr_ReactionLoads.sto"))
    times, reaction_times = (np.array(t.getIndependentColumn()) for t in (activations, carried))
    muscles = [model.getMuscles().get(i) for i in range(80)]
    off, contact_off, alone, largest = [], [], [], 0.0
    for k, time in enumerate(times):
        angles = {f"{n}_{s}": a for n, a in POSE.items() for s in "rl"}
        angles |= {f"knee_angle_{s}_beta": angles[f"knee_angle_{s}"] for s in "rl"}
        state = _at(model, angles)
        for side in "rl":
            own = [m for m in muscles if m.getName().endswith(f"_{side}")]
            names = [m.getName() for m in own]
            dofs = [n for n in MOVED if n.endswith(f"_{side}")]
            coordinates = [model.getCoordinateSet().get(n) for n in dofs]
            arms = np.array([[m.computeMomentArm(state, c) for m in own] for c in coordinates])
            theirs = np.array([_column(activations, n)[k] for n in names])
            pull = np.array([_column(forces, n)[k] for n in names])
            # Force at full activation, of a fibre at rest behind a rigid tendon, by OpenSim.
            able = np.array(
                [
                    opensim.Millard2012EquilibriumMuscle.safeDownCast(m)
                    .calcInextensibleTendonActiveFiberForce(state, 1.0)
                    for m in own
                ]
            )  # fmt: skip
            able = np.where(theirs > 2 * LOWEST, pull / theirs, able)
            reserve = np.array([_column(forces, f"reserve_{n}")[k] for n in dofs])
            moment = arms @ pull + reserve
            ours = solve((arms * able)[None], moment[None], 2.0, np.ones(40), lowest=LOWEST)
            off.append(ours.activations[0] - theirs)
            assert np.abs(ours.left).max() < 0.02 * np.abs(moment).max()

            at = np.argmin(np.abs(reaction_times - time))
            lines = _pulls(model, state, own, side)
            for joint, (before, beyond, _) in BEYOND.items():
                parent = before if before == "pelvis" else f"{before}_{side}"
                label = f"{joint}_{side}_on_{beyond}_{side}_in_{parent}_f"
                load = np.array([_column(carried, label + axis)[at] for axis in "xyz"])
                # The free body: weight of what is beyond, the force under the foot, the muscles.
                up = UNDER - 9.80665 * sum(
                    model.getBodySet().get(f"{b}_{side}").getMass() for b in BEYOND[joint][2]
                )
                changed = (ours.activations[0] * able - pull) @ lines[joint]
                free = -up * lines["up", joint] - pull @ lines[joint]
                alone.append(np.linalg.norm(free - load))
                contact_off.append(np.linalg.norm(changed))
                largest = max(largest, float(np.linalg.norm(load)))
    assert np.sqrt(np.mean(np.square(off))) < 0.005
    assert max(contact_off) < 0.01 * largest
    # As far as OpenSim's forces hold the person still: it accepts small accelerations.
    assert max(alone) < 1e-6 * largest


def _pulls(model, state, muscles, side: str) -> dict:
    """Pull of each muscle per newton on what is beyond each joint, axes of the bone before it."""
    found = {}
    for joint, (before, _, beyond) in BEYOND.items():
        parent = before if before == "pelvis" else f"{before}_{side}"
        turn = model.getBodySet().get(parent).getTransformInGround(state).R()
        axes = np.array([[turn.get(i, j) for j in range(3)] for i in range(3)])
        rows = []
        for muscle in muscles:
            points = opensim.ArrayPointForceDirection()
            muscle.getGeometryPath().getPointForceDirections(state, points)
            total = np.zeros(3)
            for i in range(points.getSize()):
                point = points.get(i)
                if point.frame().findBaseFrame().getName()[:-2] in beyond:
                    total += point.direction().to_numpy()
            rows.append(total @ axes)
        found[joint] = np.array(rows)
        found["up", joint] = axes[1]
    return found
