"""What a hip's rotation does where nothing is held but the foot: the rotations the model has not.

    python -m experiments.planted_feet [S01 ...]

The model's leg turns about its own axis at the hip alone; recorded knees and ankles turn, too. Each
record is fitted with loaded feet that may not turn and hips that may. Of the stance: standard
deviation of the hip's rotation from the recorded one, of the recorded rotations of knee and ankle
together, and what is left of one without the other; their correlation, and the slope.
"""

import argparse
from dataclasses import dataclass

import numpy as np

from gaitval.configuration import ContactSettings
from gaitval.coordinates import COORDINATES, SIDES
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.reference.dynamic_fit import consistent_reference
from gaitval.reference.motion import side_phase
from gaitval.scaling.scaling import scale_subject

HELD = RecordAccuracy()._replace(rotation=float(np.deg2rad(8.0)), free_moment=0.001)


@dataclass(frozen=True)
class TurnedHip:
    """Of one leg in stance, degrees but for `correlation` and `slope`; see the module."""

    hip: float
    recorded: float
    rest: float
    correlation: float
    slope: float


def turned_hips(name: str) -> list[TurnedHip]:
    """Of both legs, right first, of the built-in subject `name`."""
    subject = load_subject(name)
    record, model = subject.record(), scale_subject(subject).model
    reference = consistent_reference(record, model, ContactSettings(), HELD)
    found = []
    for side in SIDES:
        own = np.mod(side_phase(record, side, reference.phase), 1.0)
        stance = own < record.stance_fraction[side]
        rotation, knee, ankle = (
            record.angles[f"{joint}_rotation_{side[0]}"](own[stance])
            for joint in ("hip", "knee", "ankle")
        )
        column = COORDINATES.index(f"hip_rotation_{side[0]}")
        hip = np.degrees(reference.positions[stance, column] - rotation)
        lacking = np.degrees(knee + ankle)
        found.append(
            TurnedHip(
                hip=float(hip.std()),
                recorded=float(lacking.std()),
                rest=float((hip - lacking).std()),
                correlation=float(np.corrcoef(lacking, hip)[0, 1]),
                slope=float(np.polyfit(lacking, hip, 1)[0]),
            )
        )
    return found


def main() -> None:
    """Print a line a leg."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("subjects", nargs="*", help="all ten if none is named")
    print("leg        hip  recorded  rest      r  slope")
    for name in parser.parse_args().subjects or BUILTIN:
        for side, leg in zip(SIDES, turned_hips(name), strict=True):
            print(
                f"{name} {side:5} {leg.hip:4.1f} {leg.recorded:9.1f} {leg.rest:5.1f} "
                f"{leg.correlation:6.2f} {leg.slope:6.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
