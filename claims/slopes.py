"""Walks on slopes and with loads, predicted from level records, against published people.

Every walk is that of a stored policy, untrained for the slope, on a reference that is fitted to
what is expected there (`gaitval.prediction.slopes`). What a slope changes is told from the walk on
the level by the same route. What is known is kept below `work`, so that a run which was stopped
goes on.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

import claims
from claims import Claim
from claims.rows import STARTED

if TYPE_CHECKING:
    from gaitval.arrays import Array
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
    from gaitval.metrics.torques import torques_of
    from gaitval.metrics.walk_muscles import walk_motion
    from gaitval.model.parameters import apply_parameters
    from gaitval.musculature.gait import muscles_of
    from gaitval.policy.environment import WalkingEnvironment
    from gaitval.policy.rollouts import record_rollout
    from gaitval.prediction.slopes import ground_of
    from gaitval.quantities.metabolic_cost import metabolic_cost
    from gaitval.quantities.metabolic_rate import joint_rates

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
    found["energy"] = torques_of(
        walk, cycles, model=task.model, height=policy.subject.height_m
    ).energy
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
    stride_time = found["stride_length"] / found["speed"]
    rates = joint_rates(curves, dict.fromkeys("rl", stride_time))
    assert rates is not None
    legs = [rate for rate in rates.figures["gross"].values() if rate is not None]
    found["joints"] = float(np.mean(legs))
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


def _mean(walks: Mapping[int, Mapping[str, Any]], condition: str, name: str) -> "Array":
    """Of the people, the mean of a number or curve of their walks in a `condition`."""
    return np.mean([np.asarray(each[condition][name]) for each in walks.values()], axis=0)


def _work(walks: Mapping[int, Mapping[str, Any]], condition: str) -> dict[str, float]:
    """J/kg that each joint of a leg does in stance, positive and negative, mean of the people, from
    mean curves.
    """
    found: dict[str, float] = {}
    for joint in _CURVES:
        done = []
        for each in walks.values():
            moment, angle = (
                np.array(each[condition][f"{kind}_{joint}"]) for kind in ("moments", "angles")
            )
            work = 0.5 * (moment[1:] + moment[:-1]) * np.diff(angle)
            stance = work[:STANCE]
            done.append([stance[stance > 0.0].sum(), stance[stance < 0.0].sum()])
        found[f"{joint}+"], found[f"{joint}-"] = np.mean(done, axis=0).tolist()
    return found


def _share(work: Mapping[str, float], joint: str, sign: str) -> float:
    return work[f"{joint}{sign}"] / sum(work[f"{each}{sign}"] for each in _CURVES)


STANCE: Final = 62
"""% of the cycle."""


class PublishedChange(NamedTuple):
    """What a study says of a change from level ground.

    Attributes
    ----------
    source, locator : read there.
    what : the quantity, a key of `_measures`.
    condition : ours that is nearest.
    sign : of the change.
    size, error : its value and standard error, where the study tells both.
    """

    source: str
    locator: str
    what: str
    condition: str
    sign: int
    size: float | None = None
    error: float | None = None


FRANZ: Final = "Franz and Kram (2012), Gait Posture 35:143"
HONG: Final = "Hong et al. (2014), Gait Posture 39:29"
MONTGOMERY: Final = "Montgomery and Grabowski (2018), J R Soc Interface 15:20180550"
PUBLISHED: Final = (
    PublishedChange(FRANZ, "table 1", "step length", "down_10", -1, 100 * (0.93 / 0.98 - 1.0), 1.5),
    PublishedChange(FRANZ, "table 1", "step length", "up_10", 1, 100 * (0.93 / 0.91 - 1.0), 2.4),
    PublishedChange("Kafetzakis et al. (2024), Appl Sci 14:4383", "abstract, -10 %", "step length",
              "down_10", -1),
    PublishedChange("Sakurai, Kuster and Wood (1994)", "abstract, -19.3 %: 2.60 for 1.16 Nm/kg",
              "knee extension moment", "down_10", 1),
    PublishedChange(HONG, "abstract: contributions to the first peak unaltered", "support moment",
              "up_10", 1),
    PublishedChange(HONG, "abstract", "hip extension moment", "up_10", 1),
    PublishedChange(HONG, "abstract", "knee at the first peak", "up_10", 1),
    PublishedChange(HONG, "abstract", "ankle at the first peak", "up_10", 1),
    PublishedChange(MONTGOMERY, "abstract, +9 deg .37 for .33", "hip share +", "up_10", 1),
    PublishedChange(MONTGOMERY, "abstract, +9 deg .29 for .19", "hip share -", "up_10", 1),
    PublishedChange(MONTGOMERY, "abstract, -9 deg .17 for .19", "hip share -", "down_10", -1),
    PublishedChange(MONTGOMERY, "abstract, +9 deg .27 for .42", "ankle share -", "up_10", -1),
    PublishedChange(MONTGOMERY, "abstract, -9 deg .38 for .42", "ankle share -", "down_10", -1),
)  # fmt: skip
"""Only what was read, and at slopes that people were measured on; errors of step length by Taylor's
rule from the standard errors of stride frequency. Strides are an input of the prediction, so the
first two tell that the walks keep them, and the third is another laboratory's."""


def _measures(walks: Mapping[int, Mapping[str, Any]], condition: str) -> dict[str, float]:
    """Figures of a condition by the names that `PUBLISHED` calls them."""
    hip, knee, ankle = (-_mean(walks, condition, f"moments_{joint}") for joint in _CURVES)
    work, first = _work(walks, condition), slice(3, 31)
    peak = first.start + int(np.argmax((hip + knee + ankle)[first]))
    return {
        "step length": float(_mean(walks, condition, "stride_length")),
        "knee extension moment": float(knee[first].max()),
        "hip extension moment": float(hip[first].max()),
        "support moment": float((hip + knee + ankle)[peak]),
        "knee at the first peak": float(knee[peak]),
        "ankle at the first peak": float(ankle[peak]),
        **{
            f"{joint.split('_')[0]} share {sign}": _share(work, joint, sign)
            for joint in _CURVES
            for sign in "+-"
        },
    }


@claims.measured()
def walked(given: claims.Given) -> list[Claim]:
    """People of ten who walk 100 cycles on slopes and with loads, and their walks' balances."""
    walks = _all(given)
    rows = []
    for name in CONDITIONS:
        stood = [
            not each[name]["fell"] and each[name]["cycles"] >= 100.0 for each in walks.values()
        ]
        rows.append(
            Claim(f"{name}: people who walk 100 cycles", float(sum(stood)), "people", len(stood))
        )
    steep = [name for name, (slope, _) in CONDITIONS.items() if slope]
    known = [each[name] for each in walks.values() for name in steep if "energy" in each[name]]
    momentum = [each["momentum"] for each in known]
    energy = [100.0 * abs(each["energy"]["unexplained"]) / each["work"] for each in known]
    lifted = [
        100.0 * abs(each["energy"]["unexplained"] / each["energy"]["change"]) for each in known
    ]
    rows.append(Claim("slopes, momentum balance: largest", max(momentum), "% BW", len(known)))
    rows.append(
        Claim("slopes, energy balance of the joints' work: largest", max(energy), "%", len(known))
    )
    rows.append(
        Claim("slopes, energy balance of the work against gravity: largest", max(lifted), "%",
              len(known))
    )  # fmt: skip
    return rows


@claims.measured()
def published(given: claims.Given) -> list[Claim]:
    """Changes on slopes of ten percent against published ones: signs, and sizes where known."""
    walks = _all(given)
    level, right, inside = _measures(walks, "level"), [], []
    for each in PUBLISHED:
        there = _measures(walks, each.condition)[each.what]
        change = there - level[each.what]
        right.append(bool(change * each.sign > 0.0))
        print(each.what, each.condition, round(level[each.what], 3), round(there, 3),
              "as" if right[-1] else "NOT AS", each.source, flush=True)  # fmt: skip
        if each.size is not None and each.error is not None:
            percent = 100.0 * change / level[each.what]
            inside.append(abs(percent - each.size) <= 1.96 * each.error)
    studies = len({each.source for each in PUBLISHED})
    return [
        Claim("slopes: published signs", float(sum(right)), f"of {len(right)}", studies),
        Claim("slopes: sizes within the study's 95 %", float(sum(inside)), f"of {len(inside)}", 1),
    ]


def graded_change(speed: float, slope: float) -> float:
    """W/kg that walking at a `speed` (m/s) costs more on a `slope` (%) than on the level, by the
    graded load carriage equation: Looney et al. (2019) Med Sci Sports Exerc 51:1954, of 95 people
    of 11 studies on -40 to 45 %, whose error for a person is 0.42 W/kg (the abstract; the equation
    as three public programs have it).
    """
    return float(0.34 * speed * slope * (1.0 - 1.05 ** (1.0 - 1.1 ** (slope + 32.0))))


GRADED: Final = {name: slope for name, (slope, load) in CONDITIONS.items() if slope and not load}
"""Slopes, %, without a load."""


@claims.measured()
def graded(given: claims.Given) -> list[Claim]:
    """Change of metabolic rate on slopes, by the joints, against the graded equation, at the speed
    of each walk; no number of the joints' model was found on a slope.
    """
    walks = _all(given)
    rows = []
    for name, slope in GRADED.items():
        changes = [each[name]["joints"] - each["level"]["joints"] for each in walks.values()]
        expected = [graded_change(each[name]["speed"], slope) for each in walks.values()]
        at, off = f"{name}, joints", np.array(changes) - np.array(expected)
        print(at, np.round(changes, 2), np.round(expected, 2), flush=True)
        mean, missed = float(np.mean(changes)), float(off.mean())
        rows.append(Claim(f"{at}: change of rate", mean, "W/kg", len(walks)))
        rows.append(Claim(f"{at}: off the graded equation", missed, "W/kg", len(walks)))
    return rows


@claims.measured("data")
def cost(given: claims.Given) -> list[Claim]:
    """Change of metabolic rate with a vest and on 5 % against Silder's, who were given: of the ten,
    and of those who walk about as fast as adults choose to, for lifting costs by speed.
    """
    from scipy.stats import spearmanr

    from claims.metabolic import _middle, coverage, rates_of

    names, walks, usual = tuple(SILDER), _all(given), _usual(given)
    rates = rates_of(given.data, "silder", tuple(SILDER.values()))
    measured = rates.mean(axis=0)
    rows = []
    for title, read in (("mean of two", _middle), ("joints", lambda rates: rates["joints"])):
        for who, some in (("", walks), (f", {len(usual)} at usual speed", usual)):
            predicted = np.array(
                [np.mean([read(each[name]["gross"]) for each in some.values()]) for name in names]
            )
            print(title, who, predicted.round(2), measured.round(2), flush=True)
            rank = float(spearmanr(predicted, measured).statistic)
            slope = float(np.polyfit(measured, predicted, 1)[0])
            what = f"vest and 5 %, {title}{who}"
            rows.append(Claim(f"{what}: rank correlation", rank, "1", len(names)))
            rows.append(Claim(f"{what}: slope on measured", slope, "1", len(names)))
    changes = {name: rates[:, i] - rates[:, 0] for i, name in enumerate(names) if i}
    return rows + coverage("vest and 5 %", _gross(usual), "level", changes)


SILDER: Final = {
    "level": "sildbw0", "load_10": "sild10w0", "load_20": "sild20w0", "load_30": "sild30w0",
    "up_5": "sildbw5", "up_5_load_20": "sild20w5",
}  # fmt: skip
"""Conditions of Silder and others that were given, by ours."""


def _usual(given: claims.Given) -> dict[int, dict[str, Any]]:
    """Walks of those who walk about as fast as people were measured."""
    from claims.metabolic import ANKLE_SPEED, NEAR

    return {
        number: each
        for number, each in _all(given).items()
        if abs(each["level"]["speed"] - ANKLE_SPEED) < NEAR
    }


def _gross(walks: Mapping[int, Mapping[str, Any]]) -> dict[int, dict[str, Any]]:
    """Gross rates by model, by person and condition."""
    return {n: {name: each[name]["gross"] for name in CONDITIONS} for n, each in walks.items()}


class MeasuredGroup(NamedTuple):
    """A mean change of metabolic rate that people were measured at, and others' by models.

    Attributes
    ----------
    study, what : who measured it, and in which condition.
    modelled : change (people,) W/kg of others by model.
    mean : of those who were measured, W/kg.
    people : how many they were.
    """

    study: str
    what: str
    modelled: "Mapping[str, Array]"
    mean: float
    people: int


LOADED: Final = {"load_10": 0.1, "load_20": 0.2, "load_30": 0.3}
"""Shares of body mass."""
SUPINE: Final = 3.1
"""ml of oxygen a minute and kg, at supine rest; the rate above it rises in direct proportion to a
load: `LUDLOW`, abstract, twenty people with 18 and 31 % of body weight at 0.6 to 1.4 m/s."""
OXYGEN: Final = 20.9
"""J for each ml of it, on a mixed diet mostly of carbohydrate."""
LUDLOW: Final = "Ludlow and Weyand (2017), J Appl Physiol 123:1288"
HUANG: Final = "Huang and Kuo (2014), J Exp Biol 217:605"
PER_LOAD: Final = 7.6
"""W for each kg of load: `HUANG`, abstract, eight people with up to 40 % of body weight."""


def _measured_groups(given: claims.Given) -> list[MeasuredGroup]:
    """Every mean change of people that was read, beside those of walks of ours."""
    from claims.metabolic import NO_WORK, measured_changes, modelled, rates_of, walked_with
    from gaitval.quantities.metabolic_rate import expected_rate

    groups = []
    for experiment, study, before in (
        ("jackson", "Jackson and Collins (2015)", NO_WORK),
        ("silder", "Silder et al.", "none"),
    ):
        for now, found in measured_changes(given, experiment).items():
            others = modelled(walked_with(given), before, now)
            groups.append(MeasuredGroup(study, now, others, float(found.mean()), len(found)))
    usual, ten = _usual(given), _all(given)
    rates = rates_of(given.data, "silder", tuple(SILDER.values()))
    for i, name in enumerate(SILDER):
        if i:
            others, mean = (
                modelled(_gross(usual), "level", name),
                (rates[:, i] - rates[:, 0]).mean(),
            )
            groups.append(MeasuredGroup("Silder et al.", name, others, float(mean), len(rates)))
    for name, slope in GRADED.items():
        mean = np.mean([graded_change(each[name]["speed"], slope) for each in ten.values()])
        others = modelled(_gross(ten), "level", name)
        groups.append(MeasuredGroup("Looney et al. (2019)", name, others, float(mean), 95))
    for name, share in LOADED.items():
        others = modelled(_gross(usual), "level", name)
        level = [expected_rate(each["level"]["speed"]) for each in usual.values()]
        walking = float(np.mean(level)) - SUPINE * OXYGEN / 60.0
        groups.append(MeasuredGroup(LUDLOW, name, others, share * walking, 20))
        groups.append(MeasuredGroup(HUANG, name, others, share * PER_LOAD, 8))
    return groups


def _common(groups: Sequence[MeasuredGroup]) -> float:
    """Standard deviation of what mean changes of `groups` are off those of models beyond what
    people explain, as a share of their size; every study counts the same.
    """
    from gaitval.apps.devices.costs import middle, own_error, size

    studies: dict[str, list[float]] = {}
    for each in groups:
        means = {model: float(values.mean()) for model, values in each.modelled.items()}
        off = each.mean - float(middle(means))
        own = own_error(each.modelled, each.people)
        studies.setdefault(each.study, []).append((off**2 - own**2) / size(means) ** 2)
    return float(np.sqrt(max(0.0, np.mean([np.mean(found) for found in studies.values()]))))


@claims.measured("data")
def common(given: claims.Given) -> list[Claim]:
    """What is common to people in the models' error of a change, by study, and whether measured
    means lie in the band of a group whose error the other studies say.
    """
    from gaitval.apps.devices.costs import COMMON, group_band

    groups = _measured_groups(given)
    # Of the same loads three studies say 2, 3 and 7.6 W for each kg: what the last is off is not
    # of models. Its means are held against the band all the same.
    known = [each for each in groups if each.study != HUANG]
    inside, shipped = [], []
    for each in groups:
        left = _common([other for other in known if other.study != each.study])
        low, high = group_band(each.modelled, each.people, left)
        inside.append(low <= each.mean <= high)
        text = f"{each.mean:.2f}, without the study {low:.2f} to {high:.2f}"
        low, high = group_band(each.modelled, each.people)
        shipped.append(low <= each.mean <= high)
        print(each.study, each.what, f"{text}, shipped {low:.2f} to {high:.2f}", flush=True)
    for study in dict.fromkeys(each.study for each in groups):
        print(study, round(_common([each for each in groups if each.study == study]), 2))
    title = "measured mean changes inside the band of a group"
    return [
        Claim("common error of a change, of its size", _common(known), "1", len(known)),
        Claim("common error of a change, shipped", COMMON, "1", len(known)),
        Claim(title, 100.0 * float(np.mean(shipped)), "%", len(groups)),
        Claim(f"{title}, its study left out", 100.0 * float(np.mean(inside)), "%", len(groups)),
    ]
