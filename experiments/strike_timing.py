"""What a heel strike that is found too early or too late costs an estimate of kinetics.

    python -m experiments.strike_timing    # ten minutes, writes a table in docs/held-out.md

People without plates have their heel strikes from the motion of their feet. Each of the ten people,
of whom only angles are known, gets heel strikes that are a share of the cycle off on both sides;
the estimate is compared with the forces and moments as they were.
"""

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from evidence.fit import SKILLS
from evidence.fitted import MOMENTS
from evidence.marked_table import with_table
from gaitval.arrays import Array
from gaitval.configuration import ContactSettings, RecordSettings
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.gait.record import GaitRecord, PeriodicCurve, periodic_through
from gaitval.metrics.baselines import others_line
from gaitval.metrics.comparison import rms
from gaitval.prediction.deviations import KINETICS, kinetics_of, kinetics_of_curves, units
from gaitval.prediction.known import Told, told
from gaitval.prediction.normal_form import SAMPLES, normal_form
from gaitval.scaling.scaling import scale_subject
from gaitval.study.estimate_stage import of_known

PAGE = Path(__file__).parents[1] / "docs" / "held-out.md"
LATE: Final = (-0.02, -0.01, -0.005, 0.0, 0.005, 0.01, 0.02)
"""Shares of the cycle by which the strikes are called too late."""


def errors(subject: Subject, late: float) -> Array:
    """RMSE (7,) of the estimate of `KINETICS`, mean of both sides, in Nm/kg and body weights."""
    known = told(subject, RecordSettings(use="kinematics"), builtin_subjects())
    model = scale_subject(subject).model
    heard = Told(_called(known.record, late), known.accuracy)
    found = of_known(heard, subject, model, ContactSettings()).kinetics
    return _off(found, subject, late)


def of_the_line(subject: Subject) -> Array:
    """The same of the line through the other people, whose strikes are right."""
    line = others_line(subject, builtin_subjects())
    assert line is not None
    return _off(kinetics_of_curves(line.curves, subject.leg_length_m), subject, 0.0)


def _called(record: GaitRecord, late: float) -> GaitRecord:
    """The record with the strikes of both feet called late: its angles are seen earlier."""
    angles = {name: _turned(curve, late) for name, curve in record.angles.items()}
    return replace(record, angles=angles)


def _turned(curve: PeriodicCurve, late: float) -> PeriodicCurve:
    phase = np.arange(SAMPLES) / SAMPLES
    return periodic_through(curve(phase + late), len(curve.cosine))


def _off(found: Array, subject: Subject, late: float) -> Array:
    true = kinetics_of(normal_form(subject.record(), subject.leg_length_m))
    # By the spectrum a curve is moved by less than a sample.
    turns = np.exp(2j * np.pi * late * np.arange(true.shape[-1] // 2 + 1))
    moved = np.fft.irfft(np.fft.rfft(true) * turns, true.shape[-1])
    miss = units(subject.leg_length_m) * (found - moved)
    return np.array([[rms(curve) for curve in side] for side in miss]).mean(axis=0)


def main() -> None:
    """Write the table."""
    people = builtin_subjects()
    line = np.mean([of_the_line(each) for each in people], axis=0)
    order = [KINETICS.index(each) for each in SKILLS]
    names = [
        f"{MOMENTS[name]} moment" if kind == "moments" else f"{name} force" for kind, name in SKILLS
    ]
    table = [f"| called late by | {' | '.join(names)} |", f"|{'---|' * (1 + len(names))}"]
    for late in LATE:
        skills = 1.0 - np.mean([errors(each, late) for each in people], axis=0) / line
        table.append(f"| {100 * late:+.1f} % | {' | '.join(f'{skills[i]:.2f}' for i in order)} |")
        print(table[-1], flush=True)
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_table(text, "strikes", "\n".join(table)), encoding="utf-8")


if __name__ == "__main__":
    main()
