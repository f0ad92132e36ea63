"""How large the medial force of people of other laboratories is, against how wide they step.

    python -m experiments.step_widths SUBJECT.toml ...

Of subjects with forces on both sides that `gaitval import` wrote (those of
`experiments/public_recordings.toml`, each person once), prints the size of the medial force over
what is expected of anybody at the speed, the distance sideways between the ankles and between the
lines from ankle to metatarsal heads (`gaitval.prediction.body`), both over leg length, and the
correlations. Where on the foot the width is taken was chosen by them.
"""

import argparse
from dataclasses import replace

import numpy as np

from gaitval.datasets.subject_file import builtin_subjects, load_subject
from gaitval.gait.record import GaitRecord, PeriodicCurve
from gaitval.prediction.body import step_width
from gaitval.prediction.deviations import KINETICS, kinetics_of
from gaitval.prediction.normal_form import normal_form, symmetric
from gaitval.prediction.population import expected, gaits_of

MEDIAL = KINETICS.index(("forces", "medial"))


def toes_ahead(record: GaitRecord) -> GaitRecord:
    """The record with feet that point straight ahead, so that only the ankles count."""
    ahead = {f"foot_progression_{side}": PeriodicCurve(0.0, (), ()) for side in "rl"}
    return replace(record, angles={**record.angles, **ahead})


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("subjects", nargs="+")
    people = [gaits_of(each) for each in builtin_subjects()]
    rows = []
    for name in parser.parse_args().subjects:
        subject = load_subject(name)
        record = subject.record()
        heads = step_width(subject, record)
        if np.isnan(heads):
            print(f"{subject.identifier}: no width, since lengths or foot angles are unknown")
            continue
        gait = normal_form(record, subject.leg_length_m)
        own, usual = (
            kinetics_of(each)[:, MEDIAL] for each in (gait, symmetric(expected(people, gait.speed)))
        )
        size = float(np.mean(np.sum(own * usual, axis=1) / np.sum(usual**2, axis=1)))
        rows.append((size, step_width(subject, toes_ahead(record)), heads))
        size, ankles, heads = rows[-1]
        print(f"{subject.identifier:20s} size {size:.2f}, ankles {ankles:.3f}, heads {heads:.3f}")
    ankles, heads = np.corrcoef(np.array(rows).T)[0, 1:]
    print(f"{len(rows)} people: correlation {ankles:.2f} (ankles), {heads:.2f} (metatarsal heads)")


if __name__ == "__main__":
    main()
