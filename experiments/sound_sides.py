"""Shipped: writes what amputees' sides do into gaitval/apps/patients: sound_sides.csv,
sound_rests.csv, prosthetic_sides.csv and prosthetic_rests.csv; prints how far their ankle moments
are off.

    python -m experiments.sound_sides ../shared/data          # the files
    python -m experiments.sound_sides ../shared/data --check  # fails if one is another

Reads the strides of above-knee amputees (`gps/`) and their ankles' moments (`amputee/`). `later`:
where the moment has fallen to `ENDED` of its peak, less where the angles have the foot leave the
ground, less the mean of the same in the ten built-in people. `larger`: with the foot leaving so
late, the factor of healthy people's moment in the time of this foot (`told.rolled_ankle`) that is
nearest to the measured one by least squares. `sound_rests`: what of the measured one is left, with
the others' figures and what the ankle's angle says (`known_record.sound_ankle`);
`prosthetic_rests`: the same without `passive_foot.with_passive_foot`, and the angle. Errors are of
the moments that are expected before any walk, each person's with the others' figures alone.
"""

import csv
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from experiments.shipped import parser_of, ship
from gaitval._internal.io.text_tables import csv_text
from gaitval.apps.patients.cohort import found_patients
from gaitval.apps.patients.known_record import (
    expected_record,
    known_record,
    over_stance,
    rolled_ankle,
    sound_ankle,
)
from gaitval.apps.patients.passive_foot import expected_ankles, with_passive_foot
from gaitval.apps.patients.records import Patient, two_sided
from gaitval.apps.patients.rolling_foot import feet
from gaitval.apps.patients.sound_side import (
    PROSTHETIC_RESTS,
    PROSTHETIC_TABLE,
    RESTS,
    TABLE,
    expected_of,
    rows_of,
)
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.prediction.population import with_others_kinetics
from gaitval.subjects.subject_file import builtin_subjects

SPEEDS = ("transfemoral_amputee=0.8", "TF02=0.7")
"""m/s on the treadmill (Hood et al. 2020); TF02's fastest trial, which his stride is of, by his
ankle's angle."""
HEALTHY = "control"
FOLDER = Path(__file__).resolve().parent.parent / "gaitval" / "apps" / "patients"

ENDED = 0.05
"""Of the largest plantarflexor moment, below which it has ended."""

PHASE = np.linspace(0.0, 1.0, 101)

ABOUT = {
    TABLE: """\
# Sound sides of {people} above-knee amputees on a treadmill at 0.8 m/s (TF02: 0.7): how much later,
# of the cycle, the ankle's moment ends than the angles and healthy people say; and by what factor
# it is larger. """,
    PROSTHETIC_TABLE: """\
# Prosthetic sides of {people} above-knee amputees on a treadmill at 0.8 m/s (TF02: 0.7): how much
# later, of the cycle, the ankle's moment ends than the angles and healthy people say. """,
    RESTS: """\
# Sound ankles of {people} above-knee amputees on a treadmill at 0.8 m/s (TF02: 0.7): the moment at
# each percent of the cycle, Nm/kg, dorsiflexion positive, less the expected one. """,
    PROSTHETIC_RESTS: """\
# Prosthetic ankles of {people} above-knee amputees on a treadmill at 0.8 m/s (TF02: 0.7): the
# angle, rad, and the moment, Nm/kg, dorsiflexion positive, less the mean of healthy people's and of
# two springs', at each percent of the cycle. """,
}
SOURCE = """\
Computed by experiments/sound_sides.py from: Hood S, Ishmael MK, Gunnell A, Foreman
# KB, Lenzi T (2020) A kinematic and kinetic dataset of 18 above-knee amputees walking at various
# speeds. Sci Data 7:150, https://doi.org/10.1038/s41597-020-0494-7. Licence of the data and of this
# file: CC BY 4.0, https://creativecommons.org/licenses/by/4.0/. Its authors do not endorse this
# project.
"""


def tables(data: Path) -> tuple[Path, list[Path]]:
    """The strides, and the tables of people."""
    people = ["gps/amputee_subjects.csv", "gps/parkinson_subjects.csv"]
    return data / "gps" / "strides.csv", [
        *(data / each for each in people),
        data / "wbds" / "WBDS_subjects_merged.csv",
    ]


def true_moments(data: Path) -> dict[tuple[str, str], Array]:
    """Ankle moment (101,) Nm/kg, dorsiflexion positive, at the speed of the strides, by person and
    side ("prosthetic", "intact").

    A person's speeds are 0.4, 0.5, … m/s or 0.6, 0.8, … (by the ratio of the slowest two), of which
    the file has the dimensionless ones.
    """
    found: dict[tuple[str, str], dict[float, Array]] = {}
    with (data / "amputee" / "ankle.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["quantity"] == "ankle_moment_nm_kg":
                curve = np.array([float(row[f"p{each}"]) for each in range(101)])
                known = found.setdefault((row["subject"], row["side"]), {})
                known[float(row["dimensionless_speed"])] = curve
    chosen = {}
    for (subject, side), curves in found.items():
        slowest, second = sorted(curves)[:2]
        first, step = (0.4, 0.1) if second / slowest < 1.29 else (0.6, 0.2)
        wanted = 0.7 if subject == "TF02" else 0.8
        number = round((wanted - first) / step)
        chosen[subject, side] = curves[sorted(curves)[number]]
    return chosen


def ends(moment: Array) -> float:
    """Phase at which an ankle's moment (101,), plantarflexor negative, has fallen to `ENDED`."""
    share = moment / moment.min()
    after = int(np.argmin(moment)) + int(np.argmax(share[np.argmin(moment) :] <= ENDED))
    # falls from the sample before to this one
    return float(np.interp(-ENDED, -share[after - 1 : after + 1], PHASE[after - 1 : after + 1]))


def bias() -> float:
    """By how much later the moment ends than the angles have the foot leave the ground, of the
    cycle: mean of both sides of the ten built-in people.
    """
    found = []
    for subject in builtin_subjects():
        record = subject.record()
        stance = feet(record.angles, subject.left_phase, scale_subject(subject).model).stance
        found += [
            ends(record.moments[f"ankle_angle_{side[0]}"](PHASE)) - stance[side] for side in SIDES
        ]
    return float(np.mean(found))


def figures(patient: Patient, side: Side, moment: Array, usual: float) -> tuple[float, float]:
    """`later` and `larger` of a patient with the measured `moment` (101,) Nm/kg of the sound
    `side`; `usual` as `bias` gives it.
    """
    others, subject = builtin_subjects(), patient.subject
    model = scale_subject(subject, symmetric=not two_sided(patient.person)).model
    record = with_others_kinetics(subject, others)
    stance = dict(feet(record.angles, subject.left_phase, model).stance)
    later = ends(moment) - stance[side] - usual
    stance[side] += later
    usual_record = expected_record(subject, others)
    expected = rolled_ankle(over_stance(record, stance), usual_record, side, model)(PHASE)
    return later, float(expected @ moment / (expected @ expected))


@cache
def _patients(data: Path) -> list[Patient]:
    """All of the strides, for the four files."""
    strides, people = tables(data)
    return found_patients(strides, people, SPEEDS, [HEALTHY])


def _amputees(data: Path, kind: str) -> Iterator[tuple[Patient, Side, Array]]:
    """Those whose ankle moment on a side ("intact", "prosthetic") was measured, and it."""
    truth = true_moments(data)
    for each in _patients(data):
        moment = truth.get((each.subject.identifier, kind))
        if each.person.amputation is not None and moment is not None:
            side = each.person.amputation
            yield each, side if kind == "prosthetic" else opposite(side), moment


def _file(table: str, people: int, rows: Sequence[Sequence[object]]) -> str:
    return ABOUT[table].format(people=people) + SOURCE + csv_text(rows)


def sound_sides(data: Path) -> str:
    """The file of that name."""
    usual = bias()
    rows = [
        (each.subject.identifier, f"{later:.4f}", f"{larger:.3f}")
        for each, side, moment in _amputees(data, "intact")
        for later, larger in [figures(each, side, moment, usual)]
    ]
    return _file(TABLE, len(rows), [("person", "later", "larger"), *rows])


def sound_rests(data: Path) -> str:
    """The file of that name."""
    others, rows = builtin_subjects(), []
    for each, side, moment in _amputees(data, "intact"):
        subject = each.subject
        model = scale_subject(subject, symmetric=not two_sided(each.person)).model
        known = with_others_kinetics(subject, others)
        record = over_stance(known, subject.stance_fraction.of_both())
        usual, larger = expected_record(subject, others), expected_of(subject.identifier).larger
        rest = moment - sound_ankle(subject, record, usual, side, model, larger)(PHASE)
        rows.append((subject.identifier, *(f"{value:.4f}" for value in rest)))
    columns = ("person", *(f"p{each}" for each in range(101)))
    return _file(RESTS, len(rows), [columns, *rows])


def prosthetic_sides(data: Path) -> str:
    """The file of that name."""
    usual = bias()
    rows = [
        (each.subject.identifier, f"{figures(each, side, moment, usual)[0]:.4f}")
        for each, side, moment in _amputees(data, "prosthetic")
    ]
    return _file(PROSTHETIC_TABLE, len(rows), [("person", "later"), *rows])


def prosthetic_rests(data: Path) -> str:
    """The file of that name."""
    others, rows = builtin_subjects(), []
    for each, side, moment in _amputees(data, "prosthetic"):
        model = scale_subject(each.subject, symmetric=not two_sided(each.person)).model
        record = known_record(each.subject, others, model, side)
        found, name = with_passive_foot(record, model, side), f"ankle_angle_{side[0]}"
        for curve, values in (
            ("angle", record.angles[name](PHASE)),
            ("rest", moment - found.moments[name](PHASE)),
        ):
            rows.append((each.subject.identifier, curve, *(f"{value:.4f}" for value in values)))
    columns = ("person", "curve", *(f"p{each}" for each in range(101)))
    return _file(PROSTHETIC_RESTS, len(rows) // 2, [columns, *rows])


def ankle_errors(data: Path) -> Iterator[str]:
    """RMSE of the expected ankle moments, Nm/kg, mean over people, of each kind of side."""
    others = builtin_subjects()
    for kind in ("intact", "prosthetic"):
        errors = [
            float(np.sqrt(((expected_ankles(each, others)[side](PHASE) - moment) ** 2).mean()))
            for each, side, moment in _amputees(data, kind)
        ]
        yield f"{kind}: {np.mean(errors):.3f} Nm/kg, {len(errors)} people"


def main() -> None:
    """Command line; see the module's docstring."""
    arguments = parser_of(__doc__).parse_args()
    for name, make in (
        (TABLE, sound_sides),
        (PROSTHETIC_TABLE, prosthetic_sides),
        (RESTS, sound_rests),
        (PROSTHETIC_RESTS, prosthetic_rests),
    ):
        ship({FOLDER / name: make}, arguments, "sound_sides")
        rows_of.cache_clear()
    print("\n".join(ankle_errors(arguments.data)))


if __name__ == "__main__":
    main()
