"""Whether devices do to a person what they should.

What people walk with is read once; a run that is ended goes on where it was with the same `--work`
folder, which holds what is known so far.
"""

import json
import re
import tempfile
import time
import tomllib
from argparse import Namespace
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import evidence
from evidence import ROOT, option

if TYPE_CHECKING:
    from gaitval.apps.devices.study import Wearer
    from gaitval.model.devices.device import Device

EIGHT = (
    *("hip_exo", "knee_exo", "ankle_exo", "ankle_spring"),
    *("below_knee", "above_knee", "afo", "backpack"),
)
TEN = tuple(str(number) for number in range(1, 11))
CYCLES = 100.0
POWERED = ("hip_exo", "knee_exo", "ankle_exo")
WORK = option("--work", type=Path, help="folder of what is known so far, for a run that goes on")
PEOPLE = option("--people", nargs="+", default=list(TEN), help="subjects (default: all ten)")
LEARNED = option(
    "--learned", nargs="*", default=list(EIGHT), help="devices that are learned by who falls"
)
SAMPLES = option("--samples", type=int, default=400_000, help="samples of a learned adaptation")

MEASURES = {
    "composite body*": {
        "code": (
            "@body",
            "gaitval/model/devices/composite.py",
            "gaitval/apps/devices/engines.py",
            "evidence/devices.py:bodies",
        ),
        "data": ("gaitval/apps/devices/shipped/*.toml", "models/xacro/devices/*"),
    },
    "shipped devices*": {
        "code": (
            "@device walk",
            "evidence/devices.py:walks,_walks,CYCLES,EIGHT",
        ),
        "data": ("gaitval/apps/devices/shipped/*.toml", "reports/S*/baseline/policy/*"),
        "allowed": 40,
        "why": "tests/devices/test_walking.py walks with devices at every change",
    },
    "torque of devices*": {
        "code": (
            "@device walk",
            "evidence/devices.py:torque",
        ),
        "data": ("gaitval/apps/devices/shipped/*.toml",),
        "allowed": 40,
        "why": "tests/devices/test_walking.py walks with devices at every change",
    },
    "published experiments*": {
        "code": (
            "@device walk",
            "gaitval/apps/devices/adaptation.py",
            "gaitval/apps/devices/curves.py",
            "gaitval/apps/devices/experiments.py",
            "evidence/devices.py:experiments",
        ),
        "data": (
            "gaitval/apps/devices/shipped/*.toml",
            "gaitval/apps/devices/experiments.toml",
        ),
        "allowed": 40,
        "why": "tests/devices/test_experiments.py computes the quantities at every change",
    },
    "above-knee prosthesis*": {
        "code": (
            "@device walk",
            "gaitval/apps/devices/experiments.py:effects,measured",
            "evidence/devices.py:transfemoral",
        ),
        "data": (
            "gaitval/model/devices/shipped/above_knee.toml",
            "gaitval/apps/devices/experiments_above_knee.toml",
        ),
        "allowed": 40,
        "why": "tests/devices/test_walking.py walks with devices at every change",
    },
    "strategy search*": {
        "code": (
            "@device walk",
            "gaitval/apps/devices/search.py",
            "evidence/devices.py:search",
        ),
        "allowed": 60,
        "why": "tests/devices/test_search.py searches at every change",
    },
    "gaitval * hip_exo*": {
        "code": ("gaitval/apps/devices/*.py", "evidence/devices.py:seconds,_minutes"),
        "allowed": 150,
        "why": "a time of half a minute changes little by a change of a few lines",
    },
    "own controller*": {
        "code": ("gaitval/model/devices/controllers.py", "evidence/devices.py:controller"),
    },
    "bad input*": {
        "code": (
            "gaitval/model/devices/device.py",
            "gaitval/model/devices/controllers.py",
            "gaitval/model/devices/tables.py",
            "evidence/devices.py:refused,_faults,_leaves,_changed,NAMED",
        ),
        "data": ("gaitval/apps/devices/shipped/*.toml",),
    },
}
"""What the rows depend on; see evidence/stale.py."""


@cache
def _person(name: str) -> "Wearer":
    from gaitval.apps.devices.study import wearer

    return wearer(name)


@cache
def _device(name: str) -> "Device":
    from gaitval.model.devices.device import shipped_device

    return shipped_device(name)


def _once(work: Path | None, name: str, compute: Callable[[], Any]) -> Any:
    """What `compute` gives, or gave in an earlier run; the folder `work` keeps it as JSON."""
    if work is None:
        return compute()
    path = work / f"{name}.json"
    if path.is_file():
        return json.loads(path.read_text(encoding="utf-8"))
    found = compute()
    work.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(found), encoding="utf-8")
    print(f"{name}: {found}", flush=True)
    return found


@evidence.measurement()
def bodies(_: Namespace) -> list[evidence.Row]:
    """The body with each shipped device in yourdfpy, DART, MuJoCo and the compiled engine."""
    from gaitval.apps.devices.engines import differences, in_engines
    from gaitval.datasets.subject_file import load_subject
    from gaitval.scaling.scaling import scale_subject

    largest: dict[str, float] = {}
    for number, name in enumerate(EIGHT):
        model = scale_subject(load_subject(str(number + 1))).model
        with tempfile.TemporaryDirectory() as folder:
            found = differences(in_engines(model, [_device(name)], Path(folder), seed=number))
        print(name, found, flush=True)
        largest = {key: max(value, largest.get(key, 0.0)) for key, value in found.items()}
    return [
        evidence.Row(
            f"composite body in four engines: {name}, largest relative difference"
            + (" over 10 s of passive motion" if name == "energy" else ""),
            *(value, "1", "<=", 1e-6, 1e-4, len(EIGHT)),
        )
        for name, value in largest.items()
    ]


def _walks(person: str, device: str, samples: int) -> dict[str, float]:
    """Gait cycles of a person with a device: as they are and, if they fall, after learning."""
    from gaitval.apps.devices.learning import adapt
    from gaitval.apps.devices.tracking import torque_errors
    from gaitval.apps.devices.walking import DeviceEnvironment, walk_with, with_devices

    who, worn = _person(person), _device(device)
    task = with_devices(who.task, [worn])
    environment = DeviceEnvironment(task)
    began = time.process_time()
    walk = walk_with(environment, who.policy, mu=who.mu, cycles=CYCLES)
    errors = torque_errors(walk, worn) if not walk.rollout.fell[0] else {}
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


@evidence.measurement(SAMPLES, LEARNED, WORK)
def walks(arguments: Namespace) -> list[evidence.Row]:
    """Shipped devices that all ten walk 100 cycles with, before and after learning.

    A person whom a device makes fall learns to walk with it. Once somebody has not, the device is
    not among those that all walk with, and nobody else learns it; nor is one that is not learned.
    """
    before, after, pairs, falls = 0, 0, 0, 0
    for device in EIGHT:
        plain = [
            _once(arguments.work, f"{device}-{who}", lambda w=who, d=device: _walks(w, d, 0))
            for who in TEN
        ]
        fell = [who for who, each in zip(TEN, plain, strict=True) if each["fell"]]
        before, falls = before + (not fell), falls + len(fell)
        pairs += len(plain)
        good = not fell or device in arguments.learned
        for who in fell if good else ():
            found = _once(
                arguments.work,
                f"{device}-{who}-learned",
                lambda w=who, d=device: _walks(w, d, arguments.samples),
            )
            good = good and not found["learned fell"]
            if not good:
                break
        after += good
        print(f"{device}: {len(fell)} of {len(plain)} fall, all walk after learning: {good}")
    print(f"{falls} of {pairs} pairs fall before learning")
    return [
        evidence.Row(
            "shipped devices that all ten people walk 100 cycles with, learned where they fell",
            *(after, "devices", ">=", 8, 6, len(EIGHT)),
        ),
        evidence.Row(
            "shipped devices that all ten people walk 100 cycles with, control as it was",
            *(before, "devices", ">=", 6, 0, len(EIGHT)),
        ),
    ]


@evidence.measurement(WORK)
def torque(arguments: Namespace) -> evidence.Row:
    """Torque of powered devices in 100 cycles of walking against their command, ten people."""
    found = [
        _once(arguments.work, f"{device}-{who}", lambda w=who, d=device: _walks(w, d, 0))["torque"]
        for device in POWERED
        for who in TEN
    ]
    known = [100.0 * each for each in found if np.isfinite(each)]
    print(f"median {np.median(known):.2f} %")
    return evidence.Row(
        "torque of devices on the limb against their command, bandwidth and delay aside: RMS, of "
        "the largest command, worst person and device",
        *(max(known), "%", "<=", 2.0, 5.0, len(known)),
    )


@evidence.measurement(PEOPLE, SAMPLES, WORK)
def experiments(arguments: Namespace) -> list[evidence.Row]:
    """Quantities of published experiments, by each assumption on how people adapt.

    One that half of the people or more do not walk for counts as missed.
    """
    from gaitval.apps.devices.experiments import ASSUMED, effects, quantities, within

    people = arguments.people
    found = {
        who: _once(
            arguments.work,
            f"experiments-{who}-{arguments.samples}",
            lambda w=who: effects(_person(w), samples=arguments.samples),
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
            evidence.Row(
                f"published experiments, {assumption}: quantities whose mean over "
                f"{len(people)} people is within the band",
                *(met, "quantities", ">=", 8, 6, len(wanted)),
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
            evidence.Row(what + end, *(value, "1", ">=", 0.5, 0.0, count))
            for end, value in zip(ends, (middle, low, high), strict=True)
        ]
    return rows


@evidence.measurement(PEOPLE, SAMPLES, WORK)
def transfemoral(arguments: Namespace) -> list[evidence.Row]:
    """The sound side's load with an above-knee prosthesis, after a long training."""
    from gaitval.apps.devices.experiments import effects, quantities
    from gaitval.apps.devices.study import PROSTHETIC_EFFORT as EFFORT

    file, people = "experiments_above_knee", arguments.people
    (quantity,) = quantities(file)
    found = {
        who: _once(
            arguments.work,
            f"{file}-{who}-{arguments.samples}",
            lambda w=who: effects(_person(w), samples=arguments.samples, effort=EFFORT, file=file),
        )
        for who in people
    }
    print(found)
    values = [found[who]["learned"].get(quantity.name) for who in people]
    known = [each for each in values if each is not None]
    good = sum(quantity.band[0] <= each <= quantity.band[1] for each in known)
    what = "above-knee prosthesis, learned: "
    rows = [
        evidence.Row(
            what + "people who walk 20 cycles", *(len(known), "people", ">=", 3, 0, len(people))
        ),
        evidence.Row(
            what + "of these, whose vertical impulse of the sound side is in the published band",
            *(good, "people", ">=", len(known), 0, len(known)),
        ),
    ]
    if known:
        rows.append(
            evidence.Row(
                what + "vertical impulse of the sound side, more than the other's, mean",
                *(float(np.mean(known)), "%", ">=", quantity.band[0], quantity.band[0], len(known)),
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


@evidence.measurement(WORK)
def search(arguments: Namespace) -> list[evidence.Row]:
    """A search over eight parameters of a controller for one person."""
    from gaitval.apps.devices.search import search_spline
    from gaitval.model.devices.aim import Aim

    who = _person("5")
    began = time.process_time()
    folder = arguments.work or Path(tempfile.mkdtemp())
    found = search_spline(who, _device("hip_exo"), Aim(joint="hip_flexion"), folder)
    seconds = time.process_time() - began
    print(found)
    return [
        evidence.Row(
            "strategy search, 8 parameters, one person: processor time",
            *(seconds / 60.0, "min", "<=", 10.0, 20.0, found.walks),
        ),
        evidence.Row(
            "strategy search: positive work of the muscles of the hip, of that without a device",
            *(found.best / found.without, "1", "<=", 0.9, 1.0, found.walks),
        ),
    ]


def _minutes(*words: str) -> float:
    """Processor time of a command of gaitval and its workers."""
    import os
    import subprocess
    import sys

    before = os.times()
    line = [sys.executable, "-m", "gaitval", *words]
    subprocess.run(line, check=True, capture_output=True, cwd=ROOT)
    after = os.times()
    return sum(after[k] - before[k] for k in (2, 3)) / 60.0


@evidence.measurement()
def seconds(_: Namespace) -> list[evidence.Row]:
    """Processor time of `gaitval device 5 hip_exo`, and of the main job with the device, the first
    time and in the folder of a finished run.
    """
    with tempfile.TemporaryDirectory() as folder:
        alone = _minutes("device", "5", "hip_exo", "--out", f"{folder}/alone")
        main = _minutes("subject", "5", "--out", f"{folder}/S05")
        then = _minutes("subject", "5", "--device", "hip_exo", "--out", f"{folder}/S05")
    return [
        evidence.Row(what, value, "min", "<=", 2.0, 4.0, 1)
        for what, value in (
            ("gaitval device 5 hip_exo from the stored policy: processor time", alone),
            (
                "gaitval subject 5 --device hip_exo after a finished run: processor time",
                then,
            ),
            (
                "gaitval subject 5 --device hip_exo, main job and all: processor time",
                main + then,
            ),
        )
    ]


@evidence.measurement()
def controller(_: Namespace) -> evidence.Row:
    """Lines of a working controller of one's own."""
    import subprocess
    import sys

    path = ROOT / "examples" / "own_controller.py"
    done = subprocess.run([sys.executable, path], check=True, capture_output=True, text=True)
    print(done.stdout)
    assert "walked 10 cycles" in done.stdout
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    return evidence.Row(
        "own controller: lines of a working example (examples/own_controller.py)",
        *(len(lines), "lines", "<=", 25, 50, 1),
    )


NAMED = {
    "a joint that is not there": ('joint = "hip_flexion"', 'joint = "wing"'),
    "torque beyond the motor": ("torque = 17.5", "torque = 5.0"),
    "mass < 0": ("mass = 2.0", "mass = -2.0"),
    "a controller without a motor": ("motor =", "moter ="),
}
"""Faults of hip_exo that anybody makes; a strap on nothing is made of it below."""


@evidence.measurement()
def refused(_: Namespace) -> evidence.Row:
    """Faults in the tables of shipped devices: refused with file, key and remedy."""
    from gaitval.artefacts import parse_toml
    from gaitval.errors import ConfigurationError
    from gaitval.model.devices.device import devices_of

    missed, count = [], 0
    for what, text in _faults():
        count += 1
        try:
            devices_of(parse_toml(text, "fault.toml", ConfigurationError), "fault.toml")
        except ConfigurationError as error:
            said = str(error)
            if "fault.toml" in said and re.search(r"devices|line", said) and said[-1] == ".":
                continue
        missed.append(what)
    print(missed)
    return evidence.none_may(
        "bad input: faults of a device's table that are not refused with file, key and remedy",
        len(missed), "faults", count,
    )  # fmt: skip


def _faults() -> Iterator[tuple[str, str]]:
    """What is wrong, and the text of a device's file: the named ones, and every value of every
    shipped device made impossible, one at a time.
    """
    import tomli_w

    folder = ROOT / "extras" / "gaitval.apps.devices" / "shipped"
    hip = (folder / "hip_exo.toml").read_text(encoding="utf-8")
    for what, (old, new) in NAMED.items():
        assert old in hip, old
        yield what, hip.replace(old, new, 1)
    kept = [line for line in hip.splitlines() if not line.startswith(("motor", "controller"))]
    yield "a strap on nothing", "\n".join(kept)
    for path in sorted(folder.glob("*.toml")):
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        for place in _leaves(table):
            for wrong in (float("nan"), float("inf"), 1e12, "?", [], {"a": 1}, True):
                value = _changed(table, place, wrong)
                if value is not None:
                    yield f"{path.stem} {place} = {wrong!r}", tomli_w.dumps(value)


def _leaves(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    if isinstance(value, dict):
        for key, each in value.items():
            yield from _leaves(each, (*place, key))
    elif isinstance(value, list):
        for number, each in enumerate(value):
            yield from _leaves(each, (*place, number))
    else:
        yield place


def _changed(table: Any, place: tuple[Any, ...], wrong: Any) -> Any:
    """A copy of a table with another value in a place; None where that would not be wrong."""
    changed = json.loads(json.dumps(table))
    at = changed
    for key in place[:-1]:
        at = at[key]
    old = at[place[-1]]
    free = place[-1] == "source" and isinstance(wrong, str)  # any text is a source
    if free or (isinstance(old, bool) and isinstance(wrong, bool)):
        return None
    at[place[-1]] = wrong
    return changed
