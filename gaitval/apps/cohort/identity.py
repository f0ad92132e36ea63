"""What the results of a study depend on, as one hash: its fingerprint.

A worker imports this for every study, so what takes long to load is imported where it is used.
"""

import importlib
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gaitval.apps.cohort.device_studies import DevicesSetting, identity_of
from gaitval.apps.cohort.table import Study
from gaitval.artefacts import file_hash, value_hash
from gaitval.configuration import Configuration, load_configuration
from gaitval.errors import ArtefactError, ConfigurationError
from gaitval.model.devices.device import tables_of
from gaitval.session.request import FILES, ImportOptions
from gaitval.study.inputs import POLICY_FILES
from gaitval.study.stage import Observer
from gaitval.study.stage_versions import STAGE_VERSIONS
from gaitval.study.stored_policy import DELAYED, SLOW, general_policy

if TYPE_CHECKING:
    from gaitval.datasets.subject import Subject

Json = dict[str, Any]
_StudyFunction = Callable[[Study, Path, int, Observer], Json]
"""A study's work: the study, its folder, its threads, who hears of it → its summary."""

VERSION: Final = 1
"""Of what a study makes of the results of its stages; raised as `stage_versions` says."""

REAL: Final = "gaitval.apps.cohort.study:run"
"""The function of a real study, as `function_of` takes it."""


def function_of(name: str) -> _StudyFunction:
    """The function of this name, "module:function"."""
    module, _, attribute = name.partition(":")
    found: _StudyFunction = getattr(importlib.import_module(module), attribute)
    return found


def configuration_of(study: Study, threads: int = 1) -> Configuration:
    """The settings of `study`. Its walks run in `threads` processes: how many makes no difference
    to what comes out (`policy.training`), only to the studies beside it. Raises ConfigurationError
    if there is no such setting, or a value is out of range.
    """
    found = load_configuration(study.config, settings=study.settings)
    training = found.training.model_copy(update={"workers": threads})
    return found.model_copy(update={"training": training})


def fingerprint(study: Study, function: str = REAL) -> str:
    """Hash of all that the results of `study`, done by `function` ("module:function"), depend on:
    `VERSION` and those of the stages, the record, the settings, and the policies that its training
    may start from.

    Raises GaitvalError if the subject, a file or a setting cannot be used.
    """
    settings = configuration_of(study).model_dump(mode="json")
    parts: Json = {
        "versions": [VERSION, dict(STAGE_VERSIONS)],
        "function": function,
        "settings": settings,
        "start": study.start,
        "record": record_parts(study),
    }
    if study.devices:
        parts["devices"] = identity_of(study.devices)
    if function == REAL:
        parts["policies"] = _policies(study)
    return value_hash(parts)


def record_parts(study: Study) -> Json:
    """What says which record a study is of."""
    if study.recording is not None:
        given = study.recording
        files = [given.get("static"), *(file for key in FILES for file in given.get(key, ()))]
        hashes = [_hash_of(Path(file)) for file in files if file is not None]
        options = {key: each for key, each in given.items() if key not in ("static", *FILES)}
        # in their own place, for they change what is made of the others
        others = [key for key, each in options.items() if _is_file(key, each)]
        options |= {key: _hash_of(Path(options[key])) for key in others}
        return {"files": hashes, "name": study.name, **options}
    if study.virtual is not None:
        around, _ = _known(study.virtual.around)
        return {"around": around, **study.virtual.model_dump(mode="json")}
    assert study.subject is not None
    subject, devices = _known(study.subject, study.trial)
    return {"subject": subject} | ({"devices": identity_of(devices)} if devices else {})


def _is_file(key: str, given: object) -> bool:
    """Whether an option of a recording is the path of one file."""
    own_set = key == "marker_set" and str(given).lower().endswith(".toml")
    return own_set or ImportOptions.model_fields[key].annotation == Path | None


def record_hash(study: Study) -> str:
    """Hash of the record that a study is of, whatever its name: the same for all seeds."""
    return value_hash({key: each for key, each in record_parts(study).items() if key != "name"})


def settings_hash(study: Study) -> str:
    """Hash of how a study is done, but for its seed."""
    about = study.model_dump(mode="json", include={"start", "policy", "devices"})
    settings = configuration_of(study).model_dump(mode="json", exclude={"seed"})
    return value_hash(about | {"settings": settings})


def _hash_of(file: Path) -> str:
    try:
        return file_hash(file)
    except ArtefactError as error:
        raise ConfigurationError(f"{error} In a table, paths are relative to it.") from None


def _policies(study: Study) -> list[str]:
    """Hashes of the stored policies that a training may start from."""
    if study.policy is not None:
        return [_hash_of(Path(study.policy) / name) for name in POLICY_FILES]
    general = general_policy() if study.start != "scratch" else None
    folders = (general, general / SLOW, general / DELAYED) if general else ()
    return [file_hash(each / name) for each in folders for name in POLICY_FILES]


def _known(subject: str, trial: str = "") -> tuple[str, Sequence[DevicesSetting]]:
    """Hash of a subject's record on a trial, and the devices of its file."""
    path = Path(subject)
    stamp = path.stat().st_mtime_ns if path.is_file() else 0
    return _read(subject, trial, stamp)


@cache
def _read(subject: str, trial: str, stamp: int) -> tuple[str, Sequence[DevicesSetting]]:
    """As `_known`; a cohort has many studies of few subjects, and reading one takes 0.05 s. A
    subject is read again if `stamp`, the time of its last change, is another.
    """
    del stamp
    found = subject_in_table(Study(name="any", subject=subject, trial=trial))
    return value_hash(found.to_toml()), tables_of(found.devices)


def subject_in_table(study: Study) -> "Subject":
    """The subject that a study names, on the trial that it is of."""
    from gaitval.datasets.subject_file import load_subject

    assert study.subject is not None
    subject = load_subject(study.subject)
    return subject.on_trial(study.trial) if study.trial else subject
