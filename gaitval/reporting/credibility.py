"""What a reviewer asks of a simulation: the rows of the report's part on credibility.

The order is that of ASME V&V 40-2018 (question, context of use, risk, verification, validation,
applicability) and of the eight factors of NASA-STD-7009A; compliance with neither is claimed. Every
figure is read from a file when the page is written, and cites the file and the place in it (a JSON
pointer, RFC 6901). What is not known has a row that says so. It is long because every row is
written out here, in the order in which it is read.
"""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval.artefacts import file_hash, read_json
from gaitval.coordinates import SIDES
from gaitval.errors import ArtefactError
from gaitval.metrics.momentum import EVERY, momentum_residual
from gaitval.metrics.record_results import KINDS, UnseenResult
from gaitval.metrics.results import METRICS, IdentificationResult, Metrics
from gaitval.metrics.typed import OpenResult, array
from gaitval.reporting.facts import (
    UNKNOWN,
    Fact,
    compiled_walks,
    derived_fact,
    mean_of_known,
    measured_force_fact,
    read_fact,
)
from gaitval.reporting.page import number
from gaitval.simulation.rollout import Rollout

EVIDENCE: Final = "evidence.toml"
"""Figures measured by the project, not the run; docs/build/credibility_figures.py writes them. A
copy is put beside each report, so that its links work wherever gaitval is installed."""

PROVENANCE: Final = "provenance.json"

SKILLS: Final = ("angle_skill", "moment_skill", "force_skill")


class ProjectFigure(OpenResult):
    """A row of `evidence.toml`: what the project has measured, and where the data are."""

    part: str
    what: str
    value: float
    unit: str
    source: str
    date: str
    n: int | None = None
    commit: str | None = None


@dataclass(frozen=True)
class FactSection:
    """Rows under a heading.

    Attributes
    ----------
    factors : of both documents, which the rows address.
    facts, project : figures of the run, and of the project as a whole.
    """

    title: str
    factors: str
    facts: tuple[Fact, ...]
    project: tuple[Fact, ...] = ()


def sections(folder: Path, metrics: Metrics) -> list[FactSection]:
    """The part on credibility of the report of a run `folder` with the results `metrics`."""
    project = {
        key: ProjectFigure.model_validate(figure)
        for key, figure in tomllib.loads(evidence_text())["figure"].items()
    }
    found = {
        part: tuple(_of_project(project, part))
        for part in ("verification", "validation", "uncertainty", "sensitivity", "history")
    }
    return [
        FactSection(
            "What the model knew of the record",
            "V&V 40: model inputs, equivalency of inputs. NASA: data pedigree, input pedigree.",
            tuple(_told(folder, metrics)),
        ),
        FactSection(
            "Verification: are the equations solved right?",
            "V&V 40: code and calculation verification. NASA: verification.",
            tuple(_verified(folder, metrics)),
            found["verification"],
        ),
        FactSection(
            "Validation: are they the right equations?",
            "V&V 40: comparator, output comparison, applicability. NASA: validation.",
            tuple(_validated(metrics)),
            found["validation"],
        ),
        FactSection(
            "Uncertainty",
            "V&V 40: model inputs, test samples. NASA: uncertainty characterization.",
            tuple(_uncertain(folder, metrics)),
            found["uncertainty"],
        ),
        FactSection(
            "Sensitivity",
            "V&V 40: model form, model inputs. NASA: results robustness.",
            tuple(_sensitive(metrics)),
            found["sensitivity"],
        ),
        FactSection(
            "History and management",
            "V&V 40: software quality assurance, use error. NASA: M&S history, M&S process and "
            "product management.",
            tuple(_history(folder, metrics)),
            found["history"],
        ),
    ]


def evidence_text() -> str:
    """The figures of the project, as shipped with the package."""
    return resources.files("gaitval.reporting").joinpath(EVIDENCE).read_text("utf-8")


def _of_project(project: Mapping[str, ProjectFigure], part: str) -> Iterator[Fact]:
    for key, figure in project.items():
        if figure.part == part:
            cases = "" if figure.n is None else f"{figure.n} cases, "
            commit = "" if figure.commit is None else f", commit {figure.commit}"
            # evidence in a folder past/ has not been measured again by later versions
            since = ", not since" if "/past/" in figure.source else ""
            yield Fact(
                figure.what[0].upper() + figure.what[1:],
                f"{figure.value:.4g} {figure.unit if figure.unit != '1' else ''}".strip(),
                EVIDENCE,
                f"/figure/{key}/value",
                f"{figure.source}, {cases}{figure.date}{commit}{since}.",
            )


def _told(folder: Path, metrics: Metrics) -> Iterator[Fact]:
    yield read_fact(metrics, "/subject/source", "Record")
    yield read_fact(metrics, "/subject/licence", "Licence")
    read = [name for name, by in metrics.told.items() if by]
    left = [name for name in metrics.told if name not in read]
    of_all = f"of {len(metrics.told)} quantities"
    yield derived_fact("/told", "Known to the model", len(read), of_all, note=_list(read))
    yield derived_fact("/told", "Held out", len(left), "quantities", note=_list(left))
    missing = sorted({"moments", "forces"} - set(metrics.recorded))
    yield derived_fact(
        "/recorded",
        "Not recorded",
        len(missing),
        "of moments and forces",
        note=_list(missing),
    )
    yield derived_fact(
        "/unseen",
        "Trials at the same speed that were kept back",
        len(metrics.unseen),
        note=_list([row.trial for row in metrics.unseen]),
    )
    yield _hash(folder, "subject.toml", "SHA-256 of the person and the record as they were read")


def _hash(folder: Path, file: str, what: str) -> Fact:
    """As `sha256sum` prints it, so that a reader can compare."""
    if not (folder / file).is_file():
        return Fact(what, UNKNOWN, note=f"{file} is not here.")
    return Fact(what, file_hash(folder / file), file)


def _list(names: Sequence[str]) -> str:
    return f"{', '.join(names)}." if names else "None."


def _verified(folder: Path, metrics: Metrics) -> Iterator[Fact]:
    yield _momentum(folder, metrics)
    yield Fact(
        "Balance of angular momentum and of energy in this walk",
        UNKNOWN,
        note="They are not worked out of a stored walk. Of energy the project's figures follow; of "
        "angular momentum tests/simulation/test_walker.py asserts the balance at every step.",
    )
    witness = metrics.witness
    what = "The same walk in a second engine"
    if witness is None:
        yield Fact(
            what,
            UNKNOWN,
            METRICS,
            "/witness",
            "`gaitval simulate` and `gaitval validate` write it.",
        )
        return
    yield read_fact(metrics, "/witness/engine", what)
    yield read_fact(metrics, "/witness/fell", "It falls there")
    yield read_fact(
        metrics,
        "/witness/goals_reached",
        "Goals of accuracy reached there",
        f"of {witness.goals}",
    )


def _momentum(folder: Path, metrics: Metrics) -> Fact:
    file = f"rollouts/{metrics.final}.npz"
    what = "Force that would be needed beside ground and gravity, largest mean over a second"
    if not (folder / file).exists():
        return Fact(what, UNKNOWN, note=f"{file} is not here; `gaitval simulate` writes it.")
    residual = momentum_residual(Rollout.load(folder / file), metrics.method.model_mass_kg)
    return derived_fact(
        "",
        what,
        residual,
        "% of body weight",
        note="Change of momentum of this walk less the impulse of its external forces."
        if residual is not None
        else f"The walk is shorter than {2 * EVERY:g} s.",
        file=file,
    )


def _validated(metrics: Metrics) -> Iterator[Fact]:
    counts = metrics.summary
    yield read_fact(
        metrics,
        "/summary/accepted",
        "Values within their tolerance"
        if metrics.is_recorded_at_all
        else "Values within limits that need no record (accuracy is not judged)",
        f"of {counts.accepted + counts.refused}",
        note="The tolerances and their sources are in a table of their own.",
    )
    for name, what in zip(SKILLS, ("angles", "moments", "forces"), strict=True):
        yield from _skill(metrics, name, what)
    if not metrics.unseen:
        yield Fact(
            "Error on a trial that was kept back",
            UNKNOWN,
            METRICS,
            "/unseen",
            "This run has none. `gaitval predict --holdout` and a subject with further trials do.",
        )
    for index, row in enumerate(metrics.unseen):
        yield from _kept_back(metrics, index, row)
    yield read_fact(
        metrics,
        "/record/spatiotemporal/walking_speed",
        "Speed to which all this applies",
        "m/s",
        digits=2,
        note="Nothing here was compared at another speed, on another ground or with another body.",
    )


def _skill(metrics: Metrics, name: str, what: str) -> Iterator[Fact]:
    """Mean skill of the curves of a kind: those known to the model, and those predicted."""
    rows = [row for row in metrics.measures if row.measure == name]
    if not rows:
        why = (
            "There are too few other people."
            if metrics.is_recorded_at_all
            else "Nothing was recorded at this speed."
        )
        yield Fact(f"Skill of {what}", UNKNOWN, METRICS, "/measures", why)
    for status in ("fitted", "predicted"):
        which = "known to the model" if status == "fitted" else "held out"
        values = [row.value for row in rows if row.comparison == status]
        measured = [value for value in values if value is not None]
        if values:
            below = sum(value < 0.0 for value in measured)
            yield derived_fact(
                "/measures",
                f"Skill of {what} ({which}), mean",
                float(np.mean(measured)) if len(measured) == len(values) else None,
                digits=2,
                note=f"{len(values)} curves, of which {below} are nearer to a guess without a "
                "model; 1 is perfect, 0 no better than the guess.",
            )


def _kept_back(metrics: Metrics, index: int, row: UnseenResult) -> Iterator[Fact]:
    for kind in sorted(KINDS):
        unit, every = metrics.units.of(kind), row.rmse.of(kind).values()
        errors = [each for each in every if each is not None]
        yield derived_fact(
            f"/unseen/{index}/rmse/{kind}",
            f"RMSE of {kind} against {row.trial}, which was kept back, mean",
            float(np.mean(errors)) if len(errors) == len(every) else None,
            unit,
            note="Between the two recorded trials: "
            f"{number(mean_of_known(row.between.of(kind)), 3)} {unit}.",
        )


def _uncertain(folder: Path, metrics: Metrics) -> Iterator[Fact]:
    yield from _posterior(metrics.identification)
    provenance = provenance_before(folder)
    what = "Seeds of this run"
    if provenance is None or "seed" not in provenance:
        yield Fact(what, UNKNOWN, note="provenance.json does not say.")
    else:
        yield Fact(
            what,
            f"1 (seed {provenance['seed']})",
            PROVENANCE,
            "/seed",
            "What another seed would give is not known of this person; the project's follow.",
        )
    yield from _scatter(metrics)
    if not metrics.is_recorded_at_all:
        return
    consistency = "/record/consistency"
    yield measured_force_fact(metrics.record)
    yield read_fact(
        metrics,
        f"{consistency}/vertical_rmse_bound_in_stance",
        "Vertical RMSE from the record as it is compared, below which no steady walk can be",
        "body weights",
        digits=4,
    )
    differences = metrics.record.consistency.moment_asymmetry.by_name()
    worst = max(differences, key=lambda name: differences[name].rms_difference)
    yield read_fact(
        metrics,
        f"{consistency}/moment_asymmetry/{worst}/rms_difference",
        f"Right less left moment of the record, largest RMS ({worst.replace('_', ' ')})",
        "Nm/kg",
    )
    yield from _hips(metrics)
    plates = metrics.record.plates
    if plates is None:
        yield Fact(
            "Faults of the force plates", "none found", METRICS, "/record/plates",
            "Nothing that the laws of motion show.",
        )  # fmt: skip
        return
    for name, what, unit in (
        ("scale", "Force plates: factor on their forces", ""),
        ("shift_right", "Centre of pressure too far forward, right", "m"),
        ("shift_left", "Centre of pressure too far forward, left", "m"),
    ):
        spread = number(getattr(plates, f"{name}_sd"), 4)
        yield read_fact(
            metrics,
            f"/record/plates/{name}",
            what,
            unit,
            digits=4,
            note=f"± {spread} {unit}".strip() + " (SD); corrected.",
        )


def _hips(metrics: Metrics) -> Iterator[Fact]:
    """Where the record's hip centres are, and what the moments' errors would be without."""
    centres = metrics.walk.hip_centres
    if centres is None:
        return
    for side in SIDES:
        place, errors = f"/walks/{metrics.final}/hip_centres/{side}", centres.of(side)
        own = ", ".join(
            f"{name.replace('_', ' ')} {number(error, 3)}"
            for name, error in errors.rmse_about_model.items()
        )
        note = "Found with the reference; moments are compared about it. RMSE about the model's own"
        for direction in ("forward", "outward"):
            yield read_fact(
                metrics,
                f"{place}/{direction}",
                f"Hip centre of the record {direction} of the model's, {side}",
                "m",
                note=f"{note}: {own} Nm/kg.",
            )


def _posterior(found: IdentificationResult | None) -> Iterator[Fact]:
    place = "/identification"
    if found is None or found.deviance_identified is None:
        yield Fact(
            "Body parameters", UNKNOWN, METRICS, place,
            "They were not looked for; the body is as scaled.",
        )  # fmt: skip
        return
    for verdict in ("identified", "weak", "not identified", "at its bound"):
        names = [
            name.replace("_", " ")
            for name, each in zip(found.names, found.verdicts, strict=True)
            if each == verdict
        ]
        yield derived_fact(
            f"{place}/verdicts",
            f"Body parameters: {verdict}",
            len(names),
            f"of {len(found.names)}",
            note=_list(names),
        )
    ratios = np.divide(found.standard_deviation, found.prior_standard_deviation)
    # the parameter that the record determines best
    least = int(np.argmin(ratios))
    yield derived_fact(
        f"{place}/standard_deviation/{least}",
        f"Posterior SD over prior SD, smallest ({found.names[least].replace('_', ' ')})",
        float(ratios[least]),
        digits=2,
        note="Over prior_standard_deviation at the same place.",
    )
    yield derived_fact(
        f"{place}/search_distance",
        "Between the results of CMA-ES and of Gauss-Newton",
        found.search_distance,
        "posterior SD",
        note="" if found.search_distance is not None else "The file has no value here.",
    )


def _scatter(metrics: Metrics) -> Iterator[Fact]:
    """How much the cycles of the walk differ."""
    final = metrics.final
    for kind in sorted(KINDS):
        unit, curves = metrics.units.of(kind), metrics.walk.curves.of(kind)
        spreads = [
            float(np.nanmean(array(curve.sd))) for curve in curves.values() if curve.sd is not None
        ]
        yield derived_fact(
            f"/walks/{final}/curves/{kind}",
            f"SD between the cycles of the walk, {kind}, mean",
            float(np.mean(spreads)) if len(spreads) == len(curves) else None,
            unit,
            note=f"Over {len(curves)} curves and 101 points."
            if len(spreads) == len(curves)
            else "Fewer than two gait cycles.",
        )


def _sensitive(metrics: Metrics) -> Iterator[Fact]:
    found = metrics.identification
    walks = metrics.walks
    for which, walk, what in (
        ("nominal", walks.nominal, "Error ε with the nominal body parameters"),
        ("identified", walks.identified, "Error ε with the identified body parameters"),
    ):
        if walk is not None and walk.epsilon is not None:
            yield read_fact(
                metrics,
                f"/walks/{which}/epsilon/total",
                what,
            )
    if found is not None and found.deviance_identified is not None:
        # below the diagonal: each pair once, and no parameter with itself
        pairs = np.abs(np.tril(np.array(found.correlation, dtype=float), -1))
        row, column = (int(each) for each in np.unravel_index(int(pairs.argmax()), pairs.shape))
        names = [found.names[each].replace("_", " ") for each in (row, column)]
        yield read_fact(
            metrics,
            f"/identification/correlation/{row}/{column}",
            f"Most correlated parameters: {names[0]} and {names[1]}, correlation",
            digits=2,
        )
    starts = metrics.walk.starts
    yield derived_fact(
        f"/walks/{metrics.final}/starts",
        "Falls over all start phases",
        sum(start.fell for start in starts),
        f"of {len(starts)}",
        note=f"Each walk starts at another phase of the gait cycle. {compiled_walks(starts)} of "
        "them walked in the compiled engine, the others in DART; both solve the same equations.",
    )
    pushes = metrics.push_recovery
    if pushes is None:
        yield Fact(
            "Pushes survived", UNKNOWN, METRICS, "/push_recovery",
            "They were not tested. `gaitval push` tests them.",
        )  # fmt: skip
    else:
        stood = [each for phase in pushes.survived for each in phase]
        yield derived_fact(
            "/push_recovery/survived",
            f"Pushes of {pushes.force:g} N survived",
            sum(stood),
            f"of {len(stood)}",
            note="Within 90° of straight ahead, at all tested phases.",
        )
    yield Fact(
        "How the walk changes with each single parameter",
        UNKNOWN,
        note="A run does not work it out. `gaitval screen` does, for the general policy.",
    )


def _history(folder: Path, metrics: Metrics) -> Iterator[Fact]:
    for name in ("gaitval", "python", "dartpy"):
        if name in metrics.provenance.versions:
            yield read_fact(metrics, f"/provenance/versions/{name}", f"Version of {name}")
    yield _hash(folder, "configuration.toml", "SHA-256 of the settings")
    provenance = provenance_before(folder)
    stages = provenance.get("stages") if provenance else None
    if isinstance(stages, dict) and stages:
        seconds = [each.get("seconds") for each in stages.values() if isinstance(each, dict)]
        known = [float(each) for each in seconds if isinstance(each, int | float)]
        yield derived_fact(
            "/stages", "Stages that ran, and how long", sum(known), "s", digits=0,
            note=f"{len(stages)} stages.", file=PROVENANCE,
        )  # fmt: skip
    for what, note in (
        (
            "Earlier checks of this walker",
            "A run does not see them; `gaitval check --history` keeps and `gaitval history` shows.",
        ),
        ("Review by others than the developers", "Nothing says that there was any."),
        ("Qualification of who ran and who reads this", "Nothing here says."),
        ("Use in earlier decisions", "No record of it is kept."),
    ):
        yield Fact(what, UNKNOWN, note=note)


def provenance_before(folder: Path) -> dict[str, Any] | None:
    """`provenance.json` of a run `folder` without the report's own stage, so that a report written
    again is the same; None without the file. Raises ArtefactError if it is no JSON object.
    """
    path = folder / PROVENANCE
    if not path.exists():
        return None
    found = read_json(path)
    if not isinstance(found, dict):
        raise ArtefactError(
            f"{path}: not a JSON object. Delete it and run `gaitval subject` again."
        )
    stages = found.get("stages")
    if isinstance(stages, dict):
        found["stages"] = {name: each for name, each in stages.items() if name != "report"}
    return found
