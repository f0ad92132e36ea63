"""Ankle moments of 33 people, each from the angle of the ankle and the 32 others."""

import numpy as np

import claims
from claims import Claim
from claims.skill_interval import skill_interval
from gaitval.constants import GRAVITY
from gaitval.prediction.ankles import ankle_moment, ankle_trials

LEG_M = 0.85
"""m, the mean leg of the 33, by which moments are told in Nm/kg."""


@claims.measured()
def left_out(_: claims.Given) -> list[Claim]:
    """RMS error of the right ankle's moment at all treadmill speeds of people who are left out,
    with how free the regression is chosen by the others; and skill against the parabola on speed.
    """
    trials = ankle_trials()
    people = list(dict.fromkeys(trials.people.tolist()))
    ours, guess = [], []
    for person in people:
        errors = []
        for at in np.flatnonzero(trials.people == person):
            angle = trials.angle_mean + trials.angles[at] @ trials.angle_shapes
            truth = trials.moment_mean + trials.moments[at] @ trials.moment_shapes
            found = ankle_moment(angle[None], float(trials.speeds[at]), {person})
            errors.append([found.usual + found.change[0] - truth, found.usual - truth])
        rms = GRAVITY * LEG_M * np.sqrt(np.mean(np.square(errors), axis=2)).mean(axis=0)
        ours.append(rms[0])
        guess.append(rms[1])
    skill = 1.0 - np.mean(ours) / np.mean(guess)
    low, high = skill_interval(np.array(ours), np.array(guess))
    print(f"skill of the angle {skill:.2f} ({low:.2f} to {high:.2f})", flush=True)
    what = "ankle moment of people left out, 32 others"
    return [
        Claim(f"{what}: RMS by their angle", float(np.mean(ours)), "Nm/kg", len(people)),
        Claim(f"{what}: RMS by speed alone", float(np.mean(guess)), "Nm/kg", len(people)),
        Claim(f"{what}: skill of the angle, 5 % point", low, "1", len(people)),
    ]
