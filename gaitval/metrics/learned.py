"""What was learned for a person, and what was given: the paper's rule, feed-forward, correction."""

from typing import Final

from gaitval.coordinates import split_side
from gaitval.metrics.curve_results import Epsilon
from gaitval.metrics.learning_gain import LearningGain
from gaitval.metrics.results import (
    CorrectionResult,
    IdentificationResult,
    Learned,
    Metrics,
    TorqueShares,
)

SAGITTAL: Final = ("hip_flexion", "knee_angle", "ankle_angle")
"""Coordinates whose share of feed-forward is given."""


def learned(
    found: IdentificationResult | None,
    training: LearningGain | None,
    correction: CorrectionResult | None,
    torque_shares: TorqueShares | None,
    shown: Epsilon | None,
    kappa: float,
) -> Learned | None:
    """What a run learned, by what its stages `found`, beside epsilon of the walk `shown`; None
    where no round of Algorithm 1 was run to its end. `kappa` is its threshold.
    """
    last = None
    if found is not None and found.rounds:
        chosen = (each for each in found.rounds if each.round == found.chosen_round)
        last = next(chosen, found.rounds[-1])
    if last is None or last.epsilon is None or last.epsilon.total is None or not last.floor:
        return None
    shares = [
        of["feed_forward"].r_squared
        for name, of in (torque_shares or {}).items()
        if split_side(name)[1] in SAGITTAL
    ]
    known = [each for each in shares if each is not None]
    return Learned(
        samples=0 if training is None else training.samples,
        epsilon_before=last.epsilon.total,
        epsilon_after=None if shown is None else shown.total,
        epsilon_reference=last.floor,
        kappa=kappa,
        feed_forward=[min(known), max(known)] if known else [],
        fitted_numbers=0 if correction is None else correction.numbers,
    )


def learned_text(metrics: Metrics) -> str:
    """`Learned` in sentences; empty where it is not known."""
    found = metrics.summary.learned
    if found is None:
        return ""
    parts = [
        f"The policy was trained further for this person ({found.samples:,} samples)."
        if found.samples
        else "Nothing was learned for this person: the general policy walks."
    ]
    if found.feed_forward:
        least, most = (f"{each:.2f}".removeprefix("0") for each in found.feed_forward)
        parts.append(
            f"Feed-forward explains {least} to {most} of the variance of the sagittal moments."
        )
    rule = "met" if found.rule_met else "not met"
    parts.append(
        f"ε is {found.epsilon_before:.3f}, {found.ratio_before:.2f} times that of the reference: "
        f"the paper's rule (below {found.kappa:g}) is {rule}."
    )
    if found.fitted_numbers and found.ratio_after is not None:
        parts.append(
            f"After the correction, an iterative fit of {found.fitted_numbers} numbers, it is "
            f"{found.epsilon_after:.3f} ({found.ratio_after:.2f} times)."
        )
    return " ".join(parts)
