"""The lengths of a body as a subject's file keeps them."""

from collections.abc import Mapping

from pydantic import ValidationError

from gaitval.coordinates import SIDES, Side
from gaitval.errors import ScalingError
from gaitval.scaling.measurements import ADAPTER, HEADS, LIMB_FIELDS, Measurements


def measurements_from(stored: Mapping[str, object]) -> Measurements:
    """What `Measurements.to_dict` stored. A length of one side only is that of both. Raises
    ScalingError, which lists every key that is missing, unknown or not of the right shape.
    """
    nested, one_sided = _by_side(stored)
    try:
        return ADAPTER.validate_python(nested | {"one_sided": one_sided})
    except ValidationError as error:
        problems = dict.fromkeys(
            _problem(each["loc"], each["type"], stored) for each in error.errors()
        )
        raise ScalingError(
            "the measurements of the body cannot be used:\n  " + "\n  ".join(problems)
        ) from None


def _by_side(stored: Mapping[str, object]) -> tuple[dict[str, object], dict[str, Side]]:
    """The stored values with those of `Limbs` by side, and what is known of one side only."""
    known: dict[str, dict[str, object]] = {side: {} for side in SIDES}
    values: dict[str, object] = {}
    for key, value in stored.items():
        name, _, side = key.rpartition("_")
        if side in known and (name in LIMB_FIELDS or name in HEADS) and name != "metatarsals":
            known[side][name] = value
        else:
            values[key] = value
    one_sided: dict[str, Side] = {}
    for side, other in (SIDES, SIDES[::-1]):
        for name in known[side]:
            if name not in known[other]:
                one_sided["metatarsals" if name in HEADS else name] = side
    for side, other in (SIDES, SIDES[::-1]):
        limbs = known[other] | known[side]
        if any(name in limbs for name in HEADS):
            limbs["metatarsals"] = [limbs.pop(name, None) for name in HEADS]
        values[side] = limbs
    return values, one_sided


def _problem(place: tuple[int | str, ...], kind: str, stored: Mapping[str, object]) -> str:
    """A problem in the words of the file."""
    name = str(place[1] if len(place) > 1 and place[0] in SIDES else place[0])
    if kind in ("missing", "unexpected_keyword_argument"):
        return f"{name}: {'missing' if kind == 'missing' else 'unknown'}"
    if name == "sources":
        return "sources: must be a table of texts"
    sides = (place[0], *SIDES)  # the value may be the other side's
    keys = [name, *(f"{each}_{side}" for side in sides for each in (name, *HEADS))]
    key = next(each for each in keys if each in stored)
    what = "three numbers" if name in ("heel", "metatarsals") else "a number"
    return f"{key} = {stored[key]!r}: must be {what} in m (masses in kg, tilt in rad)"
