"""Mistakes that are drawn, and undone again, in curves of people on whom nothing was chosen.

The table of strides has people with Parkinson's disease, amputees and healthy people; those of odd
numbers chose the constants of `curve_consistency`.
"""

import numpy as np
import pytest

from gaitval.apps.patients.strides import read_strides
from gaitval.consistency import ADVISED
from gaitval.subjects.curve_consistency import expected_curve, judge_curves
from gaitval.subjects.curve_mistakes import PRIORS, mistakes

NAMES = ("hip_flexion", "knee_angle", "ankle_angle", "hip_adduction", "pelvis_tilt")


def later(curve, rows):
    once = np.roll(curve[:-1], rows)
    return np.append(once, once[0])


def drawn(random, curves):
    """A family, and the curves with a mistake of it."""
    family = random.choice(["sign", "unit", "half a stride", "late", "rows", "exchanged names"])
    side = random.choice(["r", "l"])
    one, other = random.choice(NAMES[:3], 2, replace=False)
    found = dict(curves)
    if family == "sign":
        found |= {f"angle_{one}_{each}": -curves[f"angle_{one}_{each}"] for each in "rl"}
    elif family == "unit":
        found = {name: np.radians(curve) for name, curve in curves.items()}
    elif family == "half a stride":
        family = "late"
        found |= {n: later(c, 50) for n, c in curves.items() if n.endswith(f"_{side}")}
    elif family == "late":
        rows = int(random.choice([-20, 20, 38]))
        found = {name: later(curve, rows) for name, curve in curves.items()}
    elif family == "rows":
        found = {name: curve[::-1] for name, curve in curves.items()}
    else:
        for each in "rl":
            pair = f"angle_{one}_{each}", f"angle_{other}_{each}"
            found |= dict(zip(pair, [curves[name] for name in pair[::-1]], strict=True))
    return family, found


@pytest.mark.slow
def test_drawn_mistakes_are_named_and_sound_curves_of_patients_are_not_accused(gait_data):
    random = np.random.default_rng(20261201)
    everybody = read_strides(gait_data / "gps" / "strides.csv")  # which refuses nobody
    assert len(everybody) == 104
    assert len({each.subject.partition("_")[0] for each in everybody}) == 82
    people = [
        {f"angle_{name}": curve for name, curve in each.angles.items()}
        for each in everybody
        if int("".join(filter(str.isdigit, each.subject))) % 2 == 0
    ]
    assert len(people) == 52
    assert sum(bool(judge_curves(each).words) for each in people) <= 0.1 * len(people)
    named = wrong = silent = 0
    for curves in people:
        family, changed = drawn(random, curves)
        judged = judge_curves(changed)
        families = [each.family for each in judged.named]
        named += family in families
        silent += not judged.words
        # Advice for another mistake than the one that was made.
        wrong += bool(judged.verdict.remedy) and families != [family]
    assert named >= 0.88 * len(people)
    assert silent <= 0.06 * len(people)
    assert wrong <= 1


def test_a_mistake_is_undone_by_what_undoes_it():
    """Each that has an inverse brings back the curves that it is made of."""
    sound = {f"angle_{name}_{side}": expected_curve(f"angle_{name}_{side}")
             for name in NAMES for side in "rl"}  # fmt: skip
    seen = {**sound, "angle_knee_angle_r": 180.0 - sound["angle_knee_angle_r"]}
    seen["angle_ankle_angle_l"] = sound["angle_ankle_angle_l"] + 90.0
    found = {each.name: each for each in mistakes(seen, sound)}
    knee = sound["angle_knee_angle_r"]
    for name, made in (
        ("sign angle_knee_angle_r", -knee),
        ("radians angle_knee_angle_r", np.radians(knee)),
        ("late angle_knee_angle_r", later(knee, 50)),
        ("-1 180 angle_knee_angle_r", 180.0 - knee),
        ("rows the angles", knee[::-1]),
    ):
        undone = found[name].undo({**sound, "angle_knee_angle_r": made})
        np.testing.assert_allclose(undone["angle_knee_angle_r"], knee, atol=1e-9)
    ankle = found["1 -90 angle_ankle_angle_l"].undo
    moved = ankle({"angle_ankle_angle_l": sound["angle_ankle_angle_l"] + 90.0})
    np.testing.assert_allclose(moved["angle_ankle_angle_l"], sound["angle_ankle_angle_l"])
    assert sum(PRIORS.values()) < 1.0 - ADVISED / 2


@pytest.mark.parametrize(
    ("unit", "factors"),
    [
        ("Nm", (1.0 / 37.5, 1.0 / 150.0)),
        ("Nmm/kg", (1e-3, 1e-3)),
        ("% of body weight times height", (0.0980665 * 1.23, 0.0980665 * 2.08)),
        ("N", (1.0 / (37.5 * 9.80665), 1.0 / (150.0 * 9.80665))),
        ("N/kg", (1.0 / 9.80665, 1.0 / 9.80665)),
        ("% of body weight", (0.01, 0.01)),
    ],
)
def test_a_unit_is_undone_by_its_factor_of_small_and_large_people(unit, factors):
    names = "moment_ankle_angle_r", "force_up_r"
    sound = {name: expected_curve(name) for name in names}
    own = names[unit in ("N", "N/kg", "% of body weight")]
    words = {"moment": "the moments", "force": "the forces"}[own.partition("_")[0]]
    tried = [m for m in mistakes(sound, sound) if m.name == f"{unit} {words}"]
    found = [np.ptp(each.undo(sound)[own]) / np.ptp(sound[own]) for each in tried]
    assert sorted([found[0], found[-1]]) == pytest.approx(sorted(factors), rel=5e-3)
