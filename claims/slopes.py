"""Walks on slopes and with loads, predicted from level records, against published people.

Every walk is that of a stored policy, untrained for the slope, on a reference that is fitted to
what is expected there (`gaitval.prediction.slopes`). What a slope changes is told from the walk on
the level by the same route. What is known is kept below `work`, so that a run which was stopped
goes on.
"""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import claims
from claims.rows import STARTED

if TYPE_CHECKING:
    from gaitval.configuration import RecordSettings
    from gaitval.simulation.walker import WalkingTask
    from gaitval.study.stored_policy import StoredPolicy

TEN: Final = tuple(range(1, 11))
STRIDES: Final = 102.0
"""Cycles of a walk, so that 100 whole ones are among them."""
CONDITIONS: Final = {
    "level": (0.0, 0.0),
    "up_5": (5.0, 0.0),
    "down_5": (-5.0, 0.0),
    "up_10": (10.0, 0.0),
    "down_10": (-10.0, 0.0),
    "load_20": (0.0, 20.0),
    "load_30": (0.0, 30.0),
    "load_10": (0.0, 10.0),
    "up_5_load_20": (5.0, 20.0),
}
"""Slope, % and load, % of body mass."""
COSTED: Final = ("level", "load_10", "load_20", "load_30", "up_5", "up_5_load_20")
"""Those whose metabolic rate was measured (Silder et al.)."""
_CURVES: Final = ("hip_flexion", "knee_angle", "ankle_angle")


def _task(policy: "StoredPolicy", settings: "RecordSettings") -> "WalkingTask":
    """The walk that is predicted of the person of a `policy`, on their identified body."""
    from gaitval.prediction.slopes import ON_A_SLOPE, body_on, on_ground
    from gaitval.simulation.walker import WalkingTask
    from gaitval.study.inputs import target_record
    from gaitval.study.stage import Run

    run = Run(policy.folder, policy.subject, policy.configuration)
    record = on_ground(target_record(run, policy.model).record, settings)
    body = body_on(policy.identified_model, settings)
    return WalkingTask.of(body, record, policy.configuration, ON_A_SLOPE, mu=policy.identified)


def _walk(policy: "StoredPolicy", name: str) -> dict[str, Any]:
    """What is kept of a walk in the condition `name`."""
    from gaitval.configuration import RecordSettings
    from gaitval.coordinates import SIDES
    from gaitval.metrics.comparison import low_pass_of, simulated_curves
    from gaitval.metrics.cycles import find_cycles
    from gaitval.metrics.momentum import momentum_residual
    from gaitval.metrics.torques import energy_of
    from gaitval.metrics.walk_muscles import walk_motion
    from gaitval.model.parameters import apply_parameters
    from gaitval.musculature.gait import muscles_of
    from gaitval.policy.environment import WalkingEnvironment
    from gaitval.policy.rollouts import record_rollout
    from gaitval.prediction.slopes import ground_of
    from gaitval.quantities.metabolic_cost import metabolic_cost

    slope, load = CONDITIONS[name]
    settings = RecordSettings(slope=slope, load=load)
    task = _task(policy, settings)
    walk = record_rollout(
        WalkingEnvironment(task), policy.network, mu=policy.identified, start_phase=0.0,
        cycles=STRIDES,
    )  # fmt: skip
    found: dict[str, Any] = {"fell": bool(walk.fell[0]), "cycles": float(walk.phase[-1])}
    found["momentum"] = momentum_residual(walk, task.model.mass, ground_of(settings))
    cycles = find_cycles(walk, task.configuration).first(24)
    if min(cycles.count(side) for side in SIDES) == 0:
        return found
    found["energy"] = energy_of(walk, cycles, task.model)
    rows = cycles.rows()
    step = float(walk.time[1] - walk.time[0])
    power = walk.moments[rows] * walk.velocities[rows, 6:]
    strides = cycles.count("right")
    found["work"] = float(np.abs(power).sum() * step / (task.model.mass * strides))
    distance = walk.centre_of_mass[rows.stop, 0] - walk.centre_of_mass[rows.start, 0]
    found["stride_length"] = float(distance / strides)
    found["speed"] = float(distance / ((rows.stop - rows.start) * step))
    mass = policy.identified_model.mass
    filters = low_pass_of(task.record, task.configuration.validation.filter_frequency)
    curves = simulated_curves(walk, cycles, mass=mass, filters=filters)
    for joint in _CURVES:
        for kind in ("moments", "angles"):
            both = [getattr(curves, kind)[f"{joint}_{side}"].mean(axis=0) for side in "rl"]
            found[f"{kind}_{joint}"] = np.mean(both, axis=0).round(5).tolist()
    if name in COSTED:
        person = apply_parameters(policy.identified_model, policy.identified)
        motion = walk_motion(
            walk, cycles, person, height=policy.subject.height_m,
            laden=apply_parameters(task.model, policy.identified),
        )  # fmt: skip
        cost = metabolic_cost([motion], muscles_of([motion]))
        assert cost is not None
        found["gross"] = dict(cost.gross)
    return found


def _person(number: int, path: Path) -> dict[str, Any]:
    import gaitval

    found: dict[str, Any] = json.loads(path.read_text("utf-8")) if path.is_file() else {}
    lacking = [name for name in CONDITIONS if name not in found]
    if lacking:
        policy = gaitval.load_policy(number)
        for name in lacking:
            found[name] = _walk(policy, name)
            path.write_text(json.dumps(found), encoding="utf-8")
            kept = {key: value for key, value in found[name].items() if "_" not in key}
            print(number, name, kept, flush=True)
    return found


def _all(given: claims.Given) -> dict[int, dict[str, Any]]:
    folder = given.work / f"slopes-{STARTED}"
    folder.mkdir(parents=True, exist_ok=True)
    return {number: _person(number, folder / f"{number}.json") for number in TEN}
