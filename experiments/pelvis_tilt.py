"""How the pelvis of healthy adults is tilted as they walk: mean and spread between people.

    python -m experiments.pelvis_tilt ../shared/data

Reads `gps/strides.csv` of the data folder, a stride a side of 42 healthy adults over ground
(Fukuchi et al. 2018), and leaves out the ten who are built in. Both numbers are in
`gaitval.musculature.pelvis_zero`. Seconds.
"""

import argparse
from pathlib import Path

import numpy as np

from experiments.gps_controls import strides
from gaitval.arrays import Array
from gaitval.datasets.subject_file import builtin_subjects


def others(data: Path) -> Array:
    """(N,) deg, mean tilt of each person who is not built in."""
    tilt = strides(data).xs("control").xs("pelvis_tilt", level="angle").mean(axis=1)
    people = tilt.groupby(level="subject").mean()
    known = {subject.person for subject in builtin_subjects()}
    return np.array([value for name, value in people.items() if name not in known])


def main() -> None:
    """Print both numbers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    found = others(parser.parse_args().data)
    print(f"{len(found)} people: {found.mean():.1f} +- {found.std(ddof=1):.1f} deg")


if __name__ == "__main__":
    main()
