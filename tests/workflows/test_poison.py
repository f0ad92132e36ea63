"""With everything that a run is not told replaced by NaN, it is bit for bit the same."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from quick_settings import QUICK

from gaitval.configuration import load_configuration
from gaitval.study.identification_stages import choose_stage, evaluate_stage, identify_stage
from gaitval.study.learning_stages import hand_on_stage, need_stage, train_stage
from gaitval.study.predicted_study import (
    adopt_stage,
    predicted_correction_stage,
    predicted_walk_stage,
    run_range,
)
from gaitval.study.run import choose_start
from gaitval.study.scaling_stages import reference_stage, scale_stage
from gaitval.study.stage import Observer, Run, open_run, run_stage
from gaitval.study.walking_stages import correct_stage, simulate_stage
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import load_subject

NAN = float("nan")
SETTINGS = (
    *QUICK,
    "correction.steps=2",
    "correction.harmonics=0",
    "identification.method=shared",
)


def poisoned_curve(curve):
    poison = tuple(NAN for _ in curve.cosine)
    return curve.model_copy(update={"mean": NAN, "cosine": poison, "sine": poison})


def poisoned_gait(gait, *, angles: bool):
    forces = {
        side: getattr(gait.forces, side).model_copy(
            update={axis: poisoned_curve(getattr(getattr(gait.forces, side), axis))
                    for axis in ("forward", "left", "up")}
        )
        for side in ("right", "left")
    }  # fmt: skip
    update = {
        "moments": {name: poisoned_curve(curve) for name, curve in gait.moments.items()},
        "forces": gait.forces.model_copy(update=forces),
    }
    if angles:
        update["angles"] = {name: poisoned_curve(curve) for name, curve in gait.angles.items()}
    return gait.model_copy(update=update)


def without_kinetics(subject: Subject) -> Subject:
    """All that plates had a part in is NaN, in every trial."""

    def poison(part):
        nowhere = part.stance_fraction.model_copy(update={"right": NAN, "left": NAN})
        plates = part.plates and part.plates.model_copy(
            update=dict.fromkeys(type(part.plates).model_fields, NAN)
        )
        return {
            "gait": poisoned_gait(part.gait, angles=False),
            "stance_fraction": nowhere,
            "left_phase_from_force": NAN,
            "mean_vertical_force": NAN,
            "plates": plates,
        }

    trials = tuple(trial.model_copy(update=poison(trial)) for trial in subject.trials)
    return subject.model_copy(update={**poison(subject), "trials": trials})


def without_trial(subject: Subject, name: str) -> Subject:
    """A trial of which nothing is known but its name and speed."""
    (trial,) = (trial for trial in subject.trials if trial.name == name)
    nowhere = trial.stance_fraction.model_copy(update={"right": NAN, "left": NAN})
    poisoned = trial.model_copy(
        update={
            "gait": poisoned_gait(trial.gait, angles=True),
            "stance_fraction": nowhere,
            "stride_time_s": NAN,
            "left_phase": NAN,
            "left_phase_from_force": NAN,
            "mean_vertical_force": NAN,
        }
    )
    trials = tuple(poisoned if each is trial else each for each in subject.trials)
    return subject.model_copy(update={"trials": trials})


def hashes(folder: Path) -> dict[str, str]:
    """Of all that a run computed; the records of stages name the subject's file."""
    about = ("subject.toml", "stages.json", "provenance.json", "training.csv")
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
        and path.name not in about
        and not path.name.startswith(".")
        and "tensorboard" not in path.parts
    }


def main_job(run: Run) -> None:
    """Every stage up to the comparison."""
    for stage in (scale_stage, reference_stage):
        run_stage(stage(run), run.folder)
    choose_start(run, train_stage(run, 1))
    for stage in (need_stage, train_stage, identify_stage, hand_on_stage, evaluate_stage):
        run_stage(stage(run, 1), run.folder)
    run_stage(choose_stage(run, 1), run.folder)
    run_stage(correct_stage(run), run.folder)
    run_stage(simulate_stage(run, second_engine=False), run.folder)


def predicted(run: Run) -> None:
    """A policy of the range and the predicted walk, up to the comparison."""
    run_range(run)
    for stage in (
        reference_stage(run),
        adopt_stage(run, run.folder),
        predicted_correction_stage(run),
        predicted_walk_stage(run),
    ):
        run_stage(stage, run.folder)


def the_reference(run: Run) -> None:
    """What is walked after: of the whole run it is what reads the record most."""
    for stage in (scale_stage, reference_stage):
        run_stage(stage(run), run.folder)


def same_as_clean(folder: Path, settings, poison, job) -> dict[str, str]:
    """Hashes of a run's files, which are the same with the poison."""
    configuration = load_configuration(settings=[*SETTINGS, *settings])
    subject = load_subject("S05")
    found = []
    for name, person in (("clean", subject), ("poisoned", poison(subject))):
        with open_run(person, configuration, folder / name, Observer()) as run:
            job(run)
        found.append(hashes(folder / name))
    assert found[0] == found[1]
    return found[0]


def test_the_reference_reads_nothing_that_is_not_told(tmp_path):
    kinematics = ("record.use=kinematics",)
    found = same_as_clean(tmp_path, kinematics, without_kinetics, the_reference)
    assert {"reference.npz", "model.urdf"} <= found.keys()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "poison", "job"),
    [
        (("record.use=kinematics",), without_kinetics, main_job),
        (('record.holdout="T03"',), lambda subject: without_trial(subject, "T03"), predicted),
    ],
    ids=["kinematics", "held-out trial"],
)
def test_what_is_not_told_is_read_by_nothing_before_the_comparison(
    tmp_path, monkeypatch, settings, poison, job
):
    # Enough to show it, and a third of it.
    monkeypatch.setattr("gaitval.study.predicted_tasks.SPEEDS", 2)
    found = same_as_clean(tmp_path, settings, poison, job)
    assert {"reference.npz", "policy/policy.safetensors", "rollouts/nominal.npz"} <= found.keys()


def test_the_poison_kills_a_run_that_is_told_it(tmp_path):
    """Else the test above would prove nothing."""
    person = without_kinetics(load_subject("S05"))
    record = person.record()
    assert not np.isfinite(record.moments["hip_flexion_r"](0.3))
    assert not np.isfinite(record.ground_reaction("right", 0.3)).any()
    configuration = load_configuration(settings=SETTINGS)
    with open_run(person, configuration, tmp_path, Observer()) as run:
        run_stage(scale_stage(run), run.folder)
        with pytest.raises(Exception, match=r".+"):
            run_stage(reference_stage(run), run.folder)
