"""A page for each patient: side, norms by age and speed, asymmetry, and what cannot be said."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.metrics.gait_profile import (
    PROFILE_ANGLES,
    SMALLEST_DIFFERENCE,
    gait_profile,
    load_controls,
)
from gaitval.metrics.norms import norms
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.page import write_html
from gaitval_patients.asymmetry import angle_rows, symmetry_index, worse_side
from gaitval_patients.records import Patient

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
_COLOURS: Final = {"right": "#d55e00", "left": "#0072b2"}
_BAND: Final = "#dddddd"

NEVER_SAID: Final = (
    "How strong a muscle is, whether it is spastic, and whether anything hurts: angles do not show "
    "it.",
    "What a stick, a rail or a helping hand carries: nothing measured it, and the walker has none.",
    "How much strides differ from one to the next: there is one a side.",
    "What moments and forces act: none were measured. Those of a walk are predictions.",
)
"""What no page of this kind can say."""


def write_pages(
    found: Sequence[Patient], walks: Sequence[dict[str, Any]] | None, out: Path
) -> Path:
    """Write a page for each patient into `out`/pages, which is returned; `walks` are the results of
    `walk.walk` of the same people, or None.
    """
    by_name = {each["name"]: each for each in walks or ()}
    for each in found:
        name = each.subject.identifier
        context = page_values(each, by_name.get(name))
        write_html(out / "pages", name, "gaitval_patients:patient.html.j2", context)
    return out / "pages"


def page_values(patient: Patient, walk: dict[str, Any] | None) -> dict[str, Any]:
    """What the template is given."""
    controls, usual = load_controls(), norms(patient.subject)
    profile = gait_profile(patient.strides.angles, controls.curves)
    bands = {
        name: (usual[f"angles/{name}"].mean, usual[f"angles/{name}"].sd)
        for name in PROFILE_ANGLES
        if f"angles/{name}" in usual
    }
    side, by = worse_side(patient)
    return {
        "subject": patient.subject,
        "group": patient.strides.group.replace("_", " "),
        "state": patient.state,
        "affected": patient.affected,
        "prosthesis": patient.person.amputation,
        "worse": side,
        "worse_by": by,
        "smallest": SMALLEST_DIFFERENCE,
        "profile": profile,
        "controls": controls,
        "rows": angle_rows(patient),
        "titles": TITLES,
        "parameters": _parameters(patient),
        "beyond": any(each.beyond for each in usual.values()),
        "people": max(each.people for each in usual.values()),
        "walk": walk,
        "cannot": [*NEVER_SAID, *_of_this_person(patient)],
        "smoothing": max(float(np.degrees(e.rms)) for e in patient.smoothing.values()),
        "largest": max(float(np.degrees(e.curve.residual)) for e in patient.smoothing.values()),
        "drawings": {"angles": partial(_draw, dict(patient.strides.angles), bands)},
    }


def _of_this_person(patient: Patient) -> list[str]:
    """What cannot be said of this one."""
    found = []
    if patient.estimates["speed"].sd > 0.0:
        found.append(
            "How fast the person walked: it was not recorded. Norms are read at the estimated "
            "speed, so they are as uncertain as it is."
        )
    if "leg_difference" not in patient.estimates:
        found.append("Whether the legs differ in length: they were not measured on both sides.")
    if patient.person.amputation is not None:
        found.append(
            "What the prosthesis does between socket and foot: its masses are in the body, its "
            "knee and ankle are moved like sound ones."
        )
    if patient.person.below_knee is not None:
        found.append(
            f"What the prosthesis below the {patient.person.below_knee} knee weighs and does: the "
            "body has a sound leg there."
        )
    if patient.affected is None:
        found.append("Which side is affected: no table names one.")
    return found


def _parameters(patient: Patient) -> list[dict[str, Any]]:
    """Rows: title, value, 90 % interval or None, norm's mean and SD or None, unit."""
    usual, known = norms(patient.subject), patient.estimates
    rows = []
    for title, name, norm, unit in (
        ("Walking speed", "speed", None, "m/s"),
        ("Stride time", "stride_time", "parameter/stride_time", "s"),
        ("Stride length", "stride_length", None, "m"),
        ("Stance, right", "stance_right", "parameter/stance_fraction", "of the cycle"),
        ("Stance, left", "stance_left", "parameter/stance_fraction", "of the cycle"),
        ("Left heel strike", "left_phase", None, "of the right cycle"),
        ("Right leg less left", "leg_difference", None, "m"),
        ("Leg length", "leg_length", None, "m"),
        ("Stature", "height", None, "m"),
        ("Mass", "mass", None, "kg"),
    ):
        if name not in known:
            continue
        of = known[name]
        expected = usual.get(norm) if norm else None
        rows.append(
            {
                "title": title,
                "value": of.value,
                "interval": None if of.sd == 0.0 else of.interval(),
                "norm": None if expected is None else (float(expected.mean), float(expected.sd)),
                "unit": unit,
                "how": of.how,
            }
        )
    stance = {side: known[f"stance_{side}"].value for side in SIDES}
    steps = known["left_phase"].value
    rows += [
        {
            "title": title,
            "value": symmetry_index(*values),
            "interval": None,
            "norm": None,
            "unit": "%",
            "how": "difference over the mean of both sides; right larger is positive",
        }
        for title, values in (
            ("Symmetry index of stance", (stance["right"], stance["left"])),
            # The right step ends the right cycle: it lasts from the left heel strike on.
            ("Symmetry index of step time", (1.0 - steps, steps)),
        )
    ]
    return rows


def _draw(angles: dict[str, Array], bands: dict[str, tuple[Array, Array]]) -> str:
    """Nine angles of both sides over their own cycle, and the norm with two SD, as SVG."""
    percent = np.arange(101)
    with new_figure(5.6) as figure:
        for place, name in enumerate(PROFILE_ANGLES, start=1):
            axes = figure.add_subplot(3, 3, place)
            if name in bands:
                mean, sd = bands[name]
                axes.fill_between(percent, mean - 2.0 * sd, mean + 2.0 * sd, color=_BAND, lw=0)
            for side in SIDES:
                axes.plot(percent, angles[f"{name}_{side[0]}"], color=_COLOURS[side])
            axes.set_title(f"{TITLES[name]}, °")
            axes.set_xlim(0, 100)
            if place > 6:
                axes.set_xlabel("% of the gait cycle")
        return svg(figure, "angles")
