"""What the paper's figures are drawn from: walks of a stored policy, and stored results."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from experiments.foot_placement import PEOPLE, people_of
from gaitval._internal.io.artefacts import read_json
from gaitval.arrays import Array
from gaitval.metrics.comparison import curves_of
from gaitval.metrics.curve_results import by_kind
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.push_recovery import Push, Trace, trace_of, trials, without_drift
from gaitval.metrics.results import PlacedFoot
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.study.stored_policy import StoredPolicy
from gaitval.walk.reference.adjustment import adjusted
from gaitval.walk.reference.motion import ReferenceMotion
from gaitval.walk.simulation.walker import WalkingTask

ROOT = Path(__file__).resolve().parents[2]
REPORTS = ROOT / "reports"
ABLATION = REPORTS / "identification" / "ablation.json"

RL, IDENTIFIED, FINAL = "RL", "RL + identification", "RL + identification + correction"
"""The body as scaled; as identified; as identified, on the corrected reference."""

WINTER = "Winter 2009, one person"
WINTER_MASS = 56.7
"""kg, of the person of appendix A (Winter 2009, Biomechanics and Motor Control of Human Movement,
table A.1 ff.)."""

PaperCurves = Mapping[str, Mapping[str, Array]]


@dataclass(frozen=True)
class Simulated:
    """What was simulated for the figures of one person.

    Attributes
    ----------
    walks : cycles (n, 101) of each of `RL`, `IDENTIFIED`, `FINAL`, by kind and curve, in the units
        of `metrics.json`.
    traces : of pushes ahead, one for each phase.
    reference : of the body as scaled, for the picture of the model.
    model : that body.
    placed : where the feet of a young person and two old ones land after pushes to the side.
    """

    walks: Mapping[str, PaperCurves]
    traces: Sequence[Trace]
    reference: ReferenceMotion
    model: Any
    placed: Mapping[str, Sequence[PlacedFoot]]


def walked(task: WalkingTask, policy: StoredPolicy, mu: Array, cycles: int) -> PaperCurves:
    """Cycles of a walk of a stored policy."""
    settling = task.configuration.validation.settling_cycles
    rollout = record_rollout(
        WalkingEnvironment(task), policy.network, mu=mu, start_phase=0.0,
        cycles=settling + cycles + 2,
    )  # fmt: skip
    found = find_cycles(rollout, task.configuration).first(cycles)
    return by_kind(curves_of(task, rollout, found))


def simulated(
    baseline: Path,
    *,
    cycles: int | None = None,
    phases: int = 4,
    people: Sequence[str] = PEOPLE,
) -> Simulated:
    """Let a stored policy walk before and after identification, and push it.

    Parameters
    ----------
    cycles : of each walk; those of a validation by default.
    phases : how many of the configured ones are pushed at.
    people : whose feet are compared after pushes.
    """
    policy = StoredPolicy.load(baseline)
    as_scaled, settings = policy.task, policy.configuration
    count = settings.validation.cycles if cycles is None else cycles
    if np.array_equal(policy.identified[2:], policy.nominal[2:]):
        identified = as_scaled
    else:
        record, body = policy.subject.record(), policy.identified_model
        identified = WalkingTask.of(body, record, settings, mu=policy.identified)
    reference = adjusted(identified.reference, identified.reference_body, policy.correction)
    corrected = replace(identified, reference=reference)
    pushed = without_drift(corrected)
    pushes = [Push(phase, 0.0, settings.pushes.force) for phase in settings.pushes.phases[:phases]]
    environment = WalkingEnvironment(pushed, engine="dart")
    return Simulated(
        walks={
            RL: walked(as_scaled, policy, policy.nominal, count),
            IDENTIFIED: walked(identified, policy, policy.identified, count),
            FINAL: walked(corrected, policy, policy.identified, count),
        },
        traces=[
            trace_of(environment, trial)
            for trial in trials(pushed, policy.network, policy.identified, pushes)
        ],
        reference=as_scaled.reference,
        model=policy.model,
        placed=people_of(people),
    )


def stored() -> dict[str, dict[str, Any]]:
    """Metrics of all stored baselines by subject."""
    return {
        path.parent.parent.name: read_json(path)
        for path in sorted(REPORTS.glob("S*/baseline/metrics.json"))
    }


def ablation(subject: str) -> dict[str, dict[str, list[dict[str, float]]]]:
    """Errors by way of scaling and by `RL` or `IDENTIFIED`, one entry a seed, in the same order."""
    walks = read_json(ABLATION)["walks"]
    found: dict[str, dict[str, list[dict[str, float]]]] = {}
    for body in ("stature", "markers"):
        seeds = sorted(
            int(key.split()[2])
            for key in walks
            if key.startswith(f"{subject} {body} ") and key.endswith(" nominal")
        )
        found[body] = {
            name: [walks[f"{subject} {body} {seed} {which}"] for seed in seeds]
            for name, which in ((RL, "nominal"), (IDENTIFIED, "identified"))
        }
    return found


def winter(data: Path | None) -> tuple[Array, Array] | None:
    """Winter's hip angle (deg) and moment (Nm/kg), (101,) each, flexion positive; None without
    `normative/Winter_Appendix_data.xlsx` in the data folder.

    His tables carry no licence and are not shipped.
    """
    path = None if data is None else data / "normative" / "Winter_Appendix_data.xlsx"
    if path is None or not path.is_file():
        return None
    import openpyxl

    book = openpyxl.load_workbook(path, data_only=True, read_only=True)

    def column(sheet: str, index: int) -> Array:
        """One quantity from the right heel contact to the next; rows have a state and a time."""
        rows = [row for row in book[sheet].iter_rows(values_only=True) if _frame(row)]
        contacts = [i for i, row in enumerate(rows) if row[0] == "HCR"]
        if len(contacts) != 2:
            raise ValueError(f"{path}, {sheet}: {len(contacts)} right heel contacts, not 2.")
        values = [_number(row[index]) for row in rows[contacts[0] : contacts[1] + 1]]
        at = np.linspace(0.0, 100.0, len(values))
        return np.interp(np.arange(101), at, values)

    angle = column("A4.RelJointAngularKinematics", 9)
    moment = column("A5.ReactionForces&Moments", 23) / WINTER_MASS
    return angle, moment


def _frame(row: Sequence[Any]) -> bool:
    """Whether a row of Winter's tables is a frame."""
    return isinstance(row[1], int) and isinstance(row[2], int | float)


def _number(value: Any) -> float:
    return float(value.replace("−", "-")) if isinstance(value, str) else float(value)
