"""The figures of `gaitval perturb`: where feet are placed, and when."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from gaitval.apps.balance.compared import Pushes
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.metrics.foot_placement import TIME_FOR_A_STEP, Placement
from gaitval.reporting.balance_figure import GUESS_COLOUR, MARKS, handles, law
from gaitval.reporting.drawing import legend_above, new_figure, svg
from gaitval.reporting.figure_data import table
from gaitval.reporting.figures import COLOURS, RECORD_COLOUR, WALK_WIDTH


@dataclass(frozen=True)
class DrawnSteps:
    """What the figure shows.

    Attributes
    ----------
    aside, along : first steps that there was time for, after pushes sideways and lengthways.
    hurried : first steps after sideways pushes, whether or not there was time.
    cycles : (n,) gait cycles since the push.
    velocity : (pushes, n) m/s to the left, of the centre of mass, after sideways pushes.
    plain : (pushes, n) the same without the push, at the same times of the walk.
    """

    aside: tuple[Placement, ...]
    along: tuple[Placement, ...]
    hurried: tuple[Placement, ...]
    cycles: Array
    velocity: Array
    plain: Array

    @classmethod
    def of(cls, aside: Pushes, along: Pushes, stride: float) -> "DrawnSteps":
        """Of pushes `aside` and `along`, of a walker with this `stride` time, s."""
        cycles = np.linspace(-0.5, 4.5, 251)
        pushed: list[Array] = []
        plain: list[Array] = []
        for walk in aside.walks:
            at = walk.time[walk.onset] + cycles * stride
            for kept, each in ((pushed, walk), (plain, aside.plain)):
                kept.append(np.interp(at, each.time, each.velocity[:, 1], right=np.nan))
        return cls(
            tuple(aside.answers()),
            tuple(along.answers()),
            tuple(steps[0] for steps in aside.found if steps),
            cycles,
            np.array(pushed).reshape(-1, len(cycles)),
            np.array(plain).reshape(-1, len(cycles)),
        )

    def placement(self) -> str:
        """The figure as SVG."""
        with new_figure(5.2) as figure:
            axes = figure.subplots(2, 2)
            _law(axes[0, 0], self.aside, 1, "Sideways: foot and extrapolated centre of mass")
            _law(axes[0, 1], self.along, 0, "Forward: foot and extrapolated centre of mass")
            _shares(axes[1, 0], self.hurried)
            self._recovery(axes[1, 1])
            legend_above(figure, handles(), columns=6)
            return svg(figure, "placement")

    def _recovery(self, axes: Axes) -> None:
        change = self.velocity - self.plain
        for row in change:
            axes.plot(self.cycles, row, color=COLOURS["right"], linewidth=0.5, alpha=0.5)
        axes.axhline(0.0, color=RECORD_COLOUR, linewidth=0.5)
        axes.set_title("Velocity to the left, change by the push, m/s")
        axes.set_xlabel("gait cycles since the push")

    def tables(self) -> dict[str, str]:
        """What is drawn, as CSV."""
        rows = [("sideways", each) for each in self.aside]
        rows += [("forward", each) for each in self.along]
        return {
            "placement": table(
                {
                    "push": [kind for kind, _ in rows],
                    "foot": [SIDES[each.column] for _, each in rows],
                    "step": np.array([each.number for _, each in rows], dtype=float),
                    "lead_s": np.array([each.lead for _, each in rows]),
                    **{
                        f"{name}_{axis}_m": np.array([getattr(each, name)[i] for _, each in rows])
                        for name in ("extrapolated", "foot", "offset", "guess")
                        for i, axis in enumerate(("forward", "left"))
                    },
                }
            )
        }


def _law(axes: Axes, steps: Sequence[Placement], axis: int, title: str) -> None:
    """Change of the foot's place over that of the extrapolated centre of mass, forward or aside."""
    rows = [(each.extrapolated[axis], each.foot[axis], each.guess[axis]) for each in steps]
    x, y, guess = np.array(rows).reshape(-1, 3).T
    law(axes, x, y, guess, [SIDES[each.column] for each in steps])
    axes.set_title(title)
    axes.set_xlabel("extrapolated centre of mass, cm")
    axes.set_ylabel("next foot, cm")


def _shares(axes: Axes, steps: Sequence[Placement]) -> None:
    """How much of what was needed the first step did, over the time that it had."""
    known = [each for each in steps if abs(each.extrapolated[1]) > 0.01]
    for side, mark in MARKS.items():
        own = [each for each in known if SIDES[each.column] == side]
        axes.plot(
            [1e3 * each.lead for each in own],
            [float(each.foot[1] / each.extrapolated[1]) for each in own],
            linestyle="none", marker=mark, markersize=3.5, markerfacecolor="none",
            color=COLOURS[side],
        )  # fmt: skip
    axes.axvline(1e3 * TIME_FOR_A_STEP, color=RECORD_COLOUR, linewidth=WALK_WIDTH)
    axes.text(
        1e3 * TIME_FOR_A_STEP, 0.03, " people need this long", fontsize=6.5,
        transform=axes.get_xaxis_transform(),
    )  # fmt: skip
    axes.axhline(1.0, color=RECORD_COLOUR, linewidth=0.5)
    axes.axhline(0.0, color=GUESS_COLOUR, linewidth=0.7, linestyle=":")
    axes.set_title("First step: share of the shift that keeps its distance")
    axes.set_xlabel("ms from push to heel strike")
