"""Writes what an import found: the subject for the main job, OpenSim's files, tables, the page."""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from gaitval.artefacts import (
    file_hash,
    replacing,
    value_hash,
    versions,
    write_json,
    write_text,
)
from gaitval.configuration import Configuration
from gaitval.coordinates import COORDINATES, ROOT, SIDES, Side
from gaitval.data.gait_cycles import GaitCycle
from gaitval.data.mean_curves import (
    ANGLE_TOLERANCE,
    MOMENT_TOLERANCE,
    fit_curve,
    fit_force,
    mean_vertical_force,
    stance_fraction,
)
from gaitval.data.record import ANGLE_NAMES, MOMENT_NAMES
from gaitval.data.subject import (
    Forces,
    Gait,
    StanceFraction,
    Subject,
    make_subject,
    mass_and_height_problems,
)
from gaitval.errors import ArtefactError, RecordError, SubjectError
from gaitval.interchange.motion import (
    write_external_loads,
    write_ground_reaction,
    write_markers,
    write_moments,
    write_motion,
)
from gaitval.interchange.osim import write_osim
from gaitval.kinematics.inverse_dynamics import Residuals, residuals
from gaitval.kinematics.inverse_kinematics import marker_errors
from gaitval.laboratory import Import, Walk, valid_cycles
from gaitval.metrics.tolerances import Measure, Verdict, evaluate
from gaitval.reporting.recording_report import (
    Change,
    Decision,
    GateRow,
    InputFile,
    LeftOut,
    MarkerError,
    RecordingSummary,
    ScaledSegment,
    ScalingMethod,
    SpatiotemporalRow,
    write_recording_report,
)
from gaitval.reporting.recording_report import Residuals as ResidualCurves
from gaitval.scaling.anthropometry import Sex
from gaitval.scaling.model import BodyModel
from gaitval.scaling.parameters import PARAMETERS, nominal_parameters

Array = NDArray[np.float64]

FOLDER: Final = "recording"
"""In the folder of the subject: all but `subject.toml`."""

SUBJECT: Final = "subject.toml"
RECORD: Final = "import.json"

PHASE: Final = np.linspace(0.0, 1.0, 101)


def subject_of(
    found: Import,
    *,
    age_years: float | None = None,
    citation: str = "Own recording, not published",
    licence: str = "not stated",
) -> Subject:
    """The subject that the main job reads, from an import with forces.

    Raises
    ------
    RecordError : no cycle whose forces the plates show whole, on one side at least.
    SubjectError : implausible values.
    """
    request = found.request
    if set(found.forces) != set(SIDES) or len(found.moments) < len(MOMENT_NAMES):
        missing = " and no ".join(s for s in SIDES if s not in found.forces) or "complete"
        reasons = [
            f"{walk.name}: {cycle}"
            for walk in found.walks
            for side in SIDES
            for cycle in walk.cycles[side]
            if side not in found.forces and not cycle.kinetics_valid
        ]
        plates = [f"{walk.name}: {finding}" for walk in found.walks for finding in walk.findings]
        raise RecordError(
            f"no {missing} gait cycle whose ground reaction the plates show from heel strike to "
            "heel strike, so there is no mean of moments and forces for a subject.\n"
            + _some("the cycles", reasons)
            + _some("the plates", plates)
            + "Give a trial (or several, --trial repeated) in which each foot meets a plate of its "
            "own. If this is one, the forces are of another trial, of the other foot or in other "
            "axes than the markers: check their file. Or use --kinematics-only."
        )
    counts = " and ".join(f"{len(found.forces[side].curves)} {side}" for side in SIDES)
    where = f"{', '.join(walk.name for walk in found.walks)} ({counts} cycles)"
    means = {side: np.asarray(found.forces[side].mean) for side in SIDES}
    stance = {side: stance_fraction(means[side][:, 2]) for side in SIDES}
    fitted = {side: fit_force(means[side], stance[side], where) for side in SIDES}
    body = found.body
    values = {
        "identifier": request.identifier,
        "source": ", ".join(path.name for path in request.trials),
        "citation": citation,
        "licence": licence,
        "sex": request.sex,
        "age_years": age_years,
        "mass_kg": request.mass_kg,
        "height_m": request.height_m,
        "leg_length_m": body.chosen.hip_height,
        "walking_speed_m_s": speed(found),
        "stride_time_s": float(
            np.mean([cycle.duration for cycle in _cycles(found, "right", kinetics=False)])
        ),
        "left_phase": _left_phase(found),
        "mean_vertical_force": mean_vertical_force(means),
        "stance_fraction": StanceFraction(right=stance["right"], left=stance["left"]),
        "gait": Gait(
            samples=len(PHASE),
            angles={
                name: fit_curve(
                    name, PHASE, closed(name, "angle", curve.mean, where), ANGLE_TOLERANCE, where
                )
                for name, curve in found.angles.items()
                if name in ANGLE_NAMES
            },
            moments={
                name: fit_curve(
                    name,
                    PHASE,
                    closed(name, "moment", found.moments[name].mean, where),
                    MOMENT_TOLERANCE,
                    where,
                )
                for name in MOMENT_NAMES
            },
            forces=Forces(right=fitted["right"], left=fitted["left"]),
        ),
        "low_pass": {
            "moments_hz": found.processing.moment_force_cutoff_hz,
            "forces_hz": found.processing.force_cutoff_hz,
        },
        "measurements": body.chosen.to_dict(),
    }
    return make_subject(values, request.identifier)


def _some(what: str, lines: Sequence[str], most: int = 4) -> str:
    """The first of some lines, below what they are about; nothing if there are none."""
    if not lines:
        return ""
    more = f"\n  and {len(lines) - most} more" if len(lines) > most else ""
    return f"{what}:\n  " + "\n  ".join(lines[:most]) + more + "\n"


LARGEST_DRIFT: Final = {"angle": float(np.radians(6.0)), "moment": 0.6}
"""By how much (rad, Nm/kg) a mean curve may end elsewhere than it began. From stride to stride
steady walking varies by 2 degrees and 0.2 Nm/kg (standard deviation) at heel strike; three times as
much in the mean is a start, a stop or a turn. Convention."""


def closed(name: str, kind: str, curve: Array, where: str) -> Array:
    """A mean curve (101,) that ends where it begins.

    The mean of few cycles drifts, from one heel strike to the next; the drift is taken away evenly
    over the cycle.

    Raises
    ------
    RecordError : the drift is more than `LARGEST_DRIFT`.
    """
    drift = float(curve[-1] - curve[0])
    if abs(drift) > LARGEST_DRIFT[kind]:
        size = f"{np.degrees(drift):.1f}°" if kind == "angle" else f"{drift:.2f} Nm/kg"
        raise RecordError(
            f"{where}: the mean {kind} {name} ends {size} from where it began, so the walk was "
            "not steady. Give trials of steady walking, or more cycles of them."
        )
    return np.asarray(curve - drift * (PHASE - 0.5))


def _cycles(found: Import, side: Side, *, kinetics: bool) -> list[GaitCycle]:
    return [cycle for walk in found.walks for cycle in valid_cycles(walk, side, kinetics=kinetics)]


def speed(found: Import) -> float:
    """Mean walking speed over all cycles of both sides, m/s."""
    return float(
        np.nanmean(
            np.concatenate([walk.gait[side].speed for walk in found.walks for side in SIDES])
        )
    )


def _left_phase(found: Import) -> float:
    """Mean phase of the right cycle at which the left heel strikes."""
    return float(
        np.nanmean(
            [
                (cycle.opposite_strike - cycle.start) / cycle.duration
                for cycle in _cycles(found, "right", kinetics=False)
            ]
        )
    )


def check_person(mass_kg: float, height_m: float, sex: str) -> Sex:
    """Refuse a body that cannot be, before any file is read; returns the sex.

    Raises
    ------
    SubjectError : another sex than F or M, or swapped, missing or wrong units.
    """
    problems = [
        problem.replace("mass_kg =", "--mass").replace("height_m =", "--height")
        for problem in mass_and_height_problems(mass_kg, height_m)
    ]
    if sex not in ("F", "M"):
        problems.append(f"--sex {sex}: give F or M, which choose the segment tables.")
    if problems:
        raise SubjectError("\n".join(problems))
    return "F" if sex == "F" else "M"


# --- limits ------------------------------------------------------------------------------


def verdicts(found: Import) -> list[Verdict]:
    """Marker errors and residuals against their published limits (`metrics/tolerances.toml`)."""
    distances = np.array(list(found.body.placement.distances.values()))
    measures = [
        Measure("scaling_marker_rms", "standing", 100 * float(np.sqrt((distances**2).mean()))),
        Measure("scaling_marker_largest", "standing", 100 * float(distances.max())),
    ]
    for walk in found.walks:
        name = walk.name
        errors = marker_errors(walk.kinematics)
        measures += [
            Measure("ik_marker_rms", name, 100 * errors.whole_rms),
            Measure("ik_marker_largest", name, 100 * errors.whole_largest),
        ]
        for target, left in _residuals(walk):
            measures += [
                Measure("residual_force_peak", f"{name}{target}", left.force_peak),
                Measure("residual_force_rms", f"{name}{target}", left.force_rms),
                Measure("residual_moment_peak", f"{name}{target}", left.moment_peak),
                Measure("residual_moment_rms", f"{name}{target}", left.moment_rms),
                Measure("residual_force_share", f"{name}{target}", 100 * left.force_share),
                Measure("residual_moment_share", f"{name}{target}", 100 * left.moment_share),
            ]
    return evaluate(measures)


def _residuals(walk: Walk) -> list[tuple[str, Residuals]]:
    """Residuals of a walk where both feet's forces are known, as recorded and made consistent."""
    if walk.dynamics is None or walk.loads is None:
        return []
    known = np.asarray(walk.loads.valid.all(axis=1))
    if not known.any():
        return []
    found = [("", residuals(walk.dynamics, known))]
    if walk.consistent is not None:
        found.append((", made consistent", walk.consistent.after))
    return found


# --- files -------------------------------------------------------------------------------


def check_folder(folder: Path) -> None:
    """Refuse a folder for the results before the work is done for it.

    Raises
    ------
    ArtefactError : a file, below one, may not be written to, or with a subject in it that no
        import wrote.
    """
    for wanted in (Path(folder), Path(folder) / FOLDER):
        nearest = wanted
        while not os.path.lexists(nearest):
            nearest = nearest.parent
        if not nearest.is_dir():
            raise ArtefactError(f"{nearest}: is a file, not a folder. Give a folder with --out.")
        if not os.access(nearest, os.W_OK | os.X_OK):
            raise ArtefactError(
                f"{nearest}: may not be written to. Give another folder with --out."
            )
    subject = Path(folder) / SUBJECT
    if subject.exists() and not (Path(folder) / FOLDER / RECORD).exists():
        raise ArtefactError(
            f"{subject}: is there and was not written by an import, which would replace it. Give "
            "another folder with --out, or move the file."
        )


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ArtefactError(
            f"{error.filename or folder}: cannot be written ({error.strerror}). Free the disk, or "
            "give another folder with --out; the same command then does the import anew."
        ) from None


def write_subject(folder: Path, subject: Subject) -> Path:
    """Write `subject.toml`, after all others; returns the file."""
    with _writing(folder):
        write_text(Path(folder) / SUBJECT, subject.to_toml())
    return Path(folder) / SUBJECT


def write_import(folder: Path, found: Import, configuration: Configuration) -> list[Path]:
    """Write everything but the subject below `folder`/recording; returns the files.

    OpenSim's files of a trial belong together: from its motion and ground reaction its inverse
    dynamics finds the moments that are written. So the ground reaction is as inverse dynamics used
    it, and a trial that was made consistent has a model with its own masses.

    Each file is written whole or not at all. What an earlier import left of `subject.toml` and
    `import.json` is removed first, and `import.json` is written last: where it stands, all others
    do, and are of one import.

    Raises
    ------
    ArtefactError : the folder cannot be written to.
    """
    with _writing(folder):
        return _write_import(Path(folder), found, configuration)


def _write_import(folder: Path, found: Import, configuration: Configuration) -> list[Path]:
    target = folder / FOLDER
    target.mkdir(parents=True, exist_ok=True)
    for earlier in (folder / SUBJECT, target / RECORD):
        earlier.unlink(missing_ok=True)
    body = found.body
    motion = found.walks[0].kinematics
    determined = np.asarray(motion.determined.any(axis=0))
    held = {
        name: 0.0
        for name, seen in zip(COORDINATES, determined, strict=True)
        if not seen and name not in ROOT
    }
    friction = float(nominal_parameters()[PARAMETERS.index("friction")])

    def write_model(path: Path, model: BodyModel) -> None:
        write_osim(path, model, body.markers, configuration.contact, friction, held=held)
        written.append(path)

    written: list[Path] = []
    write_model(target / "model.osim", body.model)
    for number, walk in enumerate(found.walks, start=1):
        stem = target / f"trial{number}"
        files = {
            name: stem.with_name(f"{stem.name}_{name}")
            for name in ("markers.trc", "ik.mot", "grf.mot", "external_loads.xml", "id.sto")
        }
        write_markers(files["markers.trc"], walk.recording)
        write_motion(files["ik.mot"], walk.recording.time, walk.motion)
        written += [files["markers.trc"], files["ik.mot"]]
        if walk.consistent is not None:
            write_model(stem.with_name(f"{stem.name}_model.osim"), walk.consistent.model)
        if walk.loads is not None and walk.moments is not None:
            write_ground_reaction(files["grf.mot"], walk.loads)
            write_external_loads(files["external_loads.xml"], files["grf.mot"].name)
            write_moments(files["id.sto"], walk.motion, walk.moments)
            written += [files["grf.mot"], files["external_loads.xml"], files["id.sto"]]
    tables = {
        "scaling.csv": body.scaled.frame(),
        "cycles.csv": _cycle_table(found),
        "curves.csv": _curve_table(found),
    }
    for name, table in tables.items():
        with replacing(target / name) as temporary:
            table.to_csv(temporary, index=False)
        written.append(target / name)
    write_recording_report(target, summary_of(found))
    written += [target / "recording.html", target / "recording.pdf"]
    write_json(target / RECORD, _plain(_record(found)))
    return [*written, target / RECORD]


def _cycle_table(found: Import) -> pd.DataFrame:
    rows = []
    for walk in found.walks:
        for side in SIDES:
            for cycle in walk.cycles[side]:
                row = asdict(cycle) | {"trial": walk.name}
                rows.append(row | {"reasons": "; ".join(cycle.reasons)})
    return pd.DataFrame(rows)


def _curve_table(found: Import) -> pd.DataFrame:
    """Mean and SD of every curve: rad, Nm/kg and body weights, 0 to 100 % of the side's cycle."""
    columns: dict[str, Array] = {"percent": 100.0 * PHASE}
    for kind, curves in (("angle", found.angles), ("moment", found.moments)):
        for name, curve in curves.items():
            columns[f"{kind}_{name}_mean"] = curve.mean
            columns[f"{kind}_{name}_sd"] = curve.deviation
    for side, force in found.forces.items():
        for axis, direction in enumerate(("forward", "left", "up")):
            columns[f"force_{direction}_{side[0]}_mean"] = force.mean[:, axis]
            columns[f"force_{direction}_{side[0]}_sd"] = force.deviation[:, axis]
    return pd.DataFrame(columns)


def _inputs(found: Import) -> list[InputFile]:
    request = found.request
    files = [("static", request.static)]
    files += [("trial", path) for path in request.trials]
    files += [("forces", path) for path in request.forces]
    return [InputFile(role, p.name, file_hash(p), p.stat().st_size) for role, p in files]


def _record(found: Import) -> dict[str, Any]:
    """What `import.json` holds."""
    request, body = found.request, found.body
    return {
        "schema_version": 1,
        "versions": versions(),
        "inputs": [asdict(file) for file in _inputs(found)],
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
        "factors": {factor.name: factor.factor for factor in body.factors},
        "model": value_hash(_model_figures(body.model)),
        "weight_ratio": found.weight_ratio,
        "walking_speed_m_s": speed(found),
        "verdicts": [
            {
                "id": verdict.tolerance.id,
                "target": verdict.target,
                "value": verdict.value,
                "limit": verdict.tolerance.value,
                "unit": verdict.tolerance.unit,
                "passed": verdict.passed,
            }
            for verdict in verdicts(found)
        ],
        "placement": [asdict(check) | {"passed": check.passed} for check in body.placement.checks],
        "trials": [_trial_record(walk) for walk in found.walks],
    }


def _trial_record(walk: Walk) -> dict[str, Any]:
    record: dict[str, Any] = {
        "trial": walk.name,
        "belt_speed_m_s": walk.belt,
        "marker_errors_m": {
            method: {
                "rms": errors.whole_rms,
                "largest": errors.whole_largest,
                "worst": errors.worst_marker,
                "by_marker": dict(zip(errors.names, errors.rms.tolist(), strict=True)),
            }
            for method, errors in (
                ("joint fit", marker_errors(walk.kinematics)),
                ("marker pairs", marker_errors(walk.compared)),
            )
        },
        "anchoring": {
            name: getattr(walk.anchoring, name)
            for name in (
                "sliding_before",
                "sliding_after",
                "largest_before",
                "largest_after",
                "marker_rms_before",
                "marker_rms_after",
            )
        },
        "frames_not_converged": int((~walk.kinematics.converged).sum()),
        "gait": {side: walk.gait[side].summary() for side in SIDES},
        "findings": [str(finding) for finding in walk.findings],
        "residuals": {target or "recorded": asdict(left) for target, left in _residuals(walk)},
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


def _plain(value: Any) -> Any:
    """For JSON: numbers of NumPy as Python's, NaN as null."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


# --- the page ----------------------------------------------------------------------------

SPATIOTEMPORAL: Final = {
    "stride_time": ("Stride time", "s", 2),
    "step_time": ("Step time", "s", 2),
    "cadence": ("Cadence", "steps/min", 1),
    "stride_length": ("Stride length", "m", 3),
    "step_length": ("Step length", "m", 3),
    "step_width": ("Step width", "m", 3),
    "stance_fraction": ("Stance, share of the cycle", "1", 3),
    "double_support_fraction": ("Double support, share of the cycle", "1", 3),
    "speed": ("Speed", "m/s", 3),
    "walk_ratio": ("Walk ratio", "m/(steps/min)", 5),
}


def summary_of(found: Import) -> RecordingSummary:
    """What the page of the import shows."""
    request, first = found.request, found.walks[0]
    errors = marker_errors(first.kinematics)
    limits = {verdict.tolerance.id: verdict.tolerance.value for verdict in verdicts(found)}
    seen = np.isfinite(first.kinematics.marker_errors).mean(axis=0)
    forces = {
        f"{name}_{side[0]}": (sign * force.mean[:, axis], force.deviation[:, axis])
        for side, force in found.forces.items()
        for name, axis, sign in (
            ("forward", 0, 1.0),
            ("medial", 1, 1.0 if side == "right" else -1.0),
            ("vertical", 2, 1.0),
        )
    }
    dynamics = first.moments
    return RecordingSummary(
        identifier=request.identifier,
        sex=request.sex,
        mass=request.mass_kg,
        height=request.height_m,
        trial=", ".join(path.name for path in request.trials),
        duration=sum(len(w.recording.markers) / w.recording.marker_rate for w in found.walks),
        marker_rate=first.recording.marker_rate,
        force_rate=first.recording.force_rate,
        walking_speed=speed(found),
        cycles={side: len(_cycles(found, side, kinetics=False)) for side in SIDES},
        stance_fraction={
            side: float(
                np.nanmean(np.concatenate([w.gait[side].stance_fraction for w in found.walks]))
            )
            for side in SIDES
        },
        inputs=_inputs(found),
        decisions=[
            Decision(step, message) for step, message in found.decisions if step in _DECIDED
        ],
        gates=limit_rows(found),
        marker_errors=[
            MarkerError(name, float(errors.rms[i]), float(errors.largest[i]), float(seen[i]))
            for i, name in enumerate(errors.names)
        ],
        marker_rms_limit=limits["ik-marker-rms"] / 100,
        marker_largest_limit=limits["ik-marker-largest"] / 100,
        scaling_methods=scaling_methods(found),
        segments=[
            ScaledSegment(
                row.segment,
                row.length_m,
                np.nan if row.mass_kg is None else row.mass_kg,
                row.factor,
                row.source,
            )
            for row in found.body.scaled.table
        ],
        angles={name: (c.mean, c.deviation) for name, c in found.angles.items()},
        moments={name: (c.mean, c.deviation) for name, c in found.moments.items()},
        forces=forces,
        residuals=None
        if dynamics is None
        else ResidualCurves(
            time=dynamics.time,
            force=_where_known(first, dynamics.residual_force),
            moment=_where_known(first, dynamics.residual_moment),
            force_limit=limits.get("residual-force-peak", np.nan),
            moment_limit=limits.get("residual-moment-peak", np.nan),
        ),
        spatiotemporal=spatiotemporal_rows(found.walks),
        changes=_changes(first),
        findings=[message for step, message in found.decisions if step not in _DECIDED],
        left_out=[
            LeftOut(side, cycle.start, "; ".join(cycle.reasons))
            for walk in found.walks
            for side in SIDES
            for cycle in walk.cycles[side]
            if cycle.reasons
        ],
        versions=versions(),
    )


_DECIDED: Final = ("read", "markers", "axes", "scaling", "kinematics")
"""Steps of `Import.decisions` that are decisions; the others are findings about the data."""


def _where_known(walk: Walk, residual: Array) -> Array:
    """NaN where the plates do not show both feet: what is missing there is no residual."""
    assert walk.loads is not None
    known = np.asarray(walk.loads.valid.all(axis=1))
    return np.where(known[:, None], residual, np.nan)


def limit_rows(found: Import) -> list[GateRow]:
    """Every published limit and how the import stands to it."""
    rows = [
        GateRow(
            name=f"{verdict.tolerance.title} ({verdict.target})",
            value=verdict.value,
            limit=verdict.tolerance.value,
            unit=verdict.tolerance.unit,
            passed=verdict.passed,
            source=f"{verdict.tolerance.citation.split('.')[0]}: {verdict.tolerance.locator}",
        )
        for verdict in verdicts(found)
    ]
    # The distances of the landmarks are among the tolerances already.
    return rows + [
        GateRow(check.name, check.value, check.limit, check.unit, check.passed, check.source)
        for check in found.body.placement.checks
        if check.unit == "deg"
    ]


def scaling_methods(found: Import) -> list[ScalingMethod]:
    """Marker errors of both ways to scale the body, in standing and in the first walking trial."""
    body, walk = found.body, found.walks[0]
    standing = np.array(list(body.paired[1].distances.values()))
    landmarks = np.array(list(body.placement.distances.values()))
    paired, fitted = marker_errors(walk.compared), marker_errors(walk.kinematics)
    return [
        ScalingMethod(
            "marker pairs, as OpenSim's ScaleTool",
            float(np.sqrt((standing**2).mean())),
            float(standing.max()),
            paired.whole_rms,
            paired.whole_largest,
        ),
        ScalingMethod(
            "joint centres of the standing trial, then joint fit to both trials",
            float(np.sqrt((landmarks**2).mean())),
            float(landmarks.max()),
            fitted.whole_rms,
            fitted.whole_largest,
            chosen=True,
        ),
    ]


def spatiotemporal_rows(walks: Sequence[Walk]) -> list[SpatiotemporalRow]:
    """Mean and SD of each parameter over the cycles of all trials."""
    rows = []
    for name, (title, unit, digits) in SPATIOTEMPORAL.items():
        values = {}
        for side in SIDES:
            pooled = np.concatenate([getattr(walk.gait[side], name) for walk in walks])
            pooled = pooled[np.isfinite(pooled)]
            values[side] = (
                None
                if not len(pooled)
                else (
                    float(pooled.mean()),
                    float(pooled.std(ddof=1)) if len(pooled) > 1 else np.nan,
                )
            )
        rows.append(SpatiotemporalRow(title, unit, values["right"], values["left"], digits=digits))
    return rows


def _changes(walk: Walk) -> list[Change]:
    consistent = walk.consistent
    if consistent is None:
        return []
    before, after = consistent.before, consistent.after
    rows = [
        Change("residual force, RMS", before.force_rms, after.force_rms, "N"),
        Change("residual force, peak", before.force_peak, after.force_peak, "N"),
        Change("residual moment, RMS", before.moment_rms, after.moment_rms, "Nm"),
        Change("residual moment, peak", before.moment_peak, after.moment_peak, "Nm"),
        Change("markers on the body, RMS", 0.0, 1000 * consistent.marker_change_rms, "mm"),
        Change("markers on the body, largest", 0.0, 1000 * consistent.marker_change_max, "mm"),
    ]
    for name, change in consistent.coordinate_change.items():
        length = name.startswith("pelvis_t")
        value = 1000 * change if length else float(np.degrees(change))
        if value < 0.005:
            continue  # shown as 0.00: a held coordinate
        rows.append(Change(f"{name}, RMS change", 0.0, value, "mm" if length else "°"))
    rows += [
        Change(f"mass of {name}, factor", 1.0, factor, "1")
        for name, factor in consistent.mass_factors.items()
    ]
    return rows
