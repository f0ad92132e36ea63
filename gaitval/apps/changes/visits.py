"""A session of a person, read from an import, or from a study: its record, or its walk."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from gaitval._internal.io.artefacts import file_hash, read_arrays
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ArtefactError
from gaitval.metrics.curve_results import KINDS
from gaitval.metrics.results import read_metrics
from gaitval.metrics.typed import array
from gaitval.reporting.run_grids import strides_in
from gaitval.session.importing.files import CYCLES, FOLDER, RECORD
from gaitval.session.importing.stored import Session
from gaitval.study.inputs import METRICS
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import load_subject

VisitSource = Literal["import", "record", "walk"]
DEGREES: Final = float(np.degrees(1.0))
OF_KIND: Final = {"angles": "angle", "moments": "moment", "forces": "force"}
"""The word of a kind of curves in the tables of an import."""
UNITS: Final = {"angles": "deg", "moments": "Nm/kg", "forces": "% BW"}
_FACTORS: Final = {"angles": DEGREES, "moments": 1.0, "forces": 100.0}
_FORCES: Final = {"forward": "forward", "medial": "left", "vertical": "up"}
PARAMETERS: Final = {
    "walking_speed": "m/s",
    "cadence": "steps/min",
    "stride_time": "s",
    "stride_length": "m",
    "step_length": "m",
    "step_width": "m",
    "stance_fraction": "1",
    "double_support_fraction": "1",
}


@dataclass(frozen=True)
class VisitFigure:
    """A parameter: mean, and standard deviation over `count` cycles, where they are known."""

    mean: float
    sd: float | None = None
    count: int = 0


@dataclass(frozen=True)
class Visit:
    """A session of one person.

    Attributes
    ----------
    folder, source : where it was read, and what of it.
    identifier : of the subject; `person` who it is, where somebody said so; empty if not.
    sex, mass_kg, height_m, leg_length_m, age_years : of the person then.
    speed : walking speed, m/s.
    curves : (101,) means in deg, Nm/kg, % of body weight by "angles/knee_angle_r".
    cycles : (n, 101) likewise, where they are stored.
    half : half of the width of the band of 90 %, (101,).
    again : the same of what another session of the person would have otherwise.
    at_once : standard deviations of `again` for all curves at once; None if not known.
    parameters : by name and side, "stride_time_r"; without side where both share it.
    static : hash of the standing trial, which says who put the markers on when; empty if not known.
    processing : settings of the filters, and which hip centres; what makes curves another
        convention. None if not known.
    marker_set : empty if not known.
    files : that were read, with their hashes.
    """

    folder: Path
    source: VisitSource
    identifier: str
    person: str
    sex: str
    mass_kg: float
    height_m: float
    leg_length_m: float
    age_years: float | None
    speed: float
    curves: Mapping[str, Array]
    cycles: Mapping[str, Array] = field(default_factory=dict)
    half: Mapping[str, Array] = field(default_factory=dict)
    again: Mapping[str, Array] = field(default_factory=dict)
    at_once: float | None = None
    parameters: Mapping[str, VisitFigure] = field(default_factory=dict)
    static: str = ""
    processing: Mapping[str, Any] | None = None
    marker_set: str = ""
    files: Mapping[str, str] = field(default_factory=dict)

    def counts(self) -> dict[Side, int]:
        """Gait cycles that are kept one by one, the most of any curve of a side."""
        return {
            side: max(
                (len(each) for name, each in self.cycles.items() if name.endswith(f"_{side[0]}")),
                default=0,
            )
            for side in SIDES
        }

    def words(self) -> str:
        """What it is, for a sentence."""
        what = {"import": "import", "record": "record of the study", "walk": "walk of the study"}
        return f"{what[self.source]} {self.folder}"


def read_visit(path: str | Path, *, walk: bool = False) -> Visit:
    """The session in the folder of an import or of a finished study, whose record it is, or with
    `walk` its walk. Raises ArtefactError where there is neither, or no walk.
    """
    folder = Path(path)
    if (folder / FOLDER / RECORD).is_file() and not (folder / METRICS).is_file():
        if walk:
            raise ArtefactError(
                f"{folder}: an import, in which nobody walks by simulation, so --walks has nothing "
                "to compare. Leave --walks out, or give the folder of a study (`gaitval subject`)."
            )
        return _of_import(folder)
    if (folder / METRICS).is_file():
        return _of_study(folder, walk=walk)
    raise ArtefactError(
        f"{folder}: neither {FOLDER}/{RECORD} of an import nor {METRICS} of a study is in it, so "
        "there is no session to compare. Give the folder that `gaitval import --out` or `gaitval "
        "subject` wrote."
    )


def _of_import(folder: Path) -> Visit:
    session = Session.load(folder)
    record, subject = session.record, session.subject
    curves, half, again = {}, {}, {}
    for kind, word in OF_KIND.items():
        for name, column in _columns(session, kind, word):
            # medial is to the left of the right foot, and to the right of the left one
            sign = -1.0 if name == "forces/medial_l" else 1.0
            factor = _FACTORS[kind]
            curves[name] = sign * factor * np.asarray(session.curves[f"{column}_mean"], dtype=float)
            band = record["bands"].get(column)
            if band is not None:
                half[name] = factor * array(band["half"])
                if "again" in band:
                    again[name] = factor * array(band["again"])
    files = {f"{FOLDER}/{name}": folder / FOLDER / name for name in (RECORD, "curves.csv", CYCLES)}
    return Visit(
        folder=folder,
        source="import",
        identifier=record["person"]["identifier"],
        person=_person(subject),
        sex=record["person"]["sex"],
        mass_kg=record["person"]["mass_kg"],
        height_m=record["person"]["height_m"],
        leg_length_m=record["measurements"]["hip_height"],
        age_years=None if subject is None else subject.age_years,
        speed=float(record["walking_speed_m_s"] or np.nan),
        curves=curves,
        cycles=_cycles(folder / FOLDER / CYCLES, list(curves)),
        half=half,
        again=again,
        at_once=record.get("bands_at_once"),
        parameters=_parameters(record),
        static=next((f["sha256"] for f in record["inputs"] if f["role"] == "static"), ""),
        processing=record["processing"] | other_centres(record),
        marker_set=record["marker_set"],
        files={name: file_hash(path) for name, path in files.items() if path.is_file()},
    )


def other_centres(record: Mapping[str, Any]) -> dict[str, str]:
    """Where joint centres come from that are not by landmarks and the usual regression, by joint.
    A scaled model has another name at each visit, so its name does not count.
    """
    found = {
        f"{each['side']} {each['joint']}": "of a range-of-motion trial"
        for each in record["functional"]
        if not each["refused"]
    }
    for each in record.get("given_centres", ()):  # older imports have none
        if each["used"]:
            model = each["source"].lower().endswith(".osim")
            whose = "of a scaled model" if model else f"of {each['source']}"
            found[f"{each['side']} {each['joint']}"] = whose
    hips = record["measurements"].get("sources", {}).get("hips")
    return found if hips is None or any("hip" in name for name in found) else {"hips": hips} | found


def _person(subject: Subject | None) -> str:
    """Who it is, where that was said and not made up of a folder's name."""
    return "" if subject is None or subject.guessed else subject.person


def _columns(session: Session, kind: str, word: str) -> list[tuple[str, str]]:
    """Name and column of each curve of a kind."""
    found = []
    for column in session.curves.columns:
        if column.startswith(f"{word}_") and column.endswith("_mean"):
            plain = column.removesuffix("_mean")
            name = plain.removeprefix(f"{word}_")
            if kind == "forces":
                of = {there: here for here, there in _FORCES.items()}
                name = f"{of[name[:-2]]}{name[-2:]}"
            found.append((f"{kind}/{name}", plain))
    return found


def _cycles(path: Path, names: Sequence[str]) -> dict[str, Array]:
    """Of each of the curves `names`, in the units of the page; none where an older import
    did not store them.
    """
    if not path.is_file():
        return {}
    stored = read_arrays(path, (), names)
    return {
        name: _FACTORS[name.partition("/")[0]] * np.asarray(values, dtype=float)
        for name, values in stored.items()
        if name.partition("/")[0] in _FACTORS and values.ndim == 2 and values.shape[1] == 101
    }


def _parameters(record: Mapping[str, Any]) -> dict[str, VisitFigure]:
    """Means over the trials; a deviation is the root mean square of theirs."""
    found: dict[str, VisitFigure] = {}
    for name in PARAMETERS:
        for side in SIDES:
            pairs = [
                each
                for trial in record["trials"]
                if (each := trial["gait"][side]["speed" if name == "walking_speed" else name])[0]
                is not None
            ]
            if not pairs:
                continue
            known = [sd for _, sd in pairs if sd is not None]
            spread = float(np.sqrt(np.mean(np.square(known)))) if known else None
            mean = float(np.mean([mean for mean, _ in pairs]))
            found[f"{name}_{side[0]}"] = VisitFigure(mean, spread)
    return found


def _of_study(folder: Path, *, walk: bool) -> Visit:
    metrics = read_metrics(folder / METRICS)
    if not (folder / "subject.toml").is_file():
        raise ArtefactError(
            f"{folder}: {METRICS} is there without subject.toml, so it is not known whose it is. "
            "Give the folder of the study itself."
        )
    subject = load_subject(folder / "subject.toml")
    curves: dict[str, Array] = {}
    cycles: Mapping[str, Array] = {}
    if walk:
        for kind in KINDS:
            for name, curve in metrics.walk.curves.of(kind).items():
                if curve.mean is not None:
                    curves[f"{kind}/{name}"] = array(curve.mean)
        cycles = strides_in(folder, metrics)
    else:
        for kind in KINDS:
            for name, values in metrics.record.curves.of(kind).items():
                curves[f"{kind}/{name}"] = array(values)
        for name, angle in subject.gait.angles_of_both().items():
            own = np.degrees(angle(np.linspace(0.0, 1.0, 101)))
            curves.setdefault(f"angles/{name}", own)
    if not curves:
        raise ArtefactError(
            f"{folder}: the study has no {'walk of whole cycles' if walk else 'record'}, so there "
            f"is nothing to compare. {'Leave --walks out' if walk else 'Give another study'}."
        )
    half = {} if walk else _stored_bands(subject, curves)
    spatiotemporal = {
        each.name: VisitFigure(value, each.sd if walk else None)
        for each in metrics.walk.spatiotemporal
        if (value := each.mean if walk else each.recorded) is not None
    }
    return Visit(
        folder=folder,
        source="walk" if walk else "record",
        identifier=subject.identifier,
        person=_person(subject),
        sex=subject.sex,
        mass_kg=subject.mass_kg,
        height_m=subject.height_m,
        leg_length_m=subject.leg_length_m,
        age_years=subject.age_years,
        speed=spatiotemporal["walking_speed"].mean
        if "walking_speed" in spatiotemporal
        else subject.walking_speed_m_s,
        curves=curves,
        cycles=cycles,
        half=half,
        again=half,
        parameters={_by_side(name): each for name, each in spatiotemporal.items()},
        files={METRICS: file_hash(folder / METRICS)},
    )


def _by_side(name: str) -> str:
    for side in SIDES:
        if name.endswith(f"_{side}"):
            return f"{name.removesuffix(side)}{side[0]}"
    return name


def _stored_bands(subject: Subject, curves: Mapping[str, Array]) -> dict[str, Array]:
    """Half of the median width of each band, which a subject of an import keeps."""
    found = {}
    for name in curves:
        kind, _, curve = name.partition("/")
        plain = f"{_FORCES[curve[:-2]]}{curve[-2:]}" if kind == "forces" else curve
        size = subject.uncertainty.get(f"{OF_KIND[kind]}_{plain}")
        if size is not None:
            found[name] = np.full(101, _FACTORS[kind] * size)
    return found


def common(first: Visit, second: Visit) -> Sequence[str]:
    """Curves that both have, and that are known all over the cycle."""
    return [
        name
        for name in first.curves
        if name in second.curves
        and np.isfinite(first.curves[name]).all()
        and np.isfinite(second.curves[name]).all()
    ]
