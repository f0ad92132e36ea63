"""A page for each patient: side, norms by age and speed, asymmetry, and what cannot be said."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval.apps.patients.ankle_errors import ankle_error
from gaitval.apps.patients.asymmetry import angle_rows, symmetry_index, worse_side
from gaitval.apps.patients.passive_foot import expected_ankles
from gaitval.apps.patients.records import Patient
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.datasets.plausible import ADULT
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.metrics.gait_profile import SMALLEST_DIFFERENCE, gait_profile
from gaitval.metrics.norms import MIDDLE, norms
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.figures import BAND_COLOUR, COLOURS, STYLES, WALK_WIDTH
from gaitval.reporting.page import write_html

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

NEVER_KNOWN: Final = (
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
        write_html(out / "pages", name, "gaitval.apps.patients:patient.html.j2", context)
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
    beyond = any(each.beyond for name, each in usual.items() if name.startswith("angles/"))
    side, by = worse_side(patient)
    ankles: dict[Side, Array] = {}
    prosthesis = patient.person.amputation
    if prosthesis is not None:
        expected = expected_ankles(patient, builtin_subjects())
        ankles = {each: curve(np.linspace(0.0, 1.0, 101)) for each, curve in expected.items()}
    return {
        "subject": patient.subject,
        "person": patient.person,
        "who": _who(patient),
        "whose": _whose(patient),
        "whose_angles": _whose(patient, beyond=beyond),
        "child": _is_child(patient),
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
        "beyond": beyond,
        "walk": walk,
        "ankles": _ankle_rows(patient, ankles, walk),
        "cannot": [*NEVER_KNOWN, *_of_this_person(patient)],
        "smoothing": max(float(np.degrees(e.rms)) for e in patient.smoothing.values()),
        "largest": max(float(np.degrees(e.curve.residual)) for e in patient.smoothing.values()),
        "drawings": {
            "angles": partial(_draw, dict(patient.strides.angles), bands),
            **({"ankles": partial(_draw_ankles, prosthesis, ankles, walk)}
               if ankles else {}),
        },
    }  # fmt: skip


def _ankle_rows(
    patient: Patient, ankles: Mapping[Side, Array], walk: dict[str, Any] | None
) -> list[dict[str, Any]]:
    """Of each side of an amputee: the largest plantarflexor moment to expect with its band, how far
    such moments were off in others, and how far the walk's is from it; none of others.
    """
    rows = []
    for side, expected in ankles.items():
        assert patient.person.amputation is not None
        error = ankle_error(side, patient.person.amputation)
        at = int(np.argmin(expected))
        walked = (walk or {}).get("moments")
        apart = None
        if walked:
            apart = float(np.sqrt(np.mean((np.array(walked[_ankle(side)]) - expected) ** 2)))
        rows.append(
            {
                "side": side,
                "kind": "prosthetic" if side == patient.person.amputation else "sound",
                "peak": -float(expected[at]),
                "half": float(error.half[at]),
                "at": at,
                "people": error.people,
                "error": error.mean,
                "walk": apart,
            }
        )
    return rows


def _ankle(side: Side) -> str:
    return f"ankle_angle_{side[0]}"


def _is_child(patient: Patient) -> bool:
    """Whether `norms` are those of children."""
    age = patient.person.age
    return age is not None and age < ADULT


def _who(patient: Patient) -> str:
    """Sex and age in words, and what is assumed of an age that is not known."""
    child, age = _is_child(patient), patient.person.age
    words = {"F": ("woman", "girl"), "M": ("man", "boy"), None: ("sex not known",) * 2}
    years = f"age not known: adult norms at {MIDDLE['age']:.0f} years"
    return f"{words[patient.person.sex][child]}, {years if age is None else f'{age:.3g} years'}"


def _whose(patient: Patient, *, beyond: bool = False) -> str:
    """Whose the norms are; `beyond`: none of these people walk at the patient's speed."""
    if _is_child(patient):
        return "healthy children at their free speed"
    age = f"{MIDDLE['age']:.0f} years" if patient.person.age is None else "this age"
    return f"healthy people of {'the nearest' if beyond else 'this'} speed at {age}"


def _of_this_person(patient: Patient) -> list[str]:
    """What cannot be said of this one."""
    found = []
    if patient.person.sex is None:
        found.append(
            "Whether the person is male or female: no table says it. The segments of the body are "
            "those of a male."
        )
    if patient.person.age is None:
        found.append(
            f"What is usual at this person's age: it is not known. Norms are those of "
            f"{MIDDLE['age']:.0f} years, and the segments those of an adult."
        )
    if _is_child(patient):
        found.append(
            "What is usual at this speed: the children beside whom the person is shown walked at "
            "their free speed. A child that walks slowly differs from them for its speed alone."
        )
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
    """Rows: title, value, 90 % interval or None, norm's mean and SD or None, whether the speed is
    beyond that of the norm's people, unit, and digits of all these numbers.
    """
    usual, known = norms(patient.subject), patient.estimates
    rows = []
    for title, name, norm, unit, digits in (
        ("Walking speed", "speed", None, "m/s", 2),
        ("Stride time", "stride_time", "parameter/stride_time", "s", 2),
        ("Stride length", "stride_length", None, "m", 3),
        ("Stance, right", "stance_right", "parameter/stance_fraction", "of the cycle", 2),
        ("Stance, left", "stance_left", "parameter/stance_fraction", "of the cycle", 2),
        ("Left heel strike", "left_phase", None, "of the right cycle", 2),
        ("Right leg less left", "leg_difference", None, "mm", 0),
        ("Leg length", "leg_length", None, "m", 3),
        ("Stature", "height", None, "m", 3),
        ("Mass", "mass", None, "kg", 1),
    ):
        if name not in known:
            continue
        of = known[name]
        expected = usual.get(norm) if norm else None
        scale = 1000.0 if unit == "mm" else 1.0
        rows.append(
            {
                "title": title,
                "value": scale * of.value,
                "interval": None if of.sd == 0.0 else [scale * each for each in of.interval()],
                "norm": None if expected is None else (float(expected.mean), float(expected.sd)),
                "beyond": expected is not None and expected.beyond,
                "unit": unit,
                "digits": digits,
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
            "beyond": False,
            "unit": "%",
            "digits": 1,
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
                axes.fill_between(
                    percent, mean - 2.0 * sd, mean + 2.0 * sd, color=BAND_COLOUR, lw=0
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


def _draw_ankles(
    prosthesis: Side | None, ankles: Mapping[Side, Array], walk: dict[str, Any] | None
) -> str:
    """The ankle moment to expect of each side with its band of 90 %, and that of the walk."""
    percent = np.arange(101)
    walked = (walk or {}).get("moments")
    with new_figure(2.4) as figure:
        panels = figure.subplots(1, len(SIDES), sharey=True)
        for axes, side in zip(panels, SIDES, strict=True):
            half, own = ankle_error(side, prosthesis).half, ankles[side]
            axes.fill_between(percent, own - half, own + half, color=BAND_COLOUR, lw=0)
            axes.plot(percent, own, color=COLOURS[side], linewidth=WALK_WIDTH, label="expected")
            if walked:
                axes.plot(
                    percent, walked[_ankle(side)], color=COLOURS[side], linestyle=(0, (1, 1.2)),
                    linewidth=WALK_WIDTH, label="walk",
                )  # fmt: skip
            axes.axhline(0.0, color="0.8", lw=0.5, zorder=0)
            kind = "prosthetic" if side == prosthesis else "sound"
            axes.set_title(f"{side.capitalize()} ankle, {kind}: moment, Nm/kg")
            axes.set_xlim(0, 100)
            axes.set_xlabel("% of the gait cycle")
        return svg(figure, "ankles")
