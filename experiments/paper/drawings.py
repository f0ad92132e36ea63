"""The drawings of the paper's figures: each returns a figure, and its curves as a table."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from experiments.paper.data import FINAL, IDENTIFIED, RL, WINTER, PaperCurves, Simulated
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.metrics.norms import healthy_bands
from gaitval.metrics.push_recovery import Trace
from gaitval.metrics.results import PlacedFoot
from gaitval.reporting.balance_figure import HEIGHT, answered_pushes, draw_people
from gaitval.reporting.drawing import SETTINGS, WIDTH
from gaitval.reporting.figures import COLOURS, RECORD_COLOUR, RECORD_WIDTH
from gaitval.reporting.stick_figures import stick_figure

JOINTS = {"hip_flexion": "Hip", "knee_angle": "Knee", "ankle_angle": "Ankle"}
FORCES = {"forward": "Tangential (forward)", "vertical": "Vertical"}
UNITS = {"angles": "°", "moments": "Nm/kg", "forces": "% BW", "epsilon": "1"}
CHILDREN = "Schwartz 2008, children"
PERCENT = np.arange(101)
Drawing = tuple[Figure, pd.DataFrame]
_Stored = Mapping[str, Any]


def _figure(height: float) -> Figure:
    return Figure(figsize=(WIDTH, height), layout="constrained")


def _mean_band(axes: Axes, cycles: Array, colour: str, label: str) -> dict[str, Array]:
    mean, spread = cycles.mean(axis=0), cycles.std(axis=0, ddof=1)
    axes.fill_between(
        PERCENT, mean - spread, mean + spread, color=colour, alpha=0.25, linewidth=0, zorder=2
    )
    axes.plot(PERCENT, mean, color=colour, linewidth=1.1, label=label, zorder=3)
    return {"mean": mean, "sd": spread}


def _record(axes: Axes, curve: Sequence[float]) -> None:
    axes.plot(
        PERCENT, curve, color=RECORD_COLOUR, linewidth=RECORD_WIDTH, label="record", zorder=1
    )  # fmt: skip


def _long(rows: Mapping[tuple[str, ...], Array], names: Sequence[str]) -> pd.DataFrame:
    """A column for every curve; its name is what distinguishes it from the others."""
    table = pd.DataFrame({" | ".join(key): np.asarray(values) for key, values in rows.items()})
    table.index.name = " | ".join(names)
    return table


def model(found: Simulated) -> Drawing:
    """Figure 1: the body at heel strike from the right and from behind."""
    points = stick_figure(found.model, found.reference.positions[:1])
    with matplotlib.rc_context(SETTINGS):
        figure = _figure(3.6)
        panels = figure.subplots(1, 2)
        rows = []
        for axes, column, sign, title in zip(
            panels, (0, 1), (1.0, -1.0), ("from the right", "from behind"), strict=True
        ):
            for name, line in points.items():
                side = next((side for side in SIDES if name.startswith(side)), None)
                colour = COLOURS[side] if side else "#404040"
                x, z = sign * line[0, :, column], line[0, :, 2]
                axes.plot(x, z, "-o", color=colour, markersize=3.0, linewidth=2.0)
                rows += [(title, name, float(a), float(b)) for a, b in zip(x, z, strict=True)]
            axes.set_aspect("equal")
            axes.set_title(title)
            axes.axis("off")
    return figure, pd.DataFrame(rows, columns=["view", "line", "x_m", "z_m"]).set_index("view")


def errors(found: Mapping[str, Mapping[str, Sequence[Mapping[str, float]]]]) -> Drawing:
    """Figure 2: RMSE bars of RL against RL + identification, mean ± SD over the seeds."""
    rows = []
    with matplotlib.rc_context(SETTINGS):
        figure = _figure(2.3)
        for axes, kind in zip(figure.subplots(1, 4), ("angles", "moments", "forces", "epsilon"),
                              strict=True):  # fmt: skip
            for place, (body, walks) in enumerate(found.items()):
                for offset, name, colour in ((-0.2, RL, "#b8b8b8"), (0.2, IDENTIFIED, "#0072b2")):
                    values = np.array([walk[kind] for walk in walks[name]])
                    axes.bar(
                        place + offset, values.mean(), 0.38, yerr=values.std(ddof=1), capsize=2.5,
                        color=colour, error_kw={"linewidth": 0.8},
                        label=name if place == 0 else None,
                    )  # fmt: skip
                    axes.plot(
                        np.full(len(values), place + offset), values, ".", color="#303030",
                        markersize=2.5, zorder=3,
                    )  # fmt: skip
                    rows += [(body, name, kind, seed, v) for seed, v in enumerate(values)]
            axes.set_xticks(range(len(found)), [f"by {body}" for body in found])
            axes.set_title("ε" if kind == "epsilon" else f"RMSE of {kind}, {UNITS[kind]}")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    names = ["scaled by", "training", "quantity", "seed", "error"]
    return figure, pd.DataFrame(rows, columns=names).set_index("scaled by")


def angles(walks: Mapping[str, PaperCurves], record: _Stored) -> Drawing:
    """Figure 3: lower-limb angles before and after identification, right side."""
    table: dict[tuple[str, ...], Array] = {}
    with matplotlib.rc_context(SETTINGS):
        figure = _figure(3.8)
        grid = figure.subplots(2, 3, sharex=True, sharey="col")
        for row, name in zip(grid, (RL, IDENTIFIED), strict=True):
            for axes, (joint, title) in zip(row, JOINTS.items(), strict=True):
                key = f"{joint}_r"
                recorded = record["angles"][key]
                _record(axes, recorded)
                cycles = walks[name]["angles"][key]
                for what, values in _mean_band(axes, cycles, COLOURS["right"], "simulated").items():
                    table[key, name, what] = values
                table[key, "record", "mean"] = np.array(recorded)
                error = np.sqrt(np.mean((cycles.mean(axis=0) - recorded) ** 2))
                axes.set_title(f"{title}: RMSE {error:.1f}°")
            row[0].set_ylabel(f"{name}, °")
        for axes in grid[-1]:
            axes.set_xlabel("% of right gait cycle")
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure, _long(table, ("curve", "walk", "value"))


def loop_curves(
    walks: Mapping[str, PaperCurves], record: _Stored, winter: tuple[Array, Array] | None
) -> dict[str, tuple[Array, Array]]:
    """Hip angle and moment of the right leg of all that figure 4 shows."""
    bands, key = healthy_bands(), "hip_flexion_r"
    final = walks[FINAL]
    found = {
        "simulated": (final["angles"][key].mean(axis=0), final["moments"][key].mean(axis=0)),
        "record": (np.array(record["angles"][key]), np.array(record["moments"][key])),
        CHILDREN: (bands["angles"]["hip_flexion"][0], bands["moments"]["hip_flexion"][0]),
    }
    return found if winter is None else {**found, WINTER: winter}


def torque_loop(curves: Mapping[str, tuple[Array, Array]]) -> Drawing:
    """Figure 4: hip moment against hip angle; 0 % green, 50 % black, 100 % white, and arrows."""
    colours = {"simulated": COLOURS["right"], "record": "#808080", CHILDREN: "#cc79a7"}
    with matplotlib.rc_context(SETTINGS):
        figure = _figure(3.6)
        axes = figure.subplots()
        for name, (angle, moment) in curves.items():
            colour = colours.get(name, "#d55e00")
            axes.plot(angle, moment, color=colour, label=name, linewidth=1.3)
            for percent in (12, 30, 45, 62, 87):
                axes.annotate(
                    "", xy=(angle[percent + 1], moment[percent + 1]),
                    xytext=(angle[percent - 1], moment[percent - 1]),
                    arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 0.9},
                )  # fmt: skip
            for percent, fill, size in ((100, "white", 8.0), (0, "#009e73", 5.0), (50, "k", 5.0)):
                axes.plot(
                    angle[percent], moment[percent], "o", color=colour, markerfacecolor=fill,
                    markersize=size, zorder=4,
                )  # fmt: skip
        for percent, fill in ((0, "#009e73"), (50, "k"), (100, "white")):
            axes.plot([], [], "o", color="k", markerfacecolor=fill, label=f"{percent} %")
        axes.axhline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
        axes.axvline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
        axes.set_xlabel("hip flexion, °")
        axes.set_ylabel("hip flexion moment, Nm/kg")
        figure.legend(loc="outside right upper")
    table = {(name, what): each[i] for name, each in curves.items()
             for i, what in enumerate(("angle deg", "moment Nm/kg"))}  # fmt: skip
    return figure, _long(table, ("curve", "value"))


def against_record(
    walk: PaperCurves, record: _Stored, kind: str, names: Mapping[str, str], *, rows: bool
) -> Drawing:
    """Figures 5 and 6: simulated mean ± SD and record, both sides.

    Parameters
    ----------
    rows : one panel below the other, as the paper has the forces.
    """
    table: dict[tuple[str, ...], Array] = {}
    with matplotlib.rc_context(SETTINGS):
        figure = _figure(4.2 if rows else 3.8)
        shape = (len(names), 2) if rows else (2, len(names))
        grid = figure.subplots(*shape, sharex=True, sharey="row" if rows else "col")
        panels = grid if rows else grid.T
        for row, (name, title) in zip(panels, names.items(), strict=True):
            for axes, side in zip(row, SIDES, strict=True):
                key = f"{name}_{side[0]}"
                recorded = record[kind][key]
                _record(axes, recorded)
                found = _mean_band(axes, walk[kind][key], COLOURS[side], f"simulated, {side}")
                table |= {(key, "simulated", what): values for what, values in found.items()}
                table[key, "record", "mean"] = np.array(recorded)
                axes.set_title(f"{title}, {side}")
                axes.axhline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
            row[0].set_ylabel(UNITS[kind])
        for axes in grid[-1]:
            axes.set_xlabel("% of the side’s gait cycle")
        lines, labels = zip(
            *(pair for axes in panels[0]
              for pair in zip(*axes.get_legend_handles_labels(), strict=True)), strict=True,
        )  # fmt: skip
        once = dict(zip(labels, lines, strict=True))
        figure.legend(once.values(), once.keys(), loc="outside upper center", ncols=3)
    return figure, _long(table, ("curve", "source", "value"))


def knees(runs: Mapping[str, _Stored]) -> Drawing:
    """Figure 7a: right knee of all subjects, measured above and simulated below."""
    table: dict[tuple[str, ...], Array] = {}
    speeds = {name: run["record"]["spatiotemporal"]["walking_speed"] for name, run in runs.items()}
    shade = Normalize(min(speeds.values()), max(speeds.values()))
    map_ = matplotlib.colormaps["viridis"]
    with matplotlib.rc_context(SETTINGS):
        figure = _figure(4.4)
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for name in sorted(runs, key=lambda each: speeds[each]):
            run = runs[name]
            measured = run["record"]["curves"]["angles"]["knee_angle_r"]
            walk = run["walks"][run["final"]]["curves"]["angles"]["knee_angle_r"]["mean"]
            for axes, curve, source in (
                (panels[0], measured, "measured"), (panels[1], walk, "simulated"),
            ):  # fmt: skip
                axes.plot(
                    PERCENT, curve, color=map_(shade(speeds[name]) * 0.92),
                    label=f"{name}, {speeds[name]:.2f} m/s",
                )  # fmt: skip
                table[name, source] = np.array(curve)
        for axes, title in zip(panels, ("measured", "simulated"), strict=True):
            axes.set_title(title)
            axes.set_xlabel("% of right gait cycle")
        panels[0].set_ylabel("knee flexion, °")
        figure.legend(
            *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5,
            fontsize=7.5,
        )  # fmt: skip
    return figure, _long(table, ("subject", "source"))


def placement(placed: Mapping[str, Sequence[PlacedFoot]]) -> Drawing:
    """Beside figure 7b: the next foot over the extrapolated centre of mass."""
    columns = ("extrapolated, m", "foot, m", "pendulum, m")
    rows = {
        name: pd.DataFrame(answered_pushes(each)[0], columns=columns)
        for name, each in placed.items()
    }
    with matplotlib.rc_context(SETTINGS):
        figure = _figure(HEIGHT)
        draw_people(figure, placed)
    return figure, pd.concat(rows, names=["walker", "push"])


def pushes(recovery: _Stored, traces: Sequence[Trace]) -> Drawing:
    """Figure 7b: stability region at four phases, and forward velocity over five cycles."""
    directions = np.deg2rad([*recovery["directions"], recovery["directions"][0]])
    colours = ("#0072b2", "#009e73", "#e69f00", "#cc79a7")
    table: dict[tuple[str, ...], Array] = {}
    with matplotlib.rc_context(SETTINGS):
        figure = _figure(5.2)
        upper, lower = figure.subfigures(2, 1, height_ratios=(1.15, 1.0))
        axes = upper.subplots(subplot_kw={"projection": "polar"})
        for phase, largest, colour in zip(
            recovery["phases"], recovery["largest"], colours, strict=True
        ):
            label = f"pushed at {100 * phase:g} %"
            axes.plot(directions, [*largest, largest[0]], color=colour, label=label)
            table[label, "largest force survived, N"] = np.array(largest)
        axes.set_theta_zero_location("N")
        axes.set_xticks(np.deg2rad([0, 90, 180, 270]), ["ahead", "left", "back", "right"])
        axes.set_rlabel_position(200.0)
        axes.tick_params(axis="y", labelsize=7.0)
        axes.grid(color="#d9d9d9", linewidth=0.4)
        axes.set_title("largest force of 50 ms survived, N")
        upper.legend(loc="center right")
        axes = lower.subplots()
        by_phase = dict(zip(recovery["phases"], colours, strict=True))
        for trace in traces:
            axes.plot(
                trace.cycles, trace.velocity[:, 0], color=by_phase[trace.push.phase], linewidth=1.0
            )
            label = f"pushed at {100 * trace.push.phase:g} %"
            table[label, "cycles"] = trace.cycles
            table[label, "forward velocity, m/s"] = trace.velocity[:, 0]
        for edge in range(-1, 5):
            axes.axvline(edge, color="#d9d9d9", linewidth=0.5, zorder=0)
        middles = np.arange(-1, 5) + 0.5
        axes.set_xticks(middles, ["p−1", "p", "p+1", "p+2", "p+3", "p+4"])
        axes.tick_params(axis="x", length=0)
        axes.set_xlim(-1, 4)
        axes.set_ylabel("forward velocity of the\ncentre of mass, m/s")
        axes.set_xlabel("gait cycles; p begins with the push")
    columns = {" | ".join(key): pd.Series(values) for key, values in table.items()}
    columns = {"direction, deg": pd.Series(recovery["directions"]), **columns}
    return figure, pd.DataFrame(columns).rename_axis("row")
