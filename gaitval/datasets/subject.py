"""A subject: who walked, how they stood, and their recorded gait, as one TOML file.

Ten subjects are built in (`gaitval/datasets/builtin`, made by
`gaitval.datasets.wbds.build_subjects`). Any other is a file in the same layout. Axes are REP-103
(x forward, y left, z up), units SI, angles in radians, joint moments in Nm/kg, forces in body
weights.
"""

import difflib
import json
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    Field,
    Strict,
    ValidationError,
    model_validator,
)

from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES
from gaitval.errors import SubjectError
from gaitval.gait.record import (
    ANGLE_NAMES,
    MOMENT_NAMES,
    REQUIRED_ANGLES,
    Curve,
    Force,
    GaitRecord,
    LowPass,
    Number,
    StoredPart,
)

BUILTIN: Final[dict[str, str]] = {
    "S01": "WBDS01 T05",
    "S02": "WBDS02 T06",
    "S03": "WBDS12 T06",
    "S04": "WBDS21 T04",
    "S05": "WBDS14 T05",
    "S06": "WBDS24 T07",
    "S07": "WBDS26 T03",
    "S08": "WBDS29 T01",
    "S09": "WBDS31 T03",
    "S10": "WBDS39 T02",
}
"""The paper's ten subjects: person and treadmill trial of the WBDS dataset."""

MARKERS: Final = tuple(
    f"{side}.{name}"
    for side in "RL"
    for name in (
        "ASIS",
        "PSIS",
        "Iliac.Crest",
        "GTR",
        "Knee",
        "Knee.Medial",
        "HF",
        "TT",
        "Ankle",
        "Ankle.Medial",
        "Heel",
        "MT1",
        "MT2",
        "MT5",
    )
)
"""The 28 markers of a standing trial: anterior and posterior superior iliac spines, iliac crest,
greater trochanter, knee epicondyles, fibula head, tibial tuberosity, malleoli, heel and
metatarsal heads."""

TAPE: Final = ("hip_height", "thigh", "shank", "ankle_height", "foot", "pelvis_width")
"""Lengths that a tape measure gives; `scaling.tape` says between which points."""

# Plausible ranges. They catch units and swapped columns, not unusual people: each is wider
# than the range over the 50 people of the WBDS dataset.
HEIGHT = (1.2, 2.3)  # m
MASS = (25.0, 200.0)  # kg
BMI = (13.0, 45.0)  # kg/m²
LEG_RATIO = (0.42, 0.60)  # leg length / height; WBDS 0.48-0.56
AGE = (16.0, 105.0)  # years; de Leva's segment tables are of adults
SPEED = (0.2, 2.5)  # m/s, walking
STRIDE_TIME = (0.6, 2.5)  # s
LEFT_PHASE = (0.35, 0.65)
STANCE_FRACTION = (0.5, 0.8)
VERTICAL_FORCE = (0.85, 1.1)  # body weights; exactly 1 for a periodic gait and true calibration
LARGEST_COORDINATE = 10.0  # m, of a marker in its laboratory
LARGEST_ANGLE = 3.0  # rad
LARGEST_MOMENT = 5.0  # Nm/kg
LARGEST_FORCE = 3.0  # body weights


def _keys_problems(seen: Iterable[str], known: Sequence[str]) -> list[str]:
    """One sentence for every key of `seen` that is not `known`, with the nearest match."""
    problems = []
    for key in seen:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            problems.append(f"{key}: unknown key" + (f", did you mean {near[0]}?" if near else "."))
    return problems


def _complete(
    seen: Iterable[str], known: Sequence[str], required: Sequence[str] | None = None
) -> None:
    seen = list(seen)
    problems = _keys_problems(seen, known)
    missing = [key for key in required or known if key not in seen]
    if missing:
        problems.append(f"missing: {', '.join(missing)}.")
    if problems:
        raise ValueError(" ".join(problems))


def _angles_complete(curves: "dict[str, Curve]") -> "dict[str, Curve]":
    _complete(curves, ANGLE_NAMES, REQUIRED_ANGLES)
    return curves


def _moments_complete(curves: "dict[str, Curve]") -> "dict[str, Curve]":
    _complete(curves, MOMENT_NAMES)
    return curves


def _markers_known(markers: "dict[str, Position]") -> "dict[str, Position]":
    problems = _keys_problems(markers, MARKERS)
    if problems:
        raise ValueError(" ".join(problems))
    return markers


def _tape_known(lengths: "dict[str, Number]") -> "dict[str, Number]":
    problems = _keys_problems(lengths, TAPE)
    if problems:
        raise ValueError(" ".join(problems))
    return lengths


Position = tuple[Number, Number, Number]


class Forces(StoredPart):
    """Ground reaction of both feet."""

    right: Force
    left: Force


class Gait(StoredPart):
    """Mean gait curves in the convention of `GaitRecord`."""

    samples: Annotated[int, Strict(), Field(gt=0)]
    """Samples of a gait cycle in the source, first and last included."""
    angles: Annotated[dict[str, Curve], AfterValidator(_angles_complete)]
    moments: Annotated[dict[str, Curve], AfterValidator(_moments_complete)]
    forces: Forces


class StanceFraction(StoredPart):
    """Fraction of each side's own cycle on the ground."""

    right: Number
    left: Number


class RecordedLowPass(StoredPart):
    """What the recorded moments and forces had passed; see `LowPass`."""

    moments_hz: Annotated[Number, Field(gt=0)]
    forces_hz: Annotated[Number, Field(gt=0)]


class Printed(StoredPart):
    """What the paper's table prints for this subject, errors included; not used to compute."""

    sex: Literal["F", "M"]
    age_years: Number
    mass_kg: Number
    height_m: Number
    walking_speed_m_s: Number


class Subject(StoredPart):
    """A person and their recorded gait.

    Raises
    ------
    pydantic.ValidationError
        On construction, when a value is missing, of the wrong type or implausible.
        `make_subject` and `load_subject` turn it into a `SubjectError`.
    """

    identifier: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    """Name of the subject, also of its run folder: "S05"."""
    source: str
    """Person and trial in the source dataset: "WBDS14 T05"."""
    citation: str
    licence: str
    sex: Literal["F", "M"]
    """Chooses the segment tables (de Leva 1996)."""
    age_years: Number | None = None
    mass_kg: Number
    height_m: Number
    leg_length_m: Number
    walking_speed_m_s: Number
    """Mean forward speed; on a treadmill the belt's."""
    stride_time_s: Number
    left_phase: Number
    """Phase of the right cycle at left heel strike, from the pelvis curves of the two sides."""
    left_phase_from_force: Number | None = None
    """A second estimate, from the vertical forces; not used to compute."""
    mean_vertical_force: Number
    """Mean over the cycle of right + left vertical force, body weights. One in truth; what is
    missing is the calibration or the filter of the source."""
    stance_fraction: StanceFraction
    low_pass: RecordedLowPass | None = None
    """Known for an import; None where the source does not say."""
    paper: Printed | None = None
    gait: Gait
    markers: Annotated[dict[str, Position], AfterValidator(_markers_known)] = Field(
        default_factory=dict
    )
    """Standing marker positions, m, REP-103 axes. May be empty: scaling then uses `tape`."""
    tape: Annotated[dict[str, Number], AfterValidator(_tape_known)] = Field(default_factory=dict)
    """Lengths by tape measure, m (`TAPE`), for scaling without markers; stature for the others."""
    measurements: dict[str, Number | Position | dict[str, str]] = Field(default_factory=dict)
    """Lengths of the body as `scaling.measurements.Measurements.to_dict` gives them, m; they count
    more than the markers. Empty where scaling finds them from the markers."""

    @model_validator(mode="after")
    def _plausible(self) -> Self:
        problems = _implausible(self.model_dump())
        if problems:
            raise ValueError("\n".join(problems))
        return self

    def record(self) -> GaitRecord:
        """The recorded gait as periodic curves."""
        forces = {"right": self.gait.forces.right, "left": self.gait.forces.left}
        return GaitRecord(
            speed=self.walking_speed_m_s,
            stride_time=self.stride_time_s,
            left_phase=self.left_phase,
            stance_fraction={
                "right": self.stance_fraction.right,
                "left": self.stance_fraction.left,
            },
            angles={name: curve.periodic() for name, curve in self.gait.angles.items()},
            moments={name: curve.periodic() for name, curve in self.gait.moments.items()},
            forces={
                side: (
                    forces[side].forward.periodic(),
                    forces[side].left.periodic(),
                    forces[side].up.periodic(),
                )
                for side in SIDES
            },
            low_pass=None
            if self.low_pass is None
            else LowPass(self.low_pass.moments_hz, self.low_pass.forces_hz),
        )

    def to_toml(self) -> str:
        """The subject as TOML; numbers have six significant digits, curves a line each."""
        return _toml(self)


def _figure(value: float) -> str:
    return f"{value:.6g}"


def _figures(values: Iterable[float]) -> str:
    return "[" + ", ".join(_figure(value) for value in values) + "]"


def _curve_line(name: str, curve: Curve) -> str:
    return (
        f"{name} = {{ mean = {_figure(curve.mean)}, residual = {curve.residual:.3g}, "
        f"cosine = {_figures(curve.cosine)}, sine = {_figures(curve.sine)} }}"
    )


def _table_lines(values: BaseModel, without: Sequence[str] = ()) -> list[str]:
    lines = []
    for name in type(values).model_fields:
        value = getattr(values, name)
        if name in without or value is None:
            continue
        # JSON's string escapes are a subset of TOML's.
        text = json.dumps(value, ensure_ascii=False) if isinstance(value, str) else _figure(value)
        lines.append(f"{name} = {text}")
    return lines


def _value_line(name: str, value: "float | Sequence[float] | Mapping[str, str]") -> str:
    if isinstance(value, Mapping):
        texts = (f"{json.dumps(key)} = {json.dumps(text)}" for key, text in value.items())
        return f"{name} = {{ {', '.join(texts)} }}"
    return f"{name} = {_figure(value) if isinstance(value, float) else _figures(value)}"


def _toml(subject: Subject) -> str:
    lines = [
        "# m, kg, s, rad; axes x forward, y left, z up; moments Nm/kg; forces in body weights.",
        "# Curves: mean + sum over k of cosine[k] cos(2 pi k phase) + sine[k] sin(2 pi k phase).",
    ]
    tables = ("stance_fraction", "low_pass", "paper", "gait", "markers", "tape", "measurements")
    lines += _table_lines(subject, tables)
    lines += ["", "[stance_fraction]", *_table_lines(subject.stance_fraction)]
    if subject.low_pass is not None:
        lines += ["", "[low_pass]", *_table_lines(subject.low_pass)]
    if subject.paper is not None:
        lines += ["", "[paper]", *_table_lines(subject.paper)]
    if subject.markers:
        lines += ["", "[markers]"]
        lines += [f'"{name}" = {_figures(at)}' for name, at in subject.markers.items()]
    if subject.tape:
        lines += ["", "[tape]"]
        lines += [_value_line(name, value) for name, value in subject.tape.items()]
    if subject.measurements:
        lines += ["", "[measurements]"]
        lines += [_value_line(name, value) for name, value in subject.measurements.items()]
    lines += ["", "[gait]", f"samples = {subject.gait.samples}"]
    lines += ["", "[gait.angles]"]
    lines += [_curve_line(name, curve) for name, curve in subject.gait.angles.items()]
    lines += ["", "[gait.moments]"]
    lines += [_curve_line(name, curve) for name, curve in subject.gait.moments.items()]
    for side, force in (("right", subject.gait.forces.right), ("left", subject.gait.forces.left)):
        lines += ["", f"[gait.forces.{side}]"]
        lines += [_curve_line(axis, getattr(force, axis)) for axis in ("forward", "left", "up")]
    return "\n".join(lines) + "\n"


def _number(values: Mapping[str, Any], name: str) -> float | None:
    """The finite number stored under `name`, or None: other checks report what it is not."""
    value = values.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        return None
    return float(value)


def _within(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]


def _plausible_build(mass: float, height: float) -> bool:
    return _within(mass, MASS) and _within(height, HEIGHT) and _within(mass / height**2, BMI)


def mass_and_height_problems(mass: float, height: float) -> list[str]:
    """What is wrong with a body mass (kg) and a stature (m), a sentence each; wrong units and
    swapped values are told.
    """
    if _plausible_build(mass, height):
        return []
    swapped = [
        (new_mass, new_height)
        for new_height in (mass, mass / 100)
        for new_mass in (height, height * 100)
        if _plausible_build(new_mass, new_height)
    ]
    seen = f"mass_kg = {mass:g} and height_m = {height:g}"
    if _plausible_build(mass, height / 100):
        return [
            f"height_m = {height:g}: this looks like centimetres. "
            f"Give metres: height_m = {height / 100:g}."
        ]
    if swapped:
        new_mass, new_height = swapped[0]
        return [
            f"{seen}: the columns look swapped (a body mass of {mass:g} kg at {height:g} m is "
            f"impossible, {new_mass:g} kg at {new_height:g} m is not). "
            f"Give mass_kg = {new_mass:g} and height_m = {new_height:g}."
        ]
    if _plausible_build(mass * 0.45359237, height):
        return [
            f"mass_kg = {mass:g}: with height_m = {height:g} the body mass index is "
            f"{mass / height**2:.1f} kg/m², outside {BMI[0]:g}-{BMI[1]:g}; this looks like pounds. "
            f"Give kilograms: mass_kg = {mass * 0.45359237:.1f}."
        ]
    if _plausible_build(mass, height * 0.3048):
        return [
            f"height_m = {height:g}: this looks like feet. "
            f"Give metres: height_m = {height * 0.3048:.3f}."
        ]
    problems = [
        f"{name} = {value:g}: outside {limits[0]:g}-{limits[1]:g} {unit}. Check value and unit."
        for name, value, limits, unit in (
            ("mass_kg", mass, MASS, "kg"),
            ("height_m", height, HEIGHT, "m"),
        )
        if not _within(value, limits)
    ]
    return problems or [
        f"{seen}: the body mass index is {mass / height**2:.1f} kg/m², outside "
        f"{BMI[0]:g}-{BMI[1]:g}. Check both values and their units."
    ]


def _range_problem(
    values: Mapping[str, Any],
    name: str,
    limits: tuple[float, float],
    unit: str,
    other_units: Mapping[str, float] | None = None,
) -> list[str]:
    """Out of range; `other_units` maps a unit's name to the factor from it to `unit`."""
    value = _number(values, name)
    if value is None or _within(value, limits):
        return []
    for other, factor in (other_units or {}).items():
        if _within(value * factor, limits):
            return [
                f"{name} = {value:g}: this looks like {other}; "
                f"give {unit}: {name} = {value * factor:g}."
            ]
    return [
        f"{name} = {value:g}: outside the plausible {limits[0]:g}-{limits[1]:g} {unit}. "
        "Check value and unit."
    ]


def _marker_problems(markers: Mapping[str, Any]) -> list[str]:
    positions = {
        name: np.array(at, dtype=float)
        for name, at in markers.items()
        if isinstance(at, list | tuple)
        and len(at) == 3
        and all(isinstance(value, int | float) for value in at)
        and np.all(np.isfinite(at))
    }
    far = {name: at for name, at in positions.items() if np.abs(at).max() > LARGEST_COORDINATE}
    if far:
        name, at = next(iter(far.items()))
        return [
            f"markers: {len(far)} of {len(positions)} are more than {LARGEST_COORDINATE:g} m from "
            f"the origin (the first is {name} at {at.tolist()}); this looks like millimetres. "
            "Divide by 1000."
        ]
    problems = []
    for side in "RL":
        hip, knee = positions.get(f"{side}.ASIS"), positions.get(f"{side}.Knee")
        if hip is not None and knee is not None and hip[2] <= knee[2]:
            problems.append(
                f"markers: {side}.ASIS (z = {hip[2]:g} m) is not above {side}.Knee "
                f"(z = {knee[2]:g} m). Axes must be x forward, y left, z up; ISB axes (y up, "
                "z right) convert as x, -z, y."
            )
    right, left = positions.get("R.ASIS"), positions.get("L.ASIS")
    if not problems and right is not None and left is not None and left[1] <= right[1]:
        problems.append(
            f"markers: L.ASIS (y = {left[1]:g} m) is not to the left of R.ASIS "
            f"(y = {right[1]:g} m). The person must face +x with y to the left; check that the "
            "sides are not exchanged."
        )
    return problems


def _curve_values(curve: Any, until: float = 1.0) -> np.ndarray[Any, np.dtype[np.float64]] | None:
    """Samples of a curve as it stands in the TOML, over phases 0…`until`; None if malformed."""
    try:
        periodic = Curve.model_validate(curve).periodic()
    except ValidationError:
        return None
    return periodic(np.linspace(0, until, 100))


def _curve_problems(gait: Mapping[str, Any], stance: Mapping[str, Any]) -> list[str]:
    problems = []
    for group, largest, unit, mend in (
        ("angles", LARGEST_ANGLE, "rad", "this looks like degrees; multiply by pi/180"),
        ("moments", LARGEST_MOMENT, "Nm/kg", "this looks like Nm; divide by the body mass"),
    ):
        curves = gait.get(group)
        for name, curve in curves.items() if isinstance(curves, Mapping) else ():
            values = _curve_values(curve)
            if values is not None and np.abs(values).max() > largest:
                problems.append(
                    f"gait.{group}.{name}: reaches {np.abs(values).max():.3g} {unit}; {mend}."
                )
    forces = gait.get("forces")
    for side in SIDES:
        until = _number(stance, side)
        force = forces.get(side) if isinstance(forces, Mapping) else None
        up = force.get("up") if isinstance(force, Mapping) else None
        values = None if until is None or up is None else _curve_values(up, until)
        if values is None:
            continue
        if np.abs(values).max() > LARGEST_FORCE:
            problems.append(
                f"gait.forces.{side}.up: reaches {np.abs(values).max():.3g} body weights; this "
                f"looks like N or N/kg. Divide N/kg by {STANDARD_GRAVITY}."
            )
        elif values.mean() <= 0:
            problems.append(
                f"gait.forces.{side}.up: its mean in stance is {values.mean():.3g} body weights; "
                "the ground pushes up. Change its sign."
            )
    return problems


def _implausible(values: Mapping[str, Any]) -> list[str]:
    """Every implausible value of a subject's tables, a sentence each.

    Works on what is there, so that it can add to the list of missing and malformed keys.
    """
    mass, height = _number(values, "mass_kg"), _number(values, "height_m")
    leg = _number(values, "leg_length_m")
    problems = []
    if mass is not None and height is not None:
        problems += mass_and_height_problems(mass, height)
    if leg is not None and height is not None and _within(height, HEIGHT):
        if _within(leg / 100 / height, LEG_RATIO):
            problems.append(
                f"leg_length_m = {leg:g}: this looks like centimetres. "
                f"Give metres: leg_length_m = {leg / 100:g}."
            )
        elif not _within(leg / height, LEG_RATIO):
            problems.append(
                f"leg_length_m = {leg:g}: {leg / height:.2f} of height_m = {height:g}, outside "
                f"{LEG_RATIO[0]:g}-{LEG_RATIO[1]:g}. Leg length is from hip to floor, in metres."
            )
    problems += _range_problem(values, "age_years", AGE, "years", {"months": 1 / 12})
    problems += _range_problem(
        values, "walking_speed_m_s", SPEED, "m/s", {"km/h": 1 / 3.6, "mm/s": 1e-3}
    )
    problems += _range_problem(values, "stride_time_s", STRIDE_TIME, "s", {"milliseconds": 1e-3})
    problems += _range_problem(
        values, "left_phase", LEFT_PHASE, "of the right gait cycle", {"per cent": 0.01}
    )
    problems += _range_problem(
        values,
        "mean_vertical_force",
        VERTICAL_FORCE,
        "body weights",
        {"N/kg": 1 / STANDARD_GRAVITY},
    )
    stance = values.get("stance_fraction")
    stance = stance if isinstance(stance, Mapping) else {}
    for side in SIDES:
        problems += [
            f"stance_fraction.{problem}"
            for problem in _range_problem(
                stance, side, STANCE_FRACTION, "of the gait cycle", {"per cent": 0.01}
            )
        ]
    if isinstance(values.get("markers"), Mapping):
        problems += _marker_problems(values["markers"])
    if isinstance(values.get("gait"), Mapping):
        problems += _curve_problems(values["gait"], stance)
    return problems


_FIELDS: Final = tuple(
    name
    for part in (Subject, RecordedLowPass, Printed, StanceFraction, Gait, Forces, Force, Curve)
    for name in part.model_fields
)


def _sentence(error: Mapping[str, Any]) -> str:
    """One error of pydantic in our words: where, what was seen, how to mend."""
    location = error["loc"]
    where = ".".join(str(key) for key in location)
    if error["type"] == "missing":
        return f"{where}: missing. Add it."
    if error["type"] == "extra_forbidden":
        near = difflib.get_close_matches(str(location[-1]), _FIELDS, n=1, cutoff=0.75)
        return f"{where}: unknown key" + (f", did you mean {near[0]}?" if near else ". Remove it.")
    if error["type"] == "value_error":
        return f"{where}: {error['ctx']['error']}"
    return f"{where} = {error['input']!r}: {error['msg']}."


def make_subject(values: Mapping[str, Any], where: str) -> Subject:
    """A subject from its tables.

    Parameters
    ----------
    values : the tables and keys of a subject file.
    where : name of the file or trial, for messages.

    Raises
    ------
    SubjectError
        Lists every missing, unknown, malformed or implausible value.
    """
    try:
        return Subject.model_validate(values)
    except ValidationError as error:
        # The error without a location is `_plausible`, which only runs when all else is well.
        problems = [_sentence(item) for item in error.errors() if item["loc"]]
    problems += _implausible(values)
    raise SubjectError(
        f"{where}: {len(problems)} problem{'s' if len(problems) > 1 else ''}\n"
        + "\n".join(f"  - {problem}" for problem in problems)
    )


def parse_subject(text: str, where: str) -> Subject:
    """Read a subject from TOML `text`; `where` names the file in messages.

    Raises
    ------
    SubjectError
        Invalid TOML, or the problems that `make_subject` lists.
    """
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SubjectError(f"{where}: not valid TOML: {error}. Mend that line.") from None
    return make_subject(values, where)


def _read_file(path: Path) -> Subject:
    if path.is_dir():
        raise SubjectError(f"{path}: is a folder. Give the subject's .toml file in it.")
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SubjectError(f"{path}: no such file. Check the path of the subject file.") from None
    except UnicodeDecodeError:
        raise SubjectError(f"{path}: not UTF-8 text. Save the file as UTF-8 TOML.") from None
    return parse_subject(text, str(path))


def _read_builtin(identifier: str) -> Subject:
    file = resources.files("gaitval.datasets") / "builtin" / f"{identifier}.toml"
    return parse_subject(file.read_text(encoding="utf-8"), f"{identifier}.toml")


def builtin_subjects() -> tuple[Subject, ...]:
    """The paper's ten subjects, S01 to S10."""
    return tuple(_read_builtin(identifier) for identifier in BUILTIN)


def load_subject(name_or_path: str | int | Path) -> Subject:
    """Load a built-in subject or a subject file.

    Parameters
    ----------
    name_or_path : 5, "5", "S05", the dataset's name "WBDS14", or a path to a .toml file.

    Raises
    ------
    SubjectError
        When no such subject exists, or the file has problems (all are listed).
    """
    name = str(name_or_path).strip()
    if name.lower().endswith(".toml") or "/" in name:
        return _read_file(Path(name))
    if match := re.fullmatch(r"[Ss]?0*([1-9]\d*)", name):
        identifier = f"S{int(match[1]):02d}"
        if identifier in BUILTIN:
            return _read_builtin(identifier)
    if match := re.fullmatch(r"WBDS0*([1-9]\d*)", name.upper()):
        for identifier, source in BUILTIN.items():
            if source.startswith(f"WBDS{int(match[1]):02d} "):
                return _read_builtin(identifier)
    valid = ", ".join(f"{key} ({source.split()[0]})" for key, source in BUILTIN.items())
    raise SubjectError(
        f"{name!r}: no such subject. Built in are {valid}; or give a path to a .toml file."
    )
