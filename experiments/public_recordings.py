"""Import public recordings of several laboratories, and hold the results against their own.

    python -m experiments.public_recordings --from FOLDER [--only NAME ...]

`experiments/public_recordings.toml` lists them with repository, commit and what is known of
the person. FOLDER has a clone of each repository, named OWNER+NAME; `GAITVAL_DATA` the project's
own raw data. None of the recordings is kept in the project. Writes
`reports/recordings/public.json`, its tables `reports/recordings/public.md`, and rows of
`reports/evidence/recordings.csv`.
"""

import argparse
import hashlib
import os
import tempfile
import time
import tomllib
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

import evidence
from experiments.peer_results import against_opensim, against_plug_in_gait
from experiments.zoo_to_c3d import zoo_to_c3d
from gaitval.artefacts import read_json, versions, write_json
from gaitval.configuration import load_configuration
from gaitval.errors import GaitvalError
from gaitval.importing.importing import import_files
from gaitval.session.request import ImportOptions, checked

ROOT = Path(__file__).resolve().parent.parent
LIST = ROOT / "experiments" / "public_recordings.toml"
STORE = ROOT / "reports" / "recordings" / "public.json"
PAGE = STORE.with_suffix(".md")
COMMAND = "python -m experiments.public_recordings --from FOLDER"
ERRORS = ("to_ankle_error_m", "regression_error_m")
OPTIONS = (
    "mass",
    "height",
    "sex",
    "axes",
    "knee_width",
    "ankle_width",
    "elbow_width",
    "kinematics_only",
    "age",
    "floor",
)

PEER_WORDS = """
Sagittal, over the gait cycles. Plug-in Gait filters neither forces nor moments; its curves are
low-passed here as ours are. Its moments are positive for extensors. It puts the hip centre by Davis
1991 (about 1 cm in front of ours, Harrington 2007) and the knee centre by the thigh marker (about
1 cm behind ours, from the fit of a hinge), so its knee is 2 to 6° straighter and its hip moments
differ. The zero of an angle is therefore taken from standing, where the peer has results there,
else from the mean over the cycles.
"""
MEASURES = {
    "public laboratories *": {"data": ("experiments/public_recordings.toml",)},
    "a new marker set: *": {
        "code": ("gaitval/scaling/marker_sets.py", "experiments/public_recordings.py"),
        "data": ("gaitval/scaling/markersets/*.toml",),
    },
    "*": {
        "code": ("@motion", "experiments/public_recordings.py", "experiments/peer_results.py"),
        "data": ("experiments/public_recordings.toml", "gaitval/scaling/markersets/*.toml"),
        "allowed": 20,
        "why": "of 5,000 statements; differences from other programs of degrees and tenths of "
        "Nm/kg, which such a change does not reach unless a test of its module fails",
    },
}
"""What the rows depend on; see evidence/stale.py."""


def listed() -> list[dict[str, Any]]:
    """The recordings of the list, each with what its laboratory's table says of all of them."""
    content = tomllib.loads(LIST.read_text(encoding="utf-8"))
    return [
        {key: value for key, value in laboratory.items() if key != "recordings"} | recording
        for laboratory in content["laboratories"]
        for recording in laboratory["recordings"]
    ]


def work(recording: Mapping[str, Any], base: Path) -> dict[str, Any]:
    """Import one recording and say what became of it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = {
            key: [local_file(path, base, folder) for path in several(recording.get(key))]
            for key in ("static", "trials", "forces", "functional")
        }
        said: list[str] = []
        result: dict[str, Any] = {
            "name": recording["name"],
            "laboratory": recording["laboratory"],
            "sha256": {
                path.name: hashlib.sha256(path.read_bytes()).hexdigest()
                for paths in files.values()
                for path in paths
            },
        }
        begin = time.perf_counter()
        try:
            options = {
                **{key: recording[key] for key in OPTIONS if key in recording},
                **{key: files[key] for key in ("trials", "forces", "functional")},
                **_marker_set(recording),
                "static": next(iter(files["static"]), None),
            }
            imported = import_files(
                checked(ImportOptions, options),
                folder / "out" / recording["name"],
                configuration=load_configuration(),
                tell=lambda step, message: said.append(f"{step}: {message}"),
            )
        except GaitvalError as error:
            words = str(error)
            for start in (folder, base, Path(os.environ["GAITVAL_DATA"])):
                words = words.replace(str(start) + os.sep, "")
            result |= {"became": "refused", "why": words.splitlines()[0]}
        except Exception as error:
            result |= {"became": "fault", "why": repr(error)}
        else:
            kinetics = imported.subject.has_kinetics
            result |= {
                "became": "subject" if kinetics else "subject without forces",
                "why": imported.subject.described.partition("; ")[2],
                "peer": _peer(recording, imported.found, files["trials"], base),
                "functional": [
                    joint.record() for joint in imported.found.functional if joint.joint == "hip"
                ],
            }
        result["seconds"] = time.perf_counter() - begin
    return result


def _peer(
    recording: Mapping[str, Any], found: Any, trials: Sequence[Path], base: Path
) -> list[dict[str, Any]]:
    """Differences from the results that come with the recording, if there are any."""
    if "opensim" in recording:
        return against_opensim(found, _path(recording["opensim"], base))
    if recording.get("plug_in_gait"):
        return against_plug_in_gait(found, list(trials))
    return []


def _marker_set(recording: Mapping[str, Any]) -> dict[str, Any]:
    """The marker set of a recording whose set is not built in; its path is from the project."""
    return {"marker_set": str(ROOT / recording["marker_set"])} if "marker_set" in recording else {}


def several(value: Any) -> list[str]:
    """One name, or several, or none, as a list."""
    return [value] if isinstance(value, str) else list(value or ())


def _path(name: str, base: Path) -> Path:
    """A file of the project's data ("data:...") or of a clone."""
    if name.startswith("data:"):
        return Path(os.environ["GAITVAL_DATA"]) / name.removeprefix("data:")
    return base / name


def local_file(name: str, base: Path, folder: Path) -> Path:
    """The file itself; of a `.zoo` file the C3D that it was made from."""
    path = _path(name, base)
    if path.suffix != ".zoo":
        return path
    target = folder / f"{path.parent.name}_{path.stem}.c3d"
    zoo_to_c3d(path, target)
    return target


def right(recording: Mapping[str, Any], result: Mapping[str, Any]) -> bool:
    """Whether a recording was worked through, or refused for the reason that it has."""
    if "refused" in recording:
        return result["became"] == "refused" and recording["refused"] in result["why"]
    wanted = ("subject",) if not recording.get("kinematics_only") else ("subject without forces",)
    return result["became"] in wanted


def rows(recordings: Sequence[Mapping[str, Any]], results: Mapping[str, Any]) -> list[evidence.Row]:
    """The figures of all recordings, as rows of evidence."""
    known = [(each, results[each["name"]]) for each in recordings if each["name"] in results]
    good = [right(*pair) for pair in known]
    zoo = [
        right(*pair)
        for pair in known
        if "biomechZoo" in pair[0]["laboratory"] and "," not in pair[0]["name"]
    ]
    laboratories = {each["laboratory"] for each, _ in known}
    found = [
        evidence.Row(
            "public laboratories whose recordings were tried",
            len(laboratories), "laboratories", ">=", 6, 6, len(laboratories),
        ),
        evidence.Row(
            "public recordings worked through, or refused for the right reason",
            100 * float(np.mean(good)), "%", ">=", 100, 90, len(good),
        ),
        evidence.Row(
            "biomechZoo, one stride per trial: subjects made",
            sum(zoo), "trials", ">=", 12, 11, len(zoo),
        ),
        evidence.none_may(
            "public recordings that end in a fault of the program",
            sum(result["became"] == "fault" for _, result in known), "recordings", len(known),
        ),
    ]  # fmt: skip
    hips = [hip for _, result in known for hip in result.get("functional", ())]
    shown = [hip["hip"] for hip in hips if "hip" in hip]
    if hips:
        told = sum(
            bool(hip["refused"]) or min(hip["hip"][key] for key in ERRORS) > 0.0 for hip in hips
        )
        found.append(
            evidence.Row(
                "functional hips: length to the ankle reported with its error beside the "
                "regression's, or the reason why not",
                100 * told / len(hips), "%", ">=", 100, 100, len(hips),
            )
        )  # fmt: skip
    if shown:
        apart = [abs(hip["to_ankle_m"] - hip["regression_to_ankle_m"]) for hip in shown]
        errors = [np.hypot(*(hip[key] for key in ERRORS)) for hip in shown]
        found.append(
            evidence.Row(
                "functional against regression, hip centre to ankle: largest difference over its "
                "standard error",
                float(np.max(np.divide(apart, errors))), "1", "<=", 2, 3, len(shown),
            )
        )  # fmt: skip
    found.append(
        evidence.Row(
            "a new marker set: files that name it (helen_hayes)",
            len(_naming("helen_hayes")), "files", "<=", 2, 2, 1,
        )
    )  # fmt: skip
    peers = [row for _, result in known for row in result.get("peer", ())]
    for kind, unit, goal, must in (("angle", "deg", 2.0, 4.0), ("moment", "Nm/kg", 0.10, 0.20)):
        for joint in ("Hip", "Knee", "Ankle"):
            values = [row["rms"] for row in peers if (row["kind"], row["joint"]) == (kind, joint)]
            if values:
                found.append(
                    evidence.Row(
                        f"{joint.lower()} {kind}s against the peer's own results, same convention: "
                        "RMS, mean of legs and trials",
                        float(np.mean(values)), unit, "<=", goal, must, len(values),
                    )
                )  # fmt: skip
    return found


def _naming(marker_set: str) -> list[str]:
    """Files of code, data and tests that have a built-in marker set's name or are named so."""
    return [
        str(path.relative_to(ROOT))
        for folder in ("gaitval", "tests", "evidence", "experiments", "docs/build", "scripts")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in (".py", ".toml")
        and path != Path(__file__)
        and (path.stem == marker_set or f'"{marker_set}"' in path.read_text(encoding="utf-8"))
    ]


def page(recordings: Sequence[Mapping[str, Any]], results: Mapping[str, Any]) -> str:
    """The tables, for people."""
    lines = [
        "# Public recordings of other laboratories",
        "",
        "Written by `experiments/public_recordings.py`, which says how to get the recordings. None",
        "is kept here: address, commit and hash are in `experiments/public_recordings.toml` and",
        "`public.json`.",
        "",
        "| recording | laboratory | became | |",
        "|---|---|---|---|",
    ]
    for each in recordings:
        result = results.get(each["name"])
        if result is not None:
            mark = "" if right(each, result) else " **(not as it should be)**"
            why = result.get("why", "").replace("|", "/")
            lines.append(
                f"| {each['name']} | {each['laboratory']} | {result['became']}{mark} | {why} |"
            )
    lines += ["", "## Against the results that came with them", PEER_WORDS]
    lines += [
        "| | joint | legs and trials | RMS, mean ± SD | largest | without taking out the zero |",
        "|---|---|---|---|---|---|",
    ]
    peers = [row for each in recordings for row in results.get(each["name"], {}).get("peer", ())]
    for kind, unit, digits in (("angle", "°", 1), ("moment", " Nm/kg", 3)):
        for joint in ("Hip", "Knee", "Ankle"):
            of = [row for row in peers if (row["kind"], row["joint"]) == (kind, joint)]
            if of:
                rms, raw = (np.array([row[key] for row in of]) for key in ("rms", "raw"))
                lines.append(
                    f"| {kind} | {joint.lower()} | {len(of)} | {rms.mean():.{digits}f} ± "
                    f"{rms.std(ddof=1):.{digits}f}{unit} | {rms.max():.{digits}f}{unit} | "
                    f"{raw.mean():.{digits}f}{unit} |"
                )
    lines += ["", "By recording, the mean of both legs:", ""]
    lines += ["| recording | hip, knee, ankle | raw | moments |", "|---|---|---|---|"]
    for each in recordings:
        peer = results.get(each["name"], {}).get("peer") or []
        if peer:
            cells = [
                _by_joint(peer, kind, key, form)
                for kind, key, form in (
                    ("angle", "rms", "{:.1f}°"),
                    ("angle", "raw", "{:.1f}°"),
                    ("moment", "rms", "{:.3f}"),
                )
            ]
            lines.append(f"| {each['name']} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _by_joint(peer: Sequence[Mapping[str, Any]], kind: str, key: str, form: str) -> str:
    values = [
        [row[key] for row in peer if (row["kind"], row["joint"]) == (kind, joint)]
        for joint in ("Hip", "Knee", "Ankle")
    ]
    return ", ".join(form.format(np.mean(each)) if each else "–" for each in values)


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--from", dest="base", type=Path, required=True)
    parser.add_argument("--only", nargs="*", help="names of the list, or beginnings of them")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    recordings = listed()
    chosen = [
        each
        for each in recordings
        if not arguments.only or each["name"].startswith(tuple(arguments.only))
    ]
    results = (
        {each["name"]: each for each in read_json(STORE)["recordings"]} if STORE.exists() else {}
    )
    with ProcessPoolExecutor(arguments.workers, mp_context=get_context("spawn")) as pool:
        jobs = {pool.submit(work, each, arguments.base): each for each in chosen}
        for job in as_completed(jobs):
            result = job.result()
            results[result["name"]] = result
            said = "" if right(jobs[job], result) else "   NOT AS IT SHOULD BE"
            print(
                f"{result['name']}: {result['became']}, {result['seconds']:.0f} s. "
                f"{result.get('why', '')[:160]}{said}",
                flush=True,
            )
    ordered = [results[each["name"]] for each in recordings if each["name"] in results]
    write_json(STORE, {"versions": versions(), "recordings": ordered})
    PAGE.write_text(page(recordings, results), encoding="utf-8")
    print(evidence.write("recordings", rows(recordings, results), COMMAND))


if __name__ == "__main__":
    main()
