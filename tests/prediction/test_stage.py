"""A run that knew no forces gets its estimate; one that knew them is refused."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest
from seen_figures import bands, figure_of, forward, legend, lines

from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError, ConfigurationError
from gaitval.gait.insoles import InsoleForces
from gaitval.study.estimate_stage import (
    _UNITS,
    ESTIMATE_ACCURACY,
    INSOLES_KEPT,
    KINETICS,
    PAGE,
    TABLE,
    _draw,
    _title,
    keep_insoles,
    kept_insoles,
    of_run,
    stage,
    target_record,
)
from gaitval.study.scaling_stages import reference_stage, scale_stage
from gaitval.study.stage import Observer, Run, open_run, run_stage, why_run
from gaitval.subjects.prediction.deviations import kinetics_of
from gaitval.subjects.prediction.normal_form import normal_form
from gaitval.subjects.subject_file import load_subject

BASELINE = Path(__file__).parents[2] / "reports" / "S07" / "baseline" / "metrics.json"


@pytest.mark.slow
def test_the_table_and_the_page_of_a_run(tmp_path):
    configuration = load_configuration(settings=["record.use=kinematics"])
    with open_run(load_subject("7"), configuration, tmp_path, Observer()) as run:
        for each in (scale_stage(run), reference_stage(run)):
            run_stage(each, tmp_path, observer=run.observer)
        shutil.copy(BASELINE, tmp_path / "metrics.json")  # any walk of this body
        run_stage(stage(run), tmp_path, observer=run.observer)
        assert why_run(stage(run), tmp_path) is None
        rows = list(csv.DictReader((tmp_path / TABLE).open(encoding="utf-8")))
        assert len(rows) == 7 * 2 * 100
        vertical = [row for row in rows if row["quantity"] == "vertical force"]
        assert 40.0 < np.mean([float(row["estimate"]) for row in vertical]) < 60.0
        assert all(float(row["plus_minus"]) >= 0.0 for row in rows)
        page = (tmp_path / PAGE).read_text(encoding="utf-8")
        assert "need not obey Newton" in page
        assert "another laboratory" not in page
        kept = InsoleForces("walk.csv", np.tile(0.5, (2, 100)), 1.0, (4, 5), 1.2, 0.03)
        keep_insoles(run, kept)
        assert why_run(stage(run), tmp_path) is not None
        run_stage(stage(run), tmp_path, observer=run.observer)
        again = list(csv.DictReader((tmp_path / TABLE).open(encoding="utf-8")))
        for before, after in zip(rows, again, strict=True):
            if before["quantity"] == "vertical force":
                assert float(after["plus_minus"]) < max(float(before["plus_minus"]), 1e-9) + 1e-9
        page = (tmp_path / PAGE).read_text(encoding="utf-8")
        for word in ("walk.csv", "4 right and 5 left", "3.0 % BW"):
            assert word in page
        found = of_run(run)
        strange = load_subject("7").model_copy(update={"laboratory": "elsewhere"})
        elsewhere = of_run(type(run)(tmp_path, strange, configuration))
        assert found.looked_at_angles
        assert not elsewhere.looked_at_angles


@pytest.mark.slow
def test_a_walk_is_asked_the_known_angles_with_the_kinetics_of_the_estimate(tmp_path):
    configuration = load_configuration(settings=["record.use=kinematics"])
    with open_run(load_subject("7"), configuration, tmp_path, Observer()) as run:
        run_stage(scale_stage(run), tmp_path, observer=run.observer)
        (record, accuracy), known, found = (
            target_record(run),
            run.known_record().record,
            of_run(run),
        )
        assert accuracy is ESTIMATE_ACCURACY
        assert record.angles == known.angles
        assert (record.speed, record.stride_time) == (known.speed, known.stride_time)
        gait = normal_form(record, run.subject.leg_length_m)
        # A record has no force in swing, and its curves are Fourier series of few terms.
        assert np.std(kinetics_of(gait) - found.kinetics) < 0.01
        assert np.std(found.kinetics - found.expected) > 0.02
    settings = ["record.use=kinematics", "record.speed=1.0"]
    elsewhere = type(run)(tmp_path, load_subject("7"), load_configuration(settings=settings))
    assert target_record(elsewhere).accuracy == elsewhere.known_record().accuracy


def test_a_run_that_knew_the_forces_is_refused(tmp_path):
    with (
        open_run(load_subject("7"), load_configuration(), tmp_path, Observer()) as run,
        pytest.raises(ConfigurationError, match="knew the person's moments"),
    ):
        of_run(run)


def test_the_figure_is_the_table_quantity_by_quantity_and_side_by_side():
    step = np.arange(101)
    rows, given = [], {}
    for n, (kind, name) in enumerate(KINETICS):
        for s, side in enumerate(("right", "left")):
            mean = step + 10.0 * n + 100.0 * s
            given[n, side] = mean, 1.0 + step / 50, mean + 3.0, mean - 5.0
            title, unit = _title(kind, name), _UNITS[kind]
            columns = zip(*given[n, side], strict=True)
            rows += [(title, side, unit, p, *map(str, values)) for p, values in enumerate(columns)]
    figure = figure_of(lambda: _draw(rows))
    shown = {n: handle.get_color() for n, handle in legend(figure.axes[-1]).items()}
    for n, (kind, name) in enumerate(KINETICS):
        axes = figure.axes[n]
        assert forward(axes)
        assert axes.get_title() == f"{_title(kind, name)}, {_UNITS[kind]}"
        for side in ("right", "left"):
            mean, width, _, walk = given[n, side]
            (line,) = lines(axes, shown[f"estimate, {side}"])
            np.testing.assert_array_equal(line.T, [step, mean])
            (band,) = bands(axes, shown[f"estimate, {side}"])
            np.testing.assert_allclose(band.T, [step, mean - width, mean + width])
            walked = [line[:, 1] for line in lines(axes, shown[f"walk, {side}"])]
            assert any(np.array_equal(each, walk) for each in walked)
        (usual,) = lines(axes, shown["expected of anybody"])
        np.testing.assert_array_equal(usual[:, 1], given[n, "left"][2])


class Listener(Observer):
    """Keeps what is said."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def say(self, message: str) -> None:
        self.said.append(message)


def run_of(folder, subject="7", **changes):
    person = load_subject(subject).model_copy(update=changes)
    return Run(folder, person, load_configuration(settings=["record.use=kinematics"]), Listener())


INSOLES = InsoleForces("walk.csv", np.tile(0.5, (2, 100)), 1.0, (4, 5), 1.2, 0.03)


@pytest.mark.parametrize(
    "other", [{"subject": "5"}, {"mass_kg": 80.0}, {"stride_time_s": 1.1}, {"trial": "T09"}]
)
def test_insoles_of_another_recording_are_not_used_and_that_is_said(tmp_path, other):
    keep_insoles(run_of(tmp_path), INSOLES)
    own = run_of(tmp_path, citation="elsewhere", age_years=33.0)
    assert kept_insoles(own).source == "walk.csv"
    assert own.observer.said == []
    now = run_of(tmp_path, **other)
    assert kept_insoles(now) is None
    (message,) = now.observer.said
    for word in ("insoles.json: not used", "walk.csv", "another recording", "--insoles"):
        assert word in message


def test_insoles_are_of_the_same_walk_when_its_subject_is_read_from_a_file(tmp_path):
    """Whose numbers have fewer digits than those of a subject that was just made."""
    made = run_of(tmp_path, mass_kg=71.123456789)
    keep_insoles(made, INSOLES)
    made.subject.save(tmp_path / "subject.toml")
    assert kept_insoles(run_of(tmp_path, subject=tmp_path / "subject.toml")) is not None


@pytest.mark.parametrize("kept", ["[]", "{}", '{"source": "walk.csv", "vertical": 1}'])
def test_insoles_that_were_edited_are_named_with_what_to_do(tmp_path, kept):
    path = tmp_path / INSOLES_KEPT
    path.parent.mkdir()
    path.write_text(kept, encoding="utf-8")
    with pytest.raises(ArtefactError, match=r"insoles\.json.*Delete it"):
        kept_insoles(run_of(tmp_path))
