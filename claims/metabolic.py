"""Metabolic rate of walking against what people were measured to need.

Every walk is that of a stored policy; with a load or a device its motion is kept, so what changes
is what the muscles have to do. What is known is kept below `work`.
"""

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import claims
from claims import Claim
from claims.rows import STARTED
from gaitval.quantities.metabolic_rate import expected_rate

if TYPE_CHECKING:
    from gaitval.apps.devices.study import Wearer
    from gaitval.arrays import Array
    from gaitval.quantities.metabolic_cost import MetabolicCost
    from gaitval.simulation.rollout import Rollout

TEN: Final = tuple(range(1, 11))
CYCLES: Final = 8.0
"""So many that the shortest strides leave whole ones after the walk has settled."""
STRIDES: Final = 100.0
LOADS: Final = {"sildbw0": 0.0, "sild10w0": 10.0, "sild20w0": 20.0, "sild30w0": 30.0}
"""% of body mass of the conditions on the level that were given of Silder and others."""
LEGS: Final = ("foot_2kg", "shank_2kg", "thigh_2kg", "foot_4kg", "shank_4kg", "thigh_4kg")
MORE: Final = (
    *(("foot_4kg", "foot_2kg"), ("shank_4kg", "shank_2kg"), ("thigh_4kg", "thigh_2kg")),
    *(("foot_2kg", "shank_2kg"), ("shank_2kg", "thigh_2kg"), ("foot_2kg", "thigh_2kg")),
    *(("foot_4kg", "shank_4kg"), ("shank_4kg", "thigh_4kg"), ("foot_4kg", "thigh_4kg")),
)
"""The first of each pair costs more: net rate rises with the load's mass and with how distal it is
(Browning et al. 2007, Med Sci Sports Exerc 39:515, abstract)."""
ANKLE: Final = ("jackpower2", "jackpower3", "jackpower4", "jackpower5", "jackpower6")
"""Conditions of Jackson and Collins (2015), J Appl Physiol 119:541, in the order in which the rates
of `measured.csv` fall. `jackpower1` has the lowest but one and no net work that is known: it is
left out."""
NO_WORK: Final = "jackpower3"
"""The nearest to no net work: with most work the rate is 17 % lower than in it (their abstract)."""
WORK_RATES: Final = (-0.054, 0.25)
"""W/kg, least and most net work of the exoskeleton on one ankle (their abstract); those between
are taken to be evenly spaced."""
ANKLE_SPEED: Final = 1.25
NEAR: Final = 0.25
"""m/s: the speed of all of them (their abstract), and how much slower or faster the walks may be
that are held against it. An exoskeleton that does 0.25 W/kg at that speed would have to do ten
times what an ankle does in walks of 0.6 m/s, with torques that no leg can hold against."""
TORQUE: Final = 0.12
"""Nm/kg, its mean torque over the stride in all of them (their abstract)."""
SPEEDS: Final = tuple(np.arange(0.7, 1.81, 0.1).round(2).tolist())


def _ankle_torque(rate: "Array", work: float) -> "Array":
    """(T,) Nm/kg, plantarflexing (negative), over a stride whose ankle turns by `rate` (T,) rad/s:
    of a share that resists dorsiflexion and one that pushes off, so much of each that mean torque
    and net `work` rate are those wanted.
    """
    phase = np.linspace(0.0, 1.0, len(rate))
    bumps = [np.exp(-0.5 * ((phase - at) / wide) ** 2) for at, wide in ((0.32, 0.08), (0.52, 0.05))]
    table = np.array([[each.mean() for each in bumps], [(-each * rate).mean() for each in bumps]])
    return -np.asarray(np.linalg.solve(table, [TORQUE, work]) @ np.array(bumps))


def _costs(number: int, path: Path) -> dict[str, Any]:
    """Gross rates W/kg by condition and model of one person; `path` keeps those that are known, so
    that a run which was stopped goes on.
    """
    from gaitval.apps.devices.adaptation import kinematics_kept, walk_without
    from gaitval.apps.devices.study import device_muscles, wearer
    from gaitval.apps.devices.walking import DeviceEnvironment, with_devices
    from gaitval.model.devices.device import shipped_device
    from gaitval.model.devices.loads import trunk_load

    found: dict[str, Any] = json.loads(path.read_text("utf-8")) if path.is_file() else {}
    if set(found) >= {"speed", "none", *LOADS, *LEGS, *ANKLE} - {"sildbw0"}:
        return found
    person = wearer(str(number))
    plain = walk_without(with_devices(person.task, ()), person.policy, person.mu, CYCLES)

    def keep(name: str, cost: "MetabolicCost | None") -> None:
        assert cost is not None
        found.update({name: dict(cost.gross), "speed": cost.speed})
        path.write_text(json.dumps(found), encoding="utf-8")
        print(number, name, {each: round(rate, 2) for each, rate in cost.gross.items()}, flush=True)

    if "none" not in found:
        keep("none", device_muscles(person, (), plain, None)[1])
    worn = {each: trunk_load(of, person.task.model.mass) for each, of in LOADS.items() if of}
    worn |= {each: shipped_device(each) for each in LEGS}
    for name, device in worn.items():
        if name not in found:
            task = with_devices(person.task, (device,))
            kept = kinematics_kept(DeviceEnvironment(task), plain.rollout)
            keep(name, device_muscles(person, (device,), kept.walk, kept.own)[1])
    for name, work in zip(ANKLE, np.linspace(*WORK_RATES, len(ANKLE)), strict=True):
        if name not in found:
            keep(name, _helped(person, plain.rollout, float(work)))
    return found


def _helped(person: "Wearer", rollout: "Rollout", work: float) -> "MetabolicCost | None":
    """What a walk costs whose right ankle is helped with a net `work` rate, W/kg."""
    from gaitval.coordinates import ACTUATED
    from gaitval.metrics.cycles import find_cycles
    from gaitval.metrics.walk_muscles import walk_motion
    from gaitval.model.parameters import apply_parameters
    from gaitval.model.tree import ROOT_DOFS
    from gaitval.musculature.gait import muscles_of
    from gaitval.quantities.metabolic_cost import metabolic_cost

    assert person.height is not None
    cycles = find_cycles(rollout, person.task.configuration)
    body = apply_parameters(person.task.model, person.mu)
    ankle = ACTUATED.index("ankle_angle_r")
    torques = np.zeros_like(rollout.moments)
    for a, b in zip(cycles.starts["right"], cycles.ends["right"], strict=True):
        rate = rollout.velocities[a:b, ROOT_DOFS + ankle]
        torques[a:b, ankle] = person.task.model.mass * _ankle_torque(rate, work)
    motion = walk_motion(rollout, cycles, body, height=person.height, torques=torques)
    return metabolic_cost([motion], muscles_of([motion]))


def _all(given: claims.Given) -> dict[int, dict[str, Any]]:
    folder = given.work / f"metabolic-{STARTED}"
    folder.mkdir(parents=True, exist_ok=True)
    return {number: _costs(number, folder / f"{number}.json") for number in TEN}


def _middle(rates: Mapping[str, float]) -> float:
    return 0.5 * (rates["bhargava"] + rates["joints"])


def _models(costs: Mapping[int, Mapping[str, Any]]) -> dict[str, Any]:
    """How a rate is read of one condition: by each model, and the mean of two."""
    names = list(costs[TEN[0]]["none"])
    return {"mean of two": _middle} | {name: lambda rates, n=name: rates[n] for name in names}


MEASURED: Final = {
    0.75: (3.36, 13),
    1.0: (3.54, 22),
    1.25: (4.47, 13),
    1.5: (4.91, 22),
    1.75: (6.56, 13),
}
"""Gross rate, W/kg, and number of people by speed, m/s: 35 adults of Slade et al. (2021), Nat
Commun 12:4312, by `experiments/level_rates.py`, which has why `expected_rate` is what rates are
held against."""
ABOUT: Final = 0.13
"""m/s, how much slower or faster a walk may be than people whose mean is held against its band."""


def _of_measured(speed: float) -> float:
    """Gross rate of those who were `MEASURED`, in between in proportion to `expected_rate`."""
    share = [rate / expected_rate(at) for at, (rate, _) in MEASURED.items()]
    return expected_rate(speed) * float(np.interp(speed, list(MEASURED), share))


def _means_inside(costs: Mapping[int, Mapping[str, Any]]) -> list[bool]:
    """Whether means of people lie in the bands of a group of walks at about their speed: what the
    model is off, and who was measured.
    """
    from gaitval.apps.devices.costs import REACH
    from gaitval.quantities.metabolic_cost import MODEL, PEOPLE

    found = []
    for each in costs.values():
        middle, expected = _middle(each["none"]), expected_rate(each["speed"])
        for at, (rate, people) in MEASURED.items():
            if abs(each["speed"] - at) < ABOUT:
                reach = REACH * float(np.hypot(MODEL, PEOPLE / np.sqrt(people)))
                found.append(abs(rate * expected / expected_rate(at) / middle - 1.0) <= reach)
    return found


@claims.measured()
def level(given: claims.Given) -> list[Claim]:
    """Gross rate of the ten people's level walks against what is expected of their speeds, and
    against people who were measured, where those walked.
    """
    costs = _all(given)
    rows = []
    for name, read in _models(costs).items():
        off = [read(each["none"]) / expected_rate(each["speed"]) - 1.0 for each in costs.values()]
        rows += _errors(f"gross rate, {name}", off)
        walked = [
            read(each["none"]) / _of_measured(each["speed"]) - 1.0
            for each in costs.values()
            if min(MEASURED) <= each["speed"] <= max(MEASURED)
        ]
        rows += _errors(f"gross rate, {name}, against measured people", walked)
    rows += _errors("gross rate, joints of records", _recorded())
    inside = _means_inside(costs)
    share = _percent(inside)
    return [*rows, Claim("measured means inside the band of a group", share, "%", len(inside))]


def _errors(name: str, off: Sequence[float]) -> list[Claim]:
    print(name, np.round(100.0 * np.array(off), 1), flush=True)
    mean, largest = 100.0 * float(np.mean(off)), 100.0 * float(np.abs(off).max())
    return [
        Claim(f"{name}: mean error", mean, "%", len(off)),
        Claim(f"{name}: largest error", largest, "%", len(off)),
    ]


def _recorded() -> list[float]:
    """Share by which the joints' rate of each record is off what is expected at its speed."""
    from gaitval.datasets.subject_file import load_subject
    from gaitval.gait.cycle_curves import recorded_curves
    from gaitval.quantities.metabolic_rate import joint_rates

    off = []
    for number in TEN:
        record = load_subject(str(number)).record()
        found = joint_rates(recorded_curves(record), dict.fromkeys("rl", record.stride_time))
        assert found is not None
        gross = np.mean([rate for rate in found.figures["gross"].values() if rate is not None])
        off.append(float(gross / expected_rate(record.speed) - 1.0))
    return off


@claims.measured("data")
def loads(given: claims.Given) -> list[Claim]:
    """A vest of 10 to 30 % of body mass and masses on the legs, against Silder's and Browning's."""
    from scipy.stats import spearmanr

    measured = rates_of(given.data, "silder", tuple(LOADS)).mean(axis=0)
    costs = _all(given)
    rows = []
    for name, read in _models(costs).items():
        predicted = np.array(
            [
                np.mean([read(each["none" if not load else key]) for each in costs.values()])
                for key, load in LOADS.items()
            ]
        )
        print(name, predicted.round(2), measured.round(2), flush=True)
        rank = float(spearmanr(predicted, measured).statistic)
        slope = float(np.polyfit(measured, predicted, 1)[0])
        rows.append(Claim(f"vest, {name}: rank correlation", rank, "1", len(LOADS)))
        rows.append(Claim(f"vest, {name}: slope on measured", slope, "1", len(LOADS)))
        means = {key: np.mean([read(each[key]) for each in costs.values()]) for key in LEGS}
        right = [bool(means[more] > means[less]) for more, less in MORE]
        rows.append(
            Claim(f"masses on legs, {name}: pairs in order", 100.0 * np.mean(right), "%", len(MORE))
        )
    return rows + coverage("vest", near(costs), "none", measured_changes(given, "silder"))


def measured_changes(given: claims.Given, experiment: str) -> "dict[str, Array]":
    """Changes (people,) W/kg that people were measured at, by condition: of Silder's vests from
    none, or of the powered ankle from `NO_WORK`.
    """
    names, before = {"silder": (tuple(LOADS), "sildbw0"), "jackson": (ANKLE, NO_WORK)}[experiment]
    rates = rates_of(given.data, experiment, names)
    least = rates[:, names.index(before)]
    return {key: rates[:, i] - least for i, key in enumerate(names) if key != before}


def walked_with(given: claims.Given) -> dict[int, Mapping[str, Any]]:
    """Rates of people who walk about as fast as people were measured, by condition of `metabolic`:
    with a vest, masses on the legs, and a powered ankle.
    """
    return near(_all(given))


def modelled(costs: Mapping[int, Mapping[str, Any]], before: str, now: str) -> "dict[str, Array]":
    """Change (people,) W/kg by model, of `costs` by person, from one condition to another."""
    models = next(iter(costs.values()))[before]
    return {
        m: np.array([each[now][m] - each[before][m] for each in costs.values()]) for m in models
    }


def coverage(
    what: str,
    costs: Mapping[int, Mapping[str, Any]],
    before: str,
    changes: Mapping[str, "Array"],
) -> list[Claim]:
    """Whether measured `changes` (people,) W/kg of the rate, by condition, lie in the bands that
    the `costs` of others give of the change from the condition `before`: means in the band of a
    group, people in that of a person.
    """
    from gaitval.apps.devices.costs import group_band, person_band

    means, people = [], []
    for now, measured in changes.items():
        found = modelled(costs, before, now)
        low, high = group_band(found, len(measured))
        means.append(low <= measured.mean() <= high)
        text = f"{low:.2f} to {high:.2f}, measured {measured.mean():.2f}"
        low, high = person_band({model: float(each.mean()) for model, each in found.items()})
        inside = (low <= measured) & (measured <= high)
        people += inside.tolist()
        text += f"; of a person {low:.2f} to {high:.2f}, {inside.sum()} of {len(inside)}"
        print(now, "against", before, text, flush=True)
    return [
        Claim(f"{what}: measured changes inside the band", _percent(means), "%", len(means)),
        Claim(f"{what}: people inside a person's band", _percent(people), "%", len(people)),
    ]


def near(costs: Mapping[int, Mapping[str, Any]]) -> dict[int, Mapping[str, Any]]:
    """Of `costs` those of people who walk about as fast as people were measured."""
    return {n: each for n, each in costs.items() if abs(each["speed"] - ANKLE_SPEED) < NEAR}


def _percent(found: Sequence[bool]) -> float:
    return 100.0 * float(np.mean(found))


@claims.measured()
def carried(given: claims.Given) -> list[Claim]:
    """Whether the ten walk on with a vest of 20 and 30 % of body mass, the control kept, held to
    their speed and cadence.
    """
    from gaitval.apps.devices.adaptation import walk_without
    from gaitval.apps.devices.study import pace_of, wearer
    from gaitval.apps.devices.walking import DeviceEnvironment, walk_with, with_devices
    from gaitval.model.devices.loads import trunk_load

    stood: dict[float, list[bool]] = {20.0: [], 30.0: []}
    for number in TEN:
        person = wearer(str(number))
        task = with_devices(person.task, ())
        plain = walk_without(task, person.policy, person.mu, CYCLES)
        pace = pace_of(plain, person.task)
        for load, found in stood.items():
            laden = with_devices(person.task, (trunk_load(load, person.task.model.mass),))
            environment = DeviceEnvironment(laden, pace=pace)
            walk = walk_with(environment, person.policy, mu=person.mu, cycles=STRIDES)
            found.append(not walk.rollout.fell[0])
            cycles = float(walk.rollout.phase[-1])
            print(number, load, "walked" if found[-1] else "fell", round(cycles, 1), flush=True)
    return [
        Claim(f"vest of {load:g} %: people who walk 100 cycles", float(sum(found)), "people", 10)
        for load, found in stood.items()
    ]


@claims.measured("data")
def ankle(given: claims.Given) -> list[Claim]:
    """A powered ankle of five sizes, the motion kept, of those who walk about as fast as its
    wearers: pairs whose order is that measured.
    """
    rates = rates_of(given.data, "jackson", ANKLE)
    measured, costs = rates.mean(axis=0), near(_all(given))
    rows = []
    for name, read in _models(costs).items():
        means = [np.mean([read(each[key]) for each in costs.values()]) for key in ANKLE]
        print(name, np.round(means, 2), measured.round(2), flush=True)
        right = [
            (means[i] > means[j]) == (measured[i] > measured[j])
            for i in range(len(ANKLE))
            for j in range(i)
        ]
        rows.append(
            Claim(f"ankle, {name}: pairs in order", 100.0 * np.mean(right), "%", len(right))
        )
    return rows + coverage("ankle", costs, NO_WORK, measured_changes(given, "jackson"))


@claims.measured()
def cheapest(given: claims.Given) -> list[Claim]:
    """Speed at which a metre costs the ten people least, by the joints of their records at speeds
    that are predicted of them.
    """
    from gaitval.configuration import RecordSettings
    from gaitval.datasets.subject_file import builtin_subjects, load_subject
    from gaitval.errors import SubjectError
    from gaitval.gait.cycle_curves import recorded_curves
    from gaitval.prediction.known import known_record
    from gaitval.quantities.metabolic_rate import joint_rates

    people = builtin_subjects()
    best = []
    for number in TEN:
        person = load_subject(str(number))
        cost = {}
        for speed in SPEEDS:
            try:
                record = known_record(
                    person, RecordSettings(), people, speed=speed, forced=True
                ).record
            except SubjectError:
                continue
            found = joint_rates(recorded_curves(record), dict.fromkeys("rl", record.stride_time))
            assert found is not None
            gross = [rate for rate in found.figures["gross"].values() if rate is not None]
            cost[speed] = float(np.mean(gross)) / speed
        print(number, {k: round(v, 2) for k, v in cost.items()}, flush=True)
        best.append(min(cost, key=cost.__getitem__))
    return [
        Claim("speed of the least cost, joints: median", float(np.median(best)), "m/s", len(best)),
        Claim("speed of the least cost, joints: lowest", float(np.min(best)), "m/s", len(best)),
        Claim("speed of the least cost, joints: highest", float(np.max(best)), "m/s", len(best)),
    ]


def rates_of(data: Path, experiment: str, conditions: tuple[str, ...]) -> "Array":
    """(people, conditions) rate, W/kg, of the people who did all of the `conditions`."""
    rates: dict[str, dict[str, float]] = {}
    with (data / "metabolic" / "measured.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            if row["experiment"] == experiment and row["condition"] in conditions:
                own = rates.setdefault(row["subject"], {})
                own[row["condition"]] = float(row["metabolic_w_kg"])
    whole = [own for own in rates.values() if len(own) == len(conditions)]
    return np.array([[own[each] for each in conditions] for own in whole])
