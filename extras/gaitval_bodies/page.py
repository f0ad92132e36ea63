"""What was learned of a person's body, on a page: two sentences, a picture, tables."""

from functools import partial
from pathlib import Path

from gaitval.model.body import BodyModel
from gaitval.reporting.page import write_html
from gaitval_bodies.bars import bars, draw
from gaitval_bodies.joints import judged_lengths
from gaitval_bodies.shared_errors import NAMES, Shared
from gaitval_bodies.verdicts import judged
from gaitval_bodies.words import next_trials, sentences

Table = tuple[str, list[list[str]]]


def tables(found: Shared, model: BodyModel) -> list[Table]:
    """A title, and a header and rows, of: parameters, errors of the record, further trials.

    Parameters
    ----------
    found : of the record.
    model : the body as scaled.
    """
    body = [["parameter", "expected", "found", "SD", "SD / prior SD", "verdict"]]
    for each in (*judged(found.posterior), *judged_lengths(found.posterior, model)):
        body.append(
            [each.name, f"{each.prior_mean:.4g}", f"{each.mean:.4g}", f"{each.sd:.2g}",
             f"{each.contraction:.2f}", each.verdict]
        )  # fmt: skip
    errors = [["error of the record or the model", "found", "SD"]]
    for name, value, sd in zip(NAMES, found.values, found.sd, strict=True):
        errors.append([name, f"{value:+.3f}", f"{sd:.3f}"])
    return [
        ("Body: factors of lengths, and m", body),
        ("What seems wrong: shares of an excursion and of the belt's speed, and m", errors),
        ("SD / prior SD that trials would leave (calculated)", next_trials(found, model)),
    ]


def write_body_page(path: Path, name: str, found: Shared, model: BodyModel) -> Path:
    """Write the page of the person `name` to `path`; other parameters are those of `tables`."""
    context = {
        "name": name,
        "said": sentences(found, model),
        "tables": tables(found, model),
        "drawings": {"body": partial(draw, bars(found, model))},
    }
    return write_html(path.parent, path.stem, "gaitval_bodies:body.html.j2", context)
