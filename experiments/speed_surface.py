"""One fit over all speeds of a person, with curves that are smooth in speed, beside a fit of each.

    python -m experiments.speed_surface    # half an hour, writes a table in docs/held-out.md

For every trial of people with several, held out: the fits of the trials that are known, of the
speeds that a policy learns at, and of the speed that is held out, of which each harmonic of each
coordinate is a line or a parabola over the logarithm of speed, about the same hip centres. Printed
are the errors at the speed that is held out, and how far the separate fits are from a parabola.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Final
from unittest.mock import patch

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from evidence.marked_table import with_table
from experiments.fit_weights import Errors
from experiments.predicted_fits import errors, held_out_trials
from gaitval.arrays import Array
from gaitval.configuration import ContactSettings, RecordSettings
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.gait.record import GaitRecord
from gaitval.metrics.comparison import rms
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.reference_curves import reference_curves
from gaitval.model.body import BodyModel
from gaitval.prediction.known import Told, told
from gaitval.prediction.speed import trials_told
from gaitval.reference import dynamic_fit
from gaitval.reference.dynamic_fit import (
    MOST_DAMPING,
    SMALLEST_GAIN,
    Accuracy,
    Problem,
    consistent_reference,
    fit_problem,
    linear_terms,
    linearised,
    normal_equations,
    weighted_laws,
)
from gaitval.reference.motion import ReferenceMotion, build_reference
from gaitval.scaling.scaling import scale_subject
from gaitval.study.predicted_tasks import SPEEDS, range_speeds

PAGE = Path(__file__).parents[1] / "docs" / "held-out.md"
DEGREES: Final = {"a line over all speeds": 1, "a parabola over all speeds": 2}
CONTACT = ContactSettings()
_HIPS = slice(3, 7)
"""Of `Solution.common`."""


def speeds_of(subject: Subject, trial: str) -> list[Told]:
    """What a run that holds out `trial` fits: the trials that are known, the speeds of the range,
    and the trial itself, which comes last.
    """
    people, settings = builtin_subjects(), RecordSettings(holdout=trial)
    known = trials_told(subject, trial)
    between = range_speeds([each.walking_speed_m_s for each in known])
    return [
        *(told(each, RecordSettings(), people) for each in known),
        *(told(subject, settings, people, speed=speed) for speed in between),
        told(subject, settings, people),
    ]


def surface(
    problems: Sequence[Problem], basis: Array, start: Array, hips: Array
) -> tuple[Array, Array]:
    """Coefficients (B, 31, n) and `Solution.common` with the least sum of squares over K `problems`
    whose changes are the combinations of the coefficients by `basis` (K, B), about the same hip
    centres; from `start` (B, 31, n) and `hips` (4,).
    """
    size, whole = start[0].size, start.size
    count = len(problems[0].prior)

    def cost(coefficients: Array, common: Array) -> float:
        total = float(len(problems) * np.sum((problems[0].prior * common) ** 2))
        for problem, change in zip(problems, np.tensordot(basis, coefficients, 1), strict=True):
            laws, _ = weighted_laws(problem, change, common, 1.0)
            total += float(np.sum(laws**2) + np.sum(linear_terms(problem, change) ** 2))
        return total

    coefficients, common, damping = start, np.zeros(count), 1e-4
    common[_HIPS] = hips
    now, before = cost(coefficients, common), np.inf
    while before - now > SMALLEST_GAIN * now:
        before = now
        matrix, gradient = np.zeros((whole + count,) * 2), np.zeros(whole + count)
        changes = np.tensordot(basis, coefficients, 1)
        for problem, change, row in zip(problems, changes, basis, strict=True):
            laws = linearised(problem, change, common, 1.0)
            square, slope = normal_equations(problem, change, common, laws)
            # The change is the sum of row times coefficients, so its derivatives are theirs times
            # the row.
            across = np.kron(row[:, None], square[:size, size:])
            matrix[:whole, :whole] += np.kron(np.outer(row, row), square[:size, :size])
            matrix[:whole, whole:] += across
            matrix[whole:, :whole] += across.T
            matrix[whole:, whole:] += square[size:, size:]
            gradient += np.concatenate([np.kron(row, slope[:size]), slope[size:]])
        while damping < MOST_DAMPING:
            damped = matrix.copy()
            damped.flat[:: len(damped) + 1] *= 1.0 + damping
            try:
                step = cho_solve(cho_factor(damped, overwrite_a=True), gradient)
            except LinAlgError:
                damping *= 10.0
                continue
            tried = coefficients - step[:whole].reshape(start.shape), common - step[whole:]
            if (found := cost(*tried)) < now:
                (coefficients, common), now, damping = tried, found, 0.2 * damping
                break
            damping *= 8.0
    return coefficients, common


def on_one_surface(
    model: BodyModel, speeds: Sequence[Told], singles: Sequence[ReferenceMotion], degree: int
) -> ReferenceMotion:
    """The fit of the last of `speeds`, on one surface with the others; from `singles`, fits of
    each.
    """
    logs = np.log([each.record.speed for each in speeds])
    basis = np.vander(logs - logs[-1], degree + 1, increasing=True)
    built = [build_reference(each.record, model, CONTACT) for each in speeds]
    problems = [
        fit_problem(motion, each.record, model, CONTACT, Accuracy(record=each.accuracy), 0.0)
        for motion, each in zip(built, speeds, strict=True)
    ]
    start = np.tensordot(np.linalg.pinv(basis), [each.change for each in singles], 1)
    hips = np.mean([each.hip_centre.ravel() for each in singles], axis=0)
    coefficients, common = surface(problems, basis, start, hips)
    # The last row of the basis is 1, 0, 0: speeds are counted from the last one.
    solution = dynamic_fit.Solution(coefficients[0], common, np.empty((0, 0)), np.nan)
    # What makes a motion of a solution finds the solution first.
    with patch.object(dynamic_fit, "solve", lambda *_, **__: solution):
        return dynamic_fit.fitted(built[-1], speeds[-1].record, model, CONTACT)


def roughness(curves: Sequence[Curves], speeds: Sequence[float]) -> dict[str, float]:
    """RMS distance of each kind of `curves` at n `speeds`, m/s, from the parabola over the
    logarithm of speed that is nearest to them.
    """
    logs = np.log(speeds)
    powers = np.vander(logs - logs.mean(), 3)
    rest = np.eye(len(logs)) - powers @ np.linalg.pinv(powers)
    kinds = [by_kind(each) for each in curves]
    return {
        kind: float(
            np.mean([rms(rest @ np.array([each[kind][name] for each in kinds])) for name in names])
        )
        for kind, names in kinds[0].items()
    }


def main() -> None:
    """Write the table."""
    found: dict[str, list[Errors]] = {}
    rough: dict[str, list[dict[str, float]]] = {"predicted": [], "fitted": []}
    hips = []
    for subject, trial, last in held_out_trials():
        truth = recorded_curves(subject.on_trial(trial).record())
        model, speeds = scale_subject(subject).model, speeds_of(subject, trial)

        def curves(
            reference: ReferenceMotion, record: GaitRecord, mass: float = model.mass
        ) -> Curves:
            return reference_curves(reference, mass, record.left_phase)

        singles = [
            consistent_reference(each.record, model, CONTACT, each.accuracy) for each in speeds
        ]
        motions = {"each speed by itself": singles[-1]} | {
            name: on_one_surface(model, speeds, singles, degree) for name, degree in DEGREES.items()
        }
        now = {name: errors(curves(motion, last), truth) for name, motion in motions.items()}
        now["the prediction"] = errors(recorded_curves(last), truth)
        for name, each in now.items():
            found.setdefault(name, []).append(each)
        part = slice(-1 - SPEEDS, -1)
        walked = [each.record for each in speeds[part]]
        at = [each.speed for each in walked]
        rough["predicted"].append(roughness([recorded_curves(each) for each in walked], at))
        fits = [curves(*each) for each in zip(singles[part], walked, strict=True)]
        rough["fitted"].append(roughness(fits, at))
        hips.append(float(np.ptp([each.hip_centre for each in singles[part]], axis=0).max()))
        print(f"{subject.identifier} {trial}: {now}", flush=True)
    predicted = found.pop("the prediction")
    groups = list(predicted[0])
    table = [f"| fit | {' | '.join(groups)} |", f"|{'---|' * (1 + len(groups))}"]
    for name, fitted in found.items():
        ratios = [
            np.mean([each[group] for each in fitted]) / np.mean([each[group] for each in predicted])
            for group in groups
        ]
        table.append(f"| {name} | {' | '.join(f'{each:.2f}' for each in ratios)} |")
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_table(text, "surface", "\n".join(table)), encoding="utf-8")
    for name, rows in rough.items():
        means = {kind: float(np.mean([row[kind] for row in rows])) for kind in rows[0]}
        print(f"{name}: mean distance from a parabola {means}")
    print(f"hip centres differ over the range by {1000 * np.mean(hips):.0f} mm at most (mean)")


if __name__ == "__main__":
    main()
