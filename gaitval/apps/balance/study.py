"""All of a walker's recoveries: pushes, slips, trips, steps down, beside people's."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from gaitval._internal.text.display import Displayed
from gaitval.apps.balance.compared import (
    Guessed,
    Published,
    Pushes,
    on_ground,
    published,
    sideways,
)
from gaitval.apps.balance.disturb import Disturbance, Slip, StepDown, Trip
from gaitval.apps.balance.experiment import (
    DisturbedWalk,
    OnGround,
    TestedWalker,
    lengthways_pushes,
    pushed,
    random_pushes,
    sideways_pushes,
    steady_walks,
)
from gaitval.apps.balance.results import (
    ComparedQuantity,
    PerturbResult,
    setting_words,
)
from gaitval.coordinates import SIDES
from gaitval.metrics.balance_walk import BalanceWalk
from gaitval.metrics.foot_placement import (
    TIME_FOR_A_STEP,
    LinearMap,
    answered,
    linear_map,
    steps_to_recover,
)
from gaitval.metrics.push_ensembles import NOISE, STARTS, RobustPushes, robust_pushes
from gaitval.metrics.push_recovery import Push
from gaitval.metrics.pushed_steps import forces_of
from gaitval.metrics.typed import tidy
from gaitval.metrics.whole_body import momentum_residual
from gaitval.reporting.written import taken

if TYPE_CHECKING:
    import pandas as pd

KINDS: Final = ("push", "slip", "trip", "step")
FORCES: Final = (100.0, 200.0)
"""N for `environment.push_seconds`, of who weighs as much as an adult (`PushSettings.of_mass`)."""
PHASES: Final = 10
"""Of the gait cycle at which is pushed."""
RANDOM: Final = 24
"""Pushes in any direction, for the linear map."""
STEADY: Final = 16
"""Walks from noisy starts, for that of steady walking."""
_KIND_OF: Final[Mapping[type, str]] = {Slip: "slip", Trip: "trip", StepDown: "step"}


@dataclass(frozen=True, repr=False)
class Recoveries(Displayed):
    """What a walker does, with the walks behind it.

    Attributes
    ----------
    plain : undisturbed.
    tried, walks : pushes and the walks with them.
    grounds : by ground, the walk from the start without noise, and which starts of the ensemble
        were survived.
    """

    result: PerturbResult
    plain: BalanceWalk
    tried: tuple[Push, ...]
    walks: tuple[BalanceWalk, ...]
    grounds: tuple[tuple[DisturbedWalk, tuple[bool, ...]], ...]

    def pushed_along(self, axis: int) -> list[BalanceWalk]:
        """The walks with pushes forward and backward (0), or to the sides (1)."""
        pairs = zip(self.tried, self.walks, strict=True)
        return [walk for push, walk in pairs if push_axis(push) == axis]

    def title(self) -> str:
        """Of whom, and how many quantities are as people's."""
        result = self.result
        if result.steady_fell:
            return f"{result.walker} falls without any disturbance"
        count = len(result.quantities)
        right, _ = result.as_people["walker"]
        return f"{result.walker}: as people in {right} of {count} published quantities"

    def overview(self) -> "pd.DataFrame":
        """A row a quantity."""
        import pandas as pd

        return pd.DataFrame(
            {
                "kind": row.kind,
                "quantity": row.name,
                "low": row.low,
                "high": row.high,
                "walker": row.walker,
                "unit": row.unit,
                "as people": row.right_sign and row.inside is not False,
            }
            for row in self.result.quantities
        )

    def to_frame(self) -> "pd.DataFrame":
        """Rows of quantity, who (people, walker, nothing, pendulum), value, unit."""
        import pandas as pd

        return pd.DataFrame(
            {
                "kind": row.kind,
                "quantity": row.name,
                "who": who,
                "value": getattr(row, "published" if who == "people" else who),
                "unit": row.unit,
            }
            for row in self.result.quantities
            for who in ("people", "walker", "nothing", "pendulum")
        )


def recoveries(
    name: str,
    walker: TestedWalker,
    *,
    kinds: Collection[str] = KINDS,
    grounds: Sequence[Disturbance] = (),
    largest: bool = False,
    say: Callable[[str], None] = lambda _: None,
) -> Recoveries:
    """Disturb the `walker` called `name` in all `kinds`, on the `grounds`, and, if asked for,
    find the `largest` pushes forward, backward and sideways. `say` is told what comes next.
    """
    settings = walker.task.configuration.pushes
    forces = forces_of(settings, walker.task.model.mass, FORCES)
    say("walking undisturbed")
    plain = next(pushed(walker, [Push(0.0, 0.0, 0.0)]))
    tried: list[Push] = []
    walks: list[BalanceWalk] = []
    maps: tuple[LinearMap | None, LinearMap | None] = None, None
    compared: dict[str, Guessed] = {}
    if "push" in kinds and not plain.fell:
        say("pushes")
        aside, along = sideways_pushes(forces, PHASES), lengthways_pushes(forces[:1], PHASES)
        tried = [*aside, *along]
        walks = list(pushed(walker, tried))
        steady = linear_map(steady_walks(walker, STEADY))
        more = list(pushed(walker, random_pushes(RANDOM, forces[-1])))
        maps = steady, linear_map([*walks, *more])
        seconds = walker.task.configuration.environment.push_seconds
        compared |= sideways(Pushes.of(plain, walks[: len(aside)], seconds), *maps)
    found: list[tuple[DisturbedWalk, tuple[bool, ...]]] = []
    if not plain.fell:
        on, own = OnGround(walker), [g for g in grounds if _KIND_OF[type(g)] in kinds]
        for ground in own:
            kind, side, *_ = (given := _settings(ground)).values()
            rest = {name: each for name, each in given.items() if name not in ("kind", "side")}
            say(f"{kind}, {side} foot ({setting_words(rest)})")
            found.append((on.walk(ground), _stands(on, ground)))
        compared |= on_ground([each for each, _ in found])
    robust = _largest(walker, say) if largest and not plain.fell else None
    result = _result(name, walker, plain, tried, walks, maps, found, robust, compared)
    return Recoveries(result, plain, tuple(tried), tuple(walks), tuple(found))


def _stands(on: OnGround, ground: Disturbance) -> tuple[bool, ...]:
    """Whether each start of an ensemble survives."""
    middle = (STARTS - 1) / 2
    return tuple(
        not on.walk(ground, noise=NOISE, seed=seed, later=(seed - middle)).walk.fell
        for seed in range(STARTS)
    )


def _largest(walker: TestedWalker, say: Callable[[str], None]) -> RobustPushes:
    say("largest pushes")
    directions = (0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi)
    return robust_pushes(walker.task, walker.policy, walker.mu, directions=directions)


def _settings(ground: Disturbance) -> dict[str, Any]:
    return {"kind": _KIND_OF[type(ground)], **asdict(ground)}


def _result(
    name: str,
    walker: TestedWalker,
    plain: BalanceWalk,
    tried: Sequence[Push],
    walks: Sequence[BalanceWalk],
    maps: tuple[LinearMap | None, LinearMap | None],
    grounds: Sequence[tuple[DisturbedWalk, tuple[bool, ...]]],
    robust: RobustPushes | None,
    compared: Mapping[str, Guessed],
) -> PerturbResult:
    seconds = walker.task.configuration.environment.push_seconds
    rows = [
        ComparedQuantity.model_validate(tidy(_compared(each, compared[each.quantity])))
        for each in published()
        if each.quantity in compared
    ]
    return PerturbResult.made(
        walker=name,
        mass_kg=walker.model.mass,
        pendulum_m=plain.pendulum,
        delays_s=walker.task.configuration.environment.observation_delays,
        steady_fell=plain.fell,
        pushes=[
            _pushed_step(push, walk, plain, seconds)
            for push, walk in zip(tried, walks, strict=True)
        ],
        steady=maps[0],
        moved=maps[1],
        grounds=[_ground(each, stood) for each, stood in grounds],
        largest=None if robust is None else _robust(robust),
        quantities=rows,
        as_people={who: as_people(rows, who) for who in ("walker", "nothing", "pendulum")},
    )


def push_axis(push: Push) -> int:
    """0 of a push forward or backward, 1 of one to a side."""
    return int(abs(math.sin(push.direction)) > math.sqrt(0.5))


def _pushed_step(
    push: Push, walk: BalanceWalk, plain: BalanceWalk, seconds: float
) -> dict[str, Any]:
    steps = list(Pushes.of(plain, [walk], seconds).found[0]) if not walk.fell else []
    step = answered(steps, TIME_FOR_A_STEP)
    axis = push_axis(push)
    rows = slice(walk.onset, min(len(walk.time), len(plain.time)))
    spin, lean = (getattr(walk, n)[rows] - getattr(plain, n)[rows] for n in ("spin", "trunk"))
    known = ("number", "lead", "foot", "extrapolated", "offset", "time")
    pairs = ("foot", "extrapolated", "offset")
    return {
        "phase": push.phase,
        "direction": math.degrees(push.direction),
        "force": push.force,
        "fell": walk.fell,
        "side": None if step is None else SIDES[step.column],
        "pendulum": (None, None) if step is None else step.guess,
        **{
            name: (None, None) if step is None and name in pairs else getattr(step, name, None)
            for name in known
        },
        "recovered": steps_to_recover(steps, (axis,)),
        "spin": [_peak(spin[:, 0]), _peak(spin[:, 1])],
        "lean": [math.degrees(_peak(lean[:, each])) for each in (0, 1)],
    }


def _peak(values: Any) -> float:
    """The value of the largest size, with its sign; 0 of none."""
    return float(values[np.abs(values).argmax()]) if len(values) else 0.0


def _ground(each: DisturbedWalk, stood: tuple[bool, ...]) -> dict[str, Any]:
    settings = _settings(each.ground)
    kind, side = settings.pop("kind"), settings.pop("side")
    return {
        "kind": kind,
        "side": side,
        "settings": settings,
        "survived": list(stood),
        "slid": each.slid,
        "momentum_residual": momentum_residual(each.rollout, each.walk.mass),
        "values": {name: value.walker for name, value in on_ground([each]).items()},
    }


def _robust(found: RobustPushes) -> dict[str, Any]:
    return {
        "phases": found.phases,
        "directions": [math.degrees(each) for each in found.directions],
        "largest": found.largest,
        "tried": len(found.tried),
        "torn": sum(each.torn for each in found.tried),
        "flipped": found.flipped[0],
        "again": found.flipped[1],
    }


def _compared(row: Published, values: Guessed) -> dict[str, Any]:
    return taken(
        ComparedQuantity,
        row,
        name=row.quantity,
        published=row.value,
        **values._asdict(),
        right_sign=row.right_sign(values.walker),
        inside=row.inside(values.walker),
    )


def as_people(rows: Sequence[ComparedQuantity], who: str) -> tuple[int, int]:
    """In how many of the `rows` `who` (walker, nothing, pendulum) does as people, and of how many:
    a guess only of those of which it says something.
    """
    known = {each.quantity: each for each in published()}
    values = [(known[row.name], getattr(row, who)) for row in rows]
    told = [(row, value) for row, value in values if who == "walker" or value is not None]
    right = [row.right_sign(value) and row.inside(value) is not False for row, value in told]
    return sum(right), len(right)
