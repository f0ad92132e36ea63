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
    from gaitval.identification.combinations import judged_lengths
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


def in_words(found: "Shared", model: "BodyModel", method: str) -> dict[str, Any]:
    """What a study's report says of a body: `said`, the `bars`, and the `method` by which the
    walker's body was found; other parameters are those of `page.tables`. Which body the walker has
    is said by `study.body_stage`.
    """
    from gaitval.identification.body_words import sentences

    shown = [{"name": name, "mean": mean, "sd": sd} for name, mean, sd in bars(found, model)]
    return {"method": method, "said": sentences(found, model), "bars": shown}
