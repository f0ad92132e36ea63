"""Run the walks that know only a part of the record, and keep what they reached.

    python -m experiments.held_out_runs kinematics S01 S02    # all ten if none
    python -m experiments.held_out_runs holdout               # every trial of people with several
    python -m experiments.held_out_runs halves ../shared/data # WBDS01's raw T01; then a half's

Writes `reports/held_out/KIND/NAME.json`: errors of the walk and of predictions without a model.
Interrupted, the same command resumes. `claims/held_out.py` and `claims/prediction.py` read them.
"""

import argparse
from pathlib import Path
from typing import Any, get_args

import numpy as np

from claims import commit
from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.cli.terminal.display import live_view
from gaitval.configuration import load_configuration
from gaitval.errors import SubjectError
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.comparison import rms
from gaitval.metrics.curve_results import by_kind
from gaitval.metrics.reference_curves import reference_curves
from gaitval.model.urdf import read_urdf
from gaitval.session.importing.importing import import_files
from gaitval.session.request import Halves, ImportOptions
from gaitval.study.identification_stages import choose_stage, evaluate_stage, identify_stage
from gaitval.study.learning_stages import hand_on_stage, need_stage, train_stage
from gaitval.study.predicted_study import run_prediction
from gaitval.study.report_stages import metrics_of
from gaitval.study.run import choose_start
from gaitval.study.scaling_stages import reference_stage, scale_stage
from gaitval.study.stage import Run, Stage, open_run, run_stage
from gaitval.study.walking_stages import correct_stage, simulate_stage
from gaitval.subjects.prediction.known import known_record
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import BUILTIN, builtin_subjects, load_subject
from gaitval.walk.reference.motion import ReferenceMotion

STORE = Path(__file__).resolve().parent.parent / "reports" / "held_out"

KINEMATICS = ("record.use=kinematics",)


def reference_errors(run: Run) -> dict[str, dict[str, float]]:
    """RMSE of the reference itself from the compared record: what the dynamic fit predicts."""
    reference = ReferenceMotion.load(run.folder / "reference.npz")
    mass = read_urdf(run.folder / "model.urdf").mass
    _, record = run.compared()
    truth = by_kind(recorded_curves(record))
    wanted = reference_curves(reference, mass, run.known_record().record.left_phase)
    return {
        kind: {name: rms(curve - truth[kind][name]) for name, curve in curves.items()}
        for kind, curves in by_kind(wanted).items()
    }


def likeness(walk: dict[str, Any], run: Run) -> dict[str, dict[str, dict[str, float]]]:
    """Pearson's correlation of each moment and force with the compared record, and the relative
    RMSE, in % of the mean of both curves' peak to peak (Ren et al. 2008, J Biomech 41:2750).
    """
    _, record = run.compared()
    truth = by_kind(recorded_curves(record))
    found: dict[str, dict[str, dict[str, float]]] = {}
    for kind in ("moments", "forces"):
        found[kind] = {}
        for name, error in walk["errors"][kind].items():
            walked = walk["curves"][kind][name]["mean"]
            size = 0.5 * (np.ptp(walked) + np.ptp(truth[kind][name]))
            found[kind][name] = {
                "correlation": error["correlation"],
                "relative_rmse": float(100.0 * error["rmse"] / size),
            }
    return found


def store(kind: str, name: str, metrics: dict[str, Any], run: Run) -> None:
    """Keep what a comparison needs of `metrics.json`, and the errors of the reference."""
    walk = metrics["walks"][metrics["final"]]
    kept = {
        key: metrics[key]
        for key in (
            *("subject", "recorded", "known", "predictions"),
            *("unseen", "summary", "provenance"),
        )
    }
    kept |= {
        "speed": metrics["record"]["spatiotemporal"]["walking_speed"],
        "errors": {
            kind: {curve: error and error["rmse"] for curve, error in errors.items()}
            for kind, errors in walk["errors"].items()
        },
        "errors_as_measured": walk["errors_as_measured"],
        "reference_errors": reference_errors(run),
        "starts": walk["starts"],
        "measures": metrics["measures"],
        "commit": commit(),
    }
    path = STORE / kind / f"{name}.json"
    write_json(path, kept)
    print(path, flush=True)


def walked(run: Run) -> dict[str, Any]:
    """Metrics of the main job's walk, without pushes and a report, which are not asked here."""

    def perform(stage: Stage) -> None:
        run_stage(stage, run.folder, observer=run.observer)

    perform(scale_stage(run))
    perform(reference_stage(run))
    choose_start(run, train_stage(run, 1))
    perform(need_stage(run, 1))
    perform(train_stage(run, 1))
    perform(identify_stage(run, 1))
    perform(hand_on_stage(run, 1))
    perform(evaluate_stage(run, 1))
    perform(choose_stage(run, 1))
    perform(correct_stage(run))
    perform(simulate_stage(run))
    return metrics_of(run, pushes=None).as_dict()


def kinematics(names: list[str], work: Path) -> None:
    """The main job, given angles, speed and timing only."""
    configuration = load_configuration(settings=KINEMATICS)
    for name in names or BUILTIN:
        folder = work / f"{name}-kinematics"
        with live_view() as live, open_run(load_subject(name), configuration, folder, live) as run:
            metrics = walked(run)
            store("kinematics", name, metrics, run)
            alike = likeness(metrics["walks"][metrics["final"]], run)
            path = STORE / "kinematics" / f"{name}.json"
            write_json(path, read_json(path) | {"likeness": alike})


def holdout(names: list[str], work: Path) -> None:
    """Every trial of people with several, predicted from their others."""
    for subject in builtin_subjects():
        trials = [subject.trial, *(each.name for each in subject.trials)] if subject.trials else []
        for trial in trials:
            name = f"{subject.identifier}-{trial}"
            if names and name not in names:
                continue
            folder = work / name
            settings = [f'record.holdout="{trial}"']
            configuration = load_configuration(settings=settings)
            try:
                known_record(subject, configuration.record, builtin_subjects())
            except SubjectError as error:  # too far from every other speed
                print(error, flush=True)
                continue
            with (
                live_view() as live,
                open_run(subject, configuration, folder, live) as range_run,
                open_run(subject, configuration, folder / "at", live) as run,
            ):
                run_prediction(run, range_run)
            store("holdout", name, read_json(folder / "at" / "metrics.json"), run)


def halves(names: list[str], work: Path) -> None:
    """The odd cycles of a raw session known, the even ones held out; and first and last."""
    raw = Path(names[0]) / "wbds" / "raw"
    configuration = load_configuration()
    for which in get_args(Halves):
        if names[1:] and which not in names[1:]:
            continue
        imported = import_files(
            ImportOptions(
                static=raw / "WBDS01static1.c3d",
                trials=(raw / "WBDS01walkT01.c3d",),
                mass=74.3,
                height=1.725,
                sex="M",
                halves=which,
            ),
            work / f"WBDS01-{which}",
            configuration=configuration,
            notify=lambda step, text: print(f"{step}: {text}", flush=True),
        )
        subject: Subject = imported.subject
        folder = work / f"WBDS01-{which}"
        with live_view() as live, open_run(subject, configuration, folder, live) as run:
            store("halves", f"WBDS01-{which}", walked(run), run)


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=("kinematics", "holdout", "halves"))
    parser.add_argument("names", nargs="*")
    parser.add_argument("--work", type=Path, default=Path("reports/held-out-runs"))
    arguments = parser.parse_args()
    jobs = {"kinematics": kinematics, "holdout": holdout, "halves": halves}
    jobs[arguments.kind](arguments.names, arguments.work)


if __name__ == "__main__":
    main()
