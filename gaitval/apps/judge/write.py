"""Write a judgement: `judge.json` and a page."""

from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval._internal.io.artefacts import file_hash, versions, write_json
from gaitval.apps.judge.body import segment_shares
from gaitval.apps.judge.gait import valid, weight_ratio
from gaitval.apps.judge.judge import Judgement, floor_leg
from gaitval.apps.judge.judge_page import write_judge_page
from gaitval.apps.judge.markers import by_marker
from gaitval.apps.judge.moments import speed_group
from gaitval.apps.judge.muscles import JudgedMuscles
from gaitval.apps.judge.results import JUDGE_VERSION, JudgeResult
from gaitval.coordinates import SIDES
from gaitval.metrics.typed import tidy

NAME: Final = "judge"


def write_judgement(found: Judgement, folder: Path) -> JudgeResult:
    """Write `judge.json`, `judge.html` and `judge.pdf` of what was `found` into `folder`; returns
    what is in the first.

    Equal inputs give equal bytes of JSON and, but for the minute on the page, of HTML.
    """
    result = result_of(found)
    write_json(folder / f"{NAME}.json", result.as_dict())
    write_judge_page(found, result, folder)
    return result


def result_of(found: Judgement) -> JudgeResult:
    """What is written as `judge.json` of what was `found`."""
    values: dict[str, Any] = {
        "schema_version": JUDGE_VERSION,
        "versions": versions(),
        "inputs": [
            {"role": role, "name": path.name, "sha256": file_hash(path),
             "size": path.stat().st_size}
            for role, path in found.request.files()
        ],
        "passed": found.outcome == "passed",
        "verdict": found.outcome,
        "model": _model(found),
        "trial": _trial(found),
        "marker_errors": _marker_errors(found),
        "residuals": _residuals(found),
        "moments": {
            name: {
                "mean": found.moments[name][0],
                "low": band.low,
                "high": band.high,
                "distance": band.distance(found.moments[name][0]),
                "distance_if_negated": band.distance(-found.moments[name][0]),
            }
            for name, band in found.band.items()
        },
        "angles_deg": {name: np.degrees(mean) for name, (mean, _) in found.angles.items()},
        "segments": {
            one.segment: {
                "mass_kg": one.mass, "share": one.share, "expected_share": one.expected,
            }
            for one in segment_shares(found.skeleton)
        },
        "limits": [
            {
                "id": verdict.id,
                "title": verdict.title,
                "target": verdict.target,
                "value": verdict.value,
                "limit": verdict.tolerance,
                "relation": verdict.limit,
                "unit": verdict.unit,
                "passed": verdict.passed,
                "decides": found.decides(verdict),
                "verdict": found.state(verdict),
            }
            for verdict in found.verdicts()
        ],
        "findings": found.findings,
        "not_judged": found.not_judged,
        "undecided": found.undecided,
        "muscles": None if found.muscles is None else _muscles(found.muscles),
    }  # fmt: skip
    return JudgeResult.model_validate(tidy(values))


def _muscles(found: JudgedMuscles) -> dict[str, Any]:
    return {
        "reserves": found.reserves,
        "at_limit": found.at_limit,
        "peaks_bw": found.peaks,
        "agreement": found.agreement,
        "beside": found.beside,
    }


def _model(found: Judgement) -> dict[str, Any]:
    model = found.model
    return {
        "name": model.name,
        "version": model.version,
        "mass_kg": model.mass,
        "bodies": len(model.bodies),
        "coordinates": len(model.coordinates),
        "markers": len(model.markers),
        "thigh_and_shank_m": found.skeleton.leg_length,
        "stature_m": found.stature,
        "stature_given": found.request.height is not None,
        "senses": dict(found.skeleton.senses),
    }


def _trial(found: Judgement) -> dict[str, Any] | None:
    motion, gait, leg = found.motion, found.gait, found.skeleton.leg_length
    if motion is None:
        return None
    speed = float("nan") if gait is None else gait.speed
    return {
        "start_s": float(motion.time[0]),
        "end_s": float(motion.time[-1]),
        "frames": len(motion.time),
        "events_from": "motion" if gait is None or gait.forces is None else "forces",
        "cycles": {
            side: 0 if gait is None else len(valid(gait, side, kinetics=False)) for side in SIDES
        },
        "walking_speed_m_s": speed,
        "belt_speed_m_s": None if gait is None else gait.belt,
        "belt_given": found.request.belt is not None,
        "speed_group": speed_group(speed, floor_leg(leg))
        if leg is not None and np.isfinite(speed)
        else None,
        "weight_ratio": float("nan") if gait is None else weight_ratio(gait, found.model.mass),
    }


def _marker_errors(found: Judgement) -> dict[str, Any] | None:
    errors = found.marker_errors
    if errors is None:
        return None
    apart, frames = found.log_difference or (None, 0)
    solved = found.of_import
    return {
        "source": "placed" if errors.names else "log",
        "rms_m": errors.whole_rms,
        "largest_m": errors.whole_largest,
        "frames": len(errors.time),
        "by_marker": {
            name: {"rms_m": rms, "largest_m": largest, "at_s": at, "seen": seen}
            for name, (rms, largest, at, seen) in by_marker(errors).items()
        },
        "log_difference_m": apart,
        "log_frames": frames,
        "solved_rms_m": None if solved is None else solved.solved_rms,
        "solved_largest_m": None if solved is None else solved.solved_largest,
    }


def _residuals(found: Judgement) -> dict[str, Any] | None:
    left, gait = found.residuals, found.gait
    if left is None:
        return None
    return {
        "force_rms": left.force_rms,
        "force_peak": left.force_peak,
        "moment_rms": left.moment_rms,
        "moment_peak": left.moment_peak,
        "force_share": left.force_share,
        "moment_share": left.moment_share,
        "peak_ground_reaction": None if gait is None else gait.peak_force,
        "centre_of_mass_height": None if gait is None else gait.height,
        "frames": left.frames,
    }
