"""Which of the 14 parameters of a body a range-of-motion trial could identify.

    python -m experiments.reachable_parameters

For each: the SD that is known without a record, the SD that the verdict "identified" asks for, what
record and trial leave in the harsh people of `reports/identification/harsh.json`, and what would be
left if every joint centre and the sole's ends were known exactly in every pose. The last follows
from the null space of the derivatives of these places by mu, in prior SDs. Writes the table of
docs/identification.md.
"""

from pathlib import Path
from typing import Final

import numpy as np

from evidence.marked_table import with_table
from gaitval.arrays import Array
from gaitval.artefacts import read_json, write_text
from gaitval.coordinates import COORDINATES
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import load_subject
from gaitval.identification.prior import prior_sd
from gaitval.identification.verdicts import IDENTIFIED
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.model.tree import ROOT_DOFS, segment_frames
from gaitval.scaling.scaling import scale_subject

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "harsh.json"
PAGE = ROOT / "docs" / "identification.md"
POSES: Final = 20
_NONE: Final = 1e-6
"""Singular value, of the largest, below which a change of mu moves no place."""


def places(model: BodyModel, mu: Array, poses: Array) -> Array:
    """Of all joints and of the sole of `model` with `mu` in these `poses`, m, in one row."""
    body = apply_parameters(model, mu)
    frames = segment_frames(body, poses)[:, :, :3]
    ground = [
        frames[:, SEGMENTS.index(each.segment)] @ np.append(each.position, 1.0)
        for each in body.spheres
    ]
    return np.concatenate([frames[..., 3].ravel(), np.ravel(ground)])


def left_over(subject: Subject) -> Array:
    """(14,) SD / prior SD of mu if all places were known exactly in `POSES` poses."""
    model, sizes = scale_subject(subject).model, prior_sd(subject)
    poses = np.zeros((POSES, len(COORDINATES)))
    random = np.random.default_rng(0)
    poses[:, ROOT_DOFS:] = random.uniform(-0.5, 0.5, poses[:, ROOT_DOFS:].shape)
    mu, step = nominal_parameters(), 1e-4
    slopes = np.stack(
        [(places(model, mu + each, poses) - places(model, mu - each, poses)) / (2 * step)
         for each in step * np.eye(len(mu))], axis=1,
    )  # fmt: skip
    _, values, rows = np.linalg.svd(slopes * sizes)
    return np.sqrt(np.sum(rows[values < _NONE * values[0]] ** 2, axis=0))


def table() -> str:
    """A row for each parameter, by markers and by stature, as Markdown."""
    person = load_subject("S05")
    people = [each for each in read_json(STORE)["people"] if "refused" not in each]
    kinds = {"markers": person, "stature": person.by_stature()}
    found = {}
    for by, subject in kinds.items():
        part = [each for each in people if each["by"] == by]
        trial = [np.array(each["joints"]["sd"]) / each["prior_sd"] for each in part]
        found[by] = prior_sd(subject), np.mean(trial, axis=0), left_over(subject)
    lines = [
        "By markers; by stature.",
        "",
        "| parameter | SD before | SD that is asked for | SD / SD before with the trial | if all "
        "places were known exactly |",
        "|---|---|---|---|---|",
    ]
    for i, name in enumerate(PARAMETERS):
        columns = zip(*(
            (f"{sd[i]:.3g}", f"{IDENTIFIED * sd[i]:.2g}", f"{trial[i]:.2f}", f"{exact[i]:.2f}")
            for sd, trial, exact in found.values()
        ), strict=True)  # fmt: skip
        cells = (one if one == other else f"{one}; {other}" for one, other in columns)
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Write the table."""
    shown = table()
    text = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, with_table(text, "reachable", shown))


if __name__ == "__main__":
    main()
