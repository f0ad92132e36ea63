"""A page for each patient, and its figure."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval.apps.patients.records import Patient
from gaitval.apps.patients.results import BEYOND, result_of
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.metrics.gait_profile import SMALLEST_DIFFERENCE
from gaitval.metrics.norms import norms
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.figures import BAND_COLOUR, COLOURS, STYLES, WALK_WIDTH

TITLES: Final = {
    "pelvis_tilt": "Pelvic tilt",
    "hip_flexion": "Hip flexion",
    "knee_angle": "Knee flexion",
    "ankle_angle": "Ankle dorsiflexion",
    "pelvis_list": "Pelvic obliquity",
    "hip_adduction": "Hip adduction",
    "pelvis_rotation": "Pelvic rotation",
    "hip_rotation": "Hip rotation",
    "foot_progression": "Foot progression",
}
QUANTITIES: Final = {
    "speed": ("Walking speed", "m/s", 2),
    "stride_time": ("Stride time", "s", 2),
    "stride_length": ("Stride length", "m", 3),
    "stance_right": ("Stance, right", "of the cycle", 2),
    "stance_left": ("Stance, left", "of the cycle", 2),
    "left_phase": ("Left heel strike", "of the right cycle", 2),
    "leg_difference": ("Right leg less left", "m", 3),
    "leg_length": ("Leg length", "m", 3),
    "height": ("Stature", "m", 3),
    "mass": ("Mass", "kg", 1),
}
"""Title, unit and digits of an estimate."""


def write_pages(
    found: Sequence[Patient], walks: Sequence[dict[str, Any]] | None, out: Path
) -> Path:
    """Write what is found of each patient (`PatientResult`), with its page, into a folder of its
    name in `out`/pages, which is returned; `walks` are the results of `apps.patients.walk.walk` of
    the same people, or None.
    """
    by_name = {each["name"]: each for each in walks or ()}
    for each in found:
        name = each.subject.identifier
        bands = {
            angle: (norm.mean, norm.sd)
            for angle in PROFILE_ANGLES
            if (norm := norms(each.subject).get(f"angles/{angle}")) is not None
        }
        result_of(each, by_name.get(name)).write(
            out / "pages" / name,
            paper=False,
            controls=load_controls(),
            smallest=SMALLEST_DIFFERENCE,
            titles=TITLES,
            quantities=QUANTITIES,
            drawings={"angles": partial(draw_angles, dict(each.strides.angles), bands)},
        )
    return out / "pages"


def draw_angles(angles: dict[str, Array], bands: dict[str, tuple[Array, Array]]) -> str:
    """Nine `angles` (101,) deg of both sides over their own cycle as SVG, each with its norm of
    `bands`, mean and SD, if there is one.
    """
    percent = np.arange(101)
    with new_figure(5.6) as figure:
        for place, name in enumerate(PROFILE_ANGLES, start=1):
            axes = figure.add_subplot(3, 3, place)
            if name in bands:
                mean, sd = bands[name]
                axes.fill_between(
                    percent, mean - BEYOND * sd, mean + BEYOND * sd, color=BAND_COLOUR, lw=0
                )
            for side in SIDES:
                own = angles[f"{name}_{side[0]}"]
                axes.plot(
                    percent, own, color=COLOURS[side], linestyle=STYLES[side], linewidth=WALK_WIDTH
                )
            axes.set_title(f"{TITLES[name]}, °")
            axes.set_xlim(0, 100)
            if place > 6:
                axes.set_xlabel("% of the gait cycle")
        return svg(figure, "angles")
