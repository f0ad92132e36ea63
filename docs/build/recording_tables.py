"""Write the accuracy tables of reports/recordings/README.md from the figures stored beside it.

With `--data`, the folder of the raw data, both recorded sessions are first imported again and
compared with OpenSim 4.6, and the figures are written; that takes some minutes. `--check` writes
nothing and fails if the tables do not match the figures (for CI).
"""

import argparse
import csv
import json
import sys
import tempfile
import textwrap
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "reports" / "recordings"
IDENTIFIERS = ("WBDS01", "Rajagopal")

TITLE = """# Accuracy of the import on two recorded sessions

Written by `docs/build/recording_tables.py` from the figures beside this file, which it computes
from the recordings (`--data FOLDER`). The recordings themselves are not here. **Bold** is outside
its limit; the limits and their sources: `gaitval/metrics/tolerances.toml`. How well the import
recovers synthetic recordings whose true values are known: `tests/workflows/test_import_truth.py`.
"""

SOURCES = {
    "WBDS01": {
        "title": "WBDS01 T01: treadmill at 0.49 m/s, 30 s, markers on pelvis and legs",
        "citation": "Fukuchi CA, Fukuchi RK, Duarte M (2018) A public dataset of overground and "
        "treadmill walking kinematics and kinetics in healthy individuals. PeerJ 6:e4640, "
        "https://doi.org/10.7717/peerj.4640",
        "licence": "CC BY 4.0",
    },
    "Rajagopal": {
        "title": "Rajagopal walk: over ground, markers on the whole body",
        "citation": "Rajagopal A, Dembia CL, DeMers MS, Delp DD, Hicks JL, Delp SL (2016) "
        "Full-body musculoskeletal model for muscle-driven simulation of human gait. IEEE Trans "
        "Biomed Eng 63:2068-2079",
        "licence": "see opensim-models, https://github.com/opensim-org/opensim-models",
    },
}

PARITY_FRAMES = {"WBDS01": 15, "Rajagopal": 2}
"""One frame of this many is given to both inverse kinematics: OpenSim takes 0.1 s per frame."""
CONVERGED, SHIPPED = 1e-9, 1e-5
"""Accuracies of OpenSim's inverse kinematics: one at which it has converged, and the default."""
ROTATIONS = np.array([i not in (3, 4, 5) for i in range(31)])
"""Which of the 31 coordinates are angles."""
INSIDE = slice(5, -5)
"""Frames left out at the ends, where splines are natural in OpenSim but not-a-knot here."""
SMALLEST_PEAK = 0.1
"""Nm. For a moment that is never larger, such as at joints that no marker shows, no fraction of the
peak is computed."""


# --- figures -----------------------------------------------------------------------------


def figures_of(identifier: str, data: Path) -> dict[str, Any]:
    """Import a session and measure everything that the tables show."""
    sys.path.insert(0, str(ROOT / "tests" / "support"))
    from other_speed import SAGITTAL, change_from_t05
    from recorded_sessions import rajagopal_walk, wbds01_t01

    from gaitval.configuration import ProcessingSettings
    from gaitval.importing.importing import work_out
    from gaitval.importing.summary import limit_rows

    treadmill = identifier == "WBDS01"
    request = wbds01_t01(data) if treadmill else rajagopal_walk(data)
    found = work_out(request, ProcessingSettings())
    walk = found.trials[0]
    consistent = walk.consistent
    assert consistent is not None
    figures = {
        "marker_errors_cm": _marker_errors(walk, data if treadmill else None),
        "lengths_m": [asdict(length) for length in found.body.fit.lengths],
        "scale_factors": dict(found.body.factors),
        "limits": [
            {
                "name": row.name.replace(f"{walk.name}, ", "").replace(walk.name, "as recorded"),
                "value": row.value,
                "limit": row.limit,
                "unit": row.unit,
                "passed": bool(row.passed),
            }
            for row in limit_rows(found)
        ],
        "consistent": {
            "marker_change_rms_mm": 1e3 * consistent.marker_change_rms,
            "marker_change_largest_mm": 1e3 * consistent.marker_change_max,
            "mass_factors": dict(consistent.mass_factors),
        },
        "weight_ratio": found.weight_ratio,
        "anchoring_mm": {
            "sliding_before": 1e3 * walk.anchoring.sliding_before,
            "sliding_after": 1e3 * walk.anchoring.sliding_after,
        },
        "events_ms": _events(found, data),
        "gait": _gait(walk, data if treadmill else None),
        "opensim": _opensim(found, PARITY_FRAMES[identifier]),
    }
    if treadmill:
        figures["other_speed"] = {
            title: asdict(change_from_t05(found, data, title)) for title in SAGITTAL
        }
    rounded: dict[str, Any] = _rounded(figures)
    return rounded


def _rounded(value: Any) -> Any:
    """Rounded to four digits, which the tables show and on which two machines agree."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    if isinstance(value, bool | int | str) or value is None:
        return value
    return float(f"{float(value):.4g}") if np.isfinite(value) else None


def _marker_errors(walk: Any, data: Path | None) -> dict[str, dict[str, float]]:
    from gaitval.inverse.inverse_kinematics import marker_errors
    from gaitval.mocap.mot import read_storage

    found = {}
    for method, kinematics in (("joint fit", walk.kinematics), ("marker pairs", walk.compared)):
        errors = marker_errors(kinematics)
        found[method] = {"rms": 100 * errors.whole_rms, "largest": 100 * errors.whole_largest}
    if data is None:
        return found
    theirs = read_storage(data / "wbds" / "raw" / "WBDS01walkT01_ik_marker_errors.sto")
    frames = len(theirs.time)
    for method, kinematics in (("joint fit", walk.kinematics), ("marker pairs", walk.compared)):
        apart = 100 * kinematics.marker_errors[:frames]
        by_frame = np.sqrt(np.nanmean(apart**2, axis=1))
        found[f"{method}, frames of the third party"] = {
            "rms": by_frame.mean(),
            "largest": np.nanmax(apart),
        }
    found["third party, OpenSim with a scaled Lai-Arnold model"] = {
        "rms": 100 * theirs.column("marker_error_RMS").mean(),
        "largest": 100 * theirs.column("marker_error_max").max(),
    }
    return found


def _events(found: Any, data: Path) -> list[dict[str, Any]]:
    """Events of the import, from force, minus the nearest other ones of the same foot and kind."""
    from gaitval.coordinates import SIDES
    from gaitval.gait.events import force_events, marker_events

    walk = found.trials[0]
    others = {
        "markers": marker_events(walk.recording, landmarks=found.session.marker_set.landmarks),
        "stored in the file": walk.recording.events,
    }
    from_force = force_events(walk.forces, found.processing)
    rows = []
    for source, events in others.items():
        for kind in ("heel_strike", "toe_off"):
            for side in SIDES:
                ours = np.array([e.time for e in from_force if (e.side, e.kind) == (side, kind)])
                theirs = np.array([e.time for e in events if (e.side, e.kind) == (side, kind)])
                if not len(ours) or not len(theirs):
                    continue
                apart = 1e3 * (ours[:, None] - theirs)
                nearest = apart[np.arange(len(ours)), np.abs(apart).argmin(axis=1)]
                nearest = nearest[np.abs(nearest) < 200.0]  # that one has no partner
                rows.append(
                    {
                        "against": source,
                        "event": f"{side} {kind.replace('_', ' ')}",
                        "count": len(nearest),
                        "mean": nearest.mean(),
                        "mean_absolute": np.abs(nearest).mean(),
                        "largest": np.abs(nearest).max(),
                    }
                )
    return rows


def _gait(walk: Any, data: Path | None) -> dict[str, dict[str, float | None]]:
    published: dict[str, float] = {}
    if data is not None:
        with (data / "wbds" / "h2a_allspeeds_43subs.csv").open(encoding="utf-8") as file:
            row = next(
                row
                for row in csv.DictReader(file)
                if row["Subject"] == "1" and row["SpeedCat"] == "V1"
            )
        published = {
            "speed": float(row["Speed"]),
            "cadence": float(row["Cadence"]),
            "step_length": float(row["StepLength"]),
        }
    summaries = {side: walk.gait[side].summary() for side in walk.gait}
    return {
        name: {
            **{side: summary[name][0] for side, summary in summaries.items()},
            "published": published.get(name),
        }
        for name in summaries["right"]
    }


def _opensim(found: Any, every: int) -> dict[str, Any]:
    """Our inverse kinematics and dynamics compared with OpenSim's, on the exported model."""
    import opensim
    from opensim_peer import inverse_dynamics_tool, inverse_kinematics_tool, read_table
    from opensim_peer import run as run_tool

    from claims.opensim_motion import read_motion
    from gaitval.configuration import Configuration, ContactSettings
    from gaitval.importing.files import FOLDER as EXPORT
    from gaitval.importing.write import write_import
    from gaitval.inverse.inverse_kinematics import inverse_kinematics
    from gaitval.opensim.coordinates import OPENSIM_COORDINATES, to_opensim
    from gaitval.opensim.motion import write_markers
    from gaitval.opensim.osim import write_osim

    walk, body = found.trials[0], found.body
    markers = [marker for marker in body.markers if marker.name in walk.recording.names]
    columns = [walk.recording.names.index(marker.name) for marker in markers]
    trial = replace(
        walk.recording.with_markers(
            [marker.name for marker in markers], walk.recording.markers[::every, columns]
        ),
        marker_rate=walk.recording.marker_rate / every,
    )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_import(folder, found, Configuration())
        files = folder / EXPORT
        write_markers(folder / "walk.trc", trial)
        straight = {"mtp_angle_r": 0.0, "mtp_angle_l": 0.0}
        write_osim(
            folder / "held.osim", body.model, markers, ContactSettings(), 0.8, locked=straight
        )
        cases = [
            ("as exported", files / "model.osim", {}, SHIPPED),
            ("as exported", files / "model.osim", {}, CONVERGED),
        ]
        if any("toes" in marker.segment for marker in markers):
            cases.append(("toes held straight", folder / "held.osim", straight, CONVERGED))
        angles = []
        for label, model, fixed, accuracy in cases:
            result = folder / "ik.mot"
            run_tool(
                inverse_kinematics_tool(
                    model, markers, folder / "walk.trc", result, accuracy=accuracy
                ),
                folder,
            )
            ours = inverse_kinematics(body.model, markers, trial.markers, fixed=fixed)
            _, theirs = read_motion(result)
            apart = to_opensim(ours.positions) - to_opensim(theirs)
            sizes = np.degrees(np.sqrt((apart**2).mean(axis=0)))
            shown = np.asarray(ours.determined.any(axis=0)) & ROTATIONS
            worst = int(np.where(shown, sizes, 0.0).argmax())
            more = _cost(body.model, markers, trial.markers, theirs) - _cost(
                body.model, markers, trial.markers, ours.positions
            )
            angles.append(
                {
                    "model": label,
                    "accuracy": accuracy,
                    "all_deg": np.sqrt((sizes[shown] ** 2).mean()),
                    "worst_deg": sizes[worst],
                    "coordinate": OPENSIM_COORDINATES[worst],
                    "frames_ours_fit_better": int((more > -1e-9).sum()),
                }
            )
        run_tool(
            inverse_dynamics_tool(
                files / "trial1_model.osim",
                files / "trial1_ik.mot",
                files / "trial1_external_loads.xml",
                folder / "id.sto",
            ),
            folder,
        )
        mine, their_moments = read_table(files / "trial1_id.sto"), read_table(folder / "id.sto")
    shares = {
        name: 100 * float(np.abs(values - their_moments[name])[INSIDE].max() / np.abs(values).max())
        for name, values in mine.items()
        if name.endswith("_moment")
        and not name.startswith("pelvis")
        and np.abs(values).max() > SMALLEST_PEAK
    }
    worst = max(shares, key=lambda name: shares[name])
    return {
        "version": opensim.GetVersion(),
        "frames": len(trial.markers),
        "angles": angles,
        "moments": {"worst_percent": shares[worst], "moment": worst},
    }


def _cost(model: Any, markers: Any, measured: Any, positions: Any) -> Any:
    """The cost that inverse kinematics minimises: weighted sum of squared distances, (T,) m²."""
    from gaitval.inverse.marked_body import marker_positions

    squared = ((marker_positions(model, markers, positions) - measured) ** 2).sum(axis=2)
    return np.nansum(squared * [marker.weight for marker in markers], axis=1)


# --- tables ------------------------------------------------------------------------------


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)]) + "\n"


def _paragraph(text: str) -> str:
    return textwrap.fill(text, 100, break_long_words=False, break_on_hyphens=False) + "\n"


def _number(value: float | None, digits: int = 3) -> str:
    return "–" if value is None else f"{value:.{digits}g}"


def _limits(figures: dict[str, Any]) -> str:
    from gaitval.metrics.recording_limits import state_of
    from gaitval.metrics.tolerances import load_registry

    known = {row.title: row.id for row in load_registry().tolerance}
    rows = []
    for row in figures["limits"]:
        title, _, target = row["name"].rpartition(" (")
        reduced = target == "made consistent)"
        state = state_of(known.get(title, ""), row["passed"], reduced=reduced)
        value, failed = _number(row["value"]), state == "FAILED"
        rows.append(
            [
                row["name"],
                f"**{value}**" if failed else value,
                f"{row['limit']:g} {row['unit']}",
                f"**{state}**" if failed else state,
            ]
        )
    return _table(["measure", "value", "at most", ""], rows)


def _opensim_lines(figures: dict[str, Any]) -> str:
    peer = figures["opensim"]
    frames = peer["frames"]
    rows = [
        [
            f"angles, model {found['model']}, OpenSim's accuracy {found['accuracy']:g}",
            f"{_number(found['all_deg'], 2)}° RMS",
            f"{_number(found['worst_deg'], 2)}° RMS ({found['coordinate']})",
            f"{found['frames_ours_fit_better']} of {frames}",
        ]
        for found in peer["angles"]
    ]
    moments = peer["moments"]
    share = f"{_number(moments['worst_percent'], 2)} % of the peak ({moments['moment']})"
    rows.append(["moments, from the exported files", "", share, ""])
    head = ["difference", "all coordinates", "largest", "frames in which ours fit at least as well"]
    return _table(head, rows)


def section(identifier: str, figures: dict[str, Any]) -> str:
    """The section of the page on one session."""
    source = SOURCES[identifier]
    consistent, anchoring = figures["consistent"], figures["anchoring_mm"]
    masses = ", ".join(f"{k} {v:.3f}" for k, v in consistent["mass_factors"].items())
    parts = [
        f"## {source['title']}\n",
        _paragraph(f"{source['citation']}. Licence: {source['licence']}."),
        "### Markers\n",
        _table(
            ["method", "RMS, cm", "largest, cm"],
            [
                [method, _number(errors["rms"]), _number(errors["largest"])]
                for method, errors in figures["marker_errors_cm"].items()
            ],
        ),
        _paragraph(
            f"Resting feet slide by {_number(anchoring['sliding_before'], 2)} mm (RMS) by the "
            f"markers alone, {_number(anchoring['sliding_after'], 2)} mm anchored, as in the joint "
            "fit above."
        ),
        "### Against published limits\n",
        _limits(figures),
        _paragraph(
            "Made consistent: the markers on the body move by "
            f"{_number(consistent['marker_change_rms_mm'], 2)} mm (RMS), "
            f"{_number(consistent['marker_change_largest_mm'], 2)} mm at most. Factors of the "
            f"masses: {masses}. The plates carry {100 * figures['weight_ratio']:.1f} % of the body "
            "mass that was given, over whole cycles."
        ),
        f"### Against OpenSim {figures['opensim']['version']}, the exported model\n",
        _opensim_lines(figures),
        _paragraph(
            f"Angles over {figures['opensim']['frames']} frames; both minimise the same weighted "
            "sum of squares within the same ranges, and where the angles differ OpenSim's sum is "
            "the larger: its optimiser stops short. Moments over all but five frames at each end, "
            "where its splines end otherwise, from the motion made consistent."
        ),
        "### Body\n",
        _table(
            ["length", "joint centres in standing, m", "joint fit, m", "standard error, mm"],
            [
                [
                    length["name"].replace("_", " "),
                    f"{length['prior']:.4f} ± {length['prior_sd']:.3f}",
                    f"{length['fitted']:.4f}",
                    _number(1e3 * length["standard_error"], 2),
                ]
                for length in figures["lengths_m"]
            ],
        ),
        _paragraph(
            "Factors of the marker pairs, as OpenSim's ScaleTool: "
            + ", ".join(f"{name} {factor:.4f}" for name, factor in figures["scale_factors"].items())
            + " (over the mean body of this stature)."
        ),
        "### Events from force, less others (ms)\n",
        _table(
            ["event", "against", "count", "mean", "mean size", "largest"],
            [
                [
                    row["event"],
                    row["against"],
                    str(row["count"]),
                    f"{row['mean']:+.1f}",
                    f"{row['mean_absolute']:.1f}",
                    f"{row['largest']:.1f}",
                ]
                for row in figures["events_ms"]
            ],
        ),
    ]
    if any(row["against"].startswith("stored") for row in figures["events_ms"]):
        parts.append(
            _paragraph(
                "The stored events are those of plates that were not zeroed. The right plate shows "
                "a downward force where no foot is on it, which makes its stored toe-offs early."
            )
        )
    parts += [
        "### Gait\n",
        _table(
            ["parameter (SI; cadence steps/min)", "right", "left", "published"],
            [
                [
                    name.replace("_", " "),
                    *(_number(row[k]) for k in ("right", "left", "published")),
                ]
                for name, row in figures["gait"].items()
            ],
        ),
    ]
    if "other_speed" in figures:
        parts += [
            "### The same person at another speed\n",
            _paragraph(
                "Mean curves of the import (0.49 m/s) less the dataset's own of this person (T05, "
                "1.21 m/s), less what people usually change between these speeds (Schwartz et al. "
                "2008, J Biomech 41:1639-1650, very slow less free). Means of both sides; degrees, "
                "Nm/kg."
            ),
            _table(
                ["curve", "RMS left", "mean left", "SD between people", "correlation of change"],
                [
                    [
                        title,
                        _number(change["rms"]),
                        _number(change["mean"], 2),
                        _number(change["between_people"]),
                        f"{change['correlation']:.2f}",
                    ]
                    for title, change in figures["other_speed"].items()
                ],
            ),
        ]
    return "\n".join(parts)


def page() -> str:
    """The whole page, from the stored figures."""
    sections = [
        section(identifier, json.loads((FOLDER / f"{identifier}.json").read_text("utf-8")))
        for identifier in IDENTIFIERS
    ]
    return "\n".join([TITLE, *sections])


def main() -> int:
    """Measure with --data; then write, or with --check compare, the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail if out of date")
    parser.add_argument("--data", type=Path, help="folder of the raw data: measure again")
    options = parser.parse_args()
    if options.data is not None:
        FOLDER.mkdir(parents=True, exist_ok=True)
        for identifier in IDENTIFIERS:
            figures = figures_of(identifier, options.data)
            text = json.dumps(figures, indent=1, ensure_ascii=False) + "\n"
            (FOLDER / f"{identifier}.json").write_text(text, encoding="utf-8")
    path, text = FOLDER / "README.md", page()
    if options.check:
        if not path.exists() or path.read_text("utf-8") != text:
            sys.stderr.write(
                f"{path}: does not match the figures. Run docs/build/recording_tables.py\n"
            )
            return 1
        return 0
    path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
