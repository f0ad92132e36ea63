"""A treadmill with one plate: recordings with a plate under each foot, whose plates are made one.

The import divides its force (`--divide-plates`), and what each foot then has is compared with what
its own plate measured. Its constants were chosen on four other people of `gaitval virtual`. The
opponent lets the load go over in a straight line of time.
"""

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

import numpy as np

import claims
from claims import Claim
from gaitval.apps.virtual.recording import recorded_person
from gaitval.arrays import Array
from gaitval.configuration import load_configuration
from gaitval.coordinates import SIDES
from gaitval.datasets.subject_file import load_subject
from gaitval.gait import divided
from gaitval.gait.foot_forces import _moment
from gaitval.importing.importing import import_files
from gaitval.mocap.c3d_writing import write_c3d
from gaitval.mocap.force_plates import plate_axes
from gaitval.mocap.pressed_plates import plate_under
from gaitval.mocap.recording import Recording
from gaitval.session import trial
from gaitval.session.request import ImportOptions
from gaitval.study.stored_policy import general_walker

AROUND: Final = ("S02", "S07", "S09")
"""Whose bodies and gaits the virtual people are drawn around; those that the constants were chosen
on, around S05."""
SEED: Final = 13
PHASES: Final = np.arange(200) / 200
SAGITTAL: Final = ("hip_flexion", "knee_angle", "ankle_angle")


def as_one(recording: Recording) -> Recording:
    """A `recording`, zeroed and in the project's axes, whose plates are one."""
    plates = recording.plates
    corners = np.concatenate([plate.corners for plate in plates])
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, y, z = np.stack([low, high], axis=1)
    # Clockwise from above, so that its third axis points down, as plates have it.
    around = np.array(
        [[x[1], y[0], z[0]], [x[0], y[0], z[0]], [x[0], y[1], z[0]], [x[1], y[1], z[0]]]
    )
    assert plate_axes(around)[2, 2] < 0.0
    force = sum((plate.force for plate in plates), np.zeros_like(plates[0].force))
    moment = sum((_moment(plate) for plate in plates), np.zeros_like(force))
    return replace(recording, plates=(plate_under("1", around, force, moment),))


def recordings(data: Path, folder: Path) -> dict[str, ImportOptions]:
    """What is imported, by name: a person on a treadmill, virtual people around three others."""
    raw = data / "wbds" / "raw"
    found = {
        "WBDS01 T01": ImportOptions(
            static=raw / "WBDS01static1.c3d",
            trials=(raw / "WBDS01walkT01.c3d",),
            mass=74.3,
            height=1.71,
            sex="M",
        )
    }
    configuration = load_configuration()
    policy = general_walker(configuration.environment)
    for number, around in enumerate(AROUND):
        person = load_subject(around)
        made = recorded_person(number, SEED, person, policy, configuration)
        for trial_name, each in (("standing", made.standing), ("walking", made.walking)):
            (folder / around).mkdir(exist_ok=True)
            write_c3d(folder / around / f"{trial_name}.c3d", each)
        found[f"virtual, around {around}"] = ImportOptions(
            static=folder / around / "standing.c3d",
            trials=(folder / around / "walking.c3d",),
            mass=person.mass_kg,
            height=person.height_m,
            sex=person.sex,
            belt=made.belt,
        )
    return found


def errors(right: Any, found: Any) -> dict[str, float]:
    """Root mean squares over a cycle, worse side, of two records: forces % of body weight, and the
    mean of the sagittal moments Nm/kg.
    """
    differences = [
        found.ground_reaction(s, PHASES) - right.ground_reaction(s, PHASES) for s in SIDES
    ]
    forces = 100.0 * np.sqrt(np.mean(np.square(differences), axis=1)).max(axis=0)
    moments = [
        np.sqrt(np.mean((found.moments[name](PHASES) - right.moments[name](PHASES)) ** 2))
        for side in "rl"
        for name in (f"{joint}_{side}" for joint in SAGITTAL)
    ]
    values = (*forces, np.mean(moments))
    return dict(
        zip(("forward", "sideways", "vertical", "moments"), map(float, values), strict=True)
    )


@claims.measured("data")
def one_plate(given: claims.Given) -> list[Claim]:
    """What each foot has of one plate under both, against its own plate."""
    configuration, seen, plain = load_configuration(), [], []
    zero = trial.zero_plates  # type: ignore[attr-defined]

    def made_one(recording: Recording, **options: Any) -> tuple[Recording, Any]:
        zeroed, findings = zero(recording, **options)
        return as_one(zeroed), findings

    def straight(passed: Array, *_: object) -> Array:
        return np.linspace(0.0, 1.0, len(passed))

    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)

        def imported(options: ImportOptions, out: str) -> Any:
            return import_files(options, folder / out, configuration=configuration).subject.record()

        for name, options in recordings(given.data, folder).items():
            own = imported(options, f"{name} own")
            dividing = options.model_copy(update={"divide_plates": True})
            with patch.object(trial, "zero_plates", made_one):
                seen.append(errors(own, imported(dividing, f"{name} divided")))
                with patch.object(divided, "_share", straight):
                    plain.append(errors(own, imported(dividing, f"{name} straight")))
            print(f"{name}: {_text(seen[-1])}; straight line: {_text(plain[-1])}")

    def worst(of: Callable[[dict[str, float]], float], cases: list[dict[str, float]]) -> float:
        return max(of(each) for each in cases)

    rows = [
        Claim(
            f"one plate under both feet, divided: {name} force, root mean square error, worst",
            worst(lambda each, name=name: each[name], seen),
            "% BW",
            len(seen),
        )
        for name in ("forward", "sideways", "vertical")
    ]
    whole, line = (float(np.mean([each["vertical"] for each in cases])) for cases in (seen, plain))
    return [
        *rows,
        Claim(
            "one plate under both feet, divided: sagittal moments, root mean square error, worst",
            worst(lambda each: each["moments"], seen),
            "Nm/kg",
            len(seen),
        ),
        Claim(
            "one plate under both feet, divided: vertical force, mean error over a straight line's",
            whole / line,
            "1",
            len(seen),
        ),
    ]


def _text(found: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in found.items())
