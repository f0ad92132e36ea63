"""What a study's record says of the body in words, for its report: `body.json` in the run's folder.

The core asks for this module as the part `body`. It uses no policy and changes no walk.
"""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from gaitval import file_gate
from gaitval.artefacts import write_json
from gaitval.errors import ArtefactError
from gaitval.identification.identify import Begun, begin
from gaitval.identification.prior import prior_sd
from gaitval.model.urdf import read_urdf
from gaitval.prediction.known import quantities_told
from gaitval.reporting.drawing import Draw
from gaitval.study.sources import PACKAGE, code_of
from gaitval.study.stage import Run, Stage
from gaitval_bodies.offsets import offset_of
from gaitval_bodies.page import Bar, bars, draw
from gaitval_bodies.shared_errors import identified
from gaitval_bodies.words import sentences

FILE: Final = "body.json"
_LARGEST: Final = 100_000
"""Bytes of the file; a study writes three thousand."""
_LONGEST: Final = 1000
"""Characters of the sentences; those of `words` have 300."""


def stage(run: Run, begun: Callable[[], Begun] | None = None) -> Stage:
    """Record and scaled body of `run` → the two sentences and the picture of its report.

    Parameters
    ----------
    run : with its subject, `model.urdf` and configuration.
    begun : gives the fit of this record and its solution as scaled, if it was made before.
    """
    return Stage(
        "body",
        lambda: write(run, begun),
        inputs=("subject.toml", "model.urdf"),
        outputs=(FILE,),
        values={
            **run.sections("contact", "record", "noise"),
            "method": run.configuration.identification.method,
            "code": code_of(write, PACKAGE, Path(__file__).parent),
        },
    )


def write(run: Run, begun: Callable[[], Begun] | None = None) -> None:
    """Write `FILE` into the folder of `run`; parameters as in `stage`."""
    model, settings = read_urdf(run.folder / "model.urdf"), run.configuration.identification
    if begun is not None and settings.parameters == "paper":
        fit, held = begun()
    else:
        own = "moments" in quantities_told(run.subject, run.configuration.record)
        paper = run.configuration.model_copy(
            update={"identification": settings.model_copy(update={"parameters": "paper"})}
        )
        fit, held = begin(run.told().record, model, prior_sd(run.subject), paper, own)
    found = identified(fit, held, offset_of(run.subject))
    shown = [{"name": name, "mean": mean, "sd": sd} for name, mean, sd in bars(found, model)]
    write_json(
        run.folder / FILE,
        {"method": settings.method, "said": sentences(found, model), "bars": shown},
    )


def shown(folder: Path) -> tuple[dict[str, str], Draw]:
    """Of a run `folder`: what is `said` and the `method` by which the walker's body was found, and
    what draws the bars.

    Raises
    ------
    ArtefactError : the file is damaged.
    """
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
    return texts, partial(draw, found)
