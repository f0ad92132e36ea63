"""What was learned of a person's body, in sentences."""

from typing import Final

from gaitval._internal.text.number_text import number
from gaitval.identification.combinations import judged_combinations
from gaitval.identification.legs import LEG_ODDS, LegDifference
from gaitval.identification.shared_errors import SHARED, Shared
from gaitval.model.body import BodyModel

_LITTLE: Final = 0.9
"""Contraction from which on a record adds next to nothing."""


NEARER: Final = 0.57
"""Share of 196 people of the harsh world whose leg was found nearer to the truth than as scaled."""


def sentences(found: Shared, model: BodyModel) -> str:
    """Three sentences: how long the legs are, whether they differ, and how well the record fits;
    from what was `found` of the record, about the `model` as scaled.
    """
    if not found.fits:
        return (
            "The measurement does not fit the model of its errors "
            f"(deviance {found.cost:.0f}, of other people 70 to 225, at most "
            f"{SHARED.largest_deviance:.0f}): nothing is learned of the body, "
            f"which stays as scaled, legs {100 * model.leg_length:.1f} cm. Look at mass, speed and "
            "plates."
        )
    leg = judged_combinations(found.posterior, model)[0]
    scaled = model.leg_length
    length = f"Legs: {100 * (scaled + leg.mean):.1f} ± {100 * leg.sd:.1f} cm, thigh and shank"
    before = f"scaled: {100 * scaled:.1f} ± {100 * leg.prior_sd:.1f}"
    added = ", so the record adds next to nothing" if leg.contraction > _LITTLE else ""
    most = SHARED.largest_deviance
    fit = f"The measurement fits the model (deviance {found.cost:.0f}, at most {most:.0f})"
    return f"{length} ({before}){added}. {_difference(found.legs)}. {fit}."


AS_SCALED: Final = "The walker has the body as scaled."


def walker_words(*, found: bool, two_legs: bool) -> str:
    """A sentence: which body the walker has, the `found` one or that as scaled, with legs that
    differ if `two_legs`, by which rule, and how often that is nearer.
    """
    if not found:
        return AS_SCALED
    legs = "legs that differ so" if two_legs else "equal legs (identification.two_legs)"
    return (
        f"The walker has the found body and {legs}: on average it is nearer to the truth than the "
        f"scaled one, in {round(10 * NEARER)} of 10 people."
    )


def _difference(legs: LegDifference) -> str:
    """Which leg is longer, or that this cannot be seen."""
    mean, sd = legs.estimate
    if abs(mean) <= LEG_ODDS.seen * sd:
        size = f"{number(1000 * mean, 0)} ± {1000 * sd:.0f} mm"
        return f"Whether the legs differ in length cannot be seen (left less right {size})"
    longer = "The left leg is longer by" if mean > 0 else "The right leg is longer by"
    differs = f"{longer} {1000 * abs(mean):.0f} ± {1000 * sd:.0f} mm"
    if legs.differ:
        return (
            f"{differs}: more than people's legs differ, or that hip centre lies as much lower "
            "than the other: measure both legs, because a walk cannot tell these apart"
        )
    return f"{differs}: within what people's legs differ"
