"""What a measure looks at: which samples of the gait cycle, and which cycles, change its value.

A window that is too short or too long, or a cycle that is left out, changes few values on a smooth
walk, and every other test may pass. Here a spike is set on each sample, and an offset on each
cycle, in turn: exactly those that the definition names must matter.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest
from synthetic_walk import MASS, STRIDE_TIME, perfect_walk, sharp_filter, synthetic_record

from gaitval.coordinates import COORDINATES, SIDES
from gaitval.gait.cycle_curves import FORCES, Curves, recorded_curves
from gaitval.gait.healthy_controls import load_controls
from gaitval.gait.record import LowPass
from gaitval.metrics.comparison import compare_curve, simulated_curves
from gaitval.metrics.cycles import find_cycles, spatiotemporal, walking_speed
from gaitval.metrics.epsilon import ANGLES, JOINT_MOMENTS, epsilon
from gaitval.metrics.foot_contact import EARLY, foot_contacts
from gaitval.metrics.gait_profile import gait_profile
from gaitval.metrics.side_measures import side_values
from gaitval.metrics.whole_body import centre_of_mass_measures
from gaitval.quantities.joint_power import joint_power
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject

ALL = range(101)
RECORD = synthetic_record()
RECORDED = recorded_curves(RECORD)
CURVE = np.sin(np.linspace(0.0, 2.0 * np.pi, 101)) + 2.0


def reach(value: Callable[[np.ndarray], float | None], size: float) -> list[int]:
    """Samples of `CURVE` at which a spike of this size changes a value."""
    before = value(CURVE)
    found = []
    for at in ALL:
        curve = CURVE.copy()
        curve[at] += size
        if value(curve) != before:
            found.append(at)
    return found


@pytest.mark.parametrize("field", ["rmse", "bias"])
def test_an_error_weighs_every_percent_of_the_cycle_alike(field: str) -> None:
    expected = {"rmse": 0.7 / np.sqrt(101), "bias": 0.7 / 101}[field]
    for at in ALL:
        curve = CURVE.copy()
        curve[at] += 0.7
        found = compare_curve(curve[None], CURVE)
        assert getattr(found, field) == pytest.approx(expected, rel=1e-12), at
        assert (found.peak_error, found.peak_percent) == (pytest.approx(0.7), at)


def test_a_correlation_sees_every_percent_of_the_cycle() -> None:
    assert reach(lambda c: compare_curve(c[None], CURVE).correlation, 0.7) == [*ALL]


def of_side(name: str, curve: np.ndarray, kind: str, side: str) -> float:
    """A measure of `side_values` of a curve that stands against `CURVE`."""
    plain = Curves(
        {},
        {f"ankle_angle_{s}": CURVE for s in "rl"},
        {f"vertical_{s}": CURVE for s in "rl"},
    )
    changed = {f"{kind}_{side[0]}": curve}
    walked = Curves(*({n: changed.get(n, c) for n, c in p.items()} for p in vars(plain).values()))
    return next(v for n, s, v in side_values(walked, plain) if (n, s) == (name, side))


@pytest.mark.parametrize("side", SIDES)
def test_the_first_peak_of_the_force_is_that_of_the_first_30_percent(side: str) -> None:
    def peak(curve: np.ndarray) -> float:
        return of_side("loading_peak_error", curve, "vertical", side)

    assert reach(peak, 5.0) == [*range(31)]


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("kind", ["vertical", "ankle_angle"])
def test_the_arm_of_the_pressure_is_that_of_the_flat_foot(kind: str, side: str) -> None:
    def arm(curve: np.ndarray) -> float:
        return of_side("pressure_arm_rmse", curve, kind, side)

    assert reach(arm, 1.0) == [*range(12, 53)]


@pytest.mark.parametrize("axis", range(3))
def test_the_path_of_the_centre_of_mass_is_compared_over_the_whole_cycle(axis: int) -> None:
    for at in ALL:
        path = np.zeros((101, 3))
        path[at, axis] = 0.01
        rows = centre_of_mass_measures(path, np.zeros((101, 3)))
        values = [row.value for row in rows if row.measure == "centre_of_mass_rmse"]
        assert values[axis] == pytest.approx(10.0 / np.sqrt(101))
        assert sum(values) == values[axis]


@pytest.mark.parametrize("kind", ["generated", "absorbed"])
def test_work_counts_every_percent_once(kind: str) -> None:
    """A moment at one sample, in a joint that turns steadily; sample 100 is 0 of the next cycle."""
    sign = 1.0 if kind == "generated" else -1.0
    angle = np.linspace(0.0, 1.0, 101)
    found = []
    for at in ALL:
        moment = np.zeros(101)
        moment[at] = sign
        joints = ("hip_flexion", "knee_angle", "ankle_angle")
        names = [f"{joint}_{side}" for joint in joints for side in "rl"]
        curves = Curves(dict.fromkeys(names, angle), dict.fromkeys(names, moment), {})
        work = joint_power(curves, {"r": 1.0, "l": 1.0}).figures[kind]["knee_angle_r"]
        if work:
            assert work == pytest.approx(0.01)
            found.append(at)
    assert found == [*range(100)]


def test_a_gait_profile_scores_every_percent_of_every_variable_alike() -> None:
    controls = load_controls().curves
    names = [f"{name}_{side[0]}" for name in controls for side in SIDES]
    for name in names:
        for at in (0, 9, 50, 91, 100):
            angles = {each: controls[each[:-2]].copy() for each in names}
            angles[name][at] += 3.0
            found = gait_profile(angles, controls)
            assert found.scores[name] == pytest.approx(3.0 / np.sqrt(101))
            assert found.total == pytest.approx(3.0 / np.sqrt(101) / np.sqrt(len(names)))


@pytest.mark.parametrize(
    ("part", "name"),
    [(kind, f"{name}_{side}") for kind, names in (("angles", ANGLES), ("moments", JOINT_MOMENTS),
     ("forces", FORCES)) for name in names for side in "rl"],
)  # fmt: skip
def test_epsilon_sees_every_percent_of_every_cycle_of_its_curves(part: str, name: str) -> None:
    units = {
        "angles": "angles_rad", "moments": "moments_nm_per_kg", "forces": "forces_body_weights"
    }  # fmt: skip

    def three_cycles(curves: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        return {key: np.tile(curve, (3, 1)) for key, curve in curves.items()}

    for cycle in range(3):
        for at in (0, 5, 50, 95, 100):
            walk = Curves(*(three_cycles(vars(RECORDED)[kind]) for kind in units))
            getattr(walk, part)[name][cycle, at] += 0.3
            assert getattr(epsilon(walk, RECORDED), units[part]) == pytest.approx(0.3 / 303)


def offset_cycles(cycles: int, settling: int) -> Iterable[tuple[str, int, int]]:
    """Each cycle that counts of each side, and how many there are, in a walk of whole strides.

    The right foot starts on the ground, so its first strike is not seen. The left one strikes half
    a stride later, and its last cycle would end after the walk.
    """
    for side, count in (("right", cycles - 1 - settling), ("left", cycles - 2 - settling)):
        for cycle in range(count):
            yield side, cycle, count


@pytest.mark.parametrize(("cycles", "settling"), [(6, 1), (7, 2)])
def test_every_cycle_after_the_settling_ones_is_in_the_means_and_counts_alike(
    cycles: int, settling: int
) -> None:
    walk = perfect_walk(RECORD, cycles=cycles + 0.2)
    found = find_cycles(walk, sharp_filter(settling_cycles=settling))
    for side, cycle, count in offset_cycles(cycles, settling):
        assert found.count(side) == count
        start, end = int(found.starts[side][cycle]), int(found.ends[side][cycle])
        inside = slice(start + 3, end - 2)  # off the samples shared with the cycles beside it
        positions = walk.positions.copy()
        knee = f"knee_angle_{side[0]}"
        positions[inside, COORDINATES.index(knee)] += 0.1
        changed = simulated_curves(replace(walk, positions=positions), found, mass=MASS,
                                   filters=LowPass(100.0, 100.0)).angles[knee]  # fmt: skip
        error = changed.mean(axis=0) - RECORDED.angles[knee]
        assert error[50] == pytest.approx(0.1 / count, abs=2e-3)


def test_speed_and_times_are_of_all_cycles() -> None:
    """One stride that is longer in time, wherever it is, changes the mean by its share."""
    walk = perfect_walk(RECORD, cycles=6.2)
    found = find_cycles(walk, sharp_filter(settling_cycles=1))
    places = {side: np.zeros((found.count(side), 2)) for side in SIDES}
    times = spatiotemporal(walk, found, places)
    for side in SIDES:
        assert len(times[f"stride_time_{side}"]) == found.count(side)
        assert times[f"stride_time_{side}"] == pytest.approx(STRIDE_TIME, abs=0.011)
    for cycle in range(found.count("right")):
        place = walk.centre_of_mass.copy()
        place[int(found.starts["right"][cycle]) + 1 :, 0] += 0.1
        faster = walking_speed(replace(walk, centre_of_mass=place), found)
        total = found.count("right") * STRIDE_TIME
        assert faster - walking_speed(walk, found) == pytest.approx(0.1 / total, rel=0.02)


@pytest.mark.parametrize("side", SIDES)
def test_the_transient_is_that_of_early_stance(side: str) -> None:
    model = scale_subject(load_subject("S05")).model
    walk = perfect_walk(RECORD, cycles=4.2)
    cycles = find_cycles(walk, sharp_filter(settling_cycles=1)).first(1)
    column = SIDES.index(side)
    start = int(cycles.starts[side][0])
    stop = int(next(at for at in cycles.events[side].toe_offs if at > start))
    before = foot_contacts(walk, cycles, model, threshold=20.0)[side].transient[0]
    seen = []
    for at in range(start, stop):
        ground = walk.ground_reaction.copy()
        ground[at, column, 2] += 5000.0
        spiked = replace(walk, ground_reaction=ground)
        if foot_contacts(spiked, cycles, model, threshold=20.0)[side].transient[0] != before:
            seen.append((at - start) / (stop - start))
    assert seen[0] == 0.0
    assert EARLY - 0.03 < seen[-1] < EARLY
