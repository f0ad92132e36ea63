"""What a person's own training adds to the general policy, for people whom it has never seen.

    python -m experiments.own_training run --from FOLDER [--work FOLDER]
    python -m experiments.own_training table

`PEOPLE` were chosen before anybody of them had walked: recordings of five laboratories, none of
which recorded anybody of the general policy, with the forces of both feet, from a child of 15 with
torsional deformities to a man who walks at 0.39 m/s. Each is studied with own samples of several
numbers and with several seeds, and without any. Everything else is the same: body, reference and
identification are found once for each person and seed.

With own samples it is the trained policy that walks, although a study hands on the start where the
training made something worse. What would have been handed on is kept beside it. `run` writes each
study into the folder of --work and may be started again, and several times at once; `table` writes
`reports/general/own_training.json` and the table of docs/learning.md.
"""

import argparse
import fcntl
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from gaitval.artefacts import copy_file, copy_files, write_json

ROOT: Final = Path(__file__).resolve().parent.parent
WORK: Final = ROOT / "reports" / "own-training"
PEOPLE: Final = (
    "gait2354",
    "lux, 0.39 m/s",
    "Rajagopal walk",
    "cp2 at 15",
    "aalborg, floor 2 cm below zero",
)
"""Names in evidence/anybody/recordings.toml and experiments/public_recordings.toml."""
MOST: Final = 2_000_000
SEEDS: Final = 5
POINTS: Final = (500_000, 50_000, 4_096)
"""Numbers of own samples between none and the most."""
FINISHED: Final = "metrics.json"


def short(name: str) -> str:
    """A person's name as that of a folder."""
    return "".join(each if each.isalnum() else "-" for each in name)


def jobs(people: Sequence[str], seeds: int) -> Iterator[tuple[str, int, int]]:
    """Person, seed and number of own samples of each study, the most needed ones first."""
    first, others = people[:3], people[3:]
    for group, numbers in ((first, (0, MOST)), (others, (0, MOST)), (people, POINTS)):
        for seed in range(seeds):
            for name in group:
                for samples in numbers:
                    yield name, seed, samples


def strangers_listed() -> list[dict[str, Any]]:
    """The public recordings that should become subjects, but for those of the laboratory that
    recorded the people of the general policy.
    """
    from evidence.anybody.recordings import _listed as patients
    from experiments.public_recordings import listed

    return [
        each
        for each in (*patients(), *listed())
        if not each.get("refused") and not each.get("drafted") and "WBDS" not in each["laboratory"]
    ]


def imported(name: str, clones: Path, work: Path) -> Path:
    """The file of a subject; the recording is imported if that has not been done."""
    from experiments.public_recordings import OPTIONS, _marker_set, local_file, several
    from gaitval.configuration import load_configuration
    from gaitval.session.importing import import_files
    from gaitval.session.request import ImportOptions, checked

    folder = work / "people" / short(name)
    if not (folder / "subject.toml").is_file():
        (recording,) = [each for each in strangers_listed() if each["name"] == name]
        with tempfile.TemporaryDirectory() as temporary:
            files = {
                key: [
                    local_file(path, clones, Path(temporary))
                    for path in several(recording.get(key))
                ]
                for key in ("static", "trials", "forces", "functional")
            }
            options = {
                **{key: recording[key] for key in OPTIONS if key in recording},
                **{key: files[key] for key in ("trials", "forces", "functional")},
                **_marker_set(recording),
                "static": next(iter(files["static"]), None),
            }
            import_files(
                checked(ImportOptions, options),
                folder,
                configuration=load_configuration(),
                tell=lambda step, message: None,
            )
    return folder / "subject.toml"


def study(subject: Path, folder: Path, seed: int, samples: int) -> None:
    """Study a subject in `folder` with a number of own samples, or without any; its metrics, and
    what its training gave, go to the sub-folder `samples`.
    """
    from gaitval.configuration import load_configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.study import stages
    from gaitval.study.inputs import GAIN, NEED, POLICY_FILES
    from gaitval.study.run import choose_start
    from gaitval.study.stage import Observer, Stage, open_run, run_stage

    settings = [
        f"seed={seed}",
        f"training.samples={samples or 'auto'}",
        "training.workers=1",
        "identification.rounds=1",
    ]
    configuration = load_configuration(settings=settings)
    with open_run(load_subject(subject), configuration, folder, Observer()) as run:

        def do(stage: Stage) -> None:
            run_stage(stage, run.folder, force=False, observer=run.observer)

        do(stages.scale_stage(run))
        do(stages.reference_stage(run))
        do(stages.identify_stage(run, 1))
        choose_start(run, stages.train_stage(run, 1))
        do(stages.need_stage(run, 1))
        if not samples:  # whatever this person needs
            write_json(run.folder / "rounds/1" / NEED, {"needed": False})
        do(stages.train_stage(run, 1))
        do(stages.hand_on_stage(run, 1))
        policy = run.folder / "rounds/1/policy"
        copy_files(run.folder / "rounds/1/trained", policy, POLICY_FILES)
        do(stages.evaluate_stage(run, 1))
        do(stages.choose_stage(run, 1))
        for stage in (
            stages.correct_stage,
            stages.simulate_stage,
            stages.repeat_stage,
            stages.push_stage,
            stages.validate_stage,
        ):
            do(stage(run))
        kept = run.folder / str(samples)
        copy_file(policy / GAIN, kept / GAIN)
        copy_file(run.folder / "metrics.json", kept / FINISHED)


@contextmanager
def claimed(folder: Path) -> Iterator[bool]:
    """Whether no other process works in `folder`, which is kept for this one meanwhile."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with folder.with_suffix(".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        yield True


def run(arguments: argparse.Namespace) -> None:
    """Do every study that is lacking and that no other process does."""
    for name in arguments.people:
        with claimed(arguments.work / "people" / short(name)) as free:
            if free:
                imported(name, arguments.clones, arguments.work)
    for name, seed, samples in jobs(arguments.people, arguments.seeds):
        folder = arguments.work / f"{short(name)}-{seed}"
        with claimed(folder) as free:
            if not free or (folder / str(samples) / FINISHED).is_file():
                continue
            print(f"{name}, seed {seed}, {samples:,} samples", flush=True)
            subject = arguments.work / "people" / short(name) / "subject.toml"
            study(subject, folder, seed, samples)


def main() -> None:
    """Run the studies."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(required=True)
    runs = commands.add_parser("run")
    runs.set_defaults(do=run)
    runs.add_argument("--from", dest="clones", type=Path, required=True, help="of the clones")
    runs.add_argument("--work", type=Path, default=WORK)
    runs.add_argument("--people", nargs="+", default=PEOPLE)
    runs.add_argument("--seeds", type=int, default=SEEDS)
    arguments = parser.parse_args()
    arguments.do(arguments)


if __name__ == "__main__":
    main()
