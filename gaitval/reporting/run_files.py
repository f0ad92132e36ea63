"""A run folder, read once for its report."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

from gaitval._internal.io.artefacts import file_hash, read_json
from gaitval._internal.io.build_info import minute_of
from gaitval.configuration import Configuration, RecordSettings, load_configuration
from gaitval.errors import ArtefactError
from gaitval.identification.body_report import Bar
from gaitval.metrics.identified_body import identified_model
from gaitval.metrics.results import METRICS, Metrics, StoredPushes, read_metrics
from gaitval.model.body import BodyModel
from gaitval.model.urdf import read_urdf
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.motion import ReferenceMotion
from gaitval.walk.simulation.rollout import Rollout

PROVENANCE: Final = "provenance.json"
BODY: Final = "body.json"

FILES: Final = (
    *("subject.toml", "configuration.toml", "model.urdf", "scaling.csv", "reference.npz"),
    *("policy/policy.json", "policy/policy.safetensors", "identification.json", "identified.npz"),
    *("correction.json", "rollouts/nominal.npz", "rollouts/identified.npz"),
    *("rollouts/second_engine.npz", "push.json", "metrics.json"),
)
"""What the numbers of a report come from, in the order in which it is made. `policy/training.csv`
and `provenance.json` hold times, so that equal runs differ in them; they are not listed."""


class StoredBody(NamedTuple):
    """What a study stored of the body: sentences, the method by which the walker's body was found,
    and a bar for each parameter.
    """

    said: str
    method: str
    bars: Sequence[Bar]


@dataclass(frozen=True)
class WalkFiles:
    """The walk that measures and limits refer to; None or empty where the folder has no such file.

    Attributes
    ----------
    model : the body as scaled.
    reference : the motion that the walker follows.
    pushed : the same walk, pushed.
    legs : by what an identification found them to differ (`metrics.identified_body`).
    """

    model: BodyModel | None
    reference: ReferenceMotion | None
    rollout: Rollout | None
    pushed: Sequence[Rollout]
    legs: Mapping[str, Any] | None

    @property
    def found(self) -> BodyModel | None:
        """The body with the legs that an identification found."""
        if self.model is None or self.legs is None:
            return self.model
        return identified_model(self.model, self.legs)


class StageFiles(NamedTuple):
    """What single stages wrote; None where the folder has no such file.

    Attributes
    ----------
    body : what was learned of the body, in sentences and bars.
    """

    pushes: StoredPushes | None
    body: StoredBody | None


class OriginFiles(NamedTuple):
    """What a report was made from.

    Attributes
    ----------
    provenance : without the report's own stage, so that a report written again is the same; None
        without the file.
    hashes : SHA-256 of each of `FILES`.
    """

    provenance: Mapping[str, Any] | None
    hashes: Mapping[str, str]

    @property
    def dates(self) -> tuple[str, str] | None:
        """When the first stage started and the last one ended; None where that was not stored."""
        return dates(self.provenance)


@dataclass(frozen=True)
class RunFiles:
    """What a report is made of.

    Attributes
    ----------
    subject : the person, on the trial or at the speed that the walk is of.
    configuration : of the run; by its `record` what it knew of the record, and on what ground.
    """

    subject: Subject
    configuration: Configuration
    metrics: Metrics
    walk: WalkFiles
    stages: StageFiles
    origin: OriginFiles


def read_run(folder: Path, settings: Sequence[str] = ()) -> RunFiles:
    """Everything of a run `folder` that its report shows; `settings` override its own. Raises
    ArtefactError if `metrics.json` is missing or a file is damaged, SubjectError if `subject.toml`
    cannot be used.
    """
    configuration = configuration_of(folder, settings)
    metrics = read_metrics(folder / METRICS)
    return RunFiles(
        _person(folder, configuration.record),
        configuration,
        metrics,
        read_walk(folder, metrics),
        StageFiles(
            _pushes(folder),
            read_body(folder) if "identification" in metrics.known["angles"] else None,
        ),
        OriginFiles(_provenance(folder), hashes(folder)),
    )


def _person(folder: Path, settings: RecordSettings) -> Subject:
    subject = load_subject(str(folder / "subject.toml"))
    if settings.holdout:
        return subject.on_trial(settings.holdout)
    speed = settings.speed or subject.walking_speed_m_s
    return subject.model_copy(update={"walking_speed_m_s": speed})


def configuration_of(folder: Path, settings: Sequence[str] = ()) -> Configuration:
    """The configuration of a run `folder`, overridden by `settings`."""
    path = folder / "configuration.toml"
    return load_configuration(path if path.exists() else None, settings=settings)


def read_walk(folder: Path, metrics: Metrics) -> WalkFiles:
    """The walk in a run `folder` that its `metrics` refer to."""
    urdf, identification = folder / "model.urdf", folder / "identification.json"
    reference, walk = folder / "reference.npz", folder / "rollouts" / f"{metrics.final}.npz"
    has_legs = identification.exists() and metrics.final == "identified"
    return WalkFiles(
        read_urdf(urdf) if urdf.exists() else None,
        ReferenceMotion.load(reference) if reference.exists() else None,
        Rollout.load(walk) if walk.exists() else None,
        [Rollout.load(each) for each in sorted(walk.parent.glob("pushed_*.npz"))],
        read_json(identification) if has_legs else None,
    )


def _pushes(folder: Path) -> StoredPushes | None:
    path = folder / "push.json"
    if not path.exists():
        return None
    fix = "delete it and run `gaitval stage push SUBJECT` again"
    return StoredPushes.read(read_json(path), str(path), file="push.json", fix=fix)


def read_body(folder: Path) -> StoredBody | None:
    """Of a run `folder`; None without the file. Raises ArtefactError if it is damaged."""
    path = folder / BODY
    if not path.is_file():
        return None
    try:
        stored = read_json(path, "Remove it and run `gaitval subject` again")
        return StoredBody(
            # the sentences of `body_words` have 300 characters
            str(stored["said"])[:1000],
            str(stored["method"])[:1000],
            [
                (str(each["name"])[:1000], float(each["mean"]), float(each["sd"]))
                for each in stored["bars"]
            ],
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ArtefactError(
            f"{path}: is not what a study writes ({error}). Remove it and run `gaitval subject` "
            "again."
        ) from error


def _provenance(folder: Path) -> dict[str, Any] | None:
    path = folder / PROVENANCE
    if not path.exists():
        return None
    found = read_json(path)
    if not isinstance(found, dict):
        raise ArtefactError(
            f"{path}: not a JSON object. Delete it and run `gaitval subject` again."
        )
    stages = found.get("stages")
    if isinstance(stages, dict):
        found["stages"] = {name: each for name, each in stages.items() if name != "report"}
    return found


def hashes(folder: Path) -> dict[str, str]:
    """SHA-256 of each of `FILES` that a run `folder` has, as `sha256sum FILE` prints it."""
    return {name: file_hash(folder / name) for name in FILES if (folder / name).is_file()}


def dates(provenance: Mapping[str, Any] | None) -> tuple[str, str] | None:
    """When the first stage in `provenance` started and the last one ended; None where that was not
    stored.
    """
    stages = (provenance or {}).get("stages")
    if not isinstance(stages, Mapping):
        return None
    began, ended = (
        [str(each[name]) for each in stages.values() if isinstance(each, Mapping) and name in each]
        for name in ("started", "finished")
    )
    first, last = minute_of(min(began, default="")), minute_of(max(ended, default=""))
    return (first, last) if first and last else None
