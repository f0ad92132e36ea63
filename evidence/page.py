"""The page that decides, and doors to other tools: what `gaitval export` writes, walked and read
again there.

The test person is subject 5: with the stored baseline for the doors, with a walk made from the
record (tests/support/report_run.py) for the page.
"""

import json
import re
import subprocess
import sys
import tempfile
import warnings
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import evidence
from evidence.opensim_motion import read_motion
from gaitval.mocap.c3d import read_c3d
from gaitval.mocap.force_plates import UNLOADED_N
from gaitval.mocap.mot import read_ground_reaction, read_storage

if TYPE_CHECKING:
    from gaitval.apps.export.walked import Walked
    from gaitval.mocap.recording import Recording

PERSON = "5"
CYCLES = 100
SECOND = 500
"""Physics steps."""
STEPS = evidence.option("--steps", type=int, default=200_000, help="actions to learn from")
WIDTHS = (360, 800, 1600)
"""Pixels of the windows in which the grids are looked at."""
GRIDS = ("curves", "kinematics", "kinetics", "forces")
MEASURES = {
    "the sheet*": {
        "code": ("gaitval/reporting/*.py", "gaitval/metrics/norms.py", "evidence/page.py:sheet"),
        "data": ("tests/reporting/test_sheet.py",),
        "allowed": 150,
        "why": "tests/reporting/test_sheet.py reads every number at every change",
    },
    "words before*": {
        "code": ("gaitval/reporting/*.py", "gaitval/metrics/norms.py", "evidence/page.py:words"),
        "allowed": 150,
        "why": "tests/reporting/test_sheet.py counts them at every change",
    },
    "grids*": {
        "code": (
            "gaitval/reporting/*.py",
            "gaitval/metrics/norms.py",
            "evidence/page.py:looks,_overlaps,_page_of",
        ),
        "allowed": 150,
        "why": "tests/reporting/test_every_reader.py looks at pages in the browser",
    },
    "install for*": {
        "code": ("evidence/page.py:install",),
        "data": ("pyproject.toml", "constraints.txt"),
        "allowed": 40,
        "why": "tests/test_wings.py checks and judges without the libraries of the extras",
    },
    "report time*": {
        "code": ("gaitval/reporting/*.py", "gaitval/metrics/norms.py", "evidence/page.py:seconds"),
        "allowed": 150,
        "why": "tests/reporting/test_report.py writes a report at every change",
    },
    "texts in*": {
        "code": ("scripts/messages.py", "evidence/page.py:languages"),
        "data": ("gaitval/reporting/languages/*.po",),
        "allowed": 30,
        "why": "tests/reporting/test_languages.py reads every catalogue at every change",
    },
    "export -> plain MuJoCo*": {
        "code": (
            "@walk",
            "gaitval/metrics/comparison.py:simulated_curves",
            "gaitval/metrics/cycles.py:find_cycles,cut",
            "gaitval/apps/export/walk.py",
            "gaitval/apps/export/mujoco_folder.py",
            "evidence/page.py:mujoco,_walked_in_mujoco",
        ),
        "data": ("reports/S05/baseline/*",),
        "allowed": 150,
        "why": "tests/export/test_mujoco_folder.py walks as the compiled engine at every change",
    },
    "gaitval/Walker-v0: objections *": {
        "code": (
            "gaitval/policy/environment.py",
            "gaitval/apps/export/environment.py",
            "evidence/page.py:gymnasium",
        ),
        "allowed": 20,
        "why": "tests/export/test_environment.py runs the checker at every change",
    },
    "gaitval/Walker-v0: return *": {
        "code": (
            "gaitval/policy/environment.py",
            "gaitval/policy/observation.py",
            "gaitval/policy/reward.py",
            "gaitval/apps/export/environment.py",
            "gaitval/apps/export/train.py",
            "evidence/page.py:learning",
        ),
        "allowed": 20,
        "why": "tests/export/test_environment.py trains, a tenth as long, when slow tests run",
    },
    "export -> OpenSim*": {
        "code": (
            "@judged",
            "gaitval/inverse/inverse_dynamics.py",
            "gaitval/apps/export/opensim_folder.py",
            "evidence/page.py:opensim",
        ),
        "allowed": 60,
        "why": "tests/export/test_opensim_folder.py compares them at every change",
    },
    "export * round trip*": {
        "code": (
            "gaitval/mocap/c3d*.py",
            "gaitval/mocap/mot*.py",
            "gaitval/apps/export/opensim/motion*.py",
            "gaitval/apps/export/*_f*.py",
            "gaitval/apps/export/walk.py",
            "gaitval/apps/export/locohub.py",
            "evidence/page.py:round_trips,_relative,_first_second",
        ),
        "allowed": 60,
        "why": "tests/export reads every format back at every change",
    },
    "formats read in*": {
        "code": (
            "gaitval/mocap/*.py",
            "gaitval/mocap/*.py",
            "evidence/page.py:formats,_formats,_trial_off,_people_off,_further",
        ),
        "data": ("tests/support/format_files.py", "tests/support/locohub_files.py"),
        "allowed": 60,
        "why": "tests/formats reads every format at every change",
    },
}
"""What the rows depend on; see evidence/stale.py."""


def _page_of(folder: Path) -> str:
    """The page of a made-up run of the test person, in a folder."""
    sys.path.insert(0, str(evidence.ROOT / "tests" / "support"))
    from report_run import build_run

    from gaitval.reporting.report import write_report

    build_run(folder)
    write_report(folder)
    return (folder / "report.html").read_text(encoding="utf-8")


@evidence.measurement()
def sheet(_: Namespace) -> evidence.Row:
    """Whether the first page has everything, on one sheet, with every number its source's."""
    words = [sys.executable, "-m", "pytest", "-q", "-n", "0", "tests/reporting/test_sheet.py"]
    done = subprocess.run(words, cwd=evidence.ROOT, capture_output=True, text=True, check=False)
    failed, passed = evidence.pytest_counts(done.stdout.strip().splitlines()[-1])
    return evidence.none_may(
        "the sheet: all on one A4 page, at least 8 pt, every number its source's: tests that fail",
        *(failed, "tests", failed + passed),
    )


@evidence.measurement()
def words(_: Namespace) -> evidence.Row:
    """Words of the page in front of its first figure of curves."""
    with tempfile.TemporaryDirectory() as name:
        page = _page_of(Path(name))
    start = page.index('<main id="content"')
    before = re.sub(
        r"<svg.*?</svg>", "", page[start : page.index("<figure", start)], flags=re.DOTALL
    )
    count = len(re.sub(r"<[^>]*>", " ", before).split())
    return evidence.Row("words before the first curve", count, "words", "<=", 150, 250, 1)


@evidence.measurement()
def looks(_: Namespace) -> list[evidence.Row]:
    """The grids in a browser at three widths and in both modes, and on paper."""
    sys.path.insert(0, str(evidence.ROOT / "tests" / "support"))
    from page_in_browser import opened, overflow, violations

    from evidence.browser import program
    from gaitval.reporting.page import _with_letters

    browser = program()
    if browser is None:
        raise SystemExit("no browser")
    found, smallest, overlaps = 0, np.inf, 0
    with tempfile.TemporaryDirectory() as name:
        page = _page_of(Path(name))
        letters = {}
        for each in GRIDS:
            svg = re.search(rf'<svg(?:(?!<svg).)*?id="{each}-figure_1".*?</svg>', page, re.DOTALL)
            assert svg is not None
            sizes = re.findall(r'font-size="([\d.]+)"', _with_letters(svg[0]))
            letters[each] = [float(size) for size in sizes]
        for width in WIDTHS:
            for dark in (False, True):
                with opened(browser, Path(name) / "report.html", width=width, dark=dark) as view:
                    found += len(violations(view)) + (overflow(view) > 0)
                    overlaps += 0 if dark else sum(_overlaps(view, each) for each in GRIDS)
                    for each, sizes in letters.items():
                        shown = view.evaluate(
                            f"""() => {{
                                const part = document.querySelector('[id="{each}-figure_1"]');
                                const svg = part.ownerSVGElement;
                                const width = svg.getBoundingClientRect().width;
                                return width / svg.viewBox.baseVal.width;
                            }}"""
                        )
                        smallest = min(smallest, min(sizes) * shown)
    printed = 180.0 / 25.4 * 72.0 / 511.2  # the width of the text of A4 over that of a figure
    points = min(min(sizes) for sizes in letters.values()) * printed
    where = "grids at 360, 800 and 1600 px"
    return [
        evidence.none_may(
            f"{where}, light and dark: serious or critical by axe, or too wide",
            *(found, "findings", 6),
        ),
        evidence.none_may(
            f"{where}: texts that overlap", overlaps, "texts", len(GRIDS) * len(WIDTHS)
        ),
        evidence.Row(f"{where}: smallest text", float(smallest), "px", ">=", 9, 9, len(GRIDS)),
        evidence.Row("grids on A4: smallest text", points, "pt", ">=", 7, 7, len(GRIDS)),
    ]


def _overlaps(view: Any, name: str) -> int:
    """Pairs of texts of a figure whose boxes overlap by more than a pixel both ways; texts are
    groups behind a comment with their letters.
    """
    return int(
        view.evaluate(
            f"""() => {{
                const svg = document.querySelector('[id="{name}-figure_1"]').ownerSVGElement;
                const boxes = [...svg.querySelectorAll('g[id*="-text_"]')]
                    .map((each) => each.getBoundingClientRect()).filter((box) => box.width > 0);
                let count = 0;
                boxes.forEach((a, i) => boxes.slice(i + 1).forEach((b) => {{
                    const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
                    const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
                    count += wide > 1 && high > 1;
                }}));
                return count;
            }}"""
        )
    )


@evidence.measurement()
def seconds(_: Namespace) -> evidence.Row:
    """Processor time of a report, page and PDF, in a process of its own."""
    sys.path.insert(0, str(evidence.ROOT / "tests" / "support"))
    from report_run import build_run

    with tempfile.TemporaryDirectory() as name:
        build_run(Path(name))
        code = (
            "import sys, time; from pathlib import Path;"
            "from gaitval.reporting.report import write_report;"
            "write_report(Path(sys.argv[1])); print(time.process_time())"
        )
        done = subprocess.run(
            [sys.executable, "-c", code, name], capture_output=True, text=True, check=True
        )
    return evidence.Row(
        "report time, HTML and PDF, processor", float(done.stdout), "s", "<=", 12, 20, 1
    )


@evidence.measurement()
def languages(_: Namespace) -> list[evidence.Row]:
    """Texts of the pages that each language has."""
    sys.path.insert(0, str(evidence.ROOT / "scripts"))
    import messages

    texts = [each.id for each in messages.all_texts() if each.id]
    rows = []
    for code, language in (("de", "German"), ("pt", "Portuguese")):
        stored = messages.catalogue(messages.LANGUAGES / f"{code}.po")
        known = {each.id for each in stored if each.id and each.string and all(each.string)}
        share = 100.0 * sum(each in known for each in texts) / len(texts)
        rows.append(evidence.Row(f"texts in {language}", share, "%", ">=", 100, 100, len(texts)))
    return rows


def _walker() -> "Walked":
    from gaitval.apps.export.walked import Walked

    return Walked.of(PERSON)


def _walked_in_mujoco(walked: "Walked", cycles: int) -> tuple[dict[str, NDArray[Any]], bool]:
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
            raise SystemExit(done.stderr)
        with np.load(folder / "walk.npz") as file:
            found = dict(file)
    return found, bool(found.pop("fell"))


def angles_in_mujoco(walked: "Walked", cycles: int) -> tuple[dict[str, float], int]:
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


@evidence.measurement()
def mujoco(_: Namespace) -> list[evidence.Row]:
    """A hundred cycles of the exported person in plain MuJoCo, and their angles."""
    errors, cycles = angles_in_mujoco(_walker(), CYCLES)
    largest = max(errors, key=errors.__getitem__)
    print(f"largest: {largest}")
    what = "export -> plain MuJoCo (no gaitval imported)"
    return [
        evidence.Row(
            f"{what}: mean angles against the report, RMS of the worst of all curves",
            *(errors[largest], "deg", "<=", 0.2, 0.5, len(errors)),
        ),
        evidence.Row(f"{what}: cycles without a fall", cycles, "cycles", ">=", CYCLES, CYCLES, 1),
    ]


@evidence.measurement()
def gymnasium(_: Namespace) -> evidence.Row:
    """Whether Gymnasium's checker accepts the environment."""
    import gymnasium as library
    from gymnasium.utils.env_checker import check_env

    made = library.make("gaitval.apps.export.environment:gaitval/Walker-v0", walker=PERSON)
    with warnings.catch_warnings():
        # Advice on spaces without bounds, which a normaliser answers.
        warnings.filterwarnings("ignore", message=".*Box.*")
        warnings.simplefilter("error", append=True)
        try:
            check_env(made.unwrapped)
            refused = 0
        except (AssertionError, Warning) as error:
            print(error)
            refused = 1
    return evidence.none_may(
        "gaitval/Walker-v0: objections of Gymnasium's checker", refused, "objections", 1
    )


@evidence.measurement(STEPS)
def learning(arguments: Namespace) -> evidence.Row:
    """Return of the last hundred episodes over that of the first, with plain PPO."""
    from gaitval.apps.export.training_folder import write_training

    with tempfile.TemporaryDirectory() as name:
        write_training(Path(name), _walker())
        words = [sys.executable, "train.py", "--steps", str(arguments.steps)]
        done = subprocess.run(words, cwd=name, capture_output=True, text=True, check=False)
        if done.returncode:
            raise SystemExit(done.stderr)
        found = json.loads(done.stdout.splitlines()[-1])
    print(found)
    return evidence.Row(
        f"gaitval/Walker-v0: return after {arguments.steps:,} steps of stable-baselines3's PPO, "
        "over that of its first episodes",
        *(found["last"] / found["first"], "1", ">=", 1.5, 1.5, 1),
    )


@evidence.measurement()
def round_trips(_: Namespace) -> list[evidence.Row]:
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
            _relative(moments, walk.moments[walked.acting]),
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
        evidence.Row(
            f"export {name}, round trip: largest difference, of the quantity's largest value",
            *(value, "1", "<=", 1e-6, 1e-4, 1),
        )
        for name, value in differences.items()
    ]


@evidence.measurement()
def opensim(_: Namespace) -> evidence.Row:
    """Joint moments that OpenSim finds in the exported files, and gaitval in the same walk."""
    sys.path.insert(0, str(evidence.ROOT / "tests" / "support"))
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
    return evidence.Row(
        "export -> OpenSim 4.6: inverse dynamics of the walk against ours, RMS of the worst joint, "
        "of its peak",
        *(float(100.0 * (off / largest).max()), "%", "<=", 0.5, 2.0, len(ACTUATED)),
    )


READ_EQUAL = 1e-6
"""Of a quantity's largest value: single precision of C3D, and nine digits of text."""


@evidence.measurement()
def formats(_: Namespace) -> list[evidence.Row]:
    """Formats whose made file comes in as it was written, each by its own reader."""
    sys.path.insert(0, str(evidence.ROOT / "tests" / "support"))
    with tempfile.TemporaryDirectory() as name:
        found = _formats(Path(name))
    for each, off in found.items():
        print(f"{each}: {off:.2g}")
    right = sum(off <= READ_EQUAL for off in found.values())
    return [
        evidence.Row(
            "formats read in, each from a made file that comes in equal to 1e-6",
            *(right, "formats", ">=", 10, 7, len(found)),
        ),
        evidence.Row(
            "formats read in: largest difference of all, of the quantity's largest value",
            *(max(found.values()), "1", "<=", READ_EQUAL, 1e-4, len(found)),
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


def _first_second(walked: "Walked") -> float:
    """Motion and moments in plain MuJoCo against gaitval's own engine, while rounding is small."""
    found, _ = _walked_in_mujoco(walked, 1)
    return max(
        _relative(found[name][:SECOND], getattr(walked.walk, name)[:SECOND])
        for name in ("positions", "moments")
    )


@evidence.measurement()
def install(_: Namespace) -> evidence.Row:
    """Size of a new environment with gaitval and no extra, in which the stored walk of the test
    person is checked quickly (long walks and pushes need MuJoCo besides) and a model judged.
    """
    import gaitval
    from gaitval.configuration import ContactSettings
    from gaitval.datasets.subject_file import load_subject
    from gaitval.opensim.osim import write_osim
    from gaitval.scaling.scaling import scale_subject

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_osim(
            folder / "model.osim",
            scale_subject(load_subject(PERSON)).model,
            (),
            ContactSettings(),
            0.8,
        )
        venv = folder / "venv"
        python = [venv / "bin" / "python", "-m", "pip", "--disable-pip-version-check", "install"]
        command = venv / "bin" / "gaitval"
        constraints = evidence.ROOT / "constraints.txt"
        wheel = folder / f"gaitval-{gaitval.__version__}-py3-none-any.whl"
        build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder]
        size = 0
        for words in (
            [*build, evidence.ROOT],
            [sys.executable, "-m", "venv", venv],
            [*python, "--quiet", "-c", constraints, wheel],
            [command, "check", "--quick", "--baseline", f"S0{PERSON}"],
            [command, "judge", "model.osim"],
        ):
            if words[0] == command and not size:
                # before a first run writes bytecode of its own
                files = [each for each in venv.rglob("*") if not each.is_symlink()]
                size = sum(each.stat().st_size for each in files if each.is_file())
            texts = [str(each) for each in words]
            done = subprocess.run(texts, cwd=folder, capture_output=True, text=True, check=False)
            if done.returncode:
                raise SystemExit(f"{' '.join(texts)}:\n{done.stdout}\n{done.stderr}")
            print(done.stdout[-300:])
    return evidence.Row(
        "install for `check --quick` and `judge` alone: the whole environment",
        *(size / 1e6, "MB", "<=", 350, 600, 1),
    )
