"""OpenSim's own tools on the walk of `../shared/data/opensim_rajagopal`: scale, IK, ID.

The folder has generic models, markers, forces and set-ups, but neither a scaled model nor results
nor logs: `run_pipeline` makes them with the opensim wheel as the set-ups say, in a folder of its
own. Where the set-ups name files that are not there (`generic_unscaled.osim`, a model after RRA),
the model and the motion of this run take their place, and inverse dynamics takes the whole trial.
"""

import re
import shutil
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from typing import Final

CUTOFF_HZ: Final = 6.0
"""Of the coordinates in inverse dynamics: that of the set-up's external loads."""


@dataclass(frozen=True)
class PipelineFiles:
    """The files of one run.

    Attributes
    ----------
    model : scaled.
    setup, motion, marker_errors : of inverse kinematics, with the log's error of every frame.
    loads, moments : of inverse dynamics.
    log : what the tools said.
    """

    model: Path
    markers: Path
    setup: Path
    motion: Path
    marker_errors: Path
    loads: Path
    moments: Path
    log: Path


def run_pipeline(data: Path, generic: str, folder: Path) -> PipelineFiles:
    """Scale a generic model to the person, then inverse kinematics and dynamics of the walk.

    Parameters
    ----------
    data : `opensim_rajagopal`.
    generic : name of a model in it.
    folder : empty; the files are written there.
    """
    import opensim

    for part in ("ExpData", "IK", "ID", "Scale"):
        shutil.copytree(data / part, folder / part)
    shutil.copy(data / generic, folder / "generic_unscaled.osim")
    log = folder / "opensim.log"
    opensim.Logger.removeFileSink()
    opensim.Logger.addFileSink(str(log))
    opensim.Logger.setLevelString("Info")
    try:
        with chdir(folder / "Scale"):
            _must(opensim.ScaleTool("scale_setup_walk_scaleOnly.xml").run(), "scaling")
        # The tool does not make the folder before it writes the motion.
        (folder / "IK/results_walk").mkdir()
        with chdir(folder / "IK"):
            tool = opensim.InverseKinematicsTool("ik_setup_walk.xml")
            tool.set_report_errors(True)
            _must(tool.run(), "inverse kinematics")
        _inverse_dynamics(folder)
    finally:
        opensim.Logger.removeFileSink()
    return PipelineFiles(
        model=folder / "Scale/subject_scaled_walk.osim",
        markers=folder / "ExpData/motion_capture_walk.trc",
        setup=folder / "IK/ik_setup_walk.xml",
        motion=folder / "IK/results_walk/ik_output_walk.mot",
        marker_errors=_only(folder / "IK", "*marker_errors.sto"),
        loads=folder / "ID/grf_walk.xml",
        moments=_only(folder / "ID", "inverse_dynamics.sto"),
        log=log,
    )


def _inverse_dynamics(folder: Path) -> None:
    import opensim

    setup = folder / "ID/id_setup_walk.xml"
    text = setup.read_text()
    for tag, value in (
        ("model_file", "../Scale/subject_scaled_walk.osim"),
        ("coordinates_file", "../IK/results_walk/ik_output_walk.mot"),
        ("lowpass_cutoff_frequency_for_coordinates", f"{CUTOFF_HZ:g}"),
        ("time_range", "0 2.37"),
    ):
        text, count = re.subn(f"(<{tag}>).*?(</{tag}>)", rf"\g<1>{value}\g<2>", text)
        _must(count == 1, f"rewriting {tag}")
    setup.write_text(text)
    with chdir(folder / "ID"):
        _must(opensim.InverseDynamicsTool(setup.name).run(), "inverse dynamics")


def _only(folder: Path, pattern: str) -> Path:
    found = sorted(folder.rglob(pattern))
    _must(len(found) == 1, f"one {pattern} in {folder}, not {len(found)}")
    return found[0]


def _must(done: bool, what: str) -> None:
    if not done:
        raise SystemExit(f"OpenSim failed: {what}")
