"""What becomes of recordings of 13 public sources, of patients among others.

`evidence/anybody/recordings.toml` lists them, with what should become of each: a subject, or a
refusal for the reason that the recording has. FOLDER has a clone of each repository, named
OWNER+NAME. Each recording that is run is kept in `reports/recordings/anybody.json`, so that the
list can be worked through in several calls; the row is of the latest outcome of each.
"""

import tempfile
import tomllib
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

import evidence
from evidence import ROOT, option
from experiments.public_recordings import right, work
from gaitval.artefacts import read_json, write_json
from gaitval.mocap.reading import read_recording
from gaitval.scaling.markers.draft import draft_markers
from gaitval.scaling.markers.files import as_toml

LIST: Final = ROOT / "evidence" / "anybody" / "recordings.toml"
STORE: Final = ROOT / "reports" / "recordings" / "anybody.json"
CLONES = option("--from", dest="clones", type=Path, required=True, help="folder of the clones")
MEASURES = {
    "*": {
        "code": (
            "@motion",
            "evidence/anybody/recordings.py",
            "experiments/public_recordings.py",
            "gaitval/scaling/markers/*.py",
        ),
        "data": (
            "evidence/anybody/recordings.toml",
            "gaitval/scaling/markersets/*.toml",
            "gaitval/scaling/markers/*.toml",
        ),
        "allowed": 20,
        "why": "of 5,000 statements; a recording is refused or not, which such a change does not "
        "alter unless a test of its module fails",
    }
}
"""What the rows depend on; see evidence/stale.py."""


def _listed() -> Iterator[dict[str, Any]]:
    """The recordings, with the paths of their files from the folder of the clones."""
    for laboratory, content in tomllib.loads(LIST.read_text(encoding="utf-8")).items():
        for recording in content["recordings"]:
            placed = dict(recording, laboratory=laboratory, plug_in_gait=laboratory == "geneva")
            for key in ("static", "trials", "forces"):
                if key in recording:
                    value = recording[key]
                    paths = [value] if isinstance(value, str) else value
                    placed[key] = [content["folder"] + path for path in paths]
            yield placed


def _drafted(recording: dict[str, Any], clones: Path, folder: Path) -> dict[str, Any]:
    """The recording with the marker set that `gaitval markers` drafts, as it is, uncorrected."""
    standing = recording.get("static")
    draft = draft_markers(
        read_recording(clones / recording["trials"][0], plates=False),
        read_recording(clones / standing[0], plates=False) if standing else None,
    )
    path = folder / "drafted.toml"
    path.write_text(as_toml(draft, "drafted", "gaitval markers"), encoding="utf-8")
    return recording | {"marker_set": str(path)}


@evidence.measurement(CLONES, option("--only", nargs="*", help="names, or beginnings of them"))
def recordings(arguments: Namespace) -> list[evidence.Row]:
    """Recordings of 13 sources: subject or right refusal; children against Plug-in Gait."""
    listed = list(_listed())
    store = (
        {each["name"]: each for each in read_json(STORE)["recordings"]} if STORE.exists() else {}
    )
    for recording in listed:
        if arguments.only and not recording["name"].startswith(tuple(arguments.only)):
            continue
        with tempfile.TemporaryDirectory() as folder:
            given = recording
            if recording.get("drafted"):
                given = _drafted(recording, arguments.clones, Path(folder))
            result = work(given, arguments.clones)
        kept = {key: result[key] for key in ("name", "laboratory", "became", "why", "sha256")}
        if result.get("peer"):
            kept["peer"] = result["peer"]
        store[recording["name"]] = kept
        names = [each["name"] for each in listed]
        write_json(STORE, {"recordings": [store[name] for name in names if name in store]})
        print(
            f"{recording['name']}: {result['became']}"
            f"{'' if right(recording, result) else ' (not as it should be)'}; "
            f"{result['why']}",
            flush=True,
        )
    known = [store[each["name"]] for each in listed if each["name"] in store]
    good = sum(right(each, store[each["name"]]) for each in listed if each["name"] in store)
    return [
        evidence.Row(
            "recordings of 13 sources: right subject, or right refusal",
            100.0 * good / len(known), "%", ">=", 100, 90, len(known),
        ),
        evidence.Row(
            "recordings of 13 sources that were run",
            100.0 * len(known) / len(listed), "%", ">=", 100, 100, len(listed),
        ),
        *_sides([store[name] for name in _children(listed) if name in store]),
    ]  # fmt: skip


def _children(listed: Sequence[Mapping[str, Any]]) -> list[str]:
    """Names of the recordings of Geneva that should become subjects."""
    return [
        each["name"] for each in listed if each["laboratory"] == "geneva" and "refused" not in each
    ]


def _sides(known: Sequence[Mapping[str, Any]]) -> Iterator[evidence.Row]:
    """Each side of the children of Geneva against Plug-in Gait in their files: a joint and side is
    the mean over its trials.
    """
    legs: dict[tuple[str, str, str, str], list[tuple[float, float]]] = {}
    for each in known:
        for row in each.get("peer", ()):
            leg = (row["kind"], each["name"], row["joint"], row["side"])
            legs.setdefault(leg, []).append((row["rms"], row["raw"]))
    for kind, unit, goal, must in (("angle", "deg", 3.0, 4.5), ("moment", "Nm/kg", 0.10, 0.20)):
        found = np.array(
            [np.mean(values, axis=0) for leg, values in legs.items() if leg[0] == kind]
        )
        if not len(found):
            continue
        what = f"cerebral palsy and torsion, {kind}s of each side against Plug-in Gait"
        for column, convention in ((0, "zero of standing taken out"), (1, "as they are")):
            for word, value in (("mean", found.mean(axis=0)), ("worst", found.max(axis=0))):
                if kind == "angle" or column == 1:
                    yield evidence.Row(
                        f"{what}, {convention}: RMS, {word} joint and side",
                        float(value[column]), unit, "<=", goal, must, len(found),
                    )  # fmt: skip
