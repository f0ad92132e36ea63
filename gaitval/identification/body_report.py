"""What a study's report says and shows of a person's body: numbers and sentences."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gaitval.identification.shared_errors import Shared
    from gaitval.model.body import BodyModel

Bar = tuple[str, float, float]
"""Name, mean and SD, in SDs of what was known before."""


def bars(found: "Shared", model: "BodyModel") -> list[Bar]:
    """A bar for each parameter of the body, distance between joints, and the legs' difference;
    parameters are those of `page.tables`.
    """
    from gaitval.identification.joints import judged_lengths
    from gaitval.identification.verdicts import judged
    from gaitval.model.parameters import PARAMETERS

    shown = [
        *(each for each in judged(found.posterior) if each.name in PARAMETERS[2:]),
        *judged_lengths(found.posterior, model),
    ]
    legs = found.legs
    mean, sd = legs.estimate
    drawn = [(each.name.replace("_", " "), each.z, each.contraction) for each in shown]
    return [*drawn, ("left leg longer", mean / legs.prior_sd, sd / legs.prior_sd)]


def in_words(
    found: "Shared", model: "BodyModel", method: str, *, two_legs: bool = False
) -> dict[str, Any]:
    """What a study's report says of a body: `said`, the `bars`, and the `method` by which the
    walker's body was found; other parameters are those of `page.tables`. `two_legs`: the walker
    has legs that differ.
    """
    from gaitval.identification.body_words import sentences, walker_words

    shown = [{"name": name, "mean": mean, "sd": sd} for name, mean, sd in bars(found, model)]
    said = sentences(found, model)
    if method == "shared":  # of another method the walker has another body
        said = f"{said} {walker_words(found, two_legs)}"
    return {"method": method, "said": said, "bars": shown}


def of_scaled_walker(said: str) -> str:
    """The same sentences of a body that no walk came nearer with, and that the walker has not."""
    from gaitval.identification.body_words import AS_SCALED

    return f"{said.partition(' The walker has ')[0]} {AS_SCALED}"
