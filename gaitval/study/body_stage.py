"""What a study's record says of the body in words, for its report: `body.json` in the run's folder.

The core asks for this module as the part `body`. It uses no policy and changes no walk.
"""

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from gaitval import file_gate
from gaitval.artefacts import read_json, write_json
from gaitval.errors import ArtefactError
from gaitval.study.sources import PACKAGE, code_of
from gaitval.study.stage import Run, Stage

if TYPE_CHECKING:
    from gaitval.reporting.drawing import Draw
    from gaitval.reporting.body_bars import Bar

FILE: Final = "body.json"
FOUND: Final = "rounds/1/identification/identification.json"
"""What identified the body; the record is the same in every round."""
_LARGEST: Final = 100_000
"""Bytes of the file; a study writes three thousand."""
_LONGEST: Final = 1000
"""Characters of the sentences; those of `words` have 300."""


def stage(run: Run) -> Stage:
    """Record, scaled body and reference of `run` → the two sentences and the picture of its
    report.
    """
    shared = run.configuration.identification.method == "shared"
    return Stage(
        "body",
        lambda: write(run),
        inputs=("subject.toml", "model.urdf", FOUND if shared else "reference.npz"),
        outputs=(FILE,),
        values={
            **run.sections("contact", "record", "noise"),
            "method": run.configuration.identification.method,
            "code": code_of(write, PACKAGE, Path(__file__).parent),
        },
    )


def write(run: Run) -> None:
    """Write `FILE` into the folder of `run`."""
    # all of these here: a run asks for its stages before it does anything
    from gaitval.identification.begin import begin
    from gaitval.identification.prior import prior_sd
    from gaitval.model.urdf import read_urdf
    from gaitval.prediction.known import quantities_told
    from gaitval.reference.motion import ReferenceMotion
    from gaitval.reporting.body_bars import in_words
    from gaitval.identification.methods import WORDS
    from gaitval.identification.offsets import offset_of
    from gaitval.identification.shared_errors import identified

    model, settings = read_urdf(run.folder / "model.urdf"), run.configuration.identification
    if settings.method == "shared":  # the identification is of the same posterior
        write_json(run.folder / FILE, read_json(run.folder / FOUND)[WORDS])
        return
    own = "moments" in quantities_told(run.subject, run.configuration.record)
    paper = run.configuration.model_copy(
        update={"identification": settings.model_copy(update={"parameters": "paper"})}
    )
    near = ReferenceMotion.load(run.folder / "reference.npz")
    fit, held = begin(run.told().record, model, prior_sd(run.subject), paper, own, near)
    found = identified(fit, held, offset_of(run.subject))
    write_json(run.folder / FILE, in_words(found, model, settings.method))


def shown(folder: Path) -> "tuple[dict[str, str], list[Bar], Draw]":
    """Of a run `folder`: what is `said` and the `method` by which the walker's body was found, the
    bars, and what draws them. Raises ArtefactError if the file is damaged.
    """
    from gaitval.reporting.body_bars import draw

    path = folder / FILE
    try:
        stored = json.loads(file_gate.read_text(path, ArtefactError, largest=_LARGEST))
        texts = {name: str(stored[name])[:_LONGEST] for name in ("said", "method")}
        found: list[Bar] = [
            (str(each["name"])[:_LONGEST], float(each["mean"]), float(each["sd"]))
            for each in stored["bars"]
        ]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ArtefactError(
            f"{path}: is not what a study writes ({error}). Remove it and run `gaitval subject` "
            "again."
        ) from error
    return texts, found, partial(draw, found)
