"""How far from the reference towards the record a correction should aim.

    python -m experiments.correction_target --from PATH    # half an hour; goes on

People of public recordings with the plates of both feet, none of whom is in a table of walks, walk
with the general policy after a correction with each of `SHARES` of the way: once fitted to what
they measured, and once to the estimate of somebody without plates; and without any correction.
Errors against what they measured are means over four start phases that no correction has seen.
Beside them is kept how much worse the pelvis's angles get, which no correction looks at, and the
share of each correction that is used. PATH has the clones (`evidence/README.md`); results are kept
in `reports/general/correction_target.json`, and docs/learning.md has the table.
"""

import argparse
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from evidence import ROOT
from evidence.fit import _subject_of
from evidence.marked_table import with_table
from gaitval.arrays import Array
from gaitval.artefacts import read_json, versions, write_json, write_text
from gaitval.configuration import Configuration, RecordSettings
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.errors import GaitvalError
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.record import GaitRecord
from gaitval.lanes import WIDTH
from gaitval.learning_control import correct as rules
from gaitval.metrics.comparison import curves_of, rms
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.record_results import Kind
from gaitval.metrics.recorded import by_kind
from gaitval.model.body import BodyModel
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.rollouts import record_together
from gaitval.policy.walking_group import WalkingGroup
from gaitval.prediction.deviations import kinetics_of
from gaitval.prediction.known import told
from gaitval.prediction.normal_form import normal_form
from gaitval.prediction.seen import at_own_contacts
from gaitval.reference.adjustment import adjusted
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.walker import WalkingTask
from gaitval.study.estimate_stage import ESTIMATE_ACCURACY, of_known, with_kinetics
from gaitval.study.stored_policy import general_walker

STORE: Final = ROOT / "reports" / "general" / "correction_target.json"
PAGE: Final = ROOT / "docs" / "learning.md"
SHARES: Final = (0.0, 0.3, 0.5, 1.0)
STARTS: Final = (0.1, 0.35, 0.6, 0.85)
CYCLES: Final = 12
LEG: Final = ("hip_flexion", "knee_angle", "ankle_angle")
GROUPS: Final[Mapping[str, tuple[Kind, Sequence[str]]]] = {
    "angles": ("angles", LEG),
    "hip moment": ("moments", LEG[:1]),
    "knee moment": ("moments", LEG[1:2]),
    "ankle moment": ("moments", LEG[2:]),
    "vertical force": ("forces", ("vertical",)),
    "fore-aft force": ("forces", ("forward",)),
    "medial force": ("forces", ("medial",)),
    "pelvis": ("angles", ("pelvis_tilt", "pelvis_list", "pelvis_rotation")),
}
NONE: Final = "none"
"""In the place of a share of the way: the walk that is not corrected."""
BESIDE: Final = "pelvis's angles worse by (deg), share of the correction that is used"
Json = dict[str, Any]


def _error(ours: Mapping[str, Array], wanted: Mapping[str, Array], names: Sequence[str]) -> float:
    both = [f"{name}_{side}" for name in names for side in "rl"]
    return float(np.mean([rms(ours[each].mean(axis=0) - wanted[each]) for each in both]))


def walked(
    model: BodyModel, asked: GaitRecord, accuracy: RecordAccuracy | None, truth: GaitRecord
) -> dict[str, list[float]]:
    """Errors of `GROUPS` of the walks of a body, by the share of the way to the record that is
    `asked` of it with an accuracy, against what was measured.
    """
    configuration = Configuration()
    training = configuration.training.model_copy(update={"workers": 1})
    configuration = configuration.model_copy(update={"training": training})
    task = WalkingTask.of(model, asked, configuration, accuracy)
    policy, mu = general_walker(configuration.environment), nominal_parameters()
    wanted = by_kind(recorded_curves(truth))
    found = {}
    for share in (None, *SHARES):
        changed = task.reference
        if share is not None:
            corrected = rules.correct(task, policy, mu, asked=asked, to_record=share)
            changed = adjusted(changed, task.reference_body, corrected.correction)
            if corrected.before and corrected.after:
                worse = corrected.after.left_out() - corrected.before.left_out()
                found[f"{share:g}, {BESIDE}"] = [worse, corrected.share]
        group = WalkingGroup([WalkingTask(model, asked, changed, configuration)] * WIDTH)
        rollouts = record_together(
            group, policy, mu=mu, start_phases=STARTS,
            cycles=configuration.validation.settling_cycles + CYCLES + 2,
        )  # fmt: skip
        errors = []
        for rollout in rollouts:
            cycles = find_cycles(rollout, configuration).first(CYCLES)
            ours = by_kind(curves_of(task, rollout, cycles))
            errors.append([_error(ours[kind], wanted[kind], n) for kind, n in GROUPS.values()])
        found[NONE if share is None else f"{share:g}"] = np.mean(errors, axis=0).tolist()
    return found


def one(clones: Path, recording: Json) -> Json | None:
    """Of one recording; None without the plates of both feet."""
    try:
        full = _subject_of(recording, clones)
        known = _subject_of(recording | {"kinematics_only": True, "forces": None}, clones)
    except GaitvalError as error:
        print(f"{recording['name']}: {error}", flush=True)
        return None
    if full.gait.not_recorded:
        return None
    record, model = full.record(), scale_subject(known).model
    usual = told(known, RecordSettings(), builtin_subjects())
    estimate = of_known(usual, known, model, Configuration().contact).kinetics
    own = kinetics_of(normal_form(record, full.leg_length_m))
    return {
        "name": recording["name"],
        "laboratory": recording["laboratory"],
        "fitted": walked(scale_subject(full).model, record, None, record),
        "estimated": walked(
            model,
            with_kinetics(at_own_contacts(usual.record, known), known, estimate),
            ESTIMATE_ACCURACY,
            with_kinetics(usual.record, known, own),
        ),
    }


def table(people: Sequence[Json]) -> str:
    """Errors over those of walks that aim at the reference, geometric means over the people."""
    lines = [
        f"| way to the record | {' | '.join(GROUPS)} |",
        "|---|" + "---|" * len(GROUPS),
    ]
    for kind, noun in (("fitted", "own kinetics"), ("estimated", "the estimate's")):
        plain = np.array([each[kind]["0"] for each in people])
        for share in (NONE, *map("{:g}".format, SHARES[1:])):
            ratios: Array = np.log(np.array([each[kind][share] for each in people]) / plain)
            sd = ratios.std(axis=0, ddof=1) / np.sqrt(len(people))
            cells = [
                f"{np.exp(mean):.3f} ± {each:.3f}"
                for mean, each in zip(ratios.mean(axis=0), sd, strict=True)
            ]
            way = "no correction" if share == NONE else f"{share} of it"
            lines.append(f"| {way}, {noun} | {' | '.join(cells)} |")
    beside = [
        values
        for each in people
        for kind in ("fitted", "estimated")
        for name, values in each[kind].items()
        if name.endswith(BESIDE)
    ]
    worse, used = np.array(beside).T
    lines += [
        "",
        f"Of these {len(used)} corrections {np.sum(used == 1.0)} were used whole. The pelvis's "
        f"angles got worse by {np.percentile(worse, 95):.2f}° in 95 %, at most {worse.max():.2f}°.",
    ]
    return "\n".join(lines)


def main() -> None:
    """Command line; see the module's docstring."""
    from evidence.measurement.faults import SAMPLE, _recordings

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--from", dest="clones", type=Path, required=True)
    arguments = parser.parse_args()
    people = read_json(STORE)["people"] if STORE.exists() else []
    done = {each["name"] for each in people}
    left = [
        each for each in _recordings()
        if each is not SAMPLE and "WBDS" not in each["laboratory"] and each["name"] not in done
    ]  # fmt: skip
    with ProcessPoolExecutor(2) as pool:
        for found in pool.map(partial(one, arguments.clones), left):
            if found is not None:
                people.append(found)
                write_json(STORE, {"versions": versions(), "people": people})
                print(f"{len(people)}: {found['name']}", flush=True)
    text = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, with_table(text, "correction-target", table(people)))


if __name__ == "__main__":
    main()
