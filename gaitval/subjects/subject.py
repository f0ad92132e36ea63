"""A subject: who walked, how they stood, and their recorded gait, as one TOML file.

Ten subjects are built in (`gaitval/subjects/builtin`, made by
`experiments/ten_subjects.py`). Any other is a file in the same format. Axes are REP-103 (x
forward, y left, z up), units SI, angles in radians, joint moments in Nm/kg, forces in body weights.
"""

from collections.abc import Mapping
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, Field, ValidationError, field_validator, model_validator

from gaitval._internal.io.artefacts import write_text
from gaitval._internal.text.display import Displayed
from gaitval.coordinates import Side
from gaitval.errors import ConfigurationError, SubjectError
from gaitval.gait.plate_correction import PlateCorrection, corrected
from gaitval.gait.record import FiniteNumber, GaitRecord, LowPass, Origin, StoredPart
from gaitval.model.devices.device import Device, devices_of
from gaitval.subjects.identity import Aid, line_of_text, same_name
from gaitval.subjects.plausible import implausible
from gaitval.subjects.stored_gait import Gait, StanceFraction, keys_problems
from gaitval.subjects.subject_toml import toml_of

if TYPE_CHECKING:
    import pandas as pd


MARKERS: Final = tuple(
    f"{side}.{name}"
    for side in "RL"
    for name in (
        "ASIS", "PSIS", "Iliac.Crest", "GTR", "Knee", "Knee.Medial", "HF", "TT",
        "Ankle", "Ankle.Medial", "Heel", "MT1", "MT2", "MT5",
    )
)  # fmt: skip
"""The 28 markers of a standing trial: anterior and posterior superior iliac spines, iliac crest,
greater trochanter, knee epicondyles, fibula head, tibial tuberosity, malleoli, heel and
metatarsal heads."""

TAPE: Final = ("hip_height", "thigh", "shank", "ankle_height", "foot", "pelvis_width")
"""Lengths taken with a tape measure; `scaling.tape` defines them."""


def _known(values: dict[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    if problems := keys_problems(values, names):
        raise ValueError(" ".join(problems))
    return values


Position = tuple[FiniteNumber, FiniteNumber, FiniteNumber]


class RecordedLowPass(StoredPart):
    """Low-pass filters of the recorded moments and forces; see `LowPass`."""

    moments_hz: Annotated[FiniteNumber, Field(gt=0)]
    forces_hz: Annotated[FiniteNumber, Field(gt=0)]


class Trial(StoredPart):
    """A further trial of a person; the fields are those of `Subject`."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    """Of the trial in its source: "T03"."""
    walking_speed_m_s: FiniteNumber
    stride_time_s: FiniteNumber
    left_phase: FiniteNumber
    left_phase_from_force: Annotated[FiniteNumber, Field(ge=0, lt=1)] | None = None
    mean_vertical_force: FiniteNumber | None = None
    stance_fraction: StanceFraction
    low_pass: RecordedLowPass | None = None
    plates: PlateCorrection | None = None
    """If not given, the plates are as far out of place as in the subject's first trial, and the
    scale makes this trial's mean vertical force one body weight."""
    gait: Gait


class Printed(StoredPart):
    """What the paper's table prints for this subject, errors included; not used to compute."""

    sex: Literal["F", "M"]
    age_years: FiniteNumber
    mass_kg: FiniteNumber
    height_m: FiniteNumber
    walking_speed_m_s: FiniteNumber


class Subject(Displayed, StoredPart):
    """A person and their recorded gait.

    Raises
    ------
    pydantic.ValidationError
        On construction, when a value is missing, of the wrong type or implausible.
        `make_subject` and `load_subject` turn it into a `SubjectError`.
    """

    identifier: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    """Name of the subject, also of its run folder: "S05"."""
    person: Annotated[str, Field(min_length=1)]
    """Who it is in the laboratory: "WBDS14". Laboratory and person together say who is whom."""
    trial: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    """Name of the trial that the subject's own values are of: "T05"."""
    laboratory: Annotated[str, Field(min_length=1)]
    """Who recorded, or the dataset: "WBDS"."""
    guessed: str | None = None
    """What of person and laboratory nobody gave, and where it was taken from; None if all was."""
    source: str
    """Where the record is from, for readers: "WBDS14 T05"."""
    citation: str
    licence: str
    sex: Literal["F", "M"]
    """Chooses the segment tables (de Leva 1996)."""
    age_years: FiniteNumber | None = None
    """Below 16, the segments have a child's masses (Jensen 1986)."""
    prosthesis: Literal["none", "right", "left"] | None = None
    """Side of a leg prosthesis; not there if nobody said. Each leg of the body then keeps its own
    lengths, and masses if `measurements` has them; what else a prosthesis is, `devices` say."""
    devices: tuple[Device, ...] = ()
    """What is worn; walked with after the rest."""
    aid: Aid | None = None
    """What carries a part of the body beside the feet; it is not measured, so mean force is below
    one body weight, and moments of the legs are those of what the feet carry."""
    slope_percent: Annotated[FiniteNumber, Field(gt=-50, lt=50)] | None = None
    """Of the ground that was walked on, uphill positive, where it was not level; the record is in
    the ground's axes."""
    mass_kg: FiniteNumber
    height_m: FiniteNumber
    leg_length_m: FiniteNumber
    walking_speed_m_s: FiniteNumber
    """Mean forward speed; on a treadmill the belt's."""
    stride_time_s: FiniteNumber
    left_phase: FiniteNumber
    """Phase of the right cycle at left heel strike, from the pelvis curves of the two sides."""
    left_phase_from_force: Annotated[FiniteNumber, Field(ge=0, lt=1)] | None = None
    """A second estimate, from the vertical forces; not used to compute."""
    mean_vertical_force: FiniteNumber | None = None
    """Mean over the cycle of right + left vertical force, body weights; None if not both were
    recorded. The true value is 1; the difference comes from the source's calibration or filter."""
    stance_fraction: StanceFraction
    low_pass: RecordedLowPass | None = None
    """Known for an import; None if the source does not state it."""
    plates: PlateCorrection | None = None
    """What is wrong with the force plates, which `record` corrects; None if nothing clearly is."""
    paper: Printed | None = None
    gait: Gait
    markers: Annotated[dict[str, Position], AfterValidator(partial(_known, names=MARKERS))] = Field(
        default_factory=dict
    )
    """Standing marker positions, m, REP-103 axes. May be empty: scaling then uses `tape`."""
    tape: Annotated[dict[str, FiniteNumber], AfterValidator(partial(_known, names=TAPE))] = Field(
        default_factory=dict
    )
    """Lengths by tape measure, m (`TAPE`), for scaling without markers; the others follow from
    stature."""
    trials: tuple[Trial, ...] = ()
    """Further trials of the same person, at other speeds."""
    measurements: dict[str, FiniteNumber | Position | dict[str, str]] = Field(default_factory=dict)
    """Lengths of the body as `scaling.measurements.Measurements.to_dict` gives them, m; they take
    precedence over the markers. Empty if scaling finds them from the markers."""
    uncertainty: dict[str, Annotated[FiniteNumber, Field(ge=0)]] = Field(default_factory=dict)
    """Half the width of the 90 % band of a mean curve of the own trial, median over the cycle (rad,
    Nm/kg, body weights), by its name in `curves.csv`, and of "length_thigh_right" and others (m).
    """

    @field_validator("person", "laboratory", "guessed", "source", "citation", "licence")
    @classmethod
    def _one_line(cls, text: str | None) -> str | None:
        return None if text is None else line_of_text(text)

    @model_validator(mode="after")
    def _plausible(self) -> Self:
        problems = implausible(self.model_dump(exclude={"trials"}))
        names = [self.trial, *(trial.name for trial in self.trials)]
        problems += [
            f"trials: {name} is there {names.count(name)} times, the trial of the subject itself "
            "included. Give each its own name."
            for name in dict.fromkeys(names)
            if names.count(name) > 1
        ]
        for one, other in combinations((self.as_trial(), *self.trials), 2):
            if one.gait.has_curves_of(other.gait):
                problems.append(
                    f"trials: {other.name} has the same curves as {one.name}. A copy would be "
                    "known where its trial is held out; leave it out."
                )
        for trial in self.trials:
            values = self.on_trial(trial.name).model_dump(exclude={"trials", "markers"})
            problems += [f"trial {trial.name}: {problem}" for problem in implausible(values)]
        if problems:
            raise ValueError("\n".join(problems))
        return self

    @property
    def described(self) -> str:
        """The source, and which of its curves were not recorded."""
        message = "".join(
            f"; the {side} {'angles' if what == 'angles' else 'moments and forces'} were not "
            f"recorded{then}"
            for which, then in (
                (self.gait.mirrored, " and are the other side's, mirrored"),
                (self.gait.not_recorded, ""),
            )
            for what, side in which.items()
        )
        return self.source + message

    def origin(self, side: Side, kind: Literal["angles", "kinetics", "stance"]) -> Origin:
        """Where a side's angles, its moments and forces, or its stance fraction come from.

        Only what was "recorded" may be judged. "mirrored" is the other side's, because the user
        asked for it; "expected" is not in the subject at all, and `record` has the other side's,
        mirrored, or other people's, for the walker to be asked something.
        """
        if kind == "stance":
            # files written before `mirrored` was there have the other side's with its curves
            if side in (self.stance_fraction.mirrored, *self.gait.mirrored.values()):
                return "mirrored"
            return "expected" if self.stance_fraction.of(side) is None else "recorded"
        if self.gait.mirrored.get(kind) == side:
            return "mirrored"
        lacking = kind == "kinetics" and not self.has_kinetics
        return "expected" if lacking or self.gait.not_recorded.get(kind) == side else "recorded"

    def by_stature(self) -> "Subject":
        """The subject without measurements of the body but mass and stature."""
        return self.model_copy(update={"markers": {}, "measurements": {}, "tape": {}})

    def on_trial(self, name: str) -> "Subject":
        """The same person with the values of another trial; the others stay as `trials`. Raises
        SubjectError if there is no trial of this `name`.
        """
        if name == self.trial:
            return self
        chosen = next((trial for trial in self.trials if trial.name == name), None)
        if chosen is None:
            raise SubjectError(
                f"{self.identifier}: no trial {name!r}. It has "
                f"{', '.join([self.trial, *(trial.name for trial in self.trials)])}."
            )
        plates = chosen.plates
        if plates is None and self.plates is not None and chosen.mean_vertical_force:
            scale = 1.0 / chosen.mean_vertical_force
            plates = self.plates.model_copy(update={"scale": scale})
        rest = [trial for trial in self.trials if trial is not chosen]
        taken = {field: getattr(chosen, field) for field in Trial.model_fields if field != "name"}
        taken |= {"plates": plates}
        about = {"trial": name, "source": f"{self.person} {name}", "uncertainty": {}}
        return self.model_copy(update=taken | about | {"trials": (self.as_trial(), *rest)})

    def is_person_of(self, other: "Subject") -> bool:
        """Whether both are of the same person: the same laboratory, and the same person in it."""
        return same_name(self.laboratory, other.laboratory) and same_name(self.person, other.person)

    def with_trial(self, other: "Subject") -> "Subject":
        """The person with the own trial of another file (`other`) added to `trials`. Raises
        SubjectError if it is another person's, or a trial that is there already.
        """
        return self.model_copy(update={"trials": (*self.trials, self._named_trial(other))})

    def _named_trial(self, other: "Subject") -> Trial:
        """The own trial of `other` under a name that is not there yet; raises as `with_trial`."""
        differences = [
            f"{name} {here:g} and {there:g}"
            for name, here, there, slack in (
                ("mass_kg", self.mass_kg, other.mass_kg, 0.1 * self.mass_kg),
                ("height_m", self.height_m, other.height_m, 0.03),
                ("leg_length_m", self.leg_length_m, other.leg_length_m, 0.03),
            )
            if abs(here - there) > slack
        ]
        if self.sex != other.sex:
            differences.append(f"sex {self.sex} and {other.sex}")
        if not (self.is_person_of(other) or self.guessed or other.guessed):
            named = (f"{each.person} of {each.laboratory}" for each in (self, other))
            differences.append(" and ".join(named))
        if differences:
            raise SubjectError(
                f"{other.identifier} ({other.source}): a trial of another person than "
                f"{self.identifier} ({self.source}): {', '.join(differences)}. Give a trial of the "
                "same person."
            )
        trial = other.as_trial()
        for known in (self.as_trial(), *self.trials):
            if known.gait.has_curves_of(trial.gait):
                raise SubjectError(
                    f"{other.identifier} ({other.source}): the same curves as trial {known.name} "
                    f"of {self.identifier}. A trial cannot be both used and held out; give another."
                )
        names = {self.trial, *(known.name for known in self.trials)}
        name = trial.name
        for number in range(2, 2 + len(names)):
            name = name if name not in names else f"{trial.name}-{number}"
        return trial.model_copy(update={"name": name})

    def as_trial(self) -> Trial:
        """The subject's own trial, to be kept beside another."""
        own = {field: getattr(self, field) for field in Trial.model_fields if field != "name"}
        return Trial.model_construct(name=self.trial, **own)

    def record(self) -> GaitRecord:
        """The recorded gait as periodic curves, without the faults of the force plates."""
        measured = self.measured()
        return measured if self.plates is None else corrected(measured, self.plates)

    @property
    def has_kinetics(self) -> bool:
        """Whether moments and ground reaction were recorded."""
        return self.gait.forces is not None

    def measured(self) -> GaitRecord:
        """The recorded gait as it was measured; a side that was not is the other one's mirror image
        (`origin` says which). Raises SubjectError if no moments and forces were recorded.
        """
        if self.gait.forces is None:
            raise SubjectError(
                f"{self.identifier}: no moments and forces were recorded, which this needs. Give a "
                "recording with force plates; what needs none is `gaitval subject`, predict "
                "and export."
            )
        stance = self.stance_fraction.of_both()
        return GaitRecord(
            speed=self.walking_speed_m_s,
            stride_time=self.stride_time_s,
            left_phase=self.left_phase,
            stance_fraction=stance,
            angles=self.gait.angles_of_both(),
            moments=self.gait.moments_of_both(),
            forces=self.gait.forces_of_both(stance),
            low_pass=None
            if self.low_pass is None
            else LowPass(self.low_pass.moments_hz, self.low_pass.forces_hz),
            steps=self.gait.steps,
        )

    def to_toml(self) -> str:
        """The subject as TOML; numbers have six significant digits, each curve is one line."""
        return toml_of(self)

    def save(self, path: str | Path) -> None:
        """Write the TOML file, whole or not at all; `load_subject` reads it."""
        write_text(Path(path), self.to_toml())

    def title(self) -> str:
        """Name, person and trial, and what was said of a prosthesis or an aid."""
        message = "" if self.prosthesis is None else f", prosthesis: {self.prosthesis}"
        message += "" if self.aid is None else f", aid: {self.aid}"
        return f"Subject {self.identifier} ({self.source}){message}"

    def overview(self) -> "pd.DataFrame":
        """Build and gait, in SI units."""
        from gaitval._internal.text.frames import value_frame
        from gaitval.coordinates import SIDES

        stance = {
            side: self.stance_fraction.of(side)
            if self.origin(side, "stance") == "recorded"
            else None
            for side in SIDES
        }
        return value_frame(
            [
                ("", "mass", self.mass_kg, "kg"),
                ("", "height", self.height_m, "m"),
                ("", "leg length", self.leg_length_m, "m"),
                ("", "walking speed", self.walking_speed_m_s, "m/s"),
                ("", "stride time", self.stride_time_s, "s"),
                *((side, "stance fraction", value, "1") for side, value in stance.items()),
            ]
        ).drop(columns="percent")

    def to_frame(self) -> "pd.DataFrame":
        """The recorded joint angles (deg), joint moments (Nm/kg) and ground reaction (% of body
        weight) at 0, 1, … 100 % of each side's gait cycle. An angle has its coordinate's name
        (`knee_angle`), the moment about it "moment" after that (`knee_angle moment`). A side that
        was not recorded (`origin`) has no rows.
        """
        from dataclasses import replace

        from gaitval._internal.text.frames import curve_frame
        from gaitval.arrays import Array
        from gaitval.coordinates import SIDES
        from gaitval.gait.cycle_curves import recorded_curves

        curves = recorded_curves(self.record())

        def recorded(
            values: dict[str, Array], kind: Literal["angles", "kinetics"]
        ) -> dict[str, Array]:
            origin = {side[0]: self.origin(side, kind) for side in SIDES}
            return {n: v for n, v in values.items() if origin[n[-1]] == "recorded"}

        return curve_frame(
            replace(
                curves,
                angles=recorded(curves.angles, "angles"),
                moments=recorded(curves.moments, "kinetics"),
                forces=recorded(curves.forces, "kinetics"),
            ).named()
        )


def make_subject(values: Mapping[str, Any], where: str) -> Subject:
    """A subject from `values`, the tables and keys of a subject file; `where` names the file or
    trial in messages. Raises SubjectError, which lists every missing, unknown, malformed or
    implausible value.
    """
    try:
        return Subject.model_validate(_with_devices(values, where))
    except ValidationError as error:
        from gaitval._internal.text.refused_values import in_subject

        problems = in_subject(Subject, [item for item in error.errors() if item["loc"]])
        # `_plausible` runs only if all else is well; what it found has no location.
        whole = [item["ctx"]["error"] for item in error.errors() if not item["loc"]]
    problems += str(whole[0]).split("\n") if whole else implausible(values)
    raise SubjectError(
        f"{where}: {len(problems)} problem{'s' if len(problems) > 1 else ''}\n"
        + "\n".join(f"  - {problem}" for problem in problems)
    )


def _with_devices(values: Mapping[str, Any], where: str) -> Mapping[str, Any]:
    """`values` with whole devices in the place of the tables, some short, of a file."""
    if not values.get("devices"):
        return values
    try:
        return {**values, "devices": devices_of({"devices": values["devices"]}, where)}
    except ConfigurationError as error:
        raise SubjectError(str(error)) from None
