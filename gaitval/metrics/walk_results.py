"""The walk's parts of `metrics.json` and of the files of its stages, as typed models.

They stand apart from the functions that make them, because those load the physics engines.
"""

from typing import Annotated, Final, Literal

from pydantic import AliasChoices, Field

from gaitval.configuration import PushSettings
from gaitval.metrics.typed import (
    Count,
    Curve,
    Flag,
    Number,
    Result,
    Sides,
    Size,
    StrictPositive,
    named,
)


class CountBySide(Sides[Count]):
    """Right and left."""


class Endurance(Result):
    """How far the rollout from one start phase went, see `gaitval.metrics.rollouts.endurance`."""

    start_phase: Number
    """Of the right gait cycle."""
    fell: Flag
    """The rollout ended early."""
    seconds: Size
    cycles: CountBySide
    """Complete gait cycles in a row after the settling ones."""
    scuffs: CountBySide
    """Contacts too short for a stance."""
    walking_speed: Number | None
    """m/s over whole right cycles; null without any."""
    engine: Literal["compiled", "dart", "mujoco"] = "dart"
    """That it walked in; a file without it is from when all walked in DART."""


class Repeat(Result):
    """What was measured of a repeat of the compared walk, see gaitval/metrics/repeats.py."""

    start_phase: Number
    noise: Size
    """rad, of its start."""
    seed: Count
    fell: Flag
    measures: dict[str, dict[str, Number | None]]
    """By measure and target."""


class HipCentre(Result):
    """Where the hip centre that the record's moments are about lies, as the reference was fitted:
    by so much forward and outward of the model's, m. See `reference.hip_moments.about_record`.
    """

    forward: Number
    outward: Number
    rmse_about_model: dict[str, Size]
    """Nm/kg; what the errors of the hip's moments would be about the model's own hip, by
    coordinate."""


class HipCentres(Sides[HipCentre]):
    """Of both sides."""


class MeanCurve(Result):
    """Mean and standard deviation over the cycles; null where there are too few."""

    mean: Curve | None
    sd: Curve | None


class PressurePath(Result):
    """Centre of pressure over stance in the footprint, % of foot length from the heel, towards
    the midline.
    """

    along: MeanCurve
    across: MeanCurve


_PERCENT, _PERCENTS = named(("10", "50", "90"))


class FootContact(Result):
    """How one foot met the ground, see gaitval/metrics/foot_contact.py."""

    stances: Count
    foot_length_m: StrictPositive
    spheres: list[Annotated[list[Number], Field(min_length=3, max_length=3)]]
    """Along, across and radius of each contact sphere in the footprint, foot lengths."""
    path: PressurePath
    progress: Annotated[dict[Annotated[str, _PERCENT], Number | None], *_PERCENTS]
    """Centre of pressure at % of stance, % of foot length from the heel."""
    bounces_per_stance: Number | None
    transient_peak: Number | None
    """Largest unfiltered vertical force in the first 15 % of stance, % BW, mean."""


class FootContacts(Sides[FootContact]):
    """Right and left foot."""


class PushRecovery(Result):
    """Recovery from horizontal pushes at the pelvis, see gaitval/metrics/push_recovery.py."""

    seconds: StrictPositive
    """s, how long each push lasts."""
    cycles: StrictPositive
    """Gait cycles without a fall after which a push counts as survived."""
    resolution: StrictPositive
    """N, the finest step in force."""
    ceiling: Size
    """N, the largest push tested: a walker that survived it may survive more."""
    phases: Annotated[list[Number], Field(min_length=1)]
    """Of the right gait cycle."""
    directions: Annotated[list[Number], Field(min_length=1)]
    """Degrees from straight ahead, left positive."""
    largest: list[Annotated[list[Size], Field(min_length=1)]]
    """By phase and direction, N: the largest force up to which every tested push was survived."""
    force: Size
    """N, of the push that must be survived."""
    criterion_directions: list[Number]
    """Degrees, those within 90° of straight ahead."""
    survived: list[list[Flag]]
    """By phase and criterion direction: whether the push of `force` was survived."""

    def targets(self) -> list[str]:
        """What a limit on pushes is about, by phase: with the force, if it is not the usual one."""
        usual = self.force == PushSettings().force
        return [
            f"phase {p:g}" if usual else f"phase {p:g}, {self.force:.0f} N" for p in self.phases
        ]


class PushTrace(Result):
    """Velocity of the centre of mass around a push, with five digits."""

    phase: Number
    """Of the right gait cycle at which the push begins."""
    direction: Number
    """Degrees from straight ahead, left positive."""
    force: Size
    """N."""
    fell: Flag
    cycles: list[Number]
    """Gait cycles since the beginning of the push."""
    velocity: list[Annotated[list[Number], Field(min_length=3, max_length=3)]]
    """m/s: forward, left, up."""


class PlacedFoot(Result):
    """A push to the side, and the first step after it that there was time for, see
    gaitval/metrics/foot_placement.py. Changes from the undisturbed walk, m to the left; null
    without such a step.
    """

    phase: Number
    """Of the right gait cycle at which the push begins."""
    direction: Number
    """Degrees from straight ahead, left positive."""
    force: Size
    """N."""
    fell: Flag
    side: Literal["right", "left"] | None
    """Of the foot."""
    lead: Size | None
    """s, from the beginning of the push to the heel strike."""
    foot: Number | None
    extrapolated: Number | None
    """Of the extrapolated centre of mass at the heel strike."""
    pendulum: Number | None
    """Of the foot by the capture point of a linear inverted pendulum."""


class StoredPushes(Result):
    """What a run folder keeps of its pushes: `push.json`, with all digits."""

    recovery: PushRecovery
    traces: list[PushTrace]
    placed: list[PlacedFoot] = Field(default_factory=list)
    """Of pushes to the side; none in folders of earlier versions."""


PARTS: Final = ("feed_forward", "servo", "policy", "passive")
"""Of the moment at a coordinate."""


class MomentShare(Result):
    """A part of the moment at a coordinate, see gaitval/metrics/torque_shares.py."""

    rms: Size
    """Nm/kg."""
    r_squared: Number | None
    """Share of the moment's variance that the part alone explains: 1 − residual over variance,
    below 0 where the part alone is worse than the mean; null for a constant moment."""


_PART, _PARTS = named(PARTS)
TorqueShares = dict[str, Annotated[dict[Annotated[str, _PART], MomentShare], *_PARTS]]
"""By actuated coordinate and part."""


class StoredStarts(Result):
    """How far the corrected walker got from every start phase, see `rollouts.walked_far`."""

    starts: list[Endurance]


class StoredWalks(Result):
    """How far the rollout from each start phase went: `rollouts/walks.json`, with all digits."""

    nominal: list[Endurance]
    identified: list[Endurance] | None = None
    second_engine: Endurance | None = Field(
        None, validation_alias=AliasChoices("second_engine", "witness")
    )
    """In the second physics engine."""
    centring: Size | None = None
    """Share of the policy's action bias that was taken away, if not the configured one."""
    torque_shares: TorqueShares | None
    """Of the walk that is validated."""
