"""Which healthy people a person is beside: one footnote for all of a page's bands and norms."""

from typing import Final, NamedTuple

from gaitval.datasets.plausible import ADULT
from gaitval.gait.healthy_controls import load_controls
from gaitval.metrics.norms import norms_at

_TREADMILL: Final = "at this speed or the nearest of theirs, on a treadmill"
_OVER_GROUND: Final = "at their own speed, over ground"
WBDS: Final = "Fukuchi et al. 2018"


class HealthyPeople(NamedTuple):
    """Some healthy people, and what of a page is theirs.

    Attributes
    ----------
    of : what their mean and SD are of, as in `norms`: "angles", "moments", "power", "forces", names
        of parameters; "gait profile", and the "angle bands" and "moment bands" of one speed.
    people : how many; None where the source's number is not in what is shipped.
    how : at which speed and on what they walked.
    source : where that is published.
    """

    of: tuple[str, ...]
    people: int | None
    how: str
    source: str


def healthy_people(age_years: float | None) -> list[HealthyPeople]:
    """Whom a person of `age_years` (unknown: an adult) is beside on any page, each group once, the
    largest first.
    """
    children = "children, at free speed", "Schwartz, Rozumalski and Trost 2008"
    if age_years is not None and age_years < ADULT:
        return [HealthyPeople(("angles", "moments"), None, *children)]
    found: dict[tuple[int | None, str, str], list[str]] = {}
    for name, norm in norms_at(1.2, 0.9, None).items():
        kind, _, parameter = name.partition("/")
        what = parameter if kind == "parameter" else kind
        key: tuple[int | None, str, str]
        if what == "step_width":
            key = (None, "other adults, at their own speed", "J Neuroeng Rehabil 2012;9:69")
        else:
            own = what in ("angles", "walking_speed")
            key = (norm.people, _OVER_GROUND if own else _TREADMILL, WBDS)
        of = found.setdefault(key, [])
        if what not in of:
            of.append(what)
    # bands of whole curves (`healthy_bands`) are of one speed: theirs, of moments children's
    found[load_controls().people, _OVER_GROUND, WBDS] = ["gait profile", "angle bands"]
    found[(None, *children)] = ["moment bands"]
    return sorted(
        (HealthyPeople(tuple(of), *key) for key, of in found.items()),
        key=lambda each: -(each.people or 0),
    )
