"""All of a walker's recoveries: pushes, slips, trips, steps down, beside people's."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

from gaitval._internal.text.display import Displayed
from gaitval.apps.balance.compared import Guessed, Published, Pushes, published, sideways
from gaitval.apps.balance.disturb import Disturbance, Slip, StepDown, Trip
from gaitval.apps.balance.experiment import (
    OnGround,
    TestedWalker,
    lengthways_pushes,
    pushed,
    sideways_pushes,
)
from gaitval.apps.balance.results import (
    ComparedQuantity,
    PerturbResult,
    setting_words,
)
from gaitval.coordinates import SIDES
from gaitval.metrics.balance_walk import BalanceWalk
from gaitval.metrics.foot_placement import TIME_FOR_A_STEP, answered, steps_to_recover
from gaitval.metrics.push_recovery import Push
from gaitval.metrics.pushed_steps import forces_of
from gaitval.metrics.typed import tidy
from gaitval.reporting.written import taken

if TYPE_CHECKING:
    import pandas as pd

KINDS: Final = ("push", "slip", "trip", "step")
FORCES: Final = (100.0, 200.0)
"""N for `environment.push_seconds`, of who weighs as much as an adult (`PushSettings.of_mass`)."""
PHASES: Final = 10
"""Of the gait cycle at which is pushed."""
_KIND_OF: Final[Mapping[type, str]] = {Slip: "slip", Trip: "trip", StepDown: "step"}


@dataclass(frozen=True, repr=False)
class Recoveries(Displayed):
    """What a walker does, with the walks behind it.

    Attributes
    ----------
    plain : undisturbed.
    tried, walks : pushes and the walks with them.
    """

    result: PerturbResult
    plain: BalanceWalk
    tried: tuple[Push, ...]
    walks: tuple[BalanceWalk, ...]

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
                "quantity": row.name,
                "low": row.low,
                "high": row.high,
                "walker": row.walker,
                "unit": row.unit,
                "as people": row.inside,
            }
            for row in self.result.quantities
        )

    def to_frame(self) -> "pd.DataFrame":
        """Rows of quantity, who (walker, nothing, pendulum), value, unit."""
        import pandas as pd

        return pd.DataFrame(
            {
                "quantity": row.name,
                "who": who,
                "value": getattr(row, who),
                "unit": row.unit,
            }
            for row in self.result.quantities
            for who in ("walker", "nothing", "pendulum")
        )


def recoveries(
    name: str,
    walker: TestedWalker,
    *,
    kinds: Collection[str] = KINDS,
    grounds: Sequence[Disturbance] = (),
    say: Callable[[str], None] = lambda _: None,
) -> Recoveries:
    """Disturb the `walker` called `name` in all `kinds`, on the `grounds`. `say` is told what
    comes next.
    """
    settings = walker.task.configuration.pushes
    forces = forces_of(settings, walker.task.model.mass, FORCES)
    say("walking undisturbed")
    plain = next(pushed(walker, [Push(0.0, 0.0, 0.0)]))
    tried: list[Push] = []
    walks: list[BalanceWalk] = []
    compared: dict[str, Guessed] = {}
    if "push" in kinds and not plain.fell:
        say("pushes")
        aside, along = sideways_pushes(forces, PHASES), lengthways_pushes(forces[:1], PHASES)
        tried = [*aside, *along]
        walks = list(pushed(walker, tried))
        seconds = walker.task.configuration.environment.push_seconds
        compared = sideways(Pushes.of(plain, walks[: len(aside)], seconds))
    found: list[dict[str, Any]] = []
    if not plain.fell:
        on, own = OnGround(walker), [g for g in grounds if _KIND_OF[type(g)] in kinds]
        for ground in own:
            given = asdict(ground)
            kind, side = _KIND_OF[type(ground)], given.pop("side")
            say(f"{kind}, {side} foot ({setting_words(given)})")
            found.append(
                {
                    "kind": kind,
                    "side": side,
                    "settings": given,
                    "survived": on.starts_survived(ground),
                    "slid": on.walk(ground).slid,
                }
            )
    result = _result(name, walker, plain, tried, walks, found, compared)
    return Recoveries(result, plain, tuple(tried), tuple(walks))


def _result(
    name: str,
    walker: TestedWalker,
    plain: BalanceWalk,
    tried: Sequence[Push],
    walks: Sequence[BalanceWalk],
    grounds: Sequence[Mapping[str, Any]],
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
        grounds=grounds,
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
    known = ("number", "lead", "foot", "extrapolated", "offset")
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
    }


def _compared(row: Published, values: Guessed) -> dict[str, Any]:
    return taken(
        ComparedQuantity,
        row,
        name=row.quantity,
        **values._asdict(),
        inside=row.inside(values.walker),
    )


def as_people(rows: Sequence[ComparedQuantity], who: str) -> tuple[int, int]:
    """In how many of the `rows` `who` (walker, nothing, pendulum) does as people, and of how many:
    a guess only of those of which it says something.
    """
    known = {each.quantity: each for each in published()}
    values = [(known[row.name], getattr(row, who)) for row in rows]
    told = [(row, value) for row, value in values if who == "walker" or value is not None]
    return sum(row.inside(value) for row, value in told), len(told)
