"""Motions with moments from a folder: of an import, whole or refused, or of a run."""

from pathlib import Path

from gaitval.errors import ArtefactError
from gaitval.kinetics.musculature.gait import LoadedMotion


def motions_in(folder: Path, *, height: float | None = None) -> list[LoadedMotion]:
    """What an import or a run in `folder` has. `height` m of the person counts for imports; of
    which no file says it where they were refused.

    Raises ArtefactError if there is neither, or the run kept no walk; RecordError without moments.
    """
    from gaitval._internal.io.artefacts import there_below
    from gaitval.metrics.results import METRICS
    from gaitval.session.importing.stored_motions import is_import, stored_motions

    if is_import(folder):
        return stored_motions(folder, height=height)
    if (folder / METRICS).is_file():
        return [_walked(folder)]
    raise ArtefactError(
        f"{folder}: neither {METRICS} of a run nor recording/trial1_ik.mot of an import. Give the "
        "folder that `gaitval subject` or `gaitval import --out` wrote."
        f"{there_below(folder, METRICS)}"
    )


def _walked(folder: Path) -> LoadedMotion:
    from gaitval.configuration import load_configuration
    from gaitval.metrics.cycles import find_cycles
    from gaitval.metrics.walk_muscles import lost_joints, person_and_laden, walk_motion
    from gaitval.model.urdf import read_urdf
    from gaitval.subjects.subject_file import load_subject
    from gaitval.walk.simulation.rollout import Rollout

    kept = [folder / "rollouts" / f"{name}.npz" for name in ("identified", "nominal")]
    path = next((each for each in kept if each.is_file()), None)
    if path is None:
        raise ArtefactError(
            f"{folder}: holds the results of a run, but not its walk (rollouts/identified.npz). "
            "Stored baselines do not: give the run folder, or make it with `gaitval subject`."
        )
    subject = load_subject(folder / "subject.toml")
    configuration = load_configuration(folder / "configuration.toml")
    rollout = Rollout.load(path)
    cycles = find_cycles(rollout, configuration).first(configuration.validation.cycles)
    whole = read_urdf(folder / "model.urdf")
    body, laden = person_and_laden(whole, rollout.mu, configuration.record)
    return walk_motion(
        rollout,
        cycles,
        body,
        height=subject.height_m,
        name=subject.identifier,
        lost=lost_joints(subject),
        laden=laden,
    )
