"""The Gait Profile Score of four groups of people, as a row of `reports/evidence/report.csv`."""

from argparse import Namespace

import evidence
from experiments.gps_controls import differences

MEASURES = {
    "*": {
        "code": ("gaitval/metrics/gait_profile.py",),
        "data": ("gaitval/metrics/gps_controls.csv",),
    },
}
"""What the rows depend on; see evidence/stale.py."""


@evidence.measurement(evidence.DATA)
def scores(arguments: Namespace) -> evidence.Row:
    """Means and SD of the scores of four groups, against those stated with the data."""
    found = differences(arguments.data)
    worst = max(max(each) for each in found.values())
    for group, each in found.items():
        print(f"{group}: mean off by {each[0]:.3f}, SD by {each[1]:.3f} degrees")
    what = "GPS of the three groups against the data's README"
    return evidence.Row(what, worst, "deg", "<=", 0.1, 0.2, len(found))
