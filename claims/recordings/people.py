"""What becomes of recordings of 13 public sources, of patients among others.

`people.toml` lists them, with what should become of each: a subject, or a
refusal for the reason that the recording has. FOLDER has a clone of each repository, named
OWNER+NAME. What became of each is kept below `work`, by commit, so that a
run goes on.
"""

import tempfile
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

import claims
from claims import ROOT, Claim
from claims.recordings.public import right, work
from claims.rows import STARTED
from gaitval.artefacts import read_json, write_json
from gaitval.mocap.reading import read_recording
from gaitval.scaling.markers.draft import draft_markers
from gaitval.scaling.markers.files import as_toml

LIST: Final = ROOT / "claims" / "recordings" / "people.toml"


def listed() -> Iterator[dict[str, Any]]:
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


@claims.measured("public")
def recordings(given: claims.Given) -> list[Claim]:
    """Recordings of 13 sources: subject or right refusal; children against Plug-in Gait."""
    wanted = list(listed())
    path = given.work / f"people-{STARTED}.json"
    store = read_json(path) if path.is_file() else {}
    for recording in wanted:
        if recording["name"] in store:
            continue
        with tempfile.TemporaryDirectory() as folder:
            placed = recording
            if recording.get("drafted"):
                placed = _drafted(recording, given.public, Path(folder))
            result = work(placed, given.public)
        kept = {key: result[key] for key in ("name", "laboratory", "became", "why", "sha256")}
        if result.get("peer"):
            kept["peer"] = result["peer"]
        store[recording["name"]] = kept
        write_json(path, store)
        print(
            f"{recording['name']}: {result['became']}"
            f"{'' if right(recording, result) else ' (not as it should be)'}; "
            f"{result['why']}",
            flush=True,
        )
    known = [store[each["name"]] for each in wanted if each["name"] in store]
    good = sum(right(each, store[each["name"]]) for each in wanted if each["name"] in store)
    return [
        Claim(
            "recordings of 13 sources: right subject, or right refusal",
            100.0 * good / len(known),
            "%",
            len(known),
        ),
        *_sides([store[name] for name in _children(wanted) if name in store]),
    ]


def _children(listed: Sequence[Mapping[str, Any]]) -> list[str]:
    """Names of the recordings of Geneva that should become subjects."""
    return [
        each["name"] for each in listed if each["laboratory"] == "geneva" and "refused" not in each
    ]


def _sides(known: Sequence[Mapping[str, Any]]) -> Iterator[Claim]:
    """Each side of the children of Geneva against Plug-in Gait in their files: a joint and side is
    the mean over its trials.
    """
    legs: dict[tuple[str, str, str, str], list[tuple[float, float]]] = {}
    for each in known:
        for row in each.get("peer", ()):
            leg = (row["kind"], each["name"], row["joint"], row["side"])
            legs.setdefault(leg, []).append((row["rms"], row["raw"]))
    for kind, unit in (("angle", "deg"), ("moment", "Nm/kg")):
        found = np.array(
            [np.mean(values, axis=0) for leg, values in legs.items() if leg[0] == kind]
        )
        if not len(found):
            continue
        what = f"cerebral palsy and torsion, {kind}s of each side against Plug-in Gait"
        for column, convention in ((0, "zero of standing taken out"), (1, "as they are")):
            for word, value in (("mean", found.mean(axis=0)), ("worst", found.max(axis=0))):
                if kind == "angle" or column == 1:
                    yield Claim(
                        f"{what}, {convention}: RMS, {word} joint and side",
                        float(value[column]),
                        unit,
                        len(found),
                    )
