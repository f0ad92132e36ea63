"""What `gaitval perturb` found, as typed models: `perturb.json` and its page."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Final, Literal

from pydantic import Field

from gaitval.metrics.typed import Count, Flag, Number, Result, Size, StrictPositive
from gaitval.reporting.written import Written

_Figure = Number | None
_Pair = Annotated[list[_Figure], Field(min_length=2, max_length=2)]


class PushedStep(Result):
    """A push, and the first step after it that there was time for. Pairs are forward and to the
    left, m, but for `offset`: changes from the undisturbed walk.
    """

    phase: Number
    """Of the right gait cycle."""
    direction: Number
    """Degrees from straight ahead, left positive."""
    force: Size
    """N."""
    fell: Flag
    number: Count | None
    """Which step after the push; null without one."""
    side: Literal["right", "left"] | None
    lead: Size | None
    """s, from the beginning of the push to the heel strike."""
    foot: _Pair
    extrapolated: _Pair
    """Of the extrapolated centre of mass at the heel strike."""
    offset: _Pair
    """Of the foot's distance from it, forward and outward."""
    pendulum: _Pair
    """Of the foot by the pendulum's capture point."""
    time: _Figure
    """s, of the heel strike."""
    recovered: Count | None
    """Steps until feet are placed as before; null if not within the walk."""
    spin: _Pair
    """kg m²/s, largest change of angular momentum rolling to the right and pitching forward."""
    lean: _Pair
    """Degrees, largest change of the trunk's lean forward and to the left."""


class LinearMapResult(Result):
    """How the next foot follows from the pelvis in mid-stance, see `placement.LinearMap`."""

    gains: Annotated[list[list[Number]], Field(min_length=2, max_length=2)]
    explained: Annotated[list[Number], Field(min_length=2, max_length=2)]
    steps: Count


GROUND_WORDS: Final = {"slip": "slips", "trip": "trips", "step": "steps down"}
"""Of the kinds of disturbed ground."""


SETTING_UNITS: Final = {"distance": " m", "hold": " s", "height": " m", "drop": " m"}
"""Of the settings of disturbed ground; the others are shares."""


def setting_words(settings: Mapping[str, float]) -> str:
    """The `settings` of a ground with their units."""
    return ", ".join(
        f"{name} {value:g}{SETTING_UNITS.get(name, '')}" for name, value in settings.items()
    )


class GroundResult(Result):
    """Walks on one kind of disturbed ground."""

    kind: Literal["slip", "trip", "step"]
    side: Literal["right", "left"]
    settings: dict[str, Number]
    survived: Annotated[list[Flag], Field(min_length=1)]
    """By start, of an ensemble whose starts differ by micrometres and milliseconds; what else is
    said of the ground is of the walk without noise."""
    slid: Size
    """m."""
    momentum_residual: Size | None
    """% of body weight, of the largest force that ground and gravity do not explain."""
    values: dict[str, _Figure]
    """By quantity."""

    def words(self) -> str:
        """The settings with their units."""
        return setting_words(self.settings)


class LargestPushes(Result):
    """Largest push up to which all starts survive, N, by phase and direction."""

    phases: list[Number]
    directions: list[Number]
    """Degrees."""
    largest: list[list[Size]]
    tried: Count
    torn: Count
    """Of the tried pushes, those on which the starts disagree."""
    flipped: Count
    again: Count
    """Walks with the largest pushes from starts that they were not found with: falls, and all."""


class ComparedQuantity(Result):
    """A quantity of the walker beside what was published, and two guesses."""

    kind: Literal["push", "slip", "trip", "step"]
    name: str
    unit: str
    words: str
    of: str
    source: str
    locator: str
    sign: Annotated[int, Field(ge=-1, le=1)] | None
    published: _Figure
    low: _Figure
    high: _Figure
    walker: _Figure
    nothing: _Figure
    """Of one who does not react; null where it has none."""
    pendulum: _Figure
    right_sign: Flag
    inside: Flag | None
    """Within the published bounds; null without any."""


class PerturbResult(Written):
    """What `gaitval perturb` found."""

    NAME: ClassVar[str] = "perturb"
    TEMPLATE: ClassVar[str] = "gaitval.apps.balance:perturb.html.j2"

    schema_version: Literal[1]
    walker: str
    mass_kg: StrictPositive
    pendulum_m: StrictPositive
    """Height of the centre of mass: the length of the pendulum."""
    delays_s: Annotated[list[Size], Field(min_length=3, max_length=3)]
    """By which the policy felt its body late: joints and feet, balance organ, vision."""
    steady_fell: Flag
    """Whether it fell without any disturbance; then there is nothing else."""
    pushes: list[PushedStep]
    steady: LinearMapResult | None
    """Of walks that begin with noise and are not pushed, without the first step of each foot."""
    moved: LinearMapResult | None
    """Of pushed walks."""
    grounds: list[GroundResult]
    largest: LargestPushes | None
    quantities: list[ComparedQuantity]
    as_people: dict[
        Literal["walker", "nothing", "pendulum"],
        Annotated[list[Count], Field(min_length=2, max_length=2)],
    ]
    """In how many of the compared quantities each has the published sign, and is within what was
    published where that has bounds; and of how many it says something."""

    def answers(self) -> list[str]:
        """What it survived, and how much is as in people, a sentence each."""
        if self.steady_fell:
            return ["It falls without any disturbance, so nothing was compared."]
        found = []
        if self.pushes:
            fell = sum(each.fell for each in self.pushes)
            found.append(f"Pushes: {len(self.pushes) - fell} of {len(self.pushes)} survived.")
        starts: dict[str, list[bool]] = {}
        for each in self.grounds:
            starts.setdefault(GROUND_WORDS[each.kind], []).extend(each.survived)
        if starts:
            stood = (f"{word} {sum(each)} of {len(each)}" for word, each in starts.items())
            found.append(f"Starts that survived: {', '.join(stood)}.")
        if self.quantities:
            right, count = self.as_people["walker"]
            found.append(f"As people in {right} of {count} published quantities.")
        return found
