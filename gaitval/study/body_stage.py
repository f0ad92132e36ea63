"""What a study's record says of the body in words, for its report: `body.json` in the run's folder.

It uses no policy and changes no walk.
"""

from typing import Final

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.reporting.run_files import BODY as FILE
from gaitval.study.inputs import body_parameters
from gaitval.study.stage import Run, Stage
from gaitval.study.stage_versions import STAGE_VERSIONS

FOUND: Final = "rounds/1/identification/identification.json"
"""What identified the body; the record is the same in every round."""


def stage(run: Run) -> Stage:
    """Record, scaled body and reference of `run` → the two sentences and the picture of its
    report.
    """
    shared = run.configuration.identification.method == "shared"
    return Stage(
        "body",
        lambda: write(run),
        version=STAGE_VERSIONS["body"],
        inputs=(
            *("subject.toml", "model.urdf"),
            *((FOUND, "identification.json") if shared else ("reference.npz",)),
        ),
        outputs=(FILE,),
        values={
            **run.sections("contact", "record", "noise"),
            "method": run.configuration.identification.method,
        },
    )


def write(run: Run) -> None:
    """Write `FILE` into the folder of `run`."""
    # all of these here: a run asks for its stages before it does anything
    from gaitval.identification.begin import begin
    from gaitval.identification.body_report import in_words
    from gaitval.identification.body_words import walker_words
    from gaitval.identification.default import WORDS
    from gaitval.identification.offsets import offset_of
    from gaitval.identification.prior import prior_sd
    from gaitval.identification.shared_errors import identified
    from gaitval.model.urdf import read_urdf
    from gaitval.subjects.prediction.known import quantities_known
    from gaitval.walk.reference.motion import ReferenceMotion

    model, settings = read_urdf(run.folder / "model.urdf"), run.configuration.identification
    if settings.method == "shared":  # the identification is of the same posterior
        words, used = read_json(run.folder / FOUND)[WORDS], run.folder / "identification.json"
        # a body that brings the walk no nearer is not used, see `choose_stage`
        kept = body_parameters(used).tolist() != body_parameters(used, "nominal").tolist()
        walker = walker_words(found=kept, two_legs=bool(read_json(used).get("left_leg")))
        write_json(run.folder / FILE, words | {"said": f"{words['said']} {walker}"})
        return
    own = "moments" in quantities_known(run.subject, run.configuration.record)
    near = ReferenceMotion.load(run.folder / "reference.npz")
    record, prior = run.known_record().record, prior_sd(run.subject)
    fit, fixed_body = begin(record, model, prior, run.configuration, own, near)
    found = identified(fit, fixed_body, offset_of(run.subject))
    # of another method the walker has another body, of which this posterior says nothing
    write_json(run.folder / FILE, in_words(found, model, settings.method))
