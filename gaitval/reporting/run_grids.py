"""The grids of a run: what was recorded, what walked, and what is normal at this speed and age."""

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array, sample_deviation
from gaitval.configuration import Configuration, ReportSettings
from gaitval.coordinates import SIDES
from gaitval.gait.record import LowPass
from gaitval.metrics.comparison import foot_progression, rmse_of, simulated_curves
from gaitval.metrics.curve_results import KINDS
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.norms import Norm, norms
from gaitval.metrics.results import Metrics
from gaitval.metrics.typed import array
from gaitval.metrics.walk_quantities import of_record, of_walk
from gaitval.model.parameters import apply_parameters
from gaitval.quantities import BY_NAME, JOINT_CONTACT, MUSCLE_ACTIVATION
from gaitval.quantities.joint_power import BURSTS, burst_places
from gaitval.quantities.joint_power import JOINTS as POWER_JOINTS
from gaitval.reporting import figure_data, grids
from gaitval.reporting.drawing import WIDTH
from gaitval.reporting.figure_data import Tables
from gaitval.reporting.grids import DrawnCurve, Panel
from gaitval.reporting.muscle_figures import DrawnMuscles
from gaitval.reporting.page import Draw
from gaitval.reporting.run_files import WalkFiles, configuration_of, read_walk
from gaitval.subjects.subject import Subject

STRIDES: Final = 8
"""Drawn of each side: more are one grey area."""
NARROW: Final = "curves_narrow"
"""The small figure of the sheet for a screen so narrow that the wide one would have to scroll."""
NARROW_WIDTH: Final = 3.6
"""Inches: the smallest text, 7.5 points, is 9 pixels on a screen of 360."""


def strides_of(walk: WalkFiles, metrics: Metrics, configuration: Configuration) -> dict[str, Array]:
    """The first strides of a `walk`, (n, 101) by "kind/curve_r" in the units of `metrics`; none
    without its rollout, or where it is too short.
    """
    if walk.model is None or walk.rollout is None:
        return {}
    rollout, method = walk.rollout, metrics.method
    cycles = find_cycles(rollout, configuration)
    few = cycles.first(min(STRIDES, method.cycles))
    if not all(few.count(side) for side in SIDES):
        return {}
    # filters need some time after the last of them, and nothing of the walk's other minutes
    last = max(int(each[-1]) for each in few.ends.values()) + 1000
    length = len(rollout.time)
    rollout = replace(
        rollout,
        **{
            each.name: values[:last]
            for each in fields(rollout)
            if len(values := getattr(rollout, each.name)) == length
        },
    )
    hertz = method.filter_frequency_hz
    filters = method.record_low_pass or LowPass(hertz, hertz)
    curves = simulated_curves(rollout, few, mass=method.model_mass_kg, filters=filters)
    body = apply_parameters(walk.model, rollout.mu)
    factors = {"angles": float(np.degrees(1.0)), "moments": 1.0, "forces": 100.0}
    found = {
        f"{kind}/{name}": factors[kind] * each
        for kind in KINDS
        for name, each in getattr(curves, kind).items()
    }
    for name, each in foot_progression(rollout, few, body).items():
        found[f"angles/{name}"] = np.degrees(each)
    return found


def strides_in(folder: Path, metrics: Metrics) -> dict[str, Array]:
    """`strides_of` the walk in a run `folder`."""
    return strides_of(read_walk(folder, metrics), metrics, configuration_of(folder))


def figures(
    metrics: Metrics, subject: Subject, strides: Mapping[str, Array], looks: ReportSettings
) -> tuple[dict[str, Draw], Tables]:
    """What draws the figures of curves of a run of `subject` with the results `metrics`, by name,
    the small one of the sheet and the grids, and their tables; `strides` as `strides_of`, `looks`
    with the zero of angles and the sign of moments.
    """
    normal = norms(subject)
    panel = partial(_panel, metrics, subject, strides, normal)
    rows = {
        name: grids.in_convention(
            [[panel(each) for each in row] for row in names], looks.convention
        )
        for name, names in (
            ("curves", grids.SAGITTAL),
            ("kinematics", grids.KINEMATICS),
            ("kinetics", grids.WITH_QUANTITIES),
            ("forces", grids.FORCES),
        )
    }
    rows["curves"] = [
        [
            each._replace(error="", curves=tuple(c._replace(strides=None) for c in each.curves))
            for each in row
        ]
        for row in rows["curves"]
    ]
    rows[NARROW] = [list(column) for column in zip(*rows["curves"], strict=True)]
    adults = "parameter/cadence" in normal
    healthy = "healthy adults, ± SD" if adults else ""  # the sheet's footnote says how many
    heights = {"curves": 0.76, NARROW: 1.1, "kinematics": 1.27, "kinetics": 1.35}
    words = ("measured" if metrics.is_recorded_at_all else "predicted", "walk")
    draws: dict[str, Draw] = {
        name: partial(
            grids.grid,
            each,
            height=heights.get(name, 1.6),
            figure_name=name,
            words=words,
            norm=healthy,
            width=NARROW_WIDTH if name == NARROW else WIDTH,
            extensor_positive=looks.extensor_positive,
        )
        for name, each in rows.items()
    }
    beside = figure_data.compared_name(metrics)
    tables = {
        name: grids.grid_table(each, beside)
        for name, each in rows.items()
        if name not in ("curves", NARROW)
    }
    if (shown := walked_muscles(metrics)) is not None:
        draws |= {"activations": shown.activations, "contacts": shown.contacts}
        tables |= shown.tables()
    return draws, tables


def walked_muscles(metrics: Metrics) -> DrawnMuscles | None:
    """Activations and contact forces of the walk; None in a file of before there were any."""
    activation, contact = (
        of_walk(metrics.walk, each) for each in (MUSCLE_ACTIVATION, JOINT_CONTACT)
    )
    if activation is None or contact is None:
        return None
    return DrawnMuscles(
        *(
            {name: (curve, None) for name, curve in of.curves.items()}
            for of in (activation, contact)
        )
    )


def _panel(
    metrics: Metrics,
    subject: Subject,
    strides: Mapping[str, Array],
    normal: Mapping[str, Norm],
    name: str,
) -> Panel:
    """The panel of a quantity "kind/curve" without side."""
    kind, _, curve = name.partition("/")
    curves, errors = [], []
    for side in SIDES:
        key = f"{curve}_{side[0]}"
        recorded = _recorded(metrics, subject, kind, key)
        if recorded is not None:
            curves.append(DrawnCurve(side, recorded, which="record"))
        walked = _walked(metrics, strides, kind, key)
        if walked is not None:
            curves.append(DrawnCurve(side, *walked, strides.get(f"{kind}/{key}")))
        for each in KINDS:
            if each == kind and key in metrics.walk.errors.of(each):
                errors.append(rmse_of(metrics.walk.errors.of(each)[key]))
    known = [f"{each:.2f}" if kind == "moments" else f"{each:.1f}" for each in errors if each]
    stance = metrics.record.spatiotemporal
    return Panel(
        name,
        tuple(curves),
        normal.get(name),
        {side: 100.0 * getattr(stance, f"stance_fraction_{side}") for side in SIDES},
        bursts=_bursts(metrics, curve) if kind == "power" else {},
        error=" / ".join(known),
    )


def _recorded(metrics: Metrics, subject: Subject, kind: str, key: str) -> Array | None:
    """The record as it is compared; of what is not compared, as it came."""
    if kind in BY_NAME:
        found = of_record(metrics.record, BY_NAME[kind])
        return None if found is None else found.curves.get(key)
    for each in KINDS:
        if each == kind and key in metrics.record.curves.of(each):
            return array(metrics.record.curves.of(each)[key])
    percent = np.linspace(0.0, 1.0, 101)
    if kind == "angles":
        angle = subject.gait.angles_of_both().get(key)
        return None if angle is None else np.degrees(angle(percent))
    moment = subject.record().moments.get(key) if subject.has_kinetics else None
    return None if kind != "moments" or moment is None else np.asarray(moment(percent))


def _walked(
    metrics: Metrics, strides: Mapping[str, Array], kind: str, key: str
) -> tuple[Array, Array | None] | None:
    """Mean and SD over the cycles; of what is not compared, over the drawn ones."""
    if kind in BY_NAME:
        walked = of_walk(metrics.walk, BY_NAME[kind])
        mean = None if walked is None else walked.curves.get(key)
        return None if mean is None else (mean, None)
    for each in KINDS:
        if each == kind and key in metrics.walk.curves.of(each):
            found = metrics.walk.curves.of(each)[key]
            if found.mean is None:
                return None
            return array(found.mean), None if found.sd is None else array(found.sd)
    drawn = strides.get(f"{kind}/{key}")
    return None if drawn is None else (drawn.mean(axis=0), sample_deviation(drawn))


def _bursts(metrics: Metrics, joint: str) -> dict[str, float]:
    """Bursts of power of a joint, where the right side's record has them."""
    power = {each: array(metrics.record.joint_power.power[f"{each}_r"]) for each in POWER_JOINTS}
    return {
        name: float(at)
        for name, at in burst_places(power).items()
        if at is not None and BURSTS[name].joint == joint
    }
