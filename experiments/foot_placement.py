"""Shipped: draws where stored walkers place their feet after pushes, beside each other.

    python -m experiments.foot_placement 5 8 10 --out placement.svg

The figure of their reports (gaitval/metrics/pushed_steps.py), in one scale. S05 is young; S08 and
S10, of 71 and 84 years, walk at half its speed.
"""

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Final

import gaitval
from gaitval._internal.io.artefacts import write_text
from gaitval.metrics.pushed_steps import placed_feet
from gaitval.metrics.results import PlacedFoot
from gaitval.reporting.balance_figure import foot_placement

PEOPLE: Final = ("S05", "S08", "S10")


def people_of(names: Iterable[str]) -> dict[str, list[PlacedFoot]]:
    """By a title that says who it is, what each of the stored walkers with these `names` did."""
    found = {}
    for name in names:
        policy = gaitval.load_policy(name)
        who = policy.subject
        title = f"{who.identifier}, {who.age_years:.0f} years, {who.walking_speed_m_s:.2f} m/s"
        found[title] = placed_feet(policy.corrected_task, policy.network, policy.identified)
    return found


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("walkers", nargs="*", default=PEOPLE, help="default: %(default)s")
    parser.add_argument("--out", type=Path, default=Path("placement.svg"))
    arguments = parser.parse_args()
    write_text(arguments.out, foot_placement(people_of(arguments.walkers)))
    print(arguments.out)


if __name__ == "__main__":
    main()
