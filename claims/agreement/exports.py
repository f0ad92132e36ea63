"""What `gaitval export` writes, walked and read again by other programs, and what other programs
write, read by gaitval. The test person is subject 5 with the stored baseline.
"""

import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import claims
from claims import Claim
from claims.opensim_motion import read_motion
from gaitval.mocap.c3d import read_c3d
from gaitval.mocap.force_plates import UNLOADED_N
from gaitval.mocap.mot import read_ground_reaction, read_storage

if TYPE_CHECKING:
    from gaitval.apps.export.walked import ExportedWalk
    from gaitval.mocap.recording import Recording

PERSON = "5"
CYCLES = 100
SECOND = 500
"""Physics steps."""


def _walker() -> "ExportedWalk":
    from gaitval.apps.export.walked import ExportedWalk

    return ExportedWalk.of(PERSON)


def _walked_in_mujoco(walked: "ExportedWalk", cycles: int) -> tuple[dict[str, NDArray[Any]], bool]:
    """The walk of the exported script, run without gaitval in a process of its own."""
    from gaitval.apps.export.mujoco_folder import write_mujoco

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_mujoco(folder, walked)
        script = (
            "import runpy, sys; sys.argv = ['walk.py', *sys.argv[1:]]\n"
            "try: runpy.run_path('walk.py', run_name='__main__')\n"
            "finally: assert not [name for name in sys.modules if name.startswith('gaitval')]"
        )
        words = [sys.executable, "-I", "-c", script, "--cycles", str(cycles), "--out", "walk.npz"]
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1) or not (folder / "walk.npz").is_file():
            raise RuntimeError(done.stderr)
        with np.load(folder / "walk.npz") as file:
            found = dict(file)
    return found, bool(found.pop("fell"))


def angles_in_mujoco(walked: "ExportedWalk", cycles: int) -> tuple[dict[str, float], int]:
    """RMS of each mean angle (deg) of a walk in plain MuJoCo from that of the stored report, and
    the right cycles walked after those that settle.
    """
    from gaitval.gait.record import LowPass
    from gaitval.metrics.comparison import rms, simulated_curves
    from gaitval.metrics.cycles import find_cycles
    from gaitval.metrics.results import read_metrics
    from gaitval.simulation.rollout import Rollout

    stored, metrics = walked.stored, read_metrics(walked.stored.folder)
    settling = stored.configuration.validation.settling_cycles
    found, fell = _walked_in_mujoco(walked, settling + cycles + 1)
    count = len(found["time"])
    walk = Rollout(
        time=found["time"],
        phase=found["phase"],
        positions=found["positions"],
        moments=found["moments"],
        ground_reaction=found["ground_reaction"],
        velocities=np.zeros_like(found["positions"]),
        centre_of_pressure=np.zeros((count, 2, 3)),
        free_moment=np.zeros((count, 2)),
        centre_of_mass=found["positions"][:, 3:6],
        root_force=np.zeros((count, 6)),
        mu=walked.mu,
        start_phase=np.zeros(1),
        fell=np.array([float(fell)]),
    )
    cut = find_cycles(walk, stored.configuration)
    frequency = stored.configuration.validation.filter_frequency
    curves = simulated_curves(
        walk, cut, mass=stored.model.mass, filters=LowPass(frequency, frequency)
    )
    final = metrics.walks.nominal if metrics.final == "nominal" else metrics.walks.identified
    assert final is not None
    errors = {}
    for name, each in final.curves.angles.items():
        assert each.mean is not None
        errors[name] = rms(np.rad2deg(curves.angles[name].mean(axis=0)) - np.array(each.mean))
    return errors, cut.count("right")


@claims.measured()
def mujoco(_: claims.Given) -> list[Claim]:
    """A hundred cycles of the exported person in plain MuJoCo, and their angles."""
    errors, cycles = angles_in_mujoco(_walker(), CYCLES)
    largest = max(errors, key=errors.__getitem__)
    print(f"largest: {largest}")
    what = "export -> plain MuJoCo (no gaitval imported)"
    return [
        Claim(
            f"{what}: mean angles against the report, RMS of the worst of all curves",
            errors[largest],
            "deg",
            len(errors),
        ),
        Claim(f"{what}: cycles without a fall", cycles, "cycles", 1),
    ]


@claims.measured()
def gymnasium(_: claims.Given) -> Claim:
    """Whether Gymnasium's checker accepts the environment."""
    import gymnasium as library
    from gymnasium.utils.env_checker import check_env

    made = library.make("gaitval.apps.export.environment:gaitval/Walker-v0", walker=PERSON)
    with warnings.catch_warnings():
        # Advice on actions, which are radians over a scale and not -1 to 1.
        warnings.filterwarnings("ignore", message=".*symmetric and normalized.*")
        warnings.simplefilter("error", append=True)
        try:
            check_env(made.unwrapped)
            refused = 0
        except (AssertionError, Warning) as error:
            print(error)
            refused = 1
    return Claim("gaitval/Walker-v0: objections of Gymnasium's checker", refused, "objections", 1)


@claims.measured()
def round_trips(_: claims.Given) -> list[Claim]:
    """What is read of each format again, against what was written."""
    import pandas as pd

    from gaitval.apps.export.c3d_file import recording_of, write_c3d_file
    from gaitval.apps.export.locohub import locohub_frame, write_locohub
    from gaitval.apps.export.opensim_folder import foot_forces, write_opensim

    walked = _walker()
    differences: dict[str, float] = {"MJCF": _first_second(walked)}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_opensim(folder, walked)
        _, positions = read_motion(folder / "walk.mot")
        _, _, plates = read_ground_reaction(folder / "ground_reaction.mot")
        moments = read_storage(folder / "moments.sto").values[:, 6:]
        walk, rows = walked.walk, walked.rows
        force = np.stack([plate.force for plate in plates], axis=1)[..., [0, 2, 1]] * [1, -1, 1]
        differences["OpenSim"] = max(
            _relative(positions, walk.positions[rows]),
            _relative(moments, walk.moments[walked.rows]),
            _relative(force, foot_forces(walked).force),
        )
        (path,) = write_c3d_file(folder, walked)
        read, written = read_c3d(path), recording_of(walked)
        differences["C3D"] = max(
            _relative(read.markers, written.markers),
            *(
                _relative(theirs.force, ours.force)
                for theirs, ours in zip(read.plates, written.plates, strict=True)
            ),
            *(
                _relative(theirs.centre_of_pressure[on], ours.centre_of_pressure[on])
                for theirs, ours in zip(read.plates, written.plates, strict=True)
                for on in [ours.force[:, 2] > 2.0 * UNLOADED_N]
            ),
        )
        (path,) = write_locohub(folder, walked)
        stored = pd.read_parquet(path).select_dtypes("number").drop(columns="step")
        frame = locohub_frame(walked)
        differences["LocoHub"] = max(
            _relative(stored[name].to_numpy(), frame[name].to_numpy()) for name in stored
        )
    return [
        Claim(
            f"export {name}, round trip: largest difference, of the quantity's largest value",
            value,
            "1",
            1,
        )
        for name, value in differences.items()
    ]


@claims.measured()
def opensim(_: claims.Given) -> Claim:
    """Joint moments that OpenSim finds in the exported files, and gaitval in the same walk."""
    sys.path.insert(0, str(claims.ROOT / "tests" / "support"))
    from opensim_peer import inverse_dynamics_tool, read_table, run

    from gaitval.apps.export.opensim_folder import foot_forces, write_opensim
    from gaitval.coordinates import ACTUATED
    from gaitval.inverse.inverse_dynamics import inverse_dynamics

    walked = _walker()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        model, motion, _, _, loads = write_opensim(folder, walked)
        run(inverse_dynamics_tool(model, motion, loads, folder / "id.sto"), folder)
        found = read_table(folder / "id.sto")
    theirs = np.column_stack([found[f"{each}_moment"] for each in ACTUATED])
    forces = foot_forces(walked)
    ours = inverse_dynamics(
        walked.body,
        forces.time,
        walked.walk.positions[walked.rows],
        *(forces.force, forces.centre_of_pressure, forces.free_moment),
    )
    inside = slice(50, -50)  # both differentiate by splines, which are free at the ends
    off = np.sqrt(np.mean((theirs - ours.moments)[inside] ** 2, axis=0))
    largest = np.abs(ours.moments[inside]).max(axis=0)
    return Claim(
        "export -> OpenSim 4.6: inverse dynamics of the walk against ours, RMS of the worst joint, "
        "of its peak",
        float(100.0 * (off / largest).max()),
        "%",
        len(ACTUATED),
    )


READ_EQUAL = 1e-6
"""Of a quantity's largest value: single precision of C3D, and nine digits of text."""


@claims.measured()
def formats(_: claims.Given) -> list[Claim]:
    """Formats whose made file comes in as it was written, each by its own reader."""
    sys.path.insert(0, str(claims.ROOT / "tests" / "support"))
    with tempfile.TemporaryDirectory() as name:
        found = _formats(Path(name))
    for each, off in found.items():
        print(f"{each}: {off:.2g}")
    right = sum(off <= READ_EQUAL for off in found.values())
    return [
        Claim(
            "formats read in, each from a made file that comes in equal to 1e-6",
            right,
            "formats",
            len(found),
        ),
        Claim(
            "formats read in: largest difference of all, of the quantity's largest value",
            max(found.values()),
            "1",
            len(found),
        ),
    ]


def _formats(folder: Path) -> dict[str, float]:
    """Largest difference of what is read of each format from what was written into it."""
    from format_files import TRIALS, laboratory, opencap_folder, pose2sim_folder
    from made_up_session import made_up_session

    from gaitval.mocap.reading import read_recording

    session = made_up_session(folder, noise=1e-4, seconds=3.0, rate=100.0, standing_frames=20)
    trial = laboratory(session.walking, session.forces)
    walk = read_recording(session.walking)
    found = {}
    for name, write in TRIALS.items():
        (folder / name).mkdir()
        path, forces = write(folder / name, trial)
        found[name] = _trial_off(read_recording(path, forces=forces), trial)
    standing = read_recording(session.standing)
    opencap = opencap_folder(folder / "f2", standing, walk, session.forces)
    pose2sim = pose2sim_folder(folder / "P00", standing, walk)
    both = read_recording(session.walking, forces=session.forces)
    found["OpenCap folder"] = _people_off(opencap, both)
    found["Pose2Sim folder"] = _people_off(pose2sim, walk)
    found |= _further(folder, both)
    return found


def _trial_off(read: "Recording", written: "Recording") -> float:
    """Of markers and forces, and of centres of pressure where a foot stands."""
    assert read.names == written.names
    assert len(read.plates) == len(written.plates)
    off = [float(np.nanmax(np.abs(read.markers - written.markers))) / np.nanmax(written.markers)]
    for theirs, ours in zip(read.plates, written.plates, strict=True):
        on = np.linalg.norm(ours.force, axis=1) > 2.0 * UNLOADED_N
        off += [
            _relative(theirs.force, ours.force),
            _relative(theirs.centre_of_pressure[on], ours.centre_of_pressure[on]),
        ]
    return max(off)


def _people_off(folder: Path, written: "Recording") -> float:
    """Of the one person of another program's folder, as `gaitval imports` reads them."""
    from gaitval.importing.batch_imports import read_batch
    from gaitval.mocap.reading import read_recording

    (person,) = read_batch(folder)
    known = max(abs(person.mass / 63.2 - 1.0), abs(person.height / 1.66 - 1.0))
    forces = person.forces[0] if person.forces else None
    return max(known, _trial_off(read_recording(person.trials[0], forces=forces), written))


def _further(folder: Path, trial: "Recording") -> dict[str, float]:
    """LocoHub's Parquet, and OpenSim's and WBDS's text."""
    from locohub_files import PERSON, PHASE, data_set

    from gaitval.datasets.locohub import read_locohub_trials
    from gaitval.gait.record import REQUIRED_ANGLES
    from gaitval.mocap.mot_writing import StorageTable, write_storage
    from gaitval.mocap.reading import read_recording
    from gaitval.mocap.trc_writing import write_trc

    (person,) = read_locohub_trials(data_set(folder / "a_phase.parquet", "right", "left"))
    curves, record = person.curves(), PERSON.record()
    expected = {name: record.angles[name](PHASE) for name in REQUIRED_ANGLES}
    off = max(_relative(curves[f"angle_{name}"], each) for name, each in expected.items())
    write_trc(folder / "o.trc", trial)
    columns, values = [], []
    for plate in trial.plates:
        for kind, numbers in (
            ("force_{}_v", plate.force),
            ("force_{}_p", np.nan_to_num(plate.centre_of_pressure)),
            ("torque_{}_", plate.free_moment),
        ):
            columns += [f"ground_{kind.format(plate.name)}{axis}" for axis in "xyz"]
            values.append(numbers)
    table = StorageTable(tuple(columns), trial.force_time, np.hstack(values))
    write_storage(folder / "o.mot", table)
    read = read_recording(folder / "o.trc", forces=folder / "o.mot")
    rows = ["Time\t" + "\t".join(name + axis for name in trial.names for axis in "XYZ")]
    for time, row in zip(
        trial.time, 1e3 * trial.markers.reshape(len(trial.markers), -1), strict=True
    ):
        rows.append("\t".join(f"{value:.9g}" for value in (time, *row)))
    (folder / "wmkr.txt").write_text("\n".join(rows) + "\n")
    wbds = read_recording(folder / "wmkr.txt")
    markers = float(np.nanmax(np.abs(wbds.markers - trial.markers)) / np.nanmax(trial.markers))
    return {
        "LocoHub Parquet": off,
        "TRC with MOT": _trial_off(read, trial),
        "WBDS text": markers,
    }


def _relative(read: NDArray[Any], written: NDArray[Any]) -> float:
    return float(np.max(np.abs(read - written)) / np.max(np.abs(written)))


def _first_second(walked: "ExportedWalk") -> float:
    """Motion and moments in plain MuJoCo against gaitval's own engine, while rounding is small."""
    found, _ = _walked_in_mujoco(walked, 1)
    return max(
        _relative(found[name][:SECOND], getattr(walked.walk, name)[:SECOND])
        for name in ("positions", "moments")
    )
