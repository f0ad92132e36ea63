"""The seal of a stored baseline: a hash of each part, so that an edited one is noticed.

Metrics are JSON that anybody may edit, and a margin made ten times as wide lets every walk pass.
The seal shows whether each part is as it was stored, and whether the margins that judge a walk are
still the same. It detects accidents and edits, not forgery: whoever edits a part may seal it again,
which a review then sees.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from gaitval._internal.io.artefacts import file_hash, read_json, read_toml, value_hash, write_json
from gaitval.errors import ArtefactError
from gaitval.metrics.tolerances import load_registry
from gaitval.metrics.typed import Result, Sha256

if TYPE_CHECKING:
    from gaitval.metrics.results import Metrics

SEAL: Final = "seal.json"
VERSION: Final = 2

UNKNOWN_VERSIONS: Final = "the baseline does not say which versions of the stages made it"
"""Of a baseline that was sealed by hand, or that an earlier gaitval stored."""

_WITHOUT_MEASURES: Final = ("measures", "tolerances")


class SealedMargin(Result):
    """How much of a measure may be lost, and which way is better."""

    value: float
    unit: str
    better: str


class Seal(Result):
    """What a baseline was when it was stored.

    Attributes
    ----------
    parts : hash by part: of the contents, not of the layout of a file.
    margins : those of `tolerances.toml`, by measure, of the measures that are stored.
    versions : of the stages that walk and measure, by name; None if not recorded.
    commit : of the gaitval that ran them; None if not recorded.
    seal : hash of everything else.
    """

    version: int
    parts: dict[str, Sha256]
    margins: dict[str, SealedMargin]
    versions: dict[str, int] | None
    commit: str | None
    seal: Sha256


def parts_of(baseline: Path) -> dict[str, str]:
    """Hash of each part of a stored `baseline`."""
    metrics = read_json(baseline / "metrics.json")
    settings = read_toml(baseline / "configuration.toml", ArtefactError)
    weights, about = (baseline / "policy" / f"policy.{end}" for end in ("safetensors", "json"))
    values = {
        "subject": read_toml(baseline / "subject.toml", ArtefactError),
        "settings of validation": {name: settings.get(name) for name in ("validation", "pushes")},
        "configuration": settings,
        "policy": [file_hash(weights), read_json(about)],
        "mu": read_json(baseline / "identification.json"),
        "correction": read_json(baseline / "correction.json"),
        "record": metrics.get("record"),
        "measures": [metrics.get(name) for name in _WITHOUT_MEASURES],
        "rest of metrics.json": {
            name: value for name, value in metrics.items() if name not in _WITHOUT_MEASURES
        },
    }
    return {name: value_hash(value) for name, value in values.items()}


def installed_margins() -> dict[str, SealedMargin]:
    """The margins of the installed gaitval, by measure."""
    return {
        margin.measure: SealedMargin(value=margin.value, unit=margin.unit, better=margin.better)
        for margin in load_registry().margin
    }


def seal(baseline: Path, *, versions: Mapping[str, int] | None, commit: str | None) -> None:
    """Seal a stored `baseline` as it is, with the `versions` of the stages that made it and the
    `commit` that they ran at (see `Seal`).
    """
    stored = {row["measure"] for row in read_json(baseline / "metrics.json")["measures"]}
    margins = installed_margins().items()
    values = {
        "version": VERSION,
        "parts": parts_of(baseline),
        "margins": {name: margin.as_dict() for name, margin in margins if name in stored},
        "versions": None if versions is None else dict(versions),
        "commit": commit,
    }
    write_json(baseline / SEAL, {**values, "seal": value_hash(values)})


def read_seal(baseline: Path) -> Seal:
    """The seal of `baseline`. Raises ArtefactError if there is none, or it was edited."""
    path = baseline / SEAL
    if not path.is_file():
        raise ArtefactError(
            f"{path}: no such file, so nothing says whether this baseline is as it was stored; an "
            f"earlier gaitval wrote it, or the file was lost. {fix(baseline)}"
        )
    values = read_json(path)
    found = Seal.read(values, str(path), file=SEAL, fix=fix(baseline))
    if found.seal != value_hash({name: each for name, each in values.items() if name != "seal"}):
        raise ArtefactError(
            f"{path}: was edited: the hash in it is not that of its contents. {fix(baseline)}"
        )
    return found


def check_parts(baseline: Path) -> Seal:
    """The seal of a `baseline` whose parts are as they were stored. Raises ArtefactError if there
    is no seal or a part has changed, which the message names.
    """
    found = read_seal(baseline)
    now = parts_of(baseline)
    changed = [name for name in now if found.parts.get(name) != now[name]]
    if changed:
        raise ArtefactError(
            f"{baseline}: changed since it was stored: {', '.join(changed)}. A walk would be "
            f"compared with something else than a walk. {fix(baseline)}"
        )
    return found


def check_seal(baseline: Path) -> Seal:
    """The seal of a `baseline` whose parts and margins are as they were stored. Raises
    ArtefactError as `check_parts`, and if the margins of this gaitval are others.
    """
    found = check_parts(baseline)
    moved = _moved_margins(found)
    if moved:
        raise ArtefactError(
            f"{baseline}: the margins of this gaitval are not those that it was stored with: "
            f"{'; '.join(moved)}. What a walk may lose would be decided anew. {fix(baseline)}"
        )
    return found


def _moved_margins(found: Seal) -> list[str]:
    then, installed = found.margins, installed_margins()
    return [  # a measure that is new since has no margin there
        f"{name} {_margin(then[name])}, now {_margin(installed.get(name))}"
        for name in sorted(then)
        if then[name] != installed.get(name)
    ]


def _margin(margin: SealedMargin | None) -> str:
    if margin is None:
        return "none"
    return f"{margin.value:g} {margin.unit} ({margin.better} is better)"


def fix(baseline: Path) -> str:
    """How to repair a `baseline` that is not as it was stored."""
    return (
        "Restore the folder, for instance with `git checkout`, or, if the change is intended, "
        f"seal it as it is: `gaitval baseline SUBJECT --to {baseline} --seal`."
    )


def changes(
    found: Seal, before: "Metrics", now: "Metrics", versions: Mapping[str, int]
) -> list[str]:
    """Dependencies of a walk that have changed since its baseline was sealed (`found`), one phrase
    each, by the metrics `before` and `now` and the installed `versions` of the stages. A library
    that is not installed now did not change this walk.
    """
    then, here = (each.provenance.versions for each in (before, now))
    messages = [
        f"{name} {then.get(name, 'not there')}, now {version}"
        for name, version in sorted(here.items())
        if then.get(name) != version
    ]
    if before.provenance.record != now.provenance.record:
        messages.append("the record as it is read now")
    if found.versions is None:
        return [*messages, UNKNOWN_VERSIONS]
    return messages + [
        f"stage {name} at version {found.versions.get(name, 'none')}, now {version}"
        for name, version in versions.items()
        if found.versions.get(name) != version
    ]


def inputs_in_words(changed: Sequence[str]) -> str:
    """One sentence on what `changes` returned (`changed`). Unrecorded versions are no change."""
    known = [each for each in changed if each != UNKNOWN_VERSIONS]
    if known:
        return f"changed: {'; '.join(changed)}"
    if changed:
        return f"the same as when the baseline was stored, as far as is known: {UNKNOWN_VERSIONS}"
    return "the same as when the baseline was stored"
