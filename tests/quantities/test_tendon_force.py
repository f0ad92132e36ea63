"""Force in the Achilles tendon, and that one file and one limit bring it everywhere."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from followed_page import section_of
from synthetic_walk import MODEL, perfect_walk, sharp_filter, walks_of

from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED
from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.metrics.results import metrics_from, read_metrics
from gaitval.metrics.validation import validate
from gaitval.metrics.walk_quantities import of_record, of_walk
from gaitval.mocap.mot import read_storage
from gaitval.quantities import QUANTITIES
from gaitval.quantities.quantity import OverTime
from gaitval.quantities.tendon_force import TENDON_FORCE, moment_arm, tendon_force
from gaitval.reporting.grids import MUSCLES, WITH_QUANTITIES, title
from gaitval.reporting.tables import figure_tables
from gaitval.session.opensim.motion import write_quantities
from gaitval.subjects.subject_file import builtin_subjects, load_subject

STORED = Path(__file__).parents[2] / "reports" / "S05" / "baseline"
SECONDS = {"r": 1.1, "l": 1.1}


def test_the_arm_is_the_published_one_and_a_line_between() -> None:
    angles = np.radians([-40.0, -10.0, 5.0, 20.0, 40.0])
    np.testing.assert_allclose(
        moment_arm(angles), [0.0369, 0.0369, 0.5 * (0.0369 + 0.0346), 0.0346, 0.0346]
    )


def test_a_moment_at_a_known_arm_is_a_known_force_and_a_tendon_does_not_push() -> None:
    """60 Nm at 10° of plantarflexion, 0.0369 m: 1626 N."""
    ankle = np.radians([-10.0, -10.0])
    np.testing.assert_allclose(tendon_force(ankle, np.array([-60.0, 20.0])), [60.0 / 0.0369, 0.0])


def curves_of(moment: np.ndarray) -> Curves:
    names = ("ankle_angle_r", "ankle_angle_l")
    angle = np.full(moment.shape, math.radians(20.0))
    return Curves(dict.fromkeys(names, angle), dict.fromkeys(names, moment), {})


def test_each_cycle_pulls_before_the_mean() -> None:
    """Two cycles whose moments cancel in the mean: the tendon pulls in one of them."""
    moment = np.stack([np.full(101, -1.0), np.full(101, 1.0)])
    found = TENDON_FORCE.of_curves(curves_of(moment), SECONDS)
    assert found is not None
    expected = 0.5 / (0.0346 * GRAVITY)
    np.testing.assert_allclose(found.curves["achilles_r"], expected)
    assert found.figures["peak"]["achilles_l"] == pytest.approx(expected)


def test_without_a_cycle_or_an_ankle_there_is_none() -> None:
    assert TENDON_FORCE.of_curves(curves_of(np.empty((0, 101))), SECONDS) is None
    assert TENDON_FORCE.of_curves(Curves({}, {}, {}), SECONDS) is None


def test_people_pull_as_published() -> None:
    """By shear waves in the tendon 44 N/kg, 4.5 body weights, at 1.34 m/s (PMC11096059)."""
    for subject in builtin_subjects():
        record = subject.record()
        found = TENDON_FORCE.of_curves(recorded_curves(record), SECONDS)
        assert found is not None
        for name, force in found.curves.items():
            assert 2.5 < force.max() < 6.0, (subject.identifier, name)
            assert 40 <= int(force.argmax()) <= 60


# --- everywhere -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def metrics():
    subject, configuration = load_subject("S05"), sharp_filter()
    walk = perfect_walk(subject.record(), cycles=6)
    column = ACTUATED.index("ankle_angle_r")
    moments = walk.moments.copy()
    moments[:, column] *= 1.5
    walk = type(walk)(**{**vars(walk), "moments": moments})
    walks = walks_of([walk], configuration)
    return validate(
        subject, subject.record(), MODEL, walks, None, configuration, others=builtin_subjects()
    )


def test_metrics_have_every_quantity_of_walk_and_record_and_judge_it(metrics) -> None:
    assert metrics_from(json.loads(json.dumps(metrics.as_dict())), "here") == metrics
    of_muscles = {each.name for each in QUANTITIES if each.of_muscles is not None}
    for part in (metrics.walk, metrics.record):
        expected = {each.name for each in QUANTITIES} - {"power"} - of_muscles
        assert {*part.quantities} - of_muscles == expected
        assert part.quantities["tendon_force"].unit == "BW"
    rows = {row.target: row for row in metrics.measures if row.measure == "tendon_force_rmse"}
    assert {*rows} == {"achilles_r", "achilles_l"}
    assert rows["achilles_r"].value > 0.3 > 0.1 > rows["achilles_l"].value
    assert rows["achilles_r"].origin == "recorded"
    passed = {row.target: row.passed for row in metrics.tolerances if row.id == "tendon-force"}
    assert passed == {"achilles_r": False, "achilles_l": True}


def test_the_report_has_the_panels_and_tables_of_what_is_shown(metrics) -> None:
    for each in QUANTITIES:
        grid = WITH_QUANTITIES if each.of_muscles is None else MUSCLES
        panels = {name for row in grid for name in row}
        assert ({*each.panels()} <= panels) == (each.shown == "curves")
    assert title("tendon_force/achilles") == "Achilles tendon force"
    named = {each.table.title for each in figure_tables(metrics)}
    for each in QUANTITIES:
        listed = each.shown != "nothing" and each.of_muscles is None
        assert all((table.title in named) == listed for table in each.tables)


def test_a_file_of_before_has_it_from_its_curves() -> None:
    stored = read_metrics(STORED)
    del stored.walk.quantities["tendon_force"]
    for found in (of_record(stored.record, TENDON_FORCE), of_walk(stored.walk, TENDON_FORCE)):
        assert found is not None
        assert 2.5 < found.figures["peak"]["achilles_r"] < 6.0
    frame = stored.to_frame()
    named = frame[frame["quantity"] == "achilles tendon force"]
    assert len(named) == 2 * 2 * 101
    assert {*named["unit"]} == {"BW"}


def test_the_storage_file_has_it_over_time_in_newtons(tmp_path: Path) -> None:
    time = np.linspace(0.0, 1.0, 5)
    values = np.zeros((3, 5, len(ACTUATED)))
    values[1, :, ACTUATED.index("ankle_angle_l")] = -100.0
    values[2, :, ACTUATED.index("knee_angle_r")] = 7.0
    write_quantities(tmp_path / "quantities.sto", time, OverTime(*values))
    table = read_storage(tmp_path / "quantities.sto")
    columns = dict(zip(table.columns, table.values.T, strict=True))
    arm = float(moment_arm(np.zeros(1))[0])
    np.testing.assert_allclose(columns["achilles_tendon_force_l"], 100.0 / arm, rtol=1e-6)
    np.testing.assert_allclose(columns["achilles_tendon_force_r"], 0.0)
    np.testing.assert_allclose(columns["knee_angle_power_r"], 7.0)


def test_the_page_shows_what_is_in_the_package() -> None:
    """docs/how-to/extend.md: its pieces are those of the file, the table and the limits."""
    root = Path(__file__).parents[2]
    text = section_of("extend.md#add-a-quantity")
    pieces = re.findall(r"```(?:python|toml)\n# (\S+)\n(.*?)```", text, re.DOTALL)
    assert {Path(file).name for file, _ in pieces} == {
        "tendon_force.py", "__init__.py", "tolerances.toml",
    }  # fmt: skip
    for file, piece in pieces:
        source = (root / file).read_text(encoding="utf-8")
        for part in piece.split("…\n"):
            assert part.strip() in source, (file, part)
