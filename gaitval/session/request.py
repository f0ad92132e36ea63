"""What an import is given: one declaration for the command, session files, cohorts and Python.

A field of `ImportOptions` is an option of `gaitval import` (`mass`, `--mass`), a key of a session
file and a keyword of `import_session`. The text below it is the help of the option. One that is
marked `SESSION_FILE` is seldom needed, and no option of the command.

The command reads this at every start, so nothing that takes long to load is imported here.
"""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, NamedTuple, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, field_validator

from gaitval._internal.text.any_case import as_known, literals_of
from gaitval.errors import ConfigurationError
from gaitval.subjects.identity import Aid, Identity, identity, trial_name, wbds_trial

if TYPE_CHECKING:
    from gaitval.scaling.landmarks import Widths

Notify = Callable[[str, str], None]


JointCentres = Literal[
    "harrington", "bell", "hara", "davis", "rajagopal2016", "gait2392", "functional", "given"
]
"""Where the joint centres of the standing trial come from: hips from a regression of
`gaitval.scaling.hip_regressions` or a range-of-motion trial, or all as given."""
PlateUse = Literal["right", "left", "none"]
"""What a force plate is to be taken for; see `ImportOptions.plate`."""
Halves = Literal["odd-even", "first-last"]
"""How gait cycles are shared out to two trials."""


class OptionDisplay(NamedTuple):
    """How the command line shows an option, where that does not follow from the field."""

    metavar: str | None = None
    flag: str | None = None
    in_command: bool = True


SESSION_FILE: Final = OptionDisplay(in_command=False)
"""Of a field that session files and Python have, and the command has not."""


def _files(given: object) -> object:
    """One file may be given as such."""
    return (given,) if isinstance(given, str | Path) else given


def _pairs(given: object) -> object:
    """Pairs of names, also as text, "2=right"; the second in capitals or not."""
    listed = (given,) if isinstance(given, str) else given
    return tuple(map(_pair, listed)) if isinstance(listed, list | tuple) else given


def _pair(given: object) -> object:
    parts = given.split("=", 1) if isinstance(given, str) else given
    match parts:
        case [name, str(other)]:
            return name, other.lower()
        case [*others]:
            return tuple(others)
    return given


def _width(given: object) -> object:
    """A width of both sides, or of right and left, also as text: "0.1", "0.1,0.102"."""
    if given is None:
        return None
    parts = given.split(",") if isinstance(given, str) else given
    listed: Any = parts if isinstance(parts, list | tuple) else [parts]
    try:
        numbers = [float(part) for part in listed]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) not in (1, 2):
        raise ValueError("not a width. Give metres, of both sides (0.1) or right,left (0.1,0.102).")
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


def _window(given: object) -> object:
    """Two times, also as text: "0.5:2"."""
    if given is None:
        return None
    parts: Any = given.split(":") if isinstance(given, str) else given
    try:
        begin, end = map(float, parts)
    except (TypeError, ValueError):
        begin, end = math.nan, math.nan
    if not (math.isfinite(begin) and math.isfinite(end) and begin < end):
        raise ValueError("two times in s are needed, the second later, such as 0.5:2.")
    return begin, end


def _windows(given: object) -> object:
    """Windows of several trials; one may be given as such."""
    listed: Any = given
    one = isinstance(given, str) or (len(listed) == 2 and isinstance(listed[0], int | float))
    return tuple(_window(each) for each in ((given,) if one else listed))


def part_text(window: tuple[float, float] | None) -> str:
    """The part `window` of a trial, s, for people and as `--trial-time` takes it."""
    return "" if window is None else "{:g}:{:g} s".format(*window)


Files = Annotated[tuple[Path, ...], BeforeValidator(_files), OptionDisplay("FILE")]
JointWidth = Annotated[
    float | tuple[float, float] | None, BeforeValidator(_width), OptionDisplay("M|M,M")
]


class ImportOptions(BaseModel):
    """What an import is given; lengths in m, times in s, mass in kg."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", use_attribute_docstrings=True, allow_inf_nan=False
    )

    @field_validator("*", mode="before")
    @classmethod
    def _in_any_case(cls, value: object, info: Any) -> object:
        return as_known(value, literals_of(cls.model_fields[info.field_name].annotation))

    trials: Annotated[Files, Field(min_length=1), OptionDisplay("FILE", "--trial")]
    """Walking trials: C3D, TRC, Vicon CSV, Qualisys TSV, WBDS mkr.txt; their cycles are pooled."""
    sex: Annotated[str, OptionDisplay("F|M")]
    """Selects the segment tables."""
    static: Annotated[Path | None, OptionDisplay("FILE")] = None
    """Standing trial, as a file of a walking one. Left out, a standing pose is put together from
    the walk."""
    mass: float | None = None
    """Body mass, kg; left out if the C3D file knows it."""
    height: float | None = None
    """Stature, m; left out if the C3D file knows it."""
    forces: Files = ()
    """Ground reaction (MOT, STO, .forces, Kistler text, WBDS grf.txt) of a trial that has none in
    its own file; one for each walking trial."""
    trial_time: Annotated[
        tuple[tuple[float, float], ...], BeforeValidator(_windows), OptionDisplay("BEGIN:END")
    ] = ()
    """Part of a walking trial that counts, s: once for all trials, or once for each, in their
    order. A file of which several parts count is given as often."""
    belt: Annotated[float | None, Field(ge=0.0, le=5.0), OptionDisplay("M/S")] = None
    """Speed of the treadmill's belt in all trials, m/s; as the flat feet move if left out."""
    marker_set: str | None = None
    """Name of a built-in set (an unknown name lists them) or a TOML file; found by marker names if
    left out."""
    knee_width: JointWidth = None
    """Knee width, m, of both sides or right,left; without medial markers."""
    ankle_width: JointWidth = None
    """Ankle width, m, of both sides or right,left; without medial markers."""
    joint_centres: JointCentres = "harrington"
    """Where hips are: by the regression of Harrington (2007), Bell (1989), Hara (2016) or Davis
    (1991, as in Plug-in Gait), as in OpenSim's generic models (rajagopal2016, gait2392), or
    functional, of range-of-motion trials where the error is small; the page shows the hip moments
    by each. Or given: hips, knees and ankles by --scaled-model or points in the files (Plug-in
    Gait's RFEP, RFEO, RTIO; RHJC, RKJC, RAJC)."""
    scaled_model: Annotated[Path | None, OptionDisplay("FILE")] = None
    """The person's scaled OpenSim model (.osim): how far its joint centres are from ours, and what
    that makes of the moments, is on the page."""
    age: float | None = None
    """Years; below 16 a child's segment masses are taken. Left out if the C3D file knows it."""
    consistent: bool = False
    """Make the smallest change of motion and masses that lowers the residuals."""
    kinematics_only: bool = False
    """Use no forces. The subject walks with predicted moments and forces."""
    plate: Annotated[
        tuple[tuple[str, PlateUse], ...],
        BeforeValidator(_pairs),
        OptionDisplay("N=right|left|none"),
    ] = ()
    """What a force plate is, by its number or name in the file: whose foot is on it (found if left
    out); none, which is left out."""
    correct: Annotated[tuple[str, ...], BeforeValidator(_files), OptionDisplay("FAULT")] = ()
    """Take away a fault that the session is found to have: delay, place, rotation, gain, cross-talk
    (of plates), or several with commas. Both results are shown."""
    person: Annotated[str | None, Field(min_length=1), SESSION_FILE] = None
    """Who it is: the same name in every session of this person. Left out, the name in the C3D file
    or the subject's is assumed."""
    laboratory: Annotated[str | None, Field(min_length=1), SESSION_FILE] = None
    """Who recorded. Subjects with person and laboratory in common count as one person."""
    citation: Annotated[str, SESSION_FILE] = "Own recording, not published"
    """Where the recording is published."""
    licence: Annotated[str, SESSION_FILE] = "not stated"
    """Its licence."""
    static_time: Annotated[tuple[float, float] | None, BeforeValidator(_window), SESSION_FILE] = (
        None
    )
    """Part of the standing trial that counts, s."""
    floor: Annotated[float | None, Field(ge=-5.0, le=5.0), SESSION_FILE] = None
    """Height of what the person stands on in the standing trial, m above the origin; by the corners
    of the plates if left out, else 0."""
    feet_not_flat: Annotated[bool, SESSION_FILE] = False
    """The person stands on toes or heels: put the feet flat for scaling."""
    incline: Annotated[float | None, Field(gt=-50.0, lt=50.0), SESSION_FILE] = None
    """Slope of the belt or floor, %, uphill positive, of a file whose axes are the belt's; as the
    mean force leans if left out."""
    functional: Annotated[Files, SESSION_FILE] = ()
    """Range-of-motion trials of the same session: functional hip centres and knee axes are compared
    with those of the standing trial."""
    aid: Annotated[Aid | None, SESSION_FILE] = None
    """What carries a part of the body: crutches (or canes, or a walker), rail, support (of body
    weight). It is not measured: the plates may carry less than the body weighs."""
    prosthesis: Annotated[Literal["none", "right", "left"] | None, SESSION_FILE] = None
    """Side of a leg prosthesis: each leg keeps its own lengths, and the report says so. Its masses
    and joints are those of a device (`gaitval device`)."""
    halves: Annotated[Halves | None, SESSION_FILE] = None
    """Make two trials of the gait cycles. The walk knows the first and is compared with the second,
    too."""


FILES: Final = tuple(
    name
    for name, field in ImportOptions.model_fields.items()
    if field.annotation == tuple[Path, ...]
)
"""Options that are lists of files."""


class Request(ImportOptions):
    """The options of an import, with what its files say of the person."""

    static: Path
    """File of the standing trial; the first of `trials` if there is none."""
    mass: float
    height: float
    sex: Literal["F", "M"]
    identifier: str
    """Name of the subject."""
    elbow_width: float | tuple[float, float] | None = None
    """Elbow width in the files, m, of both sides or right and left."""
    recorded_name: tuple[str, str] = ("", "")
    """The person's name in a recording, and the name of that file."""

    def without_trial(self, number: int) -> "Request":
        """The same without one of its walking trials, and without its forces."""
        lists: dict[str, tuple[Any, ...]] = {
            "trials": self.trials, "forces": self.forces, "trial_time": self.trial_time
        }  # fmt: skip
        kept = {
            name: given if len(given) < len(self.trials) else given[:number] + given[number + 1 :]
            for name, given in lists.items()
        }
        static = kept["trials"][0] if self.stands_in_walk else self.static
        return self.model_copy(update=kept | {"static": static})

    def time_of(self, number: int) -> tuple[float, float] | None:
        """The part of a walking trial, by its number, that counts; None if all of it does."""
        return self.trial_time[min(number, len(self.trial_time) - 1)] if self.trial_time else None

    @property
    def mass_kg(self) -> float:
        """The mass, as scaling and subjects call it."""
        return self.mass

    @property
    def height_m(self) -> float:
        """The stature, as scaling and subjects call it."""
        return self.height

    @property
    def age_years(self) -> float | None:
        """The age, likewise."""
        return self.age

    @property
    def stands_in_walk(self) -> bool:
        """Whether there is no standing trial, and the pose is put together from the walk."""
        return self.static == self.trials[0]

    @property
    def widths(self) -> "Widths":
        """Keyword arguments of scaling."""
        return {
            "knee_width": self.knee_width,
            "ankle_width": self.ankle_width,
            "elbow_width": self.elbow_width,
            "hip_regression": self.hip_regression,
        }

    @property
    def hip_regression(self) -> str:
        """The regression by which hip centres are found where no trial shows them."""
        return "harrington" if self.joint_centres in ("functional", "given") else self.joint_centres

    @property
    def who(self) -> Identity:
        """Who was recorded."""
        return identity(
            self.person,
            self.laboratory,
            sources=[path.name for path in self.trials],
            name=self.identifier,
            recorded=self.recorded_name,
        )

    def called(self, number: int) -> str:
        """The name of a walking trial's file, with its folder if another one's is the same, and
        with the part that counts if the file is given for several.
        """
        trial = self.trials[number]
        alike = sum(each.name == trial.name for each in set(self.trials))
        name = trial.name if alike < 2 else f"{trial.parent.name}/{trial.name}"
        return name if self.trials.count(trial) < 2 else f"{name} {part_text(self.time_of(number))}"

    @property
    def trial(self) -> str:
        """Name of the subject's trial: that of its file, or the first of several."""
        stem = self.trials[0].stem
        name = wbds_trial(stem) or trial_name(stem)
        more = len(self.trials) - 1
        return f"{name}-and-{more}-more" if more else name


Model = TypeVar("Model", bound=BaseModel)


def checked(
    model: type[Model], values: Mapping[str, Any], *, shown: Callable[[str], str] = str
) -> Model:
    """Options of the class `model` from the `values` that were given for them; None is a value that
    was not given.

    `shown` says from an option's name what the user calls it. Raises ConfigurationError if an
    option is unknown or missing, or its value is of the wrong kind.
    """
    try:
        return model.model_validate({k: each for k, each in values.items() if each is not None})
    except ValidationError as error:
        from gaitval._internal.text.refused_values import in_options

        problems = [in_options(model, problem, shown) for problem in error.errors()]
    raise ConfigurationError(" ".join(dict.fromkeys(problems)))


def silent(step: str, message: str) -> None:
    """Report nothing of a `step` and its `message`."""
