"""Where people's knees are beside the body's, and what bands of a knee's halves are made of.

    python -m experiments.knee_middles

In the body hip, knee and ankle are in a line. The markers on the epicondyles of the ten built-in
people, standing, say how far the middle of each knee is aside of it: `contact.ASIDE` and
`bands.Spreads.knee_unseen`. The second table is the spread of the draws of `bands` without the
terms `model_...`, of the ten people's walks: what remains to what models were off by at implants
of other people is `model_split`. Minutes.
"""

from dataclasses import replace

import numpy as np

from claims.muscles import _walks
from gaitval.coordinates import SIDES
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.inverse.marker_placement import place_markers
from gaitval.musculature.bands import SPREADS, draw
from gaitval.musculature.gait import _cycle_of, muscles_of
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.scaling.scaling import scale_subject
from gaitval.session.loaded import measured_knees


def middles() -> list[float]:
    """m to the outer side, of each knee."""
    marker_set, found = load_marker_set("wbds"), []
    for subject in builtin_subjects():
        model = scale_subject(subject).model
        standing = {
            marker_set.landmarks.get(name, name): np.asarray(place)
            for name, place in subject.markers.items()
        }
        measured = measure(marker_set.on_landmarks(standing))
        placed = place_markers(model, measured, standing, marker_set)
        knees = measured_knees(model, placed.markers, marker_set.landmarks)
        found += [knees[side] for side in SIDES]
        print(subject.identifier, *(f"{1000 * knees[side]:+.1f}" for side in SIDES), "mm")
    return found


def main() -> None:
    """Print both tables."""
    found = middles()
    print(f"mean {1000 * np.mean(found):.1f}, SD {1000 * np.std(found, ddof=1):.1f} mm")
    parts = replace(SPREADS, model_share=0.0, model_force=0.0, model_split=0.0)
    rows = []
    for motion in _walks():
        gait = muscles_of([motion], sides=("right",))
        few = _cycle_of((gait.pieces[0][2], *motion.cycles["right"][0]), "right")
        drawn = draw(few, "right", draws=80, spreads=parts)
        halves = (drawn.medial - drawn.lateral) / 2
        rows.append(
            [
                float(np.sqrt(values.var(axis=0).mean())) / gait.body_weight
                for values in (drawn.compression, drawn.medial, drawn.lateral, halves)
            ]
        )
    for name, value in zip(("total", "medial", "lateral", "split"), np.mean(rows, 0), strict=True):
        print(f"{name}: {value:.2f} BW")


if __name__ == "__main__":
    main()
