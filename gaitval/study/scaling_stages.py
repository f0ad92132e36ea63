"""The stages that scale the body and make the motion that it is to walk."""

from typing import TYPE_CHECKING

from gaitval.model.urdf import read_urdf
from gaitval.study.inputs import target_record
from gaitval.study.stage import Run, Stage
from gaitval.study.stage_versions import STAGE_VERSIONS
from gaitval.subjects.subject_file import builtin_subjects

if TYPE_CHECKING:
    from gaitval.configuration import RecordSettings
    from gaitval.model.body import BodyModel
    from gaitval.walk.reference.motion import ReferenceMotion


def scale_stage(run: Run) -> Stage:
    """Subject of `run` → body model."""

    def scale() -> None:
        from gaitval.model.urdf import write_urdf
        from gaitval.scaling.scaling import scale_subject
        from gaitval.subjects.prediction.slopes import body_on

        if run.subject.guessed:
            run.observer.say(
                f"{run.subject.identifier}: who it is was not given; assumed: "
                f"{run.subject.guessed}. Subjects with both in common count as one person: say "
                "who it is with person and laboratory in the subject's file."
            )
        from gaitval.identification.unusual import remarks_before_scaling

        for remark in remarks_before_scaling(
            run.subject, run.configuration, run.known_record().record
        ):
            run.observer.say(remark)
        body = scale_subject(run.subject, symmetric=run.configuration.scaling.symmetric)
        model = body_on(body.model, run.configuration.record)
        write_urdf(model, run.folder / "model.urdf")
        body.write_table(run.folder / "scaling.csv")

    return Stage(
        "scale",
        scale,
        version=STAGE_VERSIONS["scale"],
        inputs=("subject.toml",),
        outputs=("model.urdf", "scaling.csv"),
        values={**run.sections("scaling"), "walked": walked_on(run.configuration.record)},
    )


def walked_on(settings: "RecordSettings") -> dict[str, float]:
    """What of the `settings` of a record makes another body or another ground."""
    return settings.model_dump(include={"slope", "cross_slope", "load"})


def reference_stage(run: Run) -> Stage:
    """Recorded gait and body model of `run` → reference motion."""

    def build() -> None:
        from gaitval.identification.unusual import remarks_on_gait

        for remark in remarks_on_gait(run.subject, builtin_subjects()):
            run.observer.say(remark)
        model = read_urdf(run.folder / "model.urdf")
        reference_of(run, model).save(run.folder / "reference.npz")

    return Stage(
        "reference",
        build,
        version=STAGE_VERSIONS["reference"],
        inputs=("subject.toml", "model.urdf"),
        outputs=("reference.npz",),
        values=run.sections("contact", "record"),
    )


def reference_of(
    run: Run, body: "BodyModel", near: "ReferenceMotion | None" = None
) -> "ReferenceMotion":
    """The motion of `body` to walk; that of a similar body is `near`."""
    from gaitval.walk.reference.dynamic_fit import consistent_reference

    record, accuracy = target_record(run)
    return consistent_reference(record, body, run.configuration.contact, accuracy, near)
