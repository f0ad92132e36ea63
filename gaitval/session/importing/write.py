"""Write what an import found: the subject for the main job, OpenSim files, tables, the report."""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from gaitval._internal.io.artefacts import (
    replacing,
    value_hash,
    versions,
    without_nan,
    write_arrays,
    write_json,
    write_text,
)
from gaitval._internal.io.text_tables import plain_cell, with_unit
from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES
from gaitval.errors import ArtefactError
from gaitval.kinetics.inverse.inverse_kinematics import marker_errors
from gaitval.metrics.recording_limits import CONSISTENT, state_of
from gaitval.metrics.walk_quantities import quantity_result
from gaitval.model.body import BodyModel
from gaitval.model.markers import MARKERS, save_markers
from gaitval.model.urdf import write_urdf
from gaitval.quantities import BY_NAME, Found
from gaitval.reporting.figure_data import FOLDER as FIGURES
from gaitval.reporting.recording_report import (
    RecordingSummary,
    quantities_of,
    write_recording_report,
)
from gaitval.scaling.marker_set import MarkerSet
from gaitval.session.importing.files import CURVES, CYCLES, FOLDER, RECORD, REFUSED, SUBJECT
from gaitval.session.importing.results import IMPORT_VERSION, AnchoringResult, ImportResult
from gaitval.session.importing.summary import input_files, summary_of, trial_residuals, verdicts
from gaitval.session.loaded import measured_knees
from gaitval.session.opensim import of_import
from gaitval.session.scale import FittedBody
from gaitval.session.session import Import
from gaitval.session.subject import PHASE, speed
from gaitval.session.trial import WalkingTrial
from gaitval.subjects.subject import Subject

UNITS: Final = {"angle": "rad", "moment": "Nm/kg", "force": "BW"}
"""Of the columns of `CURVES` that are no quantity's, by their first word."""


def refusal_files(target: Path) -> tuple[Path, ...]:
    """The page that a refused import leaves in `target`."""
    return tuple(target / f"{REFUSED}.{ending}" for ending in ("html", "pdf"))


def check_folder(folder: Path) -> None:
    """Refuse an unusable output `folder` before any work is done: raises ArtefactError if it is a
    file or lies below one, may not be written to, or contains a subject that no import wrote.
    """
    for wanted in (Path(folder), Path(folder) / FOLDER):
        nearest = wanted
        while not os.path.lexists(nearest):
            nearest = nearest.parent
        if not nearest.is_dir():
            raise ArtefactError(f"{nearest}: is a file, not a folder. Give a folder with --out.")
        if not os.access(nearest, os.W_OK | os.X_OK):
            raise ArtefactError(
                f"{folder}: cannot be made or written to, for {nearest.resolve()} may not be "
                "written to. Give another folder with --out."
            )
    subject = Path(folder) / SUBJECT
    if subject.exists() and not (Path(folder) / FOLDER / RECORD).exists():
        raise ArtefactError(
            f"{subject}: this file would be overwritten, but no import wrote it. Give another "
            "folder with --out, or move the file."
        )


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Raise ArtefactError for an OSError: which file or `folder` is not written, and what to do."""
    try:
        yield
    except OSError as error:
        raise ArtefactError(
            f"{error.filename or folder}: cannot be written ({error.strerror}). Free disk space or "
            "check the disk, or give another folder with --out; then run the same command again."
        ) from None


def write_subject(folder: Path, subject: Subject) -> Path:
    """Write `subject` to `subject.toml` in `folder`, after all other files; returns its path."""
    with writing(folder):
        write_text(folder / SUBJECT, subject.to_toml())
    return folder / SUBJECT


def write_import(folder: Path, found: Import, configuration: Configuration) -> list[Path]:
    """Write everything of `found` but the subject below `folder`/recording; returns the files.

    Each file is written whole or not at all. The `subject.toml` and `import.json` of an earlier
    import are removed first, and `import.json` is written last: if it exists, so do all others,
    from the same import. `configuration` gives contact and paper. Raises ArtefactError if the
    folder cannot be written to.
    """
    target = folder / FOLDER
    with writing(folder):
        target.mkdir(parents=True, exist_ok=True)
        for earlier in (folder / SUBJECT, target / RECORD, *refusal_files(target)):
            earlier.unlink(missing_ok=True)
        written = of_import.write_import(target, found, configuration.contact)
        written += write_body(target, found.body, found.session.marker_set)
        written.append(write_table(target / "cycles.csv", cycle_table(found.trials)))
        summary = summary_of(found)
        write_arrays(target / CYCLES, cycle_curves(summary))
        written.append(target / CYCLES)
        quantities = quantities_of(summary)
        written.append(write_table(target / CURVES, _curve_table(found, quantities)))
        write_recording_report(target, summary, configuration.report)
        pages = (target / f"recording.{ending}" for ending in ("html", "pdf"))
        written += [page for page in pages if page.is_file()]
        written += sorted((target / FIGURES).glob("*.csv"))
        results = {n: quantity_result(BY_NAME[n], each) for n, each in quantities.items()}
        record = ImportResult.model_validate(without_nan(_record(found)) | {"quantities": results})
        write_json(target / RECORD, record.as_dict())
    return [*written, target / RECORD]


def write_body(target: Path, body: FittedBody, marker_set: MarkerSet) -> list[Path]:
    """Write model, table and markers (of `marker_set`) of `body` to `target`; returns the files."""
    write_urdf(body.model, target / "model.urdf")
    knees = measured_knees(body.model, body.markers, marker_set.landmarks)
    save_markers(target / MARKERS, body.markers, marker_set.name, knees=knees)
    table = write_table(target / "scaling.csv", body.scaled.frame())
    return [table, target / "model.urdf", target / MARKERS]


def write_table(path: Path, table: pd.DataFrame) -> Path:
    """Write a table as CSV, whole or not at all; returns its path."""
    with replacing(path) as temporary:
        table.to_csv(temporary, index=False)
    return path


def cycle_table(trials: Sequence[WalkingTrial]) -> pd.DataFrame:
    """Every cycle of every trial of `trials`, and why it does not count."""
    rows = []
    for walk in trials:
        for side in SIDES:
            for cycle in walk.cycles[side]:
                row = {
                    with_unit(name, "s") if isinstance(value, float) else name: value
                    for name, value in asdict(cycle).items()
                }
                trial = plain_cell(walk.name)
                rows.append(row | {"reasons": "; ".join(cycle.reasons), "trial": trial})
    return pd.DataFrame(rows)


def cycle_curves(summary: RecordingSummary) -> dict[str, Array]:
    """The curves (n, 101) of the n gait cycles in the means, by "angles/knee_angle_r": rad, Nm/kg,
    body weights, as `RecordingSummary.strides`; in single precision, which halves the file.
    """
    return {name: np.asarray(curves).astype(np.float32) for name, curves in summary.strides.items()}


def _curve_table(found: Import, quantities: Mapping[str, Found]) -> pd.DataFrame:
    """Mean and SD of every curve: rad, Nm/kg and body weights, 0 to 100 % of the side's cycle; and
    the curves of `quantities`, in their units.
    """
    columns: dict[str, Array] = {}
    for kind, curves in (("angle", found.angles), ("moment", found.moments)):
        for name, curve in curves.items():
            columns[f"{kind}_{name}_mean"] = curve.mean
            columns[f"{kind}_{name}_sd"] = curve.deviation
    for side, force in found.forces.items():
        for axis, direction in enumerate(("forward", "left", "up")):
            columns[f"force_{direction}_{side[0]}_mean"] = force.mean[:, axis]
            columns[f"force_{direction}_{side[0]}_sd"] = force.deviation[:, axis]
    if found.measurement is not None:
        columns |= found.measurement.columns()
    named = {with_unit(name, UNITS[name.partition("_")[0]]): c for name, c in columns.items()}
    for kind, quantity in quantities.items():
        unit = BY_NAME[kind].unit
        named |= {with_unit(f"{kind}_{n}_mean", unit): c for n, c in quantity.curves.items()}
    return pd.DataFrame({"percent": 100.0 * PHASE} | named)


def _record(found: Import) -> dict[str, Any]:
    """The contents of `import.json`."""
    request, body, seen = found.request, found.body, found.measurement
    return {
        "schema_version": IMPORT_VERSION,
        "versions": versions(),
        "inputs": [file._asdict() for file in input_files(found)],
        "person": {
            "identifier": request.identifier,
            "sex": request.sex,
            "mass_kg": request.mass_kg,
            "height_m": request.height_m,
        },
        "processing": found.processing.model_dump(mode="json"),
        "marker_set": found.session.marker_set.name,
        "axes": found.session.axes.option,
        "decisions": [list(decision) for decision in found.decisions],
        "lengths_m": [asdict(length) for length in body.fit.lengths],
        "measurements": body.chosen.to_dict(),
        "model": value_hash(_model_figures(body.model)),
        "weight_ratio": found.weight_ratio,
        "walking_speed_m_s": speed(found),
        "verdicts": [
            {
                "id": verdict.id,
                "target": verdict.target,
                "value": verdict.value,
                "limit": verdict.tolerance,
                "unit": verdict.unit,
                "passed": verdict.passed,
                "verdict": state_of(
                    verdict.id, verdict.passed, reduced=verdict.target.endswith(CONSISTENT)
                ),
            }
            for verdict in verdicts(found)
        ],
        "placement": [asdict(check) | {"passed": check.passed} for check in body.placement.checks],
        "warnings": [
            {"trial": trial} | {name: getattr(warning, name) for name in _OF_A_WARNING}
            for trial, warning in found.warnings
        ],
        "findings": [{"trial": trial} | row._asdict() for trial, row in found.looked],
        "measurement": [] if seen is None else [asdict(row) for row in seen.faults],
        "bands": {} if seen is None else seen.band_records(),
        "bands_at_once": None if seen is None else seen.at_once(),
        "trials": [_trial_record(walk) for walk in found.trials],
        "functional": [joint.record() for joint in found.functional],
        "given_centres": [centre.record() for centre in found.given],
    }


_OF_A_WARNING: Final = ("check", "where", "value", "limit", "unit", "message")


def _trial_record(walk: WalkingTrial) -> dict[str, Any]:
    errors = marker_errors(walk.kinematics)
    record: dict[str, Any] = {
        "trial": walk.name,
        "belt_speed_m_s": walk.belt,
        "marker_errors_m": {
            "joint fit": {
                "rms": errors.whole_rms,
                "largest": errors.whole_largest,
                "worst": errors.worst_marker,
                "by_marker": dict(zip(errors.names, errors.rms.tolist(), strict=True)),
            }
        },
        "anchoring": {name: getattr(walk.anchoring, name) for name in AnchoringResult.model_fields},
        "frames_not_converged": int((~walk.kinematics.converged).sum()),
        "gait": {side: walk.gait[side].summary() for side in SIDES},
        "findings": [str(finding) for finding in walk.findings],
        "residuals": {target or "recorded": asdict(left) for target, left in trial_residuals(walk)},
    }
    if walk.consistent is not None:
        record["consistent"] = {
            "coordinate_change": dict(walk.consistent.coordinate_change),
            "marker_change_rms_m": walk.consistent.marker_change_rms,
            "marker_change_max_m": walk.consistent.marker_change_max,
            "mass_factors": dict(walk.consistent.mass_factors),
            "trunk_offset_m": walk.consistent.trunk_offset.tolist(),
        }
    return record


def _model_figures(model: BodyModel) -> list[list[float]]:
    return [
        [segment.mass, *segment.joint_position, *segment.centre_of_mass, *segment.inertia.ravel()]
        for segment in model.segments
    ]
