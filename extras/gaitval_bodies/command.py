"""The command that says what a record tells of a body."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.cli import display
from gaitval.cli.app import ConfigOption, SetOption, SubjectArgument, added_command


@added_command("gaitval body 5", "gaitval body 5 --out body.json", after="imports")
def body(
    subject: SubjectArgument,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write all of it as JSON.")
    ] = None,
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """What a record tells of a person's body, if skin moves with the joints and the belt errs.

    First in two sentences: how long the legs are, and whether they differ. Then each parameter as
    scaled and as found, what seems wrong with angles and belt, and what a further trial would add.
    Warns if mass, speed and lengths cannot be one person's. No policy has a part in it, and no run
    is changed. About ten seconds.
    """
    from gaitval.artefacts import write_json
    from gaitval.configuration import load_configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.identification.identify import begin
    from gaitval.identification.prior import prior_sd
    from gaitval.identification.verdicts import judged, judged_combinations
    from gaitval.model.parameters import PARAMETERS
    from gaitval.scaling.scaling import scale_subject
    from gaitval_bodies.offsets import offset_of
    from gaitval_bodies.plausible import implausible
    from gaitval_bodies.shared_errors import NAMES, identified
    from gaitval_bodies.words import next_trials, sentences

    configuration = load_configuration(config, settings=settings or ())
    configuration = configuration.model_copy(
        update={
            "identification": configuration.identification.model_copy(
                update={"parameters": "paper"}
            )
        }
    )
    person = load_subject(subject)
    for warning in implausible(person, configuration.contact):
        display.messages.print(f"Warning: {warning}", highlight=False)
    model = scale_subject(person, symmetric=configuration.scaling.symmetric).model
    fit, held = begin(person.record(), model, prior_sd(person), configuration, person.has_kinetics)
    found = identified(fit, held, offset_of(person))
    posterior, verdicts = found.posterior, judged(found.posterior)
    said = sentences(found, model)
    display.plain(said)
    display.print_rows(
        [
            ["parameter", "scaled", "found", "SD", "SD / prior SD", "verdict"],
            *(
                [each.name, f"{each.prior_mean:.4g}", f"{each.mean:.4g}", f"{each.sd:.2g}",
                 f"{each.contraction:.2f}", each.verdict]
                for each in (*verdicts, *judged_combinations(posterior, model))
            ),
        ],
        f"{person.identifier}: body",
    )  # fmt: skip
    display.print_rows(
        [
            ["error of the record", "found", "SD"],
            *(
                [name, f"{value:+.3f}", f"{sd:.3f}"]
                for name, value, sd in zip(NAMES, found.values, found.sd, strict=True)
            ),
        ],
        f"{person.identifier}: what seems wrong with angles (shares of an excursion) and belt",
    )
    trials = next_trials(found, PARAMETERS, model)
    display.print_rows(trials, "SD / prior SD that trials would leave (calculated)")
    if out is None:
        return
    write_json(
        out,
        {
            "said": said,
            "parameters": {
                each.name: {"scaled": each.prior_mean, "prior_sd": each.prior_sd,
                            "found": each.mean, "sd": each.sd, "verdict": each.verdict}
                for each in verdicts
            },
            "left_leg_longer_m": {
                **dict(zip(("mean", "sd"), found.legs.estimate, strict=True)),
                "odds_of_more_than_people_s": found.legs.odds,
                "more_than_people_s": found.legs.differ,
            },
            "errors": {
                name: {"mean": float(value), "sd": float(sd)}
                for name, value, sd in zip(NAMES, found.values, found.sd, strict=True)
            },
            "trials": [dict(zip(trials[0], row, strict=True)) for row in trials[1:]],
        },
    )  # fmt: skip
    display.plain(f"Body: {out}")
