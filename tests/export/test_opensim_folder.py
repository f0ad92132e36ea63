"""The walk for OpenSim: read back by gaitval's own readers, and the loads tied to the feet."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from opensim_motion import read_motion
from opensim_peer import inverse_dynamics_tool, read_table, run

from gaitval.apps.export import opensim_folder
from gaitval.apps.export.mujoco_folder import muscle_xml
from gaitval.apps.export.opensim_folder import FILES, LOADED_N, foot_forces, write_opensim
from gaitval.apps.export.walked import ExportedWalk
from gaitval.coordinates import ACTUATED
from gaitval.kinetics.inverse.inverse_dynamics import inverse_dynamics
from gaitval.kinetics.musculature.gait import LoadedMotion, MuscleGait
from gaitval.mocap.force_plates import UNLOADED_N
from gaitval.mocap.mot import read_ground_reaction, read_storage
from gaitval.session.opensim.coordinates import TO_OPENSIM
from gaitval.session.opensim.osim import BODIES

INSIDE = slice(50, -50)
"""Both differentiate by splines, which are free at the ends."""


@pytest.fixture(scope="module")
def folder(walked: ExportedWalk, tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("opensim")
    paths = write_opensim(found, walked)
    assert [path.name for path in paths] == list(FILES)
    return found


def test_the_motion_comes_in_again(walked: ExportedWalk, folder: Path) -> None:
    time, positions = read_motion(folder / "walk.mot")
    shown = walked.walk.time[walked.rows]
    np.testing.assert_allclose(time, shown - shown[0], atol=1e-9)
    np.testing.assert_allclose(positions, walked.walk.positions[walked.rows], atol=1e-9)


def test_joint_moments_come_in_again_and_nothing_holds_the_pelvis(
    walked: ExportedWalk, folder: Path
) -> None:
    table = read_storage(folder / "moments.sto")
    for column, name in enumerate(ACTUATED):
        expected = walked.walk.moments[walked.rows, column]
        np.testing.assert_allclose(table.column(f"{name}_moment"), expected, atol=1e-8)
    for name in table.columns[:6]:
        assert not table.column(name).any()


def test_the_ground_reaction_comes_in_again(walked: ExportedWalk, folder: Path) -> None:
    """As a wrench about the origin, which is what acts."""
    rate, start, plates = read_ground_reaction(folder / "ground_reaction.mot")
    assert rate == pytest.approx(1.0 / walked.environment.walker.physics_step)
    assert start == 0.0
    wrenches = walked.walk.wrenches()[walked.rows]
    for side, plate in enumerate(plates):
        loaded = wrenches[:, side, 2] > UNLOADED_N  # the reader gives no point below
        force = plate.force @ TO_OPENSIM  # rows times C are Cᵀ of columns: back from OpenSim's
        point = plate.centre_of_pressure @ TO_OPENSIM
        moment = np.cross(point, force) + plate.free_moment @ TO_OPENSIM
        expected = wrenches[:, side]
        np.testing.assert_allclose(force[loaded], expected[loaded, :3], atol=1e-6)
        np.testing.assert_allclose(moment[loaded], expected[loaded, 3:], atol=1e-5)
        assert not force[wrenches[:, side, 2] <= LOADED_N].any()


def test_the_free_moment_is_about_the_vertical(walked: ExportedWalk) -> None:
    forces = foot_forces(walked)
    known = np.isfinite(forces.centre_of_pressure).all(axis=2)
    np.testing.assert_allclose(forces.free_moment[known][:, :2], 0.0, atol=1e-8)
    assert 1.0 < np.abs(forces.free_moment[known][:, 2]).max() < 30.0  # Nm, of a walk


@pytest.mark.slow
def test_opensim_finds_the_moments_that_inverse_dynamics_finds_here(
    walked: ExportedWalk, folder: Path, tmp_path: Path
) -> None:
    model, motion, loads = (folder / FILES[number] for number in (0, 1, 4))
    run(inverse_dynamics_tool(model, motion, loads, tmp_path / "id.sto"), tmp_path)
    found = read_table(tmp_path / "id.sto")
    forces = foot_forces(walked)
    ours = inverse_dynamics(
        walked.body,
        forces.time,
        walked.walk.positions[walked.rows],
        *(forces.force, forces.centre_of_pressure, forces.free_moment),
    )
    for column, name in enumerate(ACTUATED):
        expected = ours.moments[INSIDE, column]
        largest = np.abs(expected).max()
        np.testing.assert_allclose(found[f"{name}_moment"][INSIDE], expected, atol=1e-3 * largest)


def test_forces_and_moments_act_in_the_states_that_they_are_beside(walked: ExportedWalk) -> None:
    """Row by row: what inverse dynamics of the motion leaves at the pelvis and at a hip. What
    led to a state, 2 ms before, would leave 30 N and 15 Nm."""
    forces = foot_forces(walked)
    found = inverse_dynamics(
        walked.body,
        forces.time,
        walked.walk.positions[walked.rows],
        *(forces.force, forces.centre_of_pressure, forces.free_moment),
    )
    hip = ACTUATED.index("hip_flexion_r")
    acted = walked.walk.moments[walked.rows, hip]
    left = found.residual_force[INSIDE], (found.moments[:, hip] - acted)[INSIDE]
    assert np.sqrt(np.mean(left[0] ** 2)) < 8.0
    assert np.sqrt(np.mean(left[1] ** 2)) < 5.0


def test_loads_act_on_both_feet_from_the_file_beside_them(folder: Path) -> None:
    loads = ElementTree.parse(folder / "loads.xml")
    bodies = [each.text for each in loads.iter("applied_to_body")]
    assert bodies == [BODIES["foot_r"], BODIES["foot_l"]]
    assert (folder / str(loads.findtext(".//datafile"))).is_file()


@pytest.fixture(scope="module")
def laden(walked: ExportedWalk) -> ExportedWalk:
    """The same walk by whoever carries a fifth of the body's mass."""
    stored = walked.stored
    record = stored.configuration.record.model_copy(update={"load": 20.0})
    configuration = stored.configuration.model_copy(update={"record": record})
    found = ExportedWalk(replace(stored, configuration=configuration))
    vars(found).update(walk=walked.walk, cycles=walked.cycles)
    return found


def test_muscles_of_a_laden_walk_are_the_persons(
    walked: ExportedWalk, laden: ExportedWalk, folder: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Whose body has the load: no muscle grows with it, and it is in moments and models."""
    mass = walked.body.mass
    assert laden.body.mass == pytest.approx(1.2 * mass)
    shared = []

    def muscles(motions: list[LoadedMotion]) -> MuscleGait:
        shared.extend(motions)
        raise InterruptedError

    monkeypatch.setattr(opensim_folder, "muscles_of", muscles)
    with pytest.raises(InterruptedError):
        write_opensim(tmp_path, laden)
    (motion,) = shared
    assert motion.model.mass == pytest.approx(mass)
    assert motion.laden is not None
    assert motion.laden.mass == pytest.approx(1.2 * mass)

    def numbers(path: Path, tag: str) -> list[float]:
        return [float(each.text or "") for each in ElementTree.parse(path).getroot().iter(tag)]

    own, theirs = (each / "model_with_muscles.osim" for each in (folder, tmp_path))
    assert len(numbers(own, "max_isometric_force")) == 80
    np.testing.assert_allclose(
        numbers(theirs, "max_isometric_force"), numbers(own, "max_isometric_force")
    )
    assert sum(numbers(theirs, "mass")) == pytest.approx(1.2 * sum(numbers(own, "mass")))
    of_actuators = []
    for one in (walked, laden):
        actuators = [*ElementTree.fromstring(muscle_xml(one)).findall("actuator/*")]
        assert len(actuators) == 80
        of_actuators.append([[*map(float, each.attrib["gainprm"].split())] for each in actuators])
    np.testing.assert_allclose(of_actuators[1], of_actuators[0], rtol=1e-9)
