"""One walk in every format that is read: a laboratory with plates, and its files as each program
writes them.

The laboratory has z up; the person walks towards -y, so that forward, left and up are three other
axes than the project's. Plate 1 is a strip of floor under the right foot, plate 2 under the left;
their own z points down.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from gaitval.mocap.c3d_writing import write_c3d
from gaitval.mocap.force_plates import make_plate, plate_axes
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Plate, Recording
from gaitval.mocap.trc_writing import write_trc

SENSORS, DEPTH = (0.35, 0.9), 0.054
"""Half the distances between the sensors of the Kistler plates, and their depth, m."""
PERSON = {"mass": 63.2, "height": 1.66, "sex": "F"}


def laboratory(walking: Path, forces: Path) -> Recording:
    """The trial of a made-up session in the laboratory's axes, with corners and moments."""
    trial = read_recording(walking, forces=forces)
    plates = []
    for plate in trial.plates:
        side = float(np.sign(np.nanmedian(plate.centre_of_pressure[:, 2])))
        right, left = max(side, 0.0), min(side, 0.0)
        # x forward and z to the right, so that the plate's third axis points down
        at = np.array([[6.0, 0, right], [-1.0, 0, right], [-1.0, 0, left], [6.0, 0, left]])
        plates.append(_with_moment(plate, at))
    plates.sort(key=lambda plate: -float(plate.corners[:, 2].mean()))
    named = tuple(replace(plate, name=str(i + 1)) for i, plate in enumerate(plates))
    turned = replace(trial, plates=named).turned(_turn())
    return replace(turned, axes="laboratory", source="the laboratory")


def _turn() -> np.ndarray:
    # forward x -> -y, up y -> z, right z -> -x
    return np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def _with_moment(plate: Plate, corners: np.ndarray) -> Plate:
    axes, middle = plate_axes(corners), corners.mean(axis=0)
    loaded = np.isfinite(plate.centre_of_pressure).all(axis=1)
    force = np.where(loaded[:, None], plate.force, 0.0)
    arm = np.nan_to_num(plate.centre_of_pressure) - middle
    moment = np.where(loaded[:, None], np.cross(arm, force) + plate.free_moment, 0.0)
    return make_plate(plate.name, corners, force @ axes, moment @ axes)


def _row(values: np.ndarray, separator: str) -> str:
    return separator.join("" if np.isnan(value) else f"{value:.9g}" for value in values)


def about_middle(plate: Plate) -> np.ndarray:
    """Moment (T, 3) Nm about the middle of the plate, in the laboratory's axes."""
    assert plate.moment is not None
    return plate.moment - np.cross(plate.corners.mean(axis=0), plate.force)


def vicon_csv(
    path: Path, trial: Recording, *, separator: str = ",", on_plate: bool = True,
    prefix: str = "Anna:", moments: float = 1e3, unit: str = "N.mm", magnitudes: bool = False,
) -> Path:  # fmt: skip
    """As Nexus exports it: devices with EMG, model outputs, trajectories; forces on the plate."""
    sign, s = (-1.0 if on_plate else 1.0), separator
    per_frame = round(trial.force_rate / trial.marker_rate)
    first = round(trial.start * trial.marker_rate) + 1
    names, columns, units = ["", ""], ["Frame", "Sub Frame"], ["", ""]
    values = []
    for plate in trial.plates:
        device = f"Imported AMTI OR6 Series Force Plate #{plate.name}"
        parts = (
            ("Force", "F", ["N"] * 3, sign * plate.force),
            ("Moment", "M", [unit] * 3, moments * sign * about_middle(plate)),
            ("CoP", "C", ["mm"] * 3, 1e3 * np.nan_to_num(plate.centre_of_pressure)),
        )
        for kind, letter, of, numbers in parts:
            names += [f"{device} - {kind}", "", ""]
            columns += [f"{letter}{axis}" for axis in "xyz"]
            units += of
            values.append(numbers)
    names, columns, units = [*names, "Imported EMG - Voltage"], [*columns, "1"], [*units, "V"]
    table = np.column_stack([*values, np.full(len(values[0]), 0.001)])
    lines = ["Devices", f"{trial.force_rate:g}", s.join(names), s.join(columns), s.join(units)]
    for i, row in enumerate(table):
        lines.append(f"{first + i // per_frame}{s}{i % per_frame}{s}{_row(row, s)}")
    lines += ["", "Model Outputs", f"{trial.marker_rate:g}", s.join(["", "", "Anna:LKneeAngles"])]
    lines += [s.join(["Frame", "Sub Frame", "X", "Y", "Z"]), s.join(["", "", "deg", "deg", "deg"])]
    lines += [s.join([str(first + i), "0", "1", "2", "3"]) for i in range(len(trial.markers))]
    labels = [f"{prefix}{name}" for name in trial.names] + [f"{prefix}*12" if prefix else "*12"]
    paths = np.concatenate([trial.markers, trial.markers[:, :1]], axis=1)
    lines += ["", "Trajectories", f"{trial.marker_rate:g}"]
    lengths = np.linalg.norm(paths, axis=2) if magnitudes else np.zeros((len(paths), 0))
    more = labels[: lengths.shape[1]]
    lines += [s.join(["", ""] + [cell for name in labels for cell in (name, "", "")]
                     + [f"| {name} |" for name in more])]  # fmt: skip
    lines += [s.join(["Frame", "Sub Frame"] + ["X", "Y", "Z"] * len(labels)
                     + ["Magnitude( X )"] * len(more))]  # fmt: skip
    lines += [s.join(["", ""] + ["mm"] * (3 * len(labels) + len(more)))]
    for i, row in enumerate(1e3 * np.hstack([paths.reshape(len(paths), -1), lengths])):
        lines.append(f"{first + i}{s}0{s}{_row(row, s)}")
    path.write_text("\n".join([*lines, ""]), encoding="utf-8-sig")
    return path


def qualisys_tsv(
    path: Path, trial: Recording, *, local: bool = True, clock: bool = True, moment: float = 1.0,
    on_plate: bool = True, gap: str = "",
) -> Path:  # fmt: skip
    """As QTM exports it: markers, and a file for each plate beside it."""
    frames = len(trial.markers)
    head = [
        f"NO_OF_FRAMES\t{frames}", "NO_OF_CAMERAS\t10", f"NO_OF_MARKERS\t{len(trial.names)}",
        f"FREQUENCY\t{trial.marker_rate:g}", "NO_OF_ANALOG\t0", "ANALOG_FREQUENCY\t0",
        "DESCRIPTION\t--", "TIME_STAMP\t2026-11-03, 10:47:36.627\t94247.45402301",
        "DATA_INCLUDED\t3D", "MARKER_NAMES\t" + "\t".join(trial.names),
        "TRAJECTORY_TYPES\t" + "\t".join(["Measured"] * len(trial.names)),
    ]  # fmt: skip
    if clock:
        head.append("\t".join(["Frame", "Time", *(f"{n} {a}" for n in trial.names for a in "XYZ")]))
    lines = []
    for i, row in enumerate(1e3 * trial.markers.reshape(frames, -1)):
        before = f"{i + 1}\t{i / trial.marker_rate:.5f}\t" if clock else ""
        lines.append(before + "\t".join(gap if np.isnan(v) else f"{v:.9g}" for v in row))
    path.write_text("\r\n".join([*head, *lines, ""]), newline="")
    for plate in trial.plates:
        _qualisys_plate(path, trial, plate, local, clock, moment, -1.0 if on_plate else 1.0)
    return path


def _qualisys_plate(
    path: Path, trial: Recording, plate: Plate, local: bool, clock: bool, unit: float, sign: float
) -> None:
    axes, middle = plate_axes(plate.corners), plate.corners.mean(axis=0)
    force, moment = sign * plate.force, sign * about_middle(plate)
    point = plate.centre_of_pressure
    if local:
        force, moment, point = force @ axes, moment @ axes, (point - middle) @ axes
    place = "local (force plate)" if local else "world (lab)"
    corners = [
        f"FORCE_PLATE_CORNER_{quadrant}_{axis}\t{1e3 * corner[i]:.3f}"
        for quadrant, corner in zip(
            ("POSX_POSY", "NEGX_POSY", "NEGX_NEGY", "POSX_NEGY"), plate.corners, strict=True
        )
        for i, axis in enumerate("XYZ")
    ]
    head = [
        f"NO_OF_SAMPLES\t{len(force)}", f"FREQUENCY\t{trial.force_rate:g}",
        "TIME_STAMP\t2026-11-03, 10:47:36", "FIRST_SAMPLE\t1",
        f"DESCRIPTION\tForce data in {place} coordinates", "DATA_INCLUDED\tForce",
        "FORCE_PLATE_TYPE\tKistler", "FORCE_PLATE_MODEL\tUnknown",
        f"FORCE_PLATE_NAME\tForce-plate {plate.name}", *corners, "FORCE_PLATE_LENGTH\t600.000",
        "FORCE_PLATE_WIDTH\t400.000",
    ]  # fmt: skip
    names = [f"{kind}_{axis}" for kind in ("Force", "Moment", "COP") for axis in "XYZ"]
    if clock:
        head.append("\t".join(["SAMPLE", "TIME", *(name.upper() for name in names)]))
    else:
        head.append("\t".join(names))
    table = np.column_stack([force, unit * moment, 1e3 * np.nan_to_num(point)])
    lines = [
        (f"{i + 1}\t{i / trial.force_rate:.5f}\t" if clock else "") + _row(row, "\t")
        for i, row in enumerate(table)
    ]
    name = f"{path.stem}_f_{plate.name}{path.suffix}"
    (path.parent / name).write_text("\r\n".join([*head, *lines, ""]), newline="")


def motion_analysis(path: Path, trial: Recording, *, moment: float = 1e3) -> Path:
    """As Cortex exports it beside a TRC file: forces on the person, moments in Nmm."""
    header = ["#Sample"]
    columns = []
    for plate in trial.plates:
        header += [f"{name}{plate.name}" for name in ("FX", "FY", "FZ", "X", "Y", "Z", "MZ")]
        point = 1e3 * np.nan_to_num(plate.centre_of_pressure)
        columns += [plate.force, point, moment * plate.free_moment[:, 2:]]
    table = np.column_stack(columns)
    lines = [
        "[Force Data]", f"NumberOfForcePlates={len(trial.plates)}",
        f"SampleRate={trial.force_rate:.6f}", f"NumberOfSamples={len(table)}", "\t".join(header),
    ]  # fmt: skip
    lines += [f"{i + 1}\t{_row(row, chr(9))}" for i, row in enumerate(table)]
    path.write_text("\r\n".join([*lines, ""]), newline="")
    return path


def kistler_text(
    path: Path, trial: Recording, *, sensors: bool = True, units: bool = True, places: bool = True
) -> Path:
    """As BioWare exports it: forces on the plate, in its own axes."""
    names, message, columns = ["abs time (s)"], ["s"], []
    for plate in trial.plates:
        axes = plate_axes(plate.corners)
        force, moment = -plate.force @ axes, -about_middle(plate) @ axes
        if sensors:
            names += ["Fx12", "Fx34", "Fy14", "Fy23", "Fz1", "Fz2", "Fz3", "Fz4"]
            message += ["N"] * 8
            columns.append(_eight(force, moment, -DEPTH * np.sign(axes[2, 2])))
        else:
            point = np.nan_to_num((plate.centre_of_pressure - plate.corners.mean(axis=0)) @ axes)
            torque = -(plate.free_moment @ axes)[:, 2]
            names += ["Fx", "Fy", "Fz", "|Ft|", "Ax", "Ay", "Tz"]
            message += ["N"] * 4 + ["m", "m", "Nm"]
            size = np.linalg.norm(force, axis=1)
            columns.append(np.column_stack([force, size, point[:, :2], torque]))
    table = np.column_stack([np.arange(len(columns[0])) / trial.force_rate, *columns])
    head = [
        "File:\tC:\\BioWare\\walk.dat", "Subject:\tAnna", "Sampling rate (Hz):\t1000.000000",
        "Plate Length (m):\t0.6", "", "\t".join(names), *(["\t".join(message)] if units else []),
    ]  # fmt: skip
    path.write_text("\n".join([*head, *(_row(row, "\t") for row in table), ""]))
    if places:
        tables = (
            f"[[plates]]\ncorners = {plate.corners.tolist()}\nsensors = {list(SENSORS)}\n"
            f"depth = {DEPTH}\n"
            for plate in trial.plates
        )
        path.with_suffix(".plates.toml").write_text("\n".join(tables))
    return path


def _eight(force: np.ndarray, moment: np.ndarray, depth: float) -> np.ndarray:
    """(T, 8) of the sensors, `depth` m along z, that force and moment about the middle act on."""
    (half_x, half_y), x, y, z = SENSORS, *np.eye(3)
    parts = [
        *[((0.0, side * half_y), x) for side in (1, -1)],
        *[((side * half_x, 0.0), y) for side in (1, -1)],
        *[((a * half_x, b * half_y), z) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))],
    ]
    matrix = np.column_stack([np.r_[axis, np.cross((*at, depth), axis)] for at, axis in parts])
    return np.hstack([force, moment]) @ np.linalg.pinv(matrix).T


def opencap_folder(
    folder: Path, standing: Recording, trial: Recording, forces: Path | None
) -> Path:
    """A downloaded session: metadata, markers in m with y up, and forces if there are any."""
    (folder / "MarkerData").mkdir(parents=True)
    write_trc(folder / "MarkerData" / "neutral.trc", standing)
    write_trc(folder / "MarkerData" / "walk1.trc", trial)
    if forces is not None:
        (folder / "ForceData").mkdir()
        (folder / "ForceData" / "walk1.mot").write_bytes(forces.read_bytes())
    (folder / "sessionMetadata.yaml").write_text(
        "calibrationSettings:\n  overwriteDeployedIntrinsics: false\ncheckerBoard:\n"
        "  squareSideLength_mm: 35.0\ngender_mf: f\nheight_m: 1.66\niphoneModel:\n"
        "  Cam0: iPhone13,3\nmarkerAugmentationSettings:\n  markerAugmenterModel: LSTM\n"
        "mass_kg: 63.2\nopenSimModel: LaiUhlrich2022\nposemodel: openpose\nsubjectID: anna\n"
    )
    return folder


def pose2sim_folder(folder: Path, standing: Recording, trial: Recording) -> Path:
    """A participant: a folder for each trial, with a file before and after augmentation."""
    for name, each in (("P00_T00_StaticTrial", standing), ("P00_T01_Walk", trial)):
        place = folder / name / "pose-3d"
        place.mkdir(parents=True)
        few = each.with_markers(each.names[:3], each.markers[:, :3])
        write_trc(place / f"{name}_0-100.trc", few)
        write_trc(place / f"{name}_0-100_filt_butterworth_LSTM.trc", each)
    (folder / "Config.toml").write_text(
        "[project]\nmulti_person = false\nparticipant_height = 1.66\nparticipant_mass = 63.2\n"
        "participant_sex = 'F' # of ours\nframe_rate = 'auto'\n\n[pose]\npose_model = 'HALPE_26'\n"
    )
    return folder


TRIALS: dict[str, Callable[[Path, Recording], tuple[Path, Path | None]]] = {}
"""Writers of a trial by format: from a folder to the trial's file and that of its forces."""


def _writer(function: Callable[[Path, Recording], tuple[Path, Path | None]]) -> None:
    TRIALS[function.__name__] = function


@_writer
def c3d(folder: Path, trial: Recording) -> tuple[Path, Path | None]:
    write_c3d(folder / "walk.c3d", trial)
    return folder / "walk.c3d", None


@_writer
def vicon(folder: Path, trial: Recording) -> tuple[Path, Path | None]:
    return vicon_csv(folder / "walk.csv", trial), None


@_writer
def qualisys(folder: Path, trial: Recording) -> tuple[Path, Path | None]:
    return qualisys_tsv(folder / "walk.tsv", trial), None


@_writer
def motion_analysis_forces(folder: Path, trial: Recording) -> tuple[Path, Path | None]:
    write_trc(folder / "walk.trc", trial)
    return folder / "walk.trc", motion_analysis(folder / "walk.forces", trial)


@_writer
def kistler(folder: Path, trial: Recording) -> tuple[Path, Path | None]:
    write_trc(folder / "walk.trc", trial)
    return folder / "walk.trc", kistler_text(folder / "walk_bioware.txt", trial)
