"""What a person's own training adds to the general policy, for people whom it has never seen.

    python -m experiments.own_training run --from FOLDER [--work FOLDER]
    python -m experiments.own_training table

`PEOPLE` were chosen before this comparison had a result: recordings of five laboratories, none of
which recorded anybody of the general policy, with the forces of both feet, from a child of 15 with
torsional deformities to a man who walks at 0.39 m/s. Each is studied with own samples of several
numbers and with several seeds, and without any.

Without own samples nothing is random but the search of the identification: seed 0 stands for all,
and the further ones say how much that scatters. Body, reference and identification of the trained
studies are those of seed 0.

With own samples it is the trained policy that walks, although a study hands on the start where the
training made something worse. What would have been handed on is kept beside it. `run` writes each
study into the folder of --work and may be started again, and several times at once; `table` writes
`reports/general/own_training.json` and the table of docs/learning.md.
"""

import argparse
import fcntl
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

import evidence
from evidence.marked_table import spread, with_table
from gaitval.artefacts import copy_file, copy_files, read_json, versions, write_json, write_text
from gaitval.study.inputs import GAIN

ROOT: Final = Path(__file__).resolve().parent.parent
STORE: Final = ROOT / "reports" / "general" / "own_training.json"
PAGE: Final = ROOT / "docs" / "learning.md"
COMMAND: Final = "python -m experiments.own_training table --rows"
WORK: Final = ROOT / "reports" / "own-training"
WHERE: Final = "own training of strangers, public imports with forces of both feet"
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
SCATTER: Final = 3
"""Seeds of the other numbers of samples, and of none."""
POINTS: Final = (500_000, 50_000, 4_096)
"""Numbers of own samples between none and the most."""
FINISHED: Final = "metrics.json"
QUANTITIES: Final = ("angles", "moments", "vertical")
DRAWS: Final = 2000
"""Of the bootstrap."""
Json = dict[str, Any]
MEASURES = {
    "*": {
        "code": (
            "@walk",
            "experiments/own_training.py:study,figures,pairs,walking,handed_on,ratio,kept",
        ),
        "results": ("reports/general/own_training.json",),
        "allowed": 120,
        "why": "ratios of two walks of the same code, and shares of goals: what changes both alike "
        "leaves them, and tests/policy and gaitval check say whether walks and learning do",
    },
}
"""What the rows depend on; see evidence/stale.py."""


def short(name: str) -> str:
    """A person's name as that of a folder."""
    return "".join(each if each.isalnum() else "-" for each in name)


def jobs(people: Sequence[str], seeds: int) -> Iterator[tuple[str, int, int]]:
    """Person, seed and number of own samples of each study, the most needed ones first."""
    first, others = people[:3], people[3:]
    for group in (first, others):
        for seed in range(seeds):
            for name in group:
                if seed == 0:
                    yield name, 0, 0
                yield name, seed, MOST
    for number in (*POINTS, 0):
        for seed in range(1 if number == 0 else 0, SCATTER):
            for name in people:
                yield name, seed, number


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


def by_name(name: str) -> dict[str, Any]:
    """The one of those recordings with this name."""
    (recording,) = [each for each in strangers_listed() if each["name"] == name]
    return recording


def imported(recording: Mapping[str, Any], clones: Path, work: Path) -> Path:
    """The file of a subject; the `recording` is imported if that has not been done."""
    from experiments.public_recordings import OPTIONS, _marker_set, local_file, several
    from gaitval.configuration import load_configuration
    from gaitval.importing.importing import import_files
    from gaitval.session.request import ImportOptions, checked

    folder = work / "people" / short(recording["name"])
    if not (folder / "subject.toml").is_file():
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


def study(
    subject: str,
    folder: Path,
    seed: int,
    samples: int,
    body: Path | None = None,
    general: Path | None = None,
) -> None:
    """Study a subject in `folder` with a number of own samples, or without any; its metrics, and
    what its training gave, go to the sub-folder `samples`. Reference and identification are those
    of the study in the folder `body`, if one is given; the policy to start from is that in the
    folder `general`, if it is not the shipped one.
    """
    from gaitval.configuration import load_configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.study import stages
    from gaitval.study.inputs import IDENTIFIED, NEED, POLICY_FILES, STANDING
    from gaitval.study.run import choose_start
    from gaitval.study.stage import Observer, Stage, open_run, run_stage

    settings = [
        f"seed={seed}",
        f"training.samples={samples or 'auto'}",
        "training.workers=1",
        "identification.rounds=1",
        "pushes.directions=4",  # of the largest push, which is not looked at here
    ]
    configuration = load_configuration(settings=settings)
    with open_run(load_subject(subject), configuration, folder, Observer()) as run:

        def do(stage: Stage) -> None:
            run_stage(stage, run.folder, force=False, observer=run.observer)

        do(stages.scale_stage(run))
        if body is None:
            do(stages.reference_stage(run))
            do(stages.identify_stage(run, 1))
        else:
            copy_files(body, run.folder, ("reference.npz",))
            found = "rounds/1/identification"
            names = ("identification.json", IDENTIFIED)
            copy_files(body / found, run.folder / found, names)
            copy_files(body / "rounds/1", run.folder / "rounds/1", (STANDING,))
        choose_start(run, stages.train_stage(run, 1))
        if general is not None:
            copy_files(general, run.folder / "start", POLICY_FILES)
        if not (run.folder / "rounds/1" / STANDING).is_file():
            do(stages.need_stage(run, 1))
        if not samples:  # whatever this person needs
            write_json(run.folder / "rounds/1" / NEED, {"needed": False})
        do(stages.train_stage(run, 1))
        do(stages.hand_on_stage(run, 1))
        policy, kept = run.folder / "rounds/1/policy", run.folder / str(samples)
        copy_file(policy / GAIN, kept / GAIN)
        copy_files(run.folder / "rounds/1/trained", policy, POLICY_FILES)
        write_json(policy / GAIN, read_json(policy / GAIN) | {"handed_on": "trained"})
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
                imported(by_name(name), arguments.clones, arguments.work)
    for name, seed, samples in jobs(arguments.people, arguments.seeds):
        subject = arguments.work / "people" / short(name) / "subject.toml"
        study_once(arguments.work, name, seed, samples, str(subject))


def study_once(
    work: Path, name: str, seed: int, samples: int, subject: str, general: Path | None = None
) -> None:
    """`study` in `work`, unless it is finished or another process is at it, or at its body."""
    folder = place(work, name, seed, samples)
    body = None if samples == 0 or seed == 0 else place(work, name, 0, 0)
    with claimed(folder) as free:
        if not free or (folder / str(samples) / FINISHED).is_file():
            return
        if body and not (body / "0" / FINISHED).is_file():
            return
        print(f"{name}, seed {seed}, {samples:,} samples", flush=True)
        study(subject, folder, seed, samples, body, general)


def place(work: Path, name: str, seed: int, samples: int) -> Path:
    """The folder of a study; those of a seed that share a body share it."""
    return work / f"{short(name)}-{seed}{'' if samples or not seed else '-untrained'}"


def reached(metrics: Json) -> dict[str, bool]:
    """Goals of a study: "measure target" to whether the walk reaches it."""
    return {
        _named(row): bool(row["reached"])
        for row in metrics["tolerances"]
        if row["role"] == "acceptance" and row["goal"] is not None
    }


def figures(metrics: Json, gain: Json) -> Json:
    """What counts of a study: mean errors of both sides, goals, limits, pushes and falls.

    Angles (deg) and moments (Nm/kg) are those of hip, knee and ankle in the sagittal plane, the
    vertical force is in % of body weight. A walk that falls before a whole cycle has none.
    """
    walk = metrics["walks"][metrics["final"]]
    errors = walk["errors"]
    curves = {
        "angles": ("hip_flexion", "knee_angle", "ankle_angle"),
        "moments": ("hip_flexion", "knee_angle", "ankle_angle"),
        "vertical": ("vertical",),
    }
    found: Json = {}
    for quantity, names in curves.items():
        kind = "forces" if quantity == "vertical" else quantity
        values = [errors[kind][f"{name}_{side}"] for name in names for side in "rl"]
        complete = all(value is not None for value in values)
        found[quantity] = float(np.mean([each["rmse"] for each in values])) if complete else None
    judged = [row for row in metrics["tolerances"] if row["role"] == "acceptance"]
    survived = metrics["push_recovery"]["survived"]
    return found | {
        "goals": reached(metrics),
        "limits": {_named(row): bool(row["passed"]) for row in judged},
        "pushes": int(np.sum(survived)),
        "of pushes": int(np.size(survived)),
        "falls": sum(start["fell"] for start in walk["starts"]),
        "of starts": len(walk["starts"]),
        "gain": {key: gain[key] for key in ("start", "trained", "handed_on")},
    }


def _named(row: Json) -> str:
    return f"{row['measure']} {row['target'] or ''}".strip()


def collected(work: Path, people: Sequence[str] = PEOPLE) -> list[Json]:
    """The figures of each study of some `people` that is finished in `work`."""
    found = []
    for name in people:
        for seed in range(SEEDS):
            for samples in (0, *sorted(POINTS), MOST):
                folder = place(work, name, seed, samples) / str(samples)
                if (folder / FINISHED).is_file():
                    about: Json = {"person": name, "seed": seed, "samples": samples}
                    read = [read_json(folder / each) for each in (FINISHED, GAIN)]
                    found.append(about | figures(*read))
    return found


def pairs(studies: Sequence[Json], samples: int = MOST) -> dict[str, list[tuple[Json, Json]]]:
    """By person, each study with so many own samples after that of the same body without any."""
    first = {each["person"]: each for each in studies if each["samples"] == each["seed"] == 0}
    found: dict[str, list[tuple[Json, Json]]] = {}
    for trained in studies:
        person = trained["person"]
        if trained["samples"] == samples and person in first:
            found.setdefault(person, []).append((first[person], trained))
    return found


def walking(
    found: Mapping[str, Sequence[tuple[Json, Json]]],
) -> dict[str, list[tuple[Json, Json]]]:
    """Of `pairs`, those of whom both walk a whole cycle: a fall before that has no errors."""
    both = {
        person: [pair for pair in each if all(one["angles"] is not None for one in pair)]
        for person, each in found.items()
    }
    return {person: each for person, each in both.items() if each}


def handed_on(without: Json, trained: Json) -> Json:
    """Of two studies, the one of the policy that gaitval hands on."""
    return trained if trained["gain"]["handed_on"] == "trained" else without


class Ratio(NamedTuple):
    """Of errors, geometric mean over people and seeds, and its interval of 90 %."""

    mean: float
    low: float
    high: float


def ratio(found: Mapping[str, Sequence[tuple[Json, Json]]], quantity: str) -> Ratio:
    """Error of a quantity without own training over that with it.

    The interval is that of a bootstrap over people, and over the seeds of each.
    """
    logs = [
        np.array([np.log(without[quantity] / trained[quantity]) for without, trained in each])
        for each in found.values()
    ]
    random = np.random.default_rng(0)
    drawn = [
        np.mean(
            [
                np.mean(random.choice(logs[person], len(logs[person])))
                for person in random.integers(len(logs), size=len(logs))
            ]
        )
        for _ in range(DRAWS)
    ]
    low, high = np.percentile(drawn, (5.0, 95.0))
    mean = np.mean([np.mean(each) for each in logs])
    return Ratio(*(float(np.exp(each)) for each in (mean, low, high)))


def kept(
    found: Mapping[str, Sequence[tuple[Json, Json]]], which: str, only: str = ""
) -> tuple[int, int]:
    """Of the goals or limits that hold with own training, how many hold without it; and all of
    those. Only those whose names begin so.
    """
    both = [pair for each in found.values() for pair in each]
    names = [
        (without[which][name], name)
        for without, trained in both
        for name, holds in trained[which].items()
        if holds and name.startswith(only)
    ]
    return sum(holds for holds, _ in names), len(names)


def measured(studies: Sequence[Json], where: str = WHERE) -> list[evidence.Row]:
    """The rows of evidence; `where` says of whom."""
    found = pairs(studies)
    both = walking(found)
    count = sum(len(each) for each in both.values())
    handed = {
        person: [(without, handed_on(without, trained)) for without, trained in each]
        for person, each in both.items()
    }
    first = [each for each in studies if each["samples"] == each["seed"] == 0]
    walk = sum(not each["falls"] for each in first)
    rows = [
        evidence.Row(
            f"{where}: who walks 100 cycles from 8 starts without it",
            *(100.0 * walk / len(first), "%", ">=", 99, 95, len(first)),
        )
    ]
    for quantity in QUANTITIES if both else ():
        what = f"{where}: {quantity} without it over those with 2 M samples, of who walks without"
        for words, of in (("", both), (", by the policy that is handed on", handed)):
            value = ratio(of, quantity).mean
            rows.append(evidence.Row(f"{what}{words}", value, "1", "<=", 1.05, 1.15, count))
    for words, which, only, goal, must in (
        ("goals kept without it, of those with 2 M samples", "goals", "", 98, 94),
        ("push limits kept without it, of those with 2 M", "limits", "push_survival", 95, 85),
    ):
        holds, judged = kept(found, which, only)
        value = 100.0 * holds / judged
        rows.append(evidence.Row(f"{where}: {words}", value, "%", ">=", goal, must, judged))
    return rows


def table(studies: Sequence[Json], people: Sequence[str] = PEOPLE) -> str:
    """The curves over own samples of some `people`, and what 2 M of them give."""
    lines = [
        "| person | own samples | seeds | angles, ° | moments, Nm/kg | vertical, % BW "
        "| starts that fall | goals missed | pushes survived, % | trained policy is handed on |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name in people:
        for samples in (0, *sorted(POINTS), MOST):
            some = [
                each for each in studies if (each["person"], each["samples"]) == (name, samples)
            ]
            if some:
                lines.append(_line(name, samples, some))
    lines += [
        "",
        "Errors without own training over those with it, of who walks without it; geometric",
    ]
    lines += ["mean over people and seeds (90 % interval):"]
    lines += ["", "| own samples | people, studies | angles | moments | vertical |"]
    lines += ["|---|---|---|---|---|"]
    for samples in (*sorted(POINTS), MOST):
        if found := walking(pairs(studies, samples)):
            count = sum(len(each) for each in found.values())
            cells = [_ratio_in_words(ratio(found, each), count) for each in QUANTITIES]
            lines.append(f"| {samples:,} | {len(found)}, {count} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _ratio_in_words(found: Ratio, count: int) -> str:
    """A ratio, and its interval if there was anything to draw from."""
    between = f" ({found.low:.3f} to {found.high:.3f})" if count > 1 else ""
    return f"{found.mean:.3f}{between}"


def _line(name: str, samples: int, some: Sequence[Json]) -> str:
    def of(quantity: str, digits: int) -> str:
        values = [each[quantity] for each in some if each[quantity] is not None]
        return spread(values, digits) if values else "no whole cycle"

    missed = np.mean([sum(not each for each in study["goals"].values()) for study in some])
    pushes = [100.0 * each["pushes"] / each["of pushes"] for each in some]
    handed = sum(each["gain"]["handed_on"] == "trained" for each in some)
    cells = [
        name,
        f"{samples:,}",
        str(len(some)),
        of("angles", 2),
        of("moments", 3),
        of("vertical", 2),
        f"{sum(each['falls'] for each in some)} of {sum(each['of starts'] for each in some)}",
        f"{missed:.1f} of {len(some[0]['goals'])}",
        spread(pushes, 0),
        f"{handed} of {len(some)}" if samples else "",
    ]
    return f"| {' | '.join(cells)} |"


def written(arguments: argparse.Namespace) -> None:
    """Collect what is finished in --work, if it is there, in place of what is stored of the same
    people, and write the table and the rows.
    """
    if arguments.work.is_dir():
        found = collected(arguments.work)
        again = {each["person"] for each in found}
        found += [each for each in read_json(STORE)["studies"] if each["person"] not in again]
        found.sort(key=lambda each: PEOPLE.index(each["person"]))
        write_json(STORE, {"studies": found, "versions": versions()})
    studies = read_json(STORE)["studies"]
    page = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, with_table(page, "own-training", table(studies)))
    rows = measured(studies)
    for row in rows:
        print(f"{row.what}: {row.value:.4g} {row.unit}")
    if arguments.rows:
        evidence.write("seconds", rows, COMMAND)


def main() -> None:
    """Run the studies, or write what they found."""
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
    tables = commands.add_parser("table")
    tables.set_defaults(do=written)
    tables.add_argument("--work", type=Path, default=WORK)
    tables.add_argument("--rows", action="store_true", help="and the rows of evidence")
    arguments = parser.parse_args()
    arguments.do(arguments)


if __name__ == "__main__":
    main()
