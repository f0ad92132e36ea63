"""The Gait Profile Score of four groups of people."""

import claims
from claims import Claim
from experiments.gps_controls import differences


@claims.measured("data")
def scores(given: claims.Given) -> Claim:
    """Means and SD of the scores of four groups, against those stated with the data."""
    found = differences(given.data)
    worst = max(max(each) for each in found.values())
    for group, each in found.items():
        print(f"{group}: mean off by {each[0]:.3f}, SD by {each[1]:.3f} degrees")
    what = "GPS of the three groups against the data's README"
    return Claim(what, worst, "deg", len(found))
