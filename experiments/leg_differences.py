"""Whether the difference of legs that a record gives is that of the standing markers, over its SD.

    python -m experiments.leg_differences [S01 ...]          # a quarter of a minute a person

By markers a leg is measured in three ways, of which two have an SD of the *difference* of two legs
against radiographs (31 children whose legs differ by up to 36 mm): thigh and shank between joint
centres, the hip's by Harrington (6.2 mm), and from the front spine over the inner knee to the inner
malleolus (11.5 mm). They are of an abstract without authors, so a convention; where it stands and
what else is published: docs/notebook/identification.md. The third, from the trochanter over the
outer knee to the outer malleolus, has none; palpated trochanters differ by 15 to 20 mm within and
between examiners (Della Croce et al. 2005, Gait Posture 21:226, as reviewed elsewhere), so it is
shown and not judged.
"""

import argparse
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.identification.body_of_record import body_of_record
from gaitval.scaling.scaling import scale_subject

WAYS: Mapping[str, float | None] = {
    "joint centres": 0.0062,
    "spine, knee, malleolus": 0.0115,
    "trochanter, knee, malleolus": None,
}
"""SD of the difference of two legs by each way of measuring them, m; None if none is published."""


class Difference(NamedTuple):
    """Left less right leg, m: what the record says, with its SD, and by each of `WAYS`."""

    found: float
    sd: float
    marked: tuple[float, ...]


def _along(markers: Mapping[str, Sequence[float]], *names: str) -> float:
    """m, left less right, of the way over markers of these `names`, without the side."""
    each = {
        side: np.array([markers[f"{side}.{name}"] for name in names], dtype=float) for side in "LR"
    }
    long = {s: float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum()) for s, way in each.items()}
    return long["L"] - long["R"]


def difference_of(name: str) -> Difference:
    """Of the built-in subject `name`."""
    subject = load_subject(name)
    scaled = scale_subject(subject)
    found = body_of_record(subject, scaled.model, load_configuration())
    mean, sd = found.legs.estimate
    rows = [each for each in scaled.table if each.segment in ("thigh", "shank")]
    centres = sum((each.left_m or 0.0) - (each.right_m or 0.0) for each in rows)
    return Difference(
        mean,
        sd,
        (
            float(centres),
            _along(subject.markers, "ASIS", "Knee.Medial", "Ankle.Medial"),
            _along(subject.markers, "GTR", "Knee", "Ankle"),
        ),
    )


def main() -> None:
    """Print a line a person, and what all say."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("subjects", nargs="*", help="all ten if none is named")
    names = parser.parse_args().subjects or BUILTIN
    rows = []
    for name in names:
        rows.append(difference_of(name))
        found, sd, marked = rows[-1]
        by = ", ".join(f"{1e3 * each:.1f} ({way})" for way, each in zip(WAYS, marked, strict=True))
        print(f"{name}: {1e3 * found:.1f} ± {1e3 * sd:.1f} mm; {by}", flush=True)
    found, sds = np.array([[row.found, row.sd] for row in rows]).T
    for way, own, marked in zip(
        WAYS, WAYS.values(), np.array([r.marked for r in rows]).T, strict=True
    ):
        apart = found - marked
        rms, r = np.sqrt(np.mean(apart**2)), np.corrcoef(found, marked)[0, 1]
        over = "" if own is None else f"; over the SD of both {_over(apart, sds, own):.2f}"
        print(f"{way}: RMS {1e3 * rms:.1f} mm, r {r:.2f}{over}")


def _over(apart: Array, sds: Array, own: float) -> float:
    """RMS of what is `apart` over the SD of the record's, `sds`, and of the markers', `own`."""
    return float(np.sqrt(np.mean(apart**2 / (sds**2 + own**2))))


if __name__ == "__main__":
    main()
