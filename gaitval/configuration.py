"""Every constant of a run, documented in one place. It is long because that is one place.

`Configuration()` is the default. A TOML file and `--set section.key=value` override it:

>>> configuration = load_configuration(settings=["training.samples=500000"])
>>> configuration.training.samples
500000
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    field_validator,
    model_serializer,
    model_validator,
)

from gaitval._internal.io.artefacts import parse_toml, read_toml
from gaitval._internal.text.any_case import as_known, literals_of
from gaitval.conventions import OWN, convention_of
from gaitval.errors import ConfigurationError

NAMED = Path(__file__).parent / "configurations"
"""Configurations that can be given by name: `paper`."""

LARGEST = 1e9
"""Bound on every number and its inverse. The largest constant is the modulus of the contact, 3e6
Pa; squares and sums of much larger numbers exceed the resolution of a float."""
LARGEST_SEED = 2**32 - 2
"""NumPy's and cma's random numbers take 32 bits; the search's seed is one more than the run's."""
ROLLOUT_SAMPLES = 1_000_000
"""Most samples between updates, over all environments: each takes 1.3 kB of shared memory."""
REPEATS = 1_000_000
"""Bound on counts of rounds, cycles and directions: more would run for years, or fill the memory
before the first walk."""


def _not_vanishing(value: float) -> float:
    if 0 < value < 1 / LARGEST:
        raise ValueError(f"{value:g} is all but zero; give at least {1 / LARGEST:g}")
    return value


Positive = Annotated[float, Field(gt=0, le=LARGEST), AfterValidator(_not_vanishing)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Phase = Annotated[float, Field(ge=0, lt=1)]
NerveDelay = Annotated[float, Field(ge=0, le=1)]
LARGEST_TRAINING = 10**12
"""Samples; at 10,000 a second they take three years."""
Rate = Annotated[float, Field(gt=0, le=1)]
LogDeviation = Annotated[float, Field(ge=-10, le=2)]
"""Logarithm of an action's standard deviation: beyond, actions are all but certain, or all but
random and clipped."""


def _each_once(phases: tuple[float, ...]) -> tuple[float, ...]:
    if len(set(phases)) < len(phases):
        raise ValueError(f"{list(phases)} has a phase twice; give each once")
    return phases


def _ascending(limits: tuple[float, float]) -> tuple[float, float]:
    if limits[0] > limits[1]:
        raise ValueError(
            f"{list(limits)} goes down; give the lower one first: {list(reversed(limits))}"
        )
    return limits


Phases = Annotated[
    tuple[Phase, ...], Field(min_length=1, max_length=100), AfterValidator(_each_once)
]
"""Phases of the right gait cycle, from 0 to below 1, each once."""
PositiveRange = Annotated[tuple[Positive, Positive], AfterValidator(_ascending)]
NotNegativeRange = Annotated[tuple[NotNegative, NotNegative], AfterValidator(_ascending)]
FractionRange = Annotated[tuple[Fraction, Fraction], AfterValidator(_ascending)]


class Section(BaseModel):
    """A group of constants: frozen, unknown keys, infinity and NaN refused."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True
    )

    @field_validator("*", mode="before")
    @classmethod
    def _on_or_off(cls, value: Any, info: Any) -> Any:
        if isinstance(value, bool) and cls.model_fields[info.field_name].annotation is not bool:
            raise ValueError(
                f"{str(value).lower()} is for settings that are on or off; give a value like "
                f"the default, {cls.model_fields[info.field_name].default!r}"
            )
        return as_known(value, literals_of(cls.model_fields[info.field_name].annotation))


class RecordSettings(Section):
    """What a run may know of the recorded gait."""

    use: Literal["all", "kinematics"] = "all"
    """`all`: angles, moments and forces; the walk is then fitted to the record that it is compared
    with. `kinematics`: angles, speed and timing only; moments and forces are predicted, and the
    recorded ones are read by nothing but the comparison (docs/held-out.md)."""
    holdout: str = ""
    """Name of a trial that is held out and compared with; the walk is then predicted from the
    person's other trials. Empty: the subject's own trial, which is known to the model."""
    speed: NotNegative = 0.0
    """Speed that is predicted, m/s; 0: that of the trial that is held out, or the recorded one."""
    slope: float = Field(0.0, gt=-100.0, lt=100.0)
    """%, rise of the ground over horizontal distance ahead that is predicted; uphill positive."""
    cross_slope: float = Field(0.0, gt=-100.0, lt=100.0)
    """%, likewise to the left."""
    load: NotNegative = 0.0
    """% of body mass, a vest that is predicted."""

    @model_validator(mode="after")
    def _one(self) -> Self:
        if self.holdout and self.speed:
            raise ValueError(
                f"holdout {self.holdout} and speed {self.speed:g} m/s: a walk at one speed would "
                "be compared with a trial at another. Give one of them."
            )
        if self.holdout and (self.slope or self.cross_slope or self.load):
            raise ValueError(
                f"holdout {self.holdout}, slope {self.slope:g} %, cross-slope {self.cross_slope:g} "
                f"% and load {self.load:g} %: the trial was walked on the level without a load, so "
                "it says nothing about this walk. Leave the trial or the slope and load out."
            )
        return self


class ScalingSettings(Section):
    """How a person's measurements become the body."""

    symmetric: bool = True
    """Both sides of the body are the mean of right and left. If false, or if one leg is longer in
    every length, each arm and leg has its own lengths, masses and inertia, and its own row in the
    scaling table."""


class ContactSettings(Section):
    """Contact of the foot spheres with the ground (`gaitval.walk.contact`).

    Hunt-Crossley: friction as published by Falisse et al. 2022 (PredSim: 0.8/0.8/0.5), but with
    less slip than its 0.2 m/s, with which a loaded foot crept at 10 cm/s (with 0.085 none of ten
    people's does at 4); stiffness and dissipation as in the
    Moco 2-D walking example (E 3.07 MPa, c 2 s/m): with PredSim's 1 MPa the foot sinks in by 12 mm,
    more than the foot clearance of the recorded swing.
    """

    law: Literal["hunt_crossley", "cubic"] = "hunt_crossley"
    """`hunt_crossley`: OpenSim's smooth form (Serrancolí et al. 2019). `cubic`: a cubic spring
    (Ackermann and van den Bogert 2010); it reads the settings that begin with its name."""
    stiffness: Positive = 3_067_776.0
    """Plane strain modulus E, Pa."""
    dissipation: Positive = 2.0
    """Hunt-Crossley dissipation c, s/m."""
    dynamic_to_static: Positive = 1.0
    """Dynamic / static friction; the static coefficient is the body parameter sigma."""
    viscous_friction: NotNegative = 0.5
    """Viscous friction coefficient, s/m."""
    transition_velocity: Positive = 0.085
    """Slip velocity at which friction is fully developed, m/s."""
    cubic_stiffness: Positive = 5e7
    """Force on a sphere / penetration³, N/m³. As in OpenSim Moco's form of the law; it is meant for
    two points under a foot, and six spheres sink in by 13 mm under a body that stands."""
    cubic_dissipation: Positive = 1.0
    """Force of a penetration rate of 1 m/s over that at rest, s/m."""
    cubic_friction_velocity: Positive = 0.05
    """Slip velocity at which friction is 46 % developed, m/s."""
    event_threshold: Positive = 20.0
    """Vertical force above which a foot counts as on the ground, N (the smooth form leaves a
    few newtons just above the ground)."""


class ServoSettings(Section):
    """Joint servos: stiffness Nm/rad and damping Nms/rad at 70 kg, scaled with body mass."""

    hip: Positive = 320.0
    knee: Positive = 320.0
    ankle: Positive = 240.0
    subtalar: Positive = 120.0
    toe: Positive = 30.0
    lumbar: Positive = 400.0
    """A back of 640 passed the landing on to the trunk, by more than 0.03 Nm/kg above 12 Hz in two
    of ten people, one of 480 in one (docs/what-we-tried.md)."""
    shoulder: Positive = 64.0
    damping_time: Positive = 0.08
    """Damping / stiffness, s."""
    feed_forward: Fraction = 1.0
    """Fraction of the record's joint moments that is fed forward."""


SENSES: Final = ("observation_delays", "observation_noise", "action_memory")
"""Settings of what a policy is told of its body by nerves."""


class EnvironmentSettings(Section):
    """The walking task: time steps, observation, termination, randomisation."""

    observation: Literal["paper", "extended"] = "extended"
    """`paper`: the paper's 71 numbers; `extended`: those, and what balance needs."""
    mirror: bool = True
    """Around the left heel strike observations and actions are mirrored, so the policy learns one
    step for both legs (extended observation only; the reference keeps its sides)."""
    physics_step: float = Field(0.002, ge=1e-5, le=0.05)
    """s; at most 0.05, so that the 10 Hz content used in the comparison is resolved."""
    steps_per_action: int = Field(3, ge=1, le=1000)
    """Physics steps for one action, outside training (`training.steps_per_action`)."""
    action_scale: Positive = 0.2
    """Offset of a joint target for an action of 1, rad."""
    action_limit: Positive = 4.0
    """Actions are clipped at this."""
    action_time: NotNegative = 0.015
    """Time constant of the filter between the policy and the joint targets and pace, s: as a muscle
    is activated. 0: none."""
    arm_share: Fraction = 0.0
    """Fraction of an action's offset that reaches shoulders and elbows. 0: the arms swing as in the
    reference and the policy cannot move them; the record does not contain them."""
    centring: Fraction = 0.5
    """Share of a trained policy's action bias that is removed outside training. The action bias
    is what it does at each phase when the body is exactly on the reference, where nothing needs to
    be done; it is learned under noise, pushes and other bodies, and moves the walk away from the
    reference. 0: the policy as trained."""
    pace_scale: NotNegative = 0.125
    """Change of pace for an action of 1: the policy may move through the recorded cycle faster or
    slower than the record, to step in time after a push. 0: the pace is the record's."""
    episode_seconds: float = Field(9.0, gt=0, le=3600)
    """Length of a training episode, s."""
    height_tolerance: Positive = 0.2
    """A walker has fallen when the pelvis is this far from its reference height, m, ..."""
    rotation_tolerance: Positive = 0.7
    """... or turned this far from its reference, rad, ..."""
    drift_tolerance: Positive = 0.8
    """... or this far from its reference position, along the walkway or sideways, m."""
    observation_delays: tuple[NerveDelay, NerveDelay, NerveDelay] = (0.0, 0.0, 0.0)
    """s, by which the policy feels its body late, as through nerves: joints, feet and ground; what
    the balance organ tells; what is seen of the body's path. Not its own clock, its last action and
    what it knows of itself. Rounded to whole actions. People: about 0.05, 0.1, 0.15. 0: of now."""
    observation_noise: NotNegative = 0.0
    """Standard deviation of the noise on what is felt, rad, m, m/s, rad/s, tens of rad/s of joints,
    body weights: new in every action."""
    action_memory: float = Field(0.0, ge=0.0, le=1.0)
    """s, of past actions that the policy is told, as means over 0.05 s: what a forward model needs
    to know how the body has moved since it was felt."""
    initial_noise: NotNegative = 0.02
    """Standard deviation of joint angles (rad) at the start of an episode."""
    push_probability: Fraction = 0.8
    """Fraction of training episodes with pushes."""
    push_interval: PositiveRange = (1.5, 2.5)
    """Gait cycles from one push in an episode to the next, shortest and longest."""
    push_force: NotNegative = 800.0
    """Largest push, N; the magnitude is uniform from 0 (the paper's 0-800 N) ..."""
    push_focus: NotNegative = 450.0
    """... but every other push is drawn from 0 to this, N: beyond it a sideways push makes a slow
    walker fall whatever it does, so nothing is learned."""
    push_seconds: float = Field(0.05, gt=0, le=10)
    """Duration of a push, s (the paper's 50 ms). A push acts during whole actions; the last one
    with less force if the duration is not a multiple of an action's, so the impulse is exact."""

    def entering(self, action_seconds: float) -> float:
        """The share of the way to a new action that is gone within its duration, s."""
        return 1.0 - math.exp(-action_seconds / self.action_time) if self.action_time else 1.0

    @property
    def slowest_pace(self) -> float:
        """The slowest pace that an action can choose."""
        return 1.0 - self.pace_scale * self.action_limit

    @model_serializer(mode="wrap")
    def _as_before_it_was_known(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without nerves the settings are written as before there were any, so that no stage runs
        again for them.
        """
        values: dict[str, Any] = write(self)
        for name in SENSES:
            if getattr(self, name) == type(self).model_fields[name].default:
                values.pop(name, None)
        return values

    @model_validator(mode="after")
    def _goes_forward(self) -> "EnvironmentSettings":
        if self.slowest_pace <= 0.0:
            raise ValueError(
                f"pace_scale {self.pace_scale:g} x action_limit {self.action_limit:g} must be "
                "below 1, or the walker could move backwards through the gait cycle"
            )
        return self


class RewardSettings(Section):
    """Weights and kernel widths of the reward.

    Every term is weight x exp(-sharpness x squared error), the bounded form of the paper's signed
    differences (DeepMimic's). The paper's weights are 5, 2, 0.5 and 0.005 on the first, third,
    fifth and last term; docs/learning.md shows what the other terms and the kernel widths
    contribute.
    """

    joint_positions: NotNegative = 5.0
    joint_positions_sharpness: Positive = 20.0
    """1/rad², on the sum over the 25 coordinates."""
    joint_velocities: NotNegative = 1.0
    joint_velocities_sharpness: Positive = 0.05
    """s²/rad²."""
    centre_of_mass: NotNegative = 2.0
    centre_of_mass_sharpness: Positive = 40.0
    """1/m²."""
    pelvis_rotation: NotNegative = 2.0
    pelvis_rotation_sharpness: Positive = 40.0
    """1/rad²."""
    end_effectors: NotNegative = 2.0
    end_effectors_sharpness: Positive = 100.0
    """1/m², on the sum over feet and hands."""
    ground_reaction: NotNegative = 6.0
    ground_reaction_sharpness: Positive = 40.0
    """1/(body weight)², on the sum over both feet of the mean force during the action; fore-aft
    counts twice and sideways three times, because these forces are a fifth and a tenth of the
    vertical one."""
    joint_moments: NotNegative = 3.0
    joint_moments_sharpness: Positive = 4.0
    """1/(Nm/kg)², on the sum over the 25 coordinates of the difference from the reference's
    moments."""
    pace: NotNegative = 1.0
    pace_sharpness: Positive = 400.0
    """On the squared difference from the record's pace, 1."""
    action_change: NotNegative = 2.0
    action_change_sharpness: Positive = 8.0
    """On the mean squared change of the action, in its units, from one to the next."""
    torque: NotNegative = 0.005
    """Cost of the mean squared normalised servo torque: |tau|²/(mass)², per (Nm/kg)²."""


class RandomisationSettings(Section):
    """Bounds of the 14 body parameters mu: randomised in training, bounds in identification."""

    damping: NotNegativeRange = (0.0, 2.0)
    """Passive joint damping beta, Nms/rad. PredSim uses 0.1; 2 is its toe joint."""
    friction: PositiveRange = (0.6, 1.0)
    """Foot-ground friction sigma (shoe on treadmill belt); PredSim uses 0.8."""
    foot_length: PositiveRange = (0.95, 1.05)
    """Factor on the scaled length. Marker-based lengths are accurate to about 1 cm."""
    shank_length: PositiveRange = (0.97, 1.03)
    thigh_length: PositiveRange = (0.97, 1.03)
    joint_offset: NotNegative = 0.01
    """Each coordinate of the hip, knee and ankle offset is within this, m (Harrington's hip
    regression has an error of about 1 cm)."""


def _samples_or_auto(value: Any) -> Any:
    if isinstance(value, float) and value.is_integer():  # such as 1e6
        value = int(value)
    if value in ("auto", "full") or (isinstance(value, int) and 1 <= value <= LARGEST_TRAINING):
        return value
    raise ValueError(
        f"give a number of samples from 1 to {LARGEST_TRAINING:.0e}, auto or full, but it is "
        f"{value!r}. The default is 'auto'"
    )


CountOfSamples = Annotated[int | Literal["auto", "full"], BeforeValidator(_samples_or_auto)]

Start = Literal["scratch", "general", "policy", "needing", "range"]
"""What a training starts from: nothing; the general policy, for one person or for a person's range
of speeds; another policy of this body, as each further round of Algorithm 1 does, `needing` if only
who still needs it is trained."""

SAMPLES_FROM: Final[Mapping[Start, int]] = {
    "scratch": 4_000_000,
    "general": 500_000,
    "policy": 800_000,
    "needing": 2_000_000,
    "range": 2_000_000,
}
"""Environment steps of a whole training, by its start, where `training.samples` is not a number
(docs/learning.md)."""


class TrainingSettings(Section):
    """Proximal policy optimisation (stable-baselines3)."""

    samples: CountOfSamples = "auto"
    """Environment steps of every training of the run, whatever it starts from. `full`: by its
    start, see `SAMPLES_FROM`. `auto`: as `full`, but none for a person for whom the policy it would
    start from walks without a fall and survives the pushes (`metrics.learning_gain.NEEDED`)."""
    workers: int = Field(2, ge=1, le=1024)
    """Processes; each runs its share of the environments, in groups of eight: more processes than
    environments / 8 are not started."""
    environments: int = Field(32, ge=1, le=ROLLOUT_SAMPLES)
    """Environments over all workers; a multiple of eight makes the best use of the processor."""
    steps_per_action: int = Field(5, ge=1, le=1000)
    """Physics steps for one action while learning: 10 ms, so that samples cover more time. What has
    learned so walks better with quicker actions (docs/paper.md)."""
    rollout_steps: int = Field(128, ge=1, le=ROLLOUT_SAMPLES)
    """Steps of each environment between updates."""
    batch_size: int = Field(512, ge=2, le=ROLLOUT_SAMPLES)
    epochs: int = Field(6, ge=1, le=1000)
    discount: Fraction = 0.995
    gae_lambda: Fraction = 0.98
    learning_rate: Rate = 3e-4
    final_learning_rate: Rate = 5e-5
    """The rate falls linearly to this over `samples`."""
    clip_range: Rate = 0.2
    target_kl: Positive = 0.03
    warm_learning_rate_factor: Rate = 0.6
    """Fraction of `learning_rate` that a warm start begins with."""
    initial_log_std: LogDeviation = -1.0
    """Logarithm of the standard deviation of actions: kept through the first `exploration_hold` of
    the training, then lowered linearly to `final_log_std`, because large noise hides small
    errors."""
    final_log_std: LogDeviation = -1.8
    exploration_hold: Fraction = 0.2
    difficulty_ramp: FractionRange = (0.25, 0.7)
    """Fractions of the training between which the randomisation of mu and pushes grows from nothing
    to its full range."""
    tolerance_shares: tuple[Positive, Positive] = (0.5, 1.0)
    """Fractions of the tolerances of `environment` (which define a fall) at which a training
    episode ends: before the ramp, when samples of a walker about to fall teach little, and after
    it, when pushes teach recovery."""
    hidden_units: int = Field(128, ge=1, le=4096)
    """Units in each of the two hidden layers (the paper's 128); 4096 take half a gigabyte."""
    device: Literal["auto", "cpu", "cuda"] = "cpu"
    """Where the network learns; the environments run on the CPU. `auto`: CUDA if there is any. CUDA
    rounds differently from the CPU, and walking amplifies rounding errors, so
    with `cuda`, or with `auto` on a machine with CUDA, the same seed gives another policy."""
    checkpoint_samples: int = Field(200_000, ge=1, le=LARGEST_TRAINING)
    """Samples between checkpoints, in whole rollouts; a kill loses no more. All episodes restart at
    each checkpoint, so that a training resumed from it gives the same policy bit for bit."""

    def samples_from(self, start: Start) -> int:
        """Environment steps of a training from `start`."""
        return self.samples if isinstance(self.samples, int) else SAMPLES_FROM[start]


class IdentificationSettings(Section):
    """The posterior of mu, or CMA-ES (Hansen's cma) over rollouts."""

    method: Literal["shared", "rollouts", "none"] = "shared"
    """`shared`: see `gaitval.identification.default`. `rollouts`: the paper's, with the policy of
    each round. `none`: the body stays as scaled."""
    two_legs: bool = False
    """The walker walks on legs that differ by what was found; else both are the mean."""
    population: int = Field(8, ge=4, le=10_000)
    """The paper's 8."""
    generations: int = Field(400, ge=1, le=REPEATS)
    """At most; the search ends when it has converged."""
    initial_sigma: Positive = 0.5
    """Initial step, in standard deviations of the prior."""
    tolerance: Positive = 0.03
    """The search has converged when its distribution is narrower than this in every parameter, in
    standard deviations of the prior."""
    rounds: int = Field(4, ge=1, le=1000)
    """Largest number of rounds of Algorithm 1 (train, identify)."""
    kappa: Positive = 1.4
    """Algorithm 1 ends when the walker's error epsilon is below this multiple of its reference's:
    at the square root of two, the walker adds an error as large as the reference's, if the two are
    independent."""

    @model_validator(mode="before")
    @classmethod
    def _of_an_earlier_version(cls, values: Any) -> Any:
        """Without `parameters`, of which `paper` is all that is left: files to 0.7.0 have it."""
        if isinstance(values, dict) and values.get("parameters") == "paper":
            return {name: value for name, value in values.items() if name != "parameters"}
        return values


class NoiseSettings(Section):
    """Errors of a record, as standard deviations, which weight it in identification."""

    angle_offset: Positive = 0.035
    """Of an angle throughout the cycle, rad: 2 degrees, from where markers are put (McGinley 2009:
    2-5 degrees between sessions)."""
    angle: Positive = 0.014
    """RMS of an angle's error about its offset, rad: 0.8 degrees, mostly skin."""
    angle_harmonics: int = Field(4, ge=1, le=24)
    """Harmonics up to which it is spread evenly; higher ones fall with their order squared."""
    moment: Positive = 0.05
    """Nm/kg, of hip flexion, knee and ankle moments, besides the effect of wrong joint centres."""
    adduction_moment: Positive = 0.08
    """Nm/kg, of the hip adduction moment."""
    vertical_force: Positive = 0.015
    """Body weights."""
    forward_force: Positive = 0.008
    """Body weights."""
    medial_force: Positive = 0.006
    """Body weights."""
    independent: Positive = 6.0
    """Independent values in a curve of moment or force: errors correlate over the cycle."""
    joint_centre: Positive = 0.01
    """m, of the joint centres that the laboratory's moments are about."""
    plate: Positive = 0.01
    """m, of the centre of pressure of each plate, fore and aft."""


class CorrectionSettings(Section):
    """Change of the motion given to the policy that makes its walk most like the reference."""

    steps: int = Field(10, ge=0, le=1000)
    """Largest number of steps towards it, of eight walks each; 0: no correction. Fewer are taken if
    one gains less than 2 %."""
    harmonics: int = Field(12, ge=0, le=12)
    """Harmonics of the gait cycle in the change of each angle. A prior holds them near zero. With 6
    of them forces near 10 Hz could not be answered."""
    largest: Positive = 0.052
    """No angle is changed by more than this, rad: 3 degrees, within the 2-5 degrees that OpenSim's
    checklist allows residual reduction to change a motion."""


class ValidationSettings(Section):
    """How the simulated walk is compared with the record."""

    start_phases: Phases = (0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875)
    """Each rollout starts at one of these phases. The first one is compared; in none may the walker
    fall."""
    cycles: int = Field(24, ge=2, le=10_000)
    """Gait cycles of each foot that are compared, the first ones after the settling ones."""
    consecutive_cycles: int = Field(102, ge=2, le=10_000)
    """Planned gait cycles of each rollout after the settling ones. The first and last heel strikes
    may be outside, so about one cycle less is counted."""
    settling_cycles: int = Field(3, ge=0, le=10_000)
    """Cycles left out at the start of each rollout."""
    filter_frequency: Positive = 10.0
    """Cut-off of the zero-lag fourth-order Butterworth filter on simulated forces and moments, Hz;
    convention. The recorded mean curves are as smooth as if filtered this way, but we found no
    statement of the cut-off that the dataset's authors used."""


FULL_MASS_KG: Final = 46.0
"""The lightest of the people for whom the pushes were set. Experiments push people in proportion to
their weight (Vlutters et al. 2016, J Exp Biol 219:1514)."""


class PushSettings(Section):
    """Tests of recovery from a horizontal push of `environment.push_seconds` at the pelvis."""

    phases: Phases = (0.0, 0.25, 0.5, 0.75)
    """Phases of the right gait cycle at which a push begins."""
    directions: int = Field(12, ge=1, le=360)
    """Number of directions, evenly spaced around the circle, the first one straight ahead."""
    step: float = Field(100.0, ge=0.1, le=10_000)
    """Pushes grow by this until the walker falls, N, ..."""
    resolution: float = Field(25.0, ge=0.1, le=10_000)
    """... and from the last one survived by this, N."""
    largest: float = Field(1200.0, gt=0, le=10_000)
    """Largest push tested, N."""
    force: float = Field(300.0, gt=0, le=10_000)
    """The push that must be survived in the directions within 90 degrees of straight ahead, N;
    convention, within the paper's 0-800 N."""
    cycles: float = Field(5.0, gt=0, le=1000)
    """Gait cycles without a fall after which a push counts as survived; convention: by then a
    walker that recovers walks as before."""
    required_directions: int = Field(25, ge=1, le=360)
    """Directions, evenly spaced from 90 degrees right to 90 degrees left of straight ahead, of the
    push that must be survived: one of 25 is 4 %, so that a limit of 80 % is five pushes from the
    best, and no single push decides it."""

    def of_mass(self, mass_kg: float) -> Self:
        """The same tests of a person of `mass_kg`: all forces are as much less as they are lighter
        than `FULL_MASS_KG`, so that a push changes their speed by as much.
        """
        share = min(mass_kg / FULL_MASS_KG, 1.0)
        forces = ("step", "resolution", "largest", "force")
        return self.model_copy(update={name: share * getattr(self, name) for name in forces})


class ProcessingSettings(Section):
    """How recorded markers and forces are cleaned before kinematics and dynamics (`import`)."""

    marker_cutoff_hz: Positive = 8.0
    """Zero-lag Butterworth low-pass of joint angles and positions; the stated cut-off is that of
    the whole zero-lag filter. 6 Hz is usual for walking (Winter 2009), but lowers the peak moments
    of a synthetic walk by up to 10 %; with 3 mm of marker noise, 8 Hz leaves errors of 5 % and 0.85
    degrees (`tests/workflows/test_import_truth.py`)."""
    force_cutoff_hz: Positive = 20.0
    """The same for the ground reaction that is shown and compared: it keeps the impact."""
    moment_force_cutoff_hz: Positive = 8.0
    """The same for the forces that inverse dynamics uses: as for the markers, because different
    cut-offs cause impact artefacts in the moments (Kristianslund et al. 2012)."""
    filter_order: int = Field(4, ge=2, le=8, multiple_of=2)
    """Order of the zero-lag filter (twice that of each pass)."""
    force_threshold_n: Positive = 20.0
    """Vertical force below which a foot is in the air; 5 % of the weight, if that is less."""
    largest_gap_s: Positive = 0.1
    """Longest gap of a marker that a spline fills; with three other markers on the segment, gaps up
    to five times as long are rebuilt from them."""


def _is_a_convention(name: str) -> str:
    try:
        return convention_of(name).name
    except ConfigurationError as error:
        raise ValueError(str(error)) from None


class ReportSettings(Section):
    """Paper of the pages, what they have, and how their angles are counted; no file but a page's
    figures and their tables depends on them.
    """

    paper: Literal["a4", "letter"] = "a4"
    """Sheets of the PDF."""
    pdf: bool = True
    """Whether a page is written as PDF, too, which takes as long as its figures."""
    figures: bool = True
    """Whether a page has its figures; without them it is written in a fifth of the time, and the
    tables behind them are there all the same."""
    convention: Annotated[str, AfterValidator(_is_a_convention)] = OWN
    """What joint angles are called zero by, in the figures of imports and reports: isb,
    plug-in-gait, rajagopal2016, gait2392, or the forward tilt, in degrees, of the plane of ASIS and
    PSIS in another model's zero (`gaitval.conventions`)."""
    extensor_positive: bool = False
    """Whether figures draw the moments of extensors, plantarflexors and abductors positive, as
    clinical reports do; tables of curves keep their sign."""


class Configuration(Section):
    """All sections, and the seed of all random numbers."""

    seed: int = Field(0, ge=0, le=LARGEST_SEED)
    record: RecordSettings = RecordSettings()
    contact: ContactSettings = ContactSettings()
    servo: ServoSettings = ServoSettings()
    environment: EnvironmentSettings = EnvironmentSettings()
    reward: RewardSettings = RewardSettings()
    randomisation: RandomisationSettings = RandomisationSettings()
    training: TrainingSettings = TrainingSettings()
    identification: IdentificationSettings = IdentificationSettings()
    noise: NoiseSettings = NoiseSettings()
    correction: CorrectionSettings = CorrectionSettings()
    validation: ValidationSettings = ValidationSettings()
    pushes: PushSettings = PushSettings()
    processing: ProcessingSettings = ProcessingSettings()
    scaling: ScalingSettings = ScalingSettings()
    report: ReportSettings = ReportSettings()

    @model_validator(mode="after")
    def _fit_each_other(self) -> "Configuration":
        training, validation = self.training, self.validation
        samples = training.environments * training.rollout_steps
        if samples > ROLLOUT_SAMPLES:
            raise ValueError(
                f"training.environments {training.environments} x training.rollout_steps "
                f"{training.rollout_steps} are {samples:,} samples between updates, more than "
                f"{ROLLOUT_SAMPLES:,} and than memory holds; make one of them smaller"
            )
        if validation.consecutive_cycles < validation.cycles:
            raise ValueError(
                f"validation.consecutive_cycles {validation.consecutive_cycles} are fewer than the "
                f"{validation.cycles} that are compared; give at least validation.cycles"
            )
        # a filter cannot cut off above half the sample rate
        nyquist = 0.5 / self.environment.physics_step
        if validation.filter_frequency >= nyquist:
            raise ValueError(
                f"validation.filter_frequency {validation.filter_frequency:g} Hz is not below half "
                f"the {2 * nyquist:g} Hz of the simulation, so no filter has it; give a lower one"
            )
        return self


def _merge(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in changes.items():
        if isinstance(value, dict) and isinstance(merged.get(key), dict):
            value = _merge(merged[key], value)
        merged[key] = value
    return merged


def _setting(text: str) -> dict[str, Any]:
    name, separator, value = text.partition("=")
    if not separator or not name.strip():
        raise ConfigurationError(
            f"--set {text}: not of the form section.key=value, for example "
            "--set training.samples=500000."
        )
    value, parts = value.strip(), name.strip().split(".")
    if len(parts) > 2:
        raise ConfigurationError(
            f"--set {text:.80}: {len(parts)} names with dots between them, but a setting has a "
            "section and a key at most: training.samples=500000."
        )
    try:
        parsed: Any = parse_toml(f"value = {value}", f"--set {text:.80}", ConfigurationError)
        parsed = parsed["value"]
    except ConfigurationError:
        # a bare word is taken as text; a broken list, table or number is an error
        if value[:1] in "[{" or value.lstrip("+-").isdigit():
            raise
        parsed = value
    for part in reversed(parts):
        parsed = {part: parsed}
    assert isinstance(parsed, dict)
    return parsed


def load_configuration(
    path: str | Path | None = None, *, settings: Sequence[str] = ()
) -> Configuration:
    """The default configuration, overridden by the TOML file `path`, which has some of the sections
    and keys of `Configuration` (or the name of one in `NAMED`), and then by `settings`, texts
    `section.key=value` with the value as in TOML. Raises ConfigurationError if a key is unknown, a
    value of the wrong type or out of range, or the file cannot be read.
    """
    values: dict[str, Any] = {}
    settings = [settings] if isinstance(settings, str) else settings
    if path is not None:
        named = NAMED / f"{str(path).lower()}.toml"
        file = named if named.is_file() and not Path(path).is_file() else Path(path)
        if not file.exists():
            names = ", ".join(sorted(file.stem for file in NAMED.glob("*.toml")))
            raise ConfigurationError(
                f"{path}: no such configuration file, and not the name of a built-in one "
                f"({names}). Check the path."
            )
        values = read_toml(file, ConfigurationError)
    for text in settings:
        values = _merge(values, _setting(text))
    try:
        return Configuration.model_validate(values)
    except ValidationError as error:
        origin = " ".join([str(path)] * (path is not None) + [f"--set {s}" for s in settings])
        from gaitval._internal.text.refused_values import in_configuration

        raise ConfigurationError(f"{origin}: {in_configuration(error, Configuration())}") from None
