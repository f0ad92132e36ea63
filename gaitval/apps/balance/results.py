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
    recovered: Count | None
    """Steps until feet are placed as before; null if not within the walk."""


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
    """By start, of an ensemble whose starts differ by micrometres and milliseconds."""
    slid: Size
    """m, in the walk without noise."""

    def words(self) -> str:
        """The settings with their units."""
        return setting_words(self.settings)


class ComparedQuantity(Result):
    """A quantity of the walker beside what was published, and two guesses."""

    name: str
    unit: str
    words: str
    of: str
    source: str
    locator: str
    low: _Figure
    high: _Figure
    walker: _Figure
    nothing: _Figure
    """Of one who does not react; null where it has none."""
    pendulum: _Figure
    inside: Flag
    """Whether the walker is within the published bounds."""


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
    grounds: list[GroundResult]
    quantities: list[ComparedQuantity]
    as_people: dict[
        Literal["walker", "nothing", "pendulum"],
        Annotated[list[Count], Field(min_length=2, max_length=2)],
    ]
    """In how many of the compared quantities each is within what was published, and of how many it
    says something."""

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
