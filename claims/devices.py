"""Whether devices do to a person what they should; what is known is kept below `work`."""

import json
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.signal import lfilter

import claims
from claims import Claim
from claims.rows import STARTED
from gaitval.arrays import Array

if TYPE_CHECKING:
    from gaitval.apps.devices.device_walk import DeviceWalk
    from gaitval.apps.devices.study import Wearer
    from gaitval.model.devices.device import Device
    from gaitval.model.devices.springs_and_motors import Motor

EIGHT = (
    *("hip_exo", "knee_exo", "ankle_exo", "ankle_spring"),
    *("below_knee", "above_knee", "afo", "backpack"),
)
TEN = tuple(str(number) for number in range(1, 11))
CYCLES = 100.0
POWERED = ("hip_exo", "knee_exo", "ankle_exo")
SAMPLES = 400_000
"""Of a learned adaptation of a person whom a device makes fall."""
SAMPLES_OF_EXPERIMENTS = 150_000
PEOPLE = ("2", "5", "8")
"""Of the published experiments, whose adaptations take hours."""


@cache
def _person(name: str) -> "Wearer":
    from gaitval.apps.devices.study import wearer

    return wearer(name)


@cache
def _device(name: str) -> "Device":
    from gaitval.model.devices.device import shipped_device

    return shipped_device(name)


def _folder(given: claims.Given) -> Path:
    """What this commit has found so far, for a run that goes on."""
    return given.work / f"devices-{STARTED}"


def _once(work: Path, name: str, compute: Callable[[], Any]) -> Any:
    """What `compute` gives, or gave in an earlier run; the folder `work` keeps it as JSON."""
    path = work / f"{name}.json"
    if path.is_file():
        return json.loads(path.read_text(encoding="utf-8"))
    found = compute()
    work.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(found), encoding="utf-8")
    print(f"{name}: {found}", flush=True)
    return found


def _lagged(command: Array, motor: "Motor", step: float) -> Array:
    """(T,) Nm, what the motor's bandwidth alone makes of a `command` (T,) at steps of `step` s."""
    part = float(-np.expm1(-2.0 * np.pi * motor.bandwidth * step))
    return np.asarray(lfilter([part], [1.0, part - 1.0], command))


def torque_errors(walk: "DeviceWalk", device: "Device") -> dict[str, float]:
    """RMS difference of the torque on the limb from the command, bandwidth and delay aside, over
    the command's largest value; by hinge with a motor.
    """
    step = float(walk.rollout.time[1] - walk.rollout.time[0])
    motors = {hinge.joint: hinge.motor for hinge in device.hinges if hinge.motor is not None}
    found = {}
    for h, name in enumerate(walk.hinges):
        if (motor := motors.get(name[:-2])) is not None:
            wanted = _lagged(walk.command[:, h], motor, step)
            rms = np.sqrt(np.mean((walk.limb[:, h] - wanted) ** 2))
            found[name] = float(rms / np.abs(wanted).max())
    return found


def _walks(person: str, device: str, samples: int) -> dict[str, float]:
    """Gait cycles of a person with a device: as they are and, if they fall, after learning."""
    from gaitval.apps.devices.learning import adapt
    from gaitval.apps.devices.walking import DeviceEnvironment, walk_with, with_devices

    who, fitted = _person(person), _device(device)
    task = with_devices(who.task, [fitted])
    environment = DeviceEnvironment(task)
    began = time.process_time()
    walk = walk_with(environment, who.policy, mu=who.mu, cycles=CYCLES)
    errors = torque_errors(walk, fitted) if not walk.rollout.fell[0] else {}
    found = {
        "cycles": float(walk.rollout.phase[-1]),
        "fell": float(walk.rollout.fell[0]),
        "torque": max(errors.values(), default=float("nan")),
    }
    if found["fell"] and samples:
        policy = adapt(task, who.policy, samples=samples)
        learned = walk_with(environment, policy, mu=who.mu, cycles=CYCLES)
        found["learned cycles"] = float(learned.rollout.phase[-1])
        found["learned fell"] = float(learned.rollout.fell[0])
    return found | {"seconds": time.process_time() - began}


@claims.measured()
def walks(given: claims.Given) -> list[Claim]:
    """Shipped devices that all ten walk 100 cycles with, before and after learning.

    A person whom a device makes fall learns to walk with it. Once somebody has not, the device is
    not among those that all walk with, and nobody else learns it; nor is one that is not learned.
    """
    before, after, pairs, falls = 0, 0, 0, 0
    for device in EIGHT:
        plain = [
            _once(_folder(given), f"{device}-{who}", lambda w=who, d=device: _walks(w, d, 0))
            for who in TEN
        ]
        fell = [who for who, each in zip(TEN, plain, strict=True) if each["fell"]]
        before, falls = before + (not fell), falls + len(fell)
        pairs += len(plain)
        good = True
        for who in fell:
            found = _once(
                _folder(given),
                f"{device}-{who}-learned",
                lambda w=who, d=device: _walks(w, d, SAMPLES),
            )
            good = good and not found["learned fell"]
            if not good:
                break
        after += good
        print(f"{device}: {len(fell)} of {len(plain)} fall, all walk after learning: {good}")
    print(f"{falls} of {pairs} pairs fall before learning")
    return [
        Claim(
            "shipped devices that all ten people walk 100 cycles with, learned where they fell",
            after,
            "devices",
            len(EIGHT),
        ),
        Claim(
            "shipped devices that all ten people walk 100 cycles with, control as it was",
            before,
            "devices",
            len(EIGHT),
        ),
    ]


@claims.measured()
def torque(given: claims.Given) -> Claim:
    """Torque of powered devices in 100 cycles of walking against their command, ten people."""
    found = [
        _once(_folder(given), f"{device}-{who}", lambda w=who, d=device: _walks(w, d, 0))["torque"]
        for device in POWERED
        for who in TEN
    ]
    known = [100.0 * each for each in found if np.isfinite(each)]
    print(f"median {np.median(known):.2f} %")
    return Claim(
        "torque of devices on the limb against their command, bandwidth and delay aside: RMS, of "
        "the largest command, worst person and device",
        max(known),
        "%",
        len(known),
    )


@claims.measured()
def experiments(given: claims.Given) -> list[Claim]:
    """Quantities of published experiments, by each assumption on how people adapt.

    One that half of the people or more do not walk for counts as missed.
    """
    from gaitval.apps.devices.experiments import ASSUMED, effects, quantities, within

    people = PEOPLE
    found = {
        who: _once(
            _folder(given),
            f"experiments-{who}-{SAMPLES_OF_EXPERIMENTS}",
            lambda w=who: effects(_person(w), samples=SAMPLES_OF_EXPERIMENTS),
        )
        for who in people
    }
    rows, wanted = [], quantities()
    for assumption in ASSUMED:
        met = 0
        for quantity in wanted:
            values = [found[who][assumption].get(quantity.name) for who in people]
            known = [each for each in values if each is not None]
            good = 2 * len(known) > len(people) and within(quantity, known)
            met += good
            shown = f"{np.mean(known):+.3g} ({len(known)})" if known else "nobody walked"
            print(f"{assumption}, {quantity.name}: {shown}, band {quantity.band}: {good}")
        rows.append(
            Claim(
                f"published experiments, {assumption}: quantities whose mean over "
                f"{len(people)} people is within the band",
                met,
                "quantities",
                len(wanted),
            )
        )
    nearer = [
        [
            row
            for quantity in wanted
            if (row := _nearer(found[who], quantity.name, quantity.middle)) is not None
        ]
        for who in people
    ]
    if all(nearer):
        what = "published experiments: share of quantities that learned adaptation is nearer to"
        what += " than kinematics kept"
        ends = ("", ", low end of its 95 % interval over people", ", high end of that interval")
        low, middle, high = _share(nearer)
        count = sum(map(len, nearer))
        rows += [
            Claim(what + end, value, "1", count)
            for end, value in zip(ends, (middle, low, high), strict=True)
        ]
    return rows


@claims.measured()
def transfemoral(given: claims.Given) -> list[Claim]:
    """The sound side's load with an above-knee prosthesis, after a long training."""
    from gaitval.apps.devices.experiments import effects, quantities
    from gaitval.apps.devices.study import PROSTHETIC_EFFORT as EFFORT

    file, people = "experiments_above_knee", TEN
    (quantity,) = quantities(file)
    found = {
        who: _once(
            _folder(given),
            f"{file}-{who}-{SAMPLES}",
            lambda w=who: effects(_person(w), samples=SAMPLES, effort=EFFORT, file=file),
        )
        for who in people
    }
    print(found)
    values = [found[who]["learned"].get(quantity.name) for who in people]
    known = [each for each in values if each is not None]
    good = sum(quantity.band[0] <= each <= quantity.band[1] for each in known)
    what = "above-knee prosthesis, learned: "
    rows = [
        Claim(what + "people who walk 20 cycles", len(known), "people", len(people)),
        Claim(
            what + "of these, whose vertical impulse of the sound side is in the published band",
            good,
            "people",
            len(known),
        ),
    ]
    if known:
        rows.append(
            Claim(
                what + "vertical impulse of the sound side, more than the other's, mean",
                float(np.mean(known)),
                "%",
                len(known),
            )
        )
    return rows


def _nearer(found: Any, name: str, middle: float) -> tuple[float, float] | None:
    kept, learned = found["kinematics kept"].get(name), found["learned"].get(name)
    if kept is None or learned is None:
        return None
    return (abs(learned - middle), abs(kept - middle))


def _share(people: list[list[tuple[float, float]]]) -> tuple[float, float, float]:
    """Share of pairs whose first is smaller; its interval, with people drawn again, not pairs."""
    better = [np.array([float(a < b) for a, b in pairs]) for pairs in people]
    random = np.random.default_rng(0)
    draws = [
        np.concatenate([better[k] for k in random.integers(len(better), size=len(better))]).mean()
        for _ in range(4000)
    ]
    low, high = np.percentile(draws, [2.5, 97.5])
    return float(low), float(np.concatenate(better).mean()), float(high)
