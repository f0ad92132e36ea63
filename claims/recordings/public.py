"""Public recordings of several laboratories, imported and held against their own results.

`public.toml` lists them with repository, commit and what is known of the person; the folder
`public` has a clone of each repository, named OWNER+NAME. None of the recordings is kept here.
Plug-in Gait filters neither forces nor moments; its curves are low-passed here as ours are. It puts
the hip centre by Davis 1991 (1 cm in front of ours, Harrington 2007) and the knee centre by the
thigh marker (1 cm behind ours), so its knee is 2 to 6° straighter and its hip moments differ. The
zero of an angle is therefore taken from standing, where the peer has results there, else from the
mean over the cycles.
"""

import hashlib
import os
import tempfile
import time
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

import claims
from claims import ROOT, Claim
from claims.given import DATA
from claims.recordings.peer_results import against_opensim, against_plug_in_gait
from claims.recordings.zoo_to_c3d import zoo_to_c3d
from claims.rows import STARTED
from gaitval.artefacts import read_json, write_json
from gaitval.configuration import load_configuration
from gaitval.errors import GaitvalError
from gaitval.importing.importing import import_files
from gaitval.session.request import ImportOptions, checked

LIST = Path(__file__).with_name("public.toml")
PROCESSES = 2
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
        messages: list[str] = []
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
                notify=lambda step, message: messages.append(f"{step}: {message}"),
            )
        except GaitvalError as error:
            words = str(error)
            for start in (folder, base, DATA):
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
        return against_opensim(found, public_file(recording["opensim"], base))
    if recording.get("plug_in_gait"):
        return against_plug_in_gait(found, list(trials))
    return []


def _marker_set(recording: Mapping[str, Any]) -> dict[str, Any]:
    """The marker set of a recording whose set is not built in; its path is from the project."""
    return {"marker_set": str(ROOT / recording["marker_set"])} if "marker_set" in recording else {}


def several(value: Any) -> list[str]:
    """One name, or several, or none, as a list."""
    return [value] if isinstance(value, str) else list(value or ())


def public_file(name: str, base: Path) -> Path:
    """A file of the project's data ("data:...") or of a clone in the folder `base`. Raises
    LackingError if it is not there: a figure without it would be of fewer people than it says.
    """
    of_data = name.startswith("data:")
    path = DATA / name.removeprefix("data:") if of_data else base / name
    if not path.exists():
        clone = name.partition("/")[0]
        get = (
            "the raw data of GAITVAL_DATA have it"
            if of_data
            else f"clone https://github.com/{clone.replace('+', '/')} into {base / clone}"
        )
        raise claims.LackingError(f"there is no {path}: {get}")
    return path


def local_file(name: str, base: Path, folder: Path) -> Path:
    """The file itself; of a `.zoo` file the C3D that it was made from."""
    path = public_file(name, base)
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


@claims.measured("public")
def public(given: claims.Given) -> list[Claim]:
    """Public recordings of seven laboratories: what becomes of them; against their own results."""
    store = given.work / f"public-{STARTED}.json"
    results = read_json(store) if store.is_file() else {}
    recordings = listed()
    wanted = [each for each in recordings if each["name"] not in results]
    with ProcessPoolExecutor(PROCESSES, mp_context=get_context("spawn")) as pool:
        jobs = {pool.submit(work, each, given.public): each for each in wanted}
        for job in as_completed(jobs):
            result = job.result()
            results[result["name"]] = result
            write_json(store, results)
            message = "" if right(jobs[job], result) else "   NOT AS IT SHOULD BE"
            print(f"{result['name']}: {result['became']}. {result.get('why', '')[:160]}{message}",
                  flush=True)  # fmt: skip
    return list(_rows([(each, results[each["name"]]) for each in recordings]))


def _rows(known: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> Iterator[Claim]:
    """The figures of recordings, each with its result."""
    good = [right(*pair) for pair in known]
    what = "public recordings worked through, or refused for the right reason"
    yield Claim(what, 100 * float(np.mean(good)), "%", len(good))
    faults = sum(result["became"] == "fault" for _, result in known)
    yield Claim("public recordings that end in a fault of the program", faults, "recordings",
                len(known))  # fmt: skip
    hips = [hip for _, result in known for hip in result.get("functional", ()) if "hip" in hip]
    if hips:
        apart = [abs(e["hip"]["to_ankle_m"] - e["hip"]["regression_to_ankle_m"]) for e in hips]
        errors = [np.hypot(*(each["hip"][key] for key in ERRORS)) for each in hips]
        what = "functional against regression, hip centre to ankle: largest difference over its "
        yield Claim(
            f"{what}standard error", float(np.max(np.divide(apart, errors))), "1", len(hips)
        )
    peers = [row for _, result in known for row in result.get("peer", ())]
    for kind, unit in (("angle", "deg"), ("moment", "Nm/kg")):
        for joint in ("Hip", "Knee", "Ankle"):
            values = [row["rms"] for row in peers if (row["kind"], row["joint"]) == (kind, joint)]
            if values:
                what = f"{joint.lower()} {kind}s against the peer's own results, same convention: "
                yield Claim(f"{what}RMS, mean of legs and trials", float(np.mean(values)), unit,
                            len(values))  # fmt: skip


def imported(recording: Mapping[str, Any], clones: Path, folder: Path) -> Path:
    """Import a recording into a folder; the file of the subject that it becomes."""
    with tempfile.TemporaryDirectory() as temporary:
        files = {
            key: [local_file(path, clones, Path(temporary)) for path in several(recording.get(key))]
            for key in ("static", "trials", "forces", "functional")
        }
        options = {
            **{key: recording[key] for key in OPTIONS if key in recording},
            **{key: files[key] for key in ("trials", "forces", "functional")},
            **_marker_set(recording),
            "static": next(iter(files["static"]), None),
        }
        made = checked(ImportOptions, options)
        import_files(made, folder, configuration=load_configuration(), notify=lambda *_: None)
    return folder / "subject.toml"
