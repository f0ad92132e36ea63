"""The stages that judge the walk and report it."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import read_json, value_hash, write_json
from gaitval.errors import ArtefactError
from gaitval.metrics.results import Endurance, Repeat, StoredPushes, StoredWalks
from gaitval.model.urdf import read_urdf
from gaitval.study import body_stage
from gaitval.study.inputs import (
    GAIN,
    METRICS,
    PUSHED,
    REPEATS,
    ROLLOUTS,
    SECOND_ENGINE,
    WALKS,
    stored,
)
from gaitval.study.stage import Run, Stage
from gaitval.study.stage_versions import STAGE_VERSIONS
from gaitval.subjects.subject_file import builtin_subjects

if TYPE_CHECKING:
    from gaitval.metrics.results import Metrics, PushRecovery


def body_stages(run: Run) -> list[Stage]:
    """What the record of `run` says of the body, in words for the report; none if nothing is to be
    identified.
    """
    nothing = run.configuration.identification.method == "none"
    return [] if nothing else [body_stage.stage(run)]


def metrics_of(run: Run, *, pushes: "PushRecovery | None") -> "Metrics":
    """The walks in the folder of `run`, and its `pushes`, against record and tolerances."""
    from gaitval.metrics.learning_gain import LearningGain
    from gaitval.metrics.results import CorrectionResult, IdentificationResult
    from gaitval.metrics.rollouts import Rollouts
    from gaitval.metrics.validation import StageResults, validate
    from gaitval.subjects.prediction.known import is_predicted, is_unrecorded
    from gaitval.subjects.prediction.slopes import is_changed
    from gaitval.walk.simulation.rollout import Rollout

    def rollouts(name: str, went: "Sequence[Endurance] | None") -> Rollouts | None:
        return Rollouts(Rollout.load(run.folder / name), tuple(went)) if went else None

    walks = stored(run, WALKS, StoredWalks)
    nominal = rollouts(ROLLOUTS["nominal"], walks.nominal)
    assert nominal is not None
    repeats = read_json(run.folder / REPEATS) if (run.folder / REPEATS).is_file() else []
    settings, people = run.configuration.record, builtin_subjects()
    expected_errors = None
    if is_unrecorded(settings) and not is_changed(settings):
        from gaitval.metrics.other_trials import prediction_errors

        expected_errors = prediction_errors(run.subject, settings, people)
    found = validate(
        *run.compared(),
        read_urdf(run.folder / "model.urdf"),
        nominal,
        rollouts(ROLLOUTS["identified"], walks.identified),
        run.configuration,
        StageResults(
            identification=stored(run, "identification.json", IdentificationResult)
            if walks.identified
            else None,
            correction=stored(run, "correction.json", CorrectionResult),
            training=stored(run, f"policy/{GAIN}", LearningGain),
            pushes=pushes,
            torque_shares=walks.torque_shares,
            second_engine=rollouts(
                SECOND_ENGINE, [walks.second_engine] if walks.second_engine else None
            ),
            again=[Repeat.model_validate(each) for each in repeats],
            centring=walks.centring,
            prediction_errors=expected_errors,
        ),
        others=people,
    )
    if is_predicted(settings):
        from gaitval.metrics.other_trials import predicted_curves, with_predicted

        walked = run.compared()[1] if is_changed(settings) else None
        curves = predicted_curves(run.subject, settings, people, walked)
        found = with_predicted(found, curves)
    # of the file beside it, which has neither devices nor the trial that is held out as its own
    path = run.folder / "subject.toml"
    subject = value_hash(file_gate.read_text(path, ArtefactError, largest=file_gate.SIZES.written))
    own = found.provenance.model_copy(update={"subject": subject})
    return found.model_copy(update={"provenance": own})


def validate_stage(run: Run) -> Stage:
    """Rollouts and pushes of `run`, compared with the record and the tolerances → metrics.json."""
    from gaitval.metrics.results import SCHEMA_VERSION
    from gaitval.metrics.tolerances import limits_text
    from gaitval.quantities import QUANTITIES

    def validate() -> None:
        pushes = stored(run, "push.json", StoredPushes)
        write_json(run.folder / METRICS, metrics_of(run, pushes=pushes.recovery).as_dict())

    return Stage(
        "validate",
        validate,
        version=STAGE_VERSIONS["validate"],
        inputs=(
            "subject.toml",
            "model.urdf",
            "identification.json",
            "correction.json",
            *ROLLOUTS.values(),
            SECOND_ENGINE,
            WALKS,
            REPEATS,
            "push.json",
            f"policy/{GAIN}",
        ),
        outputs=(METRICS,),
        values={
            **run.sections("seed", "record", "contact", "validation"),
            # metrics of an earlier version cannot be read, so they are written again
            "schema_version": SCHEMA_VERSION,
            "limits": limits_text(),
            "quantities": [each.name for each in QUANTITIES],
        },
    )


def report_stage(run: Run) -> Stage:
    """Everything in the folder of `run` → report.html, report-details.html and
    report.pdf, unless `report.pdf` is false.
    """

    def report() -> None:
        from gaitval.reporting.report import write_report

        write_report(run.folder)

    return Stage(
        "report",
        report,
        version=STAGE_VERSIONS["report"],
        inputs=(
            "subject.toml",
            "configuration.toml",
            "model.urdf",
            "scaling.csv",
            "reference.npz",
            "policy/training.csv",
            "identification.json",
            "metrics.json",
            "push.json",
            *PUSHED,
            *ROLLOUTS.values(),
            *(name for each in body_stages(run) for name in each.outputs),
        ),
        outputs=page_files(run),
    )


def page_files(run: Run) -> tuple[str, ...]:
    """What the report of `run` is written to."""
    pdf = ("report.pdf",) if run.configuration.report.pdf else ()
    return "report.html", "report-details.html", *pdf
