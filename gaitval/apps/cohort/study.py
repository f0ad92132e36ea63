"""One study of a cohort: its subject, its run, and its summary."""

from contextlib import suppress
from functools import cache
from pathlib import Path

from gaitval.apps.cohort.device_studies import figures, wearing
from gaitval.apps.cohort.identity import (
    Json,
    configuration_of,
    record_hash,
    record_parts,
    settings_hash,
    subject_in_table,
)
from gaitval.apps.cohort.results import PROFILE_SCORES
from gaitval.apps.cohort.table import Study
from gaitval.apps.devices.of_subject import afterwards
from gaitval.artefacts import read_json, value_hash, write_json, write_text
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects, load_subject
from gaitval.importing.batch_person import person_of
from gaitval.importing.files import FOLDER, RECORD
from gaitval.importing.importing import import_files
from gaitval.importing.stored import limits_of_record
from gaitval.metrics.groups import group_rows
from gaitval.metrics.origin import is_judged
from gaitval.metrics.results import IdentificationResult, Metrics, read_metrics
from gaitval.metrics.shown_quantities import quantities_of_walk
from gaitval.metrics.statistics_results import WalkStatistics
from gaitval.metrics.verdicts import not_judged, target_text
from gaitval.model.parameters import PARAMETERS, UNITS
from gaitval.quantities import BY_NAME
from gaitval.reporting.printer import load_printer
from gaitval.study.compile_ahead import compile_ahead, walk
from gaitval.study.run import load_report, run_subject
from gaitval.study.stage import Observer, open_run
from gaitval.study.stored_policy import general_walker


def subject_of(study: Study, folder: Path, observer: Observer) -> Subject:
    """The subject of a `study`; one of recordings is imported into `folder`/session, a virtual one
    is made, with its truth in `folder`/truth.json; `observer` hears of the steps.

    Raises GaitvalError if the import is refused, the virtual person falls, or there is no such
    subject.
    """
    if study.recording is not None:
        return _imported(study, folder, observer)
    if study.virtual is not None:
        return _virtual(study, folder)
    return subject_in_table(study)


def _imported(study: Study, folder: Path, observer: Observer) -> Subject:
    assert study.recording is not None
    person = person_of(folder, study.name, {**study.recording, "name": study.name})
    about = folder / "session" / "imported.json"
    wanted = {"record": value_hash(record_parts(study))}
    file = folder / "session" / study.name / "subject.toml"
    if not (about.is_file() and file.is_file() and read_json(about) == wanted):
        import_files(
            person,
            file.parent,
            configuration=configuration_of(study),
            notify=lambda step, text: observer.say(f"{step}: {text}"),
        )
        write_json(about, wanted)
    return load_subject(file)


def _virtual(study: Study, folder: Path) -> Subject:
    wanted = study.virtual
    assert wanted is not None
    around = load_subject(wanted.around)
    if wanted.by == "stature":
        around = around.by_stature()
    configuration = configuration_of(study)
    policy = general_walker(configuration.environment)
    from gaitval.apps.virtual.person import virtual_person

    found = virtual_person(wanted.number, wanted.seed, around, policy, configuration)
    truth = {name: float(each) for name, each in zip(PARAMETERS, found.truth, strict=True)}
    write_json(folder / "truth.json", truth)
    # Numbers of a subject file have six digits; a resumed study reads the same.
    path = folder / "virtual.toml"
    write_text(path, found.subject.to_toml())
    return load_subject(path)


@cache
def ready() -> None:
    """Load what studies need, and what they have compiled, for the processes that are forked from
    this one.
    """
    compile_ahead()
    builtin_subjects()
    load_report()
    with suppress(Exception):  # what goes wrong here will go wrong in the study, and is said there
        load_printer()
        walk()


def run(study: Study, folder: Path, threads: int, observer: Observer) -> Json:
    """A real `study`: `gaitval subject` in `folder` with `threads` and `observer`; its summary."""
    subject = wearing(study, subject_of(study, folder, observer))
    with open_run(subject, configuration_of(study, threads), folder, observer) as opened:
        run_subject(
            opened,
            scratch=study.start == "scratch",
            start=None if study.policy is None else Path(study.policy),
            afterwards=afterwards(subject),
        )
    summary = summary_of(read_metrics(folder), subject)
    if study.recording is not None:
        imported = read_json(folder / "session" / study.name / FOLDER / RECORD)
        summary["limits"] = limits_of_record(imported)
    summary["devices"] = figures(folder, subject)
    summary |= {"record": record_hash(study), "settings": settings_hash(study)}
    return summary


def summary_of(metrics: Metrics, subject: Subject) -> Json:
    """What a cohort's tables hold of a study of `subject`, from its `metrics.json`: `subject`: who
    walked (m, kg, m/s). `verdicts`: limits met and failed. `measures`: name, target, unit and
    value, of what is compared with a record or needs none, Gait Profile Scores and the figures of
    the walk's quantities (`gaitval.quantities`).
    `groups`: mean RMSE of groups of curves, and its skill against the first prediction without a
    model; of recorded groups. `parameters`: mu with its uncertainty and verdict. `epsilon`: of the
    final walk.
    """
    walk = metrics.walk
    groups = []
    for row in group_rows(metrics):
        if not is_judged(row.origin):  # a distance from no record is no error
            continue
        skills = list(row.skills().values())
        skill = skills[0] if skills else None
        groups.append({"group": row.group, "unit": row.unit, "rmse": row.walked, "skill": skill})
    kept = {"measure", "target", "unit", "value"}
    return {
        "subject": {
            "identifier": subject.identifier,
            "laboratory": subject.laboratory,
            "person": subject.person,
            "trial": subject.trial,
            "source": subject.source,
            "sex": subject.sex,
            "age": subject.age_years,
            "mass": subject.mass_kg,
            "height": subject.height_m,
            "leg_length": subject.leg_length_m,
            "speed": subject.walking_speed_m_s,
        },
        "verdicts": {
            **metrics.summary.as_dict(),
            "failed": [
                ", ".join(filter(None, (row.title, target_text(row.target))))
                for row in metrics.tolerances
                if row.role == "acceptance" and not row.passed
            ],
            "not_judged": not_judged(metrics),
        },
        "measures": [
            *(row.model_dump(include=kept) for row in metrics.measures if is_judged(row.origin)),
            *_figures(metrics),
            *_profile_scores(metrics.curve_statistics),
        ],
        "groups": groups,
        "parameters": _parameters(metrics.identification),
        "epsilon": None if walk.epsilon is None else walk.epsilon.total,
    }


def _profile_scores(found: WalkStatistics | None) -> list[Json]:
    """Gait Profile Scores of the walk and of its record, as rows of measures."""
    if found is None:
        return []
    return [
        {"measure": name, "target": "walk", "unit": "deg", "value": of.total}
        for name, of in zip(
            PROFILE_SCORES, (found.profiles.walk, found.profiles.record), strict=True
        )
        if of is not None
    ]


def _figures(metrics: Metrics) -> list[Json]:
    """Figures of every quantity of the walk, such as `tendon_force_peak` of `achilles_r`."""
    return [
        {
            "measure": f"{name}_{kind}",
            "target": target,
            "unit": BY_NAME[name].figures[kind],
            "value": value,
        }
        for name, found in quantities_of_walk(metrics.walk).items()
        for kind, values in found.figures.items()
        for target, value in values.items()
        if value is not None
    ]


def _parameters(found: IdentificationResult | None) -> list[Json]:
    if found is None:
        return []
    columns = {
        "parameter": "names",
        "nominal": "nominal",
        "prior_sd": "prior_standard_deviation",
        "mean": "posterior_mean",
        "sd": "standard_deviation",
        "identified": "identified",
        "verdict": "verdicts",
    }
    rows = zip(*(getattr(found, name) for name in columns.values()), strict=True)
    return [
        dict(zip(columns, row, strict=True)) | {"unit": UNITS[name]}
        for name, row in zip(found.names, rows, strict=True)
    ]
