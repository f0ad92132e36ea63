"""What `gaitval judge` finds on OpenSim's own models.

Needs the opensim wheel (extra `dev`). The folder has neither a scaled model nor results, so
OpenSim's tools make them from its set-ups (`opensim_pipeline`), from both generic models. Their
logs say, frame by frame, the RMS and the largest marker error of inverse kinematics, and the
generalised forces at the pelvis; `judge` works both out without OpenSim.
"""

import tempfile
from pathlib import Path

import numpy as np

import claims
from claims import Claim
from experiments import opensim_pipeline
from gaitval.apps.judge.judge import Judgement, judge
from gaitval.apps.judge.markers import logged_errors
from gaitval.apps.judge.request import JudgeRequest
from gaitval.metrics.tolerances import evaluate, measured
from gaitval.mocap.mot import read_storage
from gaitval.scaling.opensim.placing import marker_places, place

MODELS = ("Rajagopal2016.osim", "RajagopalLaiUhlrich2023.osim")
MASS, HEIGHT = 85.0668, 1.829
"""kg and m, of the person in the scaling set-up."""
FORCES = ("pelvis_tx_force", "pelvis_ty_force", "pelvis_tz_force")


@claims.measured("data")
def models(given: claims.Given) -> list[Claim]:
    """What `gaitval judge` finds on OpenSim's own models, against OpenSim's log and results."""
    judged = []
    with tempfile.TemporaryDirectory() as temporary:
        for generic in MODELS:
            folder = Path(temporary) / Path(generic).stem
            folder.mkdir()
            results = opensim_pipeline.run_pipeline(
                given.data / "opensim_rajagopal", generic, folder
            )
            judged.append((results, _judged(results)))
            _say(generic, judged[-1][1])
        return _rows(judged)


def _judged(results: opensim_pipeline.PipelineFiles) -> Judgement:
    return judge(
        JudgeRequest(
            model=results.model,
            ik=results.motion,
            id=results.moments,
            markers=results.markers,
            marker_errors=results.marker_errors,
            ik_setup=results.setup,
            external_loads=results.loads,
            mass=MASS,
            height=HEIGHT,
        )
    )


def _say(generic: str, found: Judgement) -> None:
    print(f"{generic}: {len(found.failed)} limits not kept")
    for verdict in found.failed:
        print(f"  {verdict.title}, {verdict.target}: {verdict.value:.3g}")


def _rows(judged: list[tuple[opensim_pipeline.PipelineFiles, Judgement]]) -> list[Claim]:
    apart, frames, newtons, samples, placed, places, wrong, verdicts = 0.0, 0, 0.0, 0, 0.0, 0, 0, 0
    for results, found in judged:
        assert found.log_difference is not None
        apart = max(apart, 1000 * found.log_difference[0])
        frames += found.log_difference[1]
        table = read_storage(results.moments)
        assert found.residual_curves is not None
        theirs = np.column_stack([table.column(name) for name in FORCES])
        tilt = table.column("pelvis_tilt_moment")
        _, force, moment = found.residual_curves
        newtons = max(newtons, np.abs(force - theirs).max(), np.abs(moment[:, 2] - tilt).max())
        samples += len(force)
        distance, count = _places(results, found)
        placed, places = max(placed, 1000 * distance), places + count
        differ, count = _verdicts(results, found)
        wrong, verdicts = wrong + differ, verdicts + count
    kind = "judge on the OpenSim models in ../shared/data/opensim_rajagopal: "
    return [
        Claim(
            f"{kind}RMS and largest marker error of a frame, largest difference from the IK log",
            apart,
            "mm",
            frames,
        ),
        Claim(
            f"{kind}residual force and tilting moment, largest difference from the ID results",
            newtons,
            "N, Nm",
            samples,
        ),
        Claim(
            f"{kind}places of markers, largest difference from the wheel's", placed, "mm", places
        ),
        Claim(
            f"{kind}limits of marker errors judged otherwise than by the log",
            wrong,
            "limits",
            verdicts,
        ),
    ]


def _places(results: opensim_pipeline.PipelineFiles, found: Judgement) -> tuple[float, int]:
    """Largest distance, m, of markers from where the wheel has them, and their number."""
    import opensim

    peer = opensim.Model(str(results.model))
    coordinates = peer.updCoordinateSet()
    for i in range(coordinates.getSize()):
        coordinates.get(i).set_clamped(False)
        coordinates.get(i).set_locked(False)
    state = peer.initSystem()
    assert found.motion is not None
    names = [marker.name for marker in found.model.markers]
    ours = marker_places(found.model, place(found.model, found.motion.values), names)
    worst = 0.0
    for frame in range(0, len(found.motion.time), 10):
        for i in range(coordinates.getSize()):
            one = coordinates.get(i)
            one.setValue(state, float(found.motion.values[one.getName()][frame]), False)
        peer.realizePosition(state)
        theirs = [
            peer.getMarkerSet().get(name).getLocationInGround(state).to_numpy() for name in names
        ]
        worst = max(worst, float(np.linalg.norm(ours[frame] - theirs, axis=1).max()))
    return worst, len(names) * len(range(0, len(found.motion.time), 10))


def _verdicts(results: opensim_pipeline.PipelineFiles, found: Judgement) -> tuple[int, int]:
    """Limits of marker errors that the log's own figures keep and ours do not, or the reverse."""
    log = logged_errors(results.marker_errors)
    theirs = evaluate(
        [
            measured("ik_marker_rms", "trial", 100 * log.whole_rms),
            measured("ik_marker_largest", "trial", 100 * log.whole_largest),
        ]
    )
    ours = {verdict.id: verdict.passed for verdict in found.verdicts()}
    return sum(ours[v.id] != v.passed for v in theirs), len(theirs)
