"""A run folder as the stages leave it, but for walks made from the record; for tests of reports."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from synthetic_walk import perfect_walk, sharp_filter, walks_of
from unrecorded_verdicts import CASES

from gaitval._internal.io.artefacts import write_json
from gaitval.gait.record import GaitRecord
from gaitval.metrics.other_trials import predicted_curves, with_predicted
from gaitval.metrics.results import (
    CorrectionResult,
    IdentificationResult,
    StoredPushes,
)
from gaitval.metrics.validation import StageResults, validate
from gaitval.model.body import BodyModel
from gaitval.model.urdf import write_urdf
from gaitval.scaling.scaling import scale_subject
from gaitval.study.stage import Run
from gaitval.subjects.prediction.known import is_predicted
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import builtin_subjects, load_subject
from gaitval.walk.reference.adjustment import JOINTS, Adjustment
from gaitval.walk.reference.motion import build_reference
from gaitval.walk.simulation.rollout import Rollout

PHASES = (0.0, 0.5)


_WRITTEN: dict[str, dict[str, bytes]] = {}
"""By the text of a person's file: the files that scaling and the reference write."""
_WALKED: dict[tuple[str, float], Rollout] = {}
"""By the text of a person's file and the first phase: the walk that is the record's."""


def _scaled(subject: Subject, key: str, folder: Path) -> BodyModel:
    """The body of a person; its files in the folder. They take a second, so every further run of
    the same person gets copies."""
    body = scale_subject(subject)
    names = ("model.urdf", "scaling.csv", "reference.npz")
    if key not in _WRITTEN:
        write_urdf(body.model, folder / "model.urdf")
        body.frame().to_csv(folder / "scaling.csv", index=False)
        build_reference(subject.record(), body.model).save(folder / "reference.npz")
        _WRITTEN[key] = {name: (folder / name).read_bytes() for name in names}
    for name, written in _WRITTEN[key].items():
        (folder / name).write_bytes(written)
    return body.model


def _exact_walk(record: GaitRecord, key: str, phase: float) -> Rollout:
    """The walk that a record says, once for each person; nobody changes its arrays."""
    if (key, phase) not in _WALKED:
        _WALKED[key, phase] = perfect_walk(record, cycles=9.0, start_phase=phase)
    return _WALKED[key, phase]


def _imperfect(walk, seed: int, size: float):
    """The walk with smooth errors that differ from cycle to cycle."""
    random = np.random.default_rng(seed)
    phase = walk.phase[:, None]

    def wander(columns: int) -> np.ndarray:
        shift = random.uniform(0, 2 * np.pi, (2, columns))
        within = np.sin(2 * np.pi * phase + shift[0])
        return within + 0.4 * np.sin(2 * np.pi * 0.37 * phase + shift[1])

    positions = walk.positions.copy()
    positions[:, 6:] += np.deg2rad(3.0 * size) * wander(25)
    ground = walk.ground_reaction * (1 + 0.08 * size * wander(1))[..., None]
    return replace(
        walk,
        positions=positions,
        moments=walk.moments + 8.0 * size * wander(25),
        ground_reaction=ground,
    )


def _identification() -> dict:
    names = [
        *("damping", "friction", "foot_length", "shank_length", "thigh_length"),
        *(f"{joint}_{axis}" for joint in ("ankle", "hip", "knee") for axis in "xyz"),
    ]
    nominal = [0.5, 0.8, 1.0, 1.0, 1.0, *[0.0] * 9]
    half = [0.5, 0.2, 0.05, 0.03, 0.03, *[0.01] * 9]
    share = np.linspace(-0.9, 1.0, 14)
    found = [n + h * s for n, h, s in zip(nominal, half, share, strict=True)]
    leg = {"prior_standard_deviation": 0.02, "mean": 0.0105, "standard_deviation": 0.005}
    correlation = np.eye(14)
    correlation[3, 4] = correlation[4, 3] = -0.62
    return {
        "names": names,
        "nominal": nominal,
        "identified": [*nominal[:3], *found[3:5], *nominal[5:13], found[13]],
        "prior_standard_deviation": half,
        "posterior_mean": found,
        "standard_deviation": [0.2 * h for h in half],
        "verdicts": [
            *["not identified"] * 3,
            "identified",
            "weak",
            *["not identified"] * 8,
            "at its bound",
        ],
        "correlation": correlation.tolist(),
        "combinations": [{"name": "leg length, thigh + shank", **leg, "verdict": "identified"}],
        "plates": [0.004, -0.002],
        "deviance_nominal": 151.25,
        "deviance_identified": 139.0,
        "converged": True,
        "search_distance": 0.1,
        "lower": [n - h for n, h in zip(nominal, half, strict=True)],
        "upper": [n + h for n, h in zip(nominal, half, strict=True)],
        "on_bound": [bool(s == 1.0) for s in share],
        "epsilon_nominal": None,
        "epsilon_identified": None,
        "history": [{"generation": 0, "best": 0.8123, "sigma": 0.2}],
        "rounds": [
            {
                "round": 1,
                "epsilon": {"angles": 0.1, "moments": 0.2, "forces": 0.1, "total": 0.4},
                "epsilon_nominal": None,
                "scatter": 0.0123,
                "floor": 0.3478,
            }
        ],
    }


def _correction() -> dict:
    """As `gaitval stage correct` writes it."""
    harmonics = np.zeros((len(JOINTS), 3))
    harmonics[JOINTS.index("knee_angle_l")] = np.deg2rad([-1.25, 0.5, 0.0])
    rows = [
        ("angles", "knee_angle_l", True, 2.6, 1.4),
        ("angles", "ankle_angle_l", True, 1.9, 1.8),
        ("angles", "pelvis_list_r", False, 0.7, 0.75),
        ("forces", "vertical_r", True, 3.0, 2.0),
    ]
    keys = ("kind", "curve", "fitted", "before", "after")
    return {
        **Adjustment(harmonics, -0.0021).as_dict(),
        "errors": [0.95, 0.8, 0.71],
        "numbers": 170,
        "effective_number": 101.6,
        "refused": None,
        "curves": [dict(zip(keys, row, strict=True)) for row in rows],
    }


def _pushes() -> dict:
    """Recovery as `gaitval stage push` writes it; one push of 300 N at phase 0.5 ends in a fall."""
    directions = [0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0, -150.0, -120.0, -90.0, -60.0, -30.0]
    largest = [[500.0 + 25.0 * i for i in range(12)], [1200.0 - 75.0 * i for i in range(12)]]
    ahead = [each for each in directions if abs(each) <= 90.0]
    cycles = np.linspace(-1.0, 5.0, 200)
    velocity = np.column_stack([1.1 + 0.1 * np.sin(12.6 * cycles), 0 * cycles, 0 * cycles])
    return {
        "recovery": {
            "seconds": 0.05,
            "cycles": 5.0,
            "resolution": 25.0,
            "ceiling": 1200.0,
            "phases": list(PHASES),
            "directions": directions,
            "largest": largest,
            "force": 300.0,
            "criterion_directions": ahead,
            "survived": [[True] * len(ahead), [each != -90.0 for each in ahead]],
        },
        "traces": [
            {
                "phase": phase,
                "direction": direction,
                "force": 300.0,
                "fell": phase > 0.0,
                "cycles": cycles.tolist(),
                "velocity": velocity.tolist(),
            }
            for direction in (0.0, 90.0)
            for phase in PHASES
        ],
    }


def build_run(
    folder,
    *,
    source: str | None = None,
    identified: bool = True,
    subject: Subject | None = None,
    messages: dict | None = None,
    not_recorded: str | None = None,
) -> None:
    """A run folder as the earlier stages leave it, but for walks made from the record; compared
    with a side that was not recorded if one of `unrecorded_verdicts.CASES` is named.
    """
    subject = subject or load_subject("S05")
    key = subject.to_toml()
    if source is not None:
        subject = subject.model_copy(update={"source": source, "citation": source})
    (folder / "subject.toml").write_text(subject.to_toml(), encoding="utf-8")
    record = subject.record()
    model = _scaled(subject, key, folder)
    configuration = sharp_filter(
        cycles=6, settling_cycles=1, filter_frequency=10.0, start_phases=PHASES
    )
    settings = configuration.record.model_copy(update=messages or {})
    configuration = configuration.model_copy(update={"record": settings})
    sizes = {"nominal": 2.0, "identified": 1.0} if identified else {"nominal": 2.0}
    final = list(sizes)[-1]
    made = {}
    for seed, (which, size) in enumerate(sizes.items()):
        rollouts = []
        for phase in PHASES if which == final else PHASES[:1]:
            perfect = _exact_walk(record, key, phase)
            walk = _imperfect(perfect, seed, size)
            walk.positions[:, 3] = perfect.positions[:, 3]
            rollouts.append(walk)
        made[which] = walks_of(rollouts, configuration)
        made[which].compared.save(folder / "rollouts" / f"{which}.npz")
    write_json(folder / "push.json", _pushes())
    last, person = made.get("identified", made["nominal"]), subject
    if not_recorded is not None:
        subject, configuration = CASES[not_recorded](subject, configuration)
        (folder / "subject.toml").write_text(subject.to_toml(), encoding="utf-8")
        subject, record = Run(folder, subject, configuration).compared()
    metrics = validate(
        subject,
        record,
        model,
        made["nominal"],
        made.get("identified"),
        configuration,
        StageResults(
            identification=IdentificationResult.model_validate(_identification())
            if identified
            else None,
            correction=CorrectionResult.model_validate(_correction()) if identified else None,
            pushes=StoredPushes.model_validate(_pushes()).recovery,
            second_engine=replace(last, starts=last.starts[:1]),
        ),
        others=builtin_subjects(),
    )
    if is_predicted(configuration.record):
        people = builtin_subjects()
        curves = predicted_curves(person, configuration.record, people)
        metrics = with_predicted(metrics, curves)
    write_json(folder / "metrics.json", metrics.as_dict())
    write_json(folder / "provenance.json", {"seed": 0, "stages": {"train": {"seconds": 1800.5}}})
