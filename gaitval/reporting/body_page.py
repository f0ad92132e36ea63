"""What was learned of a person's body, on a page: two sentences, a picture, tables."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from gaitval._internal.text.number_text import number
from gaitval.identification.body_report import bars
from gaitval.identification.body_words import sentences
from gaitval.identification.combinations import judged_lengths
from gaitval.identification.shared_errors import BODY_ERRORS, NAMES, SHARED, Shared
from gaitval.identification.verdicts import Judged, judged
from gaitval.model.body import BodyModel
from gaitval.model.parameters import nominal_parameters
from gaitval.reporting.body_bars import draw
from gaitval.reporting.page import write_html

_Table = tuple[str, list[list[str]]]
_UNITS: Final = {
    "damping": ("Nms/rad", 1.0, 2),
    "friction": ("1", 1.0, 2),
    **{f"{segment}_length": ("1", 1.0, 3) for segment in ("foot", "shank", "thigh")},
}
"""Unit, factor to it and decimals of a parameter that is no length."""
_LENGTH: Final = ("mm", 1000.0, 1)
BONES: Final = "left less right leg: thigh and shank"
BOTH: Final = "left less right leg: hip to ankle, with how much lower the left hip is"
"""What a walk shows of both legs, and what the sentence above says; of the first, the hips take a
part. The prior of the last is weighed anew (`legs`)."""


def tables(found: Shared, model: BodyModel) -> list[_Table]:
    """A title, and a header and rows, of: parameters, errors of the record; from
    what was `found` of the record, about the `model` as scaled.
    """
    body = [["parameter", "unit", "expected", "found", "SD", "SD / prior SD", "verdict"]]
    for each in judged(found.posterior):
        body.append(_row(each, *_UNITS.get(each.name, _LENGTH)))
    for each in judged_lengths(found.posterior, model):
        body.append(_row(replace(each, name=f"{each.name}: change"), *_LENGTH))
    errors = [["error of the record or the model", "unit", "found", "SD"]]
    for name, value, sd in zip(NAMES, found.values, found.sd, strict=True):
        share = "% of the speed" if name == "belt" else "% of the excursion"
        unit, factor = ("mm", 1000.0) if name in BODY_ERRORS else (share, 100.0)
        title = name
        if name == "left leg":  # a share, by which the right one is shorter
            title, factor = BONES, 2000.0 * model.leg_length
        errors.append([title, unit, number(factor * value, 1), number(factor * sd, 1)])
    apart, sd = found.legs.estimate
    errors.append([BOTH, "mm", number(1000.0 * apart, 1), number(1000.0 * sd, 1)])
    return [
        ("Body: lengths as factors of the scaled ones, places as changes", body),
        ("What seems wrong", errors),
    ]


def _row(each: Judged, unit: str, factor: float, digits: int) -> list[str]:
    """A row of the table of the body: values are shown times `factor`, in `unit`."""
    values = (factor * value for value in (each.prior_mean, each.mean, each.sd))
    shown = [number(value, digits) for value in values]
    return [each.name, unit, *shown, number(each.contraction, 2), each.verdict]


def write_body_page(path: Path, name: str, found: Shared, model: BodyModel) -> Path:
    """Write the page of the person `name` to `path`; other parameters are those of `tables`."""
    context = {
        "name": name,
        "said": sentences(found, model),
        "tables": tables(found, model),
        "drawings": {"body": partial(draw, bars(found, model))},
    }
    return write_html(path.parent, path.stem, "body.html.j2", context)


def as_dict(found: Shared, model: BodyModel) -> dict[str, Any]:
    """All of it for JSON: the sentences, parameters and errors."""
    return {
        "said": sentences(found, model),
        "parameters": {
            each.name: {"scaled": float(scaled), "expected": each.prior_mean,
                        "prior_sd": each.prior_sd, "found": each.mean, "sd": each.sd,
                        "verdict": each.verdict}
            for each, scaled in zip(judged(found.posterior), nominal_parameters(), strict=True)
        },
        "left_leg_longer_m": {
            **dict(zip(("mean", "sd"), found.legs.estimate, strict=True)),
            "odds_of_more_than_people_s": found.legs.odds,
            "more_than_people_s": found.legs.differ,
        },
        "deviance": {"found": found.cost, "largest": SHARED.largest_deviance, "fits": found.fits},
        "errors": {
            name: {"mean": float(value), "sd": float(sd)}
            for name, value, sd in zip(NAMES, found.values, found.sd, strict=True)
        },
    }  # fmt: skip
