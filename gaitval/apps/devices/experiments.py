"""Published experiments repeated: what devices changed in people, and what they change here."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field
from scipy.stats import t

from gaitval.apps.devices.adaptation import kinematics_kept, walk_without
from gaitval.apps.devices.curves import JOINTS, WalkCurves, walk_curves
from gaitval.apps.devices.device_walk import DeviceWalk
from gaitval.apps.devices.learning import EFFORT, adapt
from gaitval.apps.devices.study import Wearer
from gaitval.apps.devices.walking import DeviceEnvironment, walk_with, with_devices
from gaitval.artefacts import read_toml
from gaitval.configuration import Configuration
from gaitval.coordinates import Side
from gaitval.errors import ConfigurationError, RecordError
from gaitval.metrics.cycles import find_cycles
from gaitval.model.devices.device import Device, shipped_device
from gaitval.model.devices.springs_and_motors import Spring
from gaitval.model.devices.tables import Table

ASSUMED: Final = ("kinematics kept", "moments kept", "learned")
CYCLES: Final = 20.0
STANCE: Final = 62
"""% of the gait cycle from which on it is swing."""


class Paired(Table):
    """What an abstract says of people who walked without and with a device.

    Attributes
    ----------
    n, p : people, and the p of the change, taken as that of a paired t-test.
    before, after : means, in one unit.
    """

    n: Annotated[int, Field(ge=2)]
    p: Annotated[float, Field(gt=0, lt=1)]
    before: float
    after: float

    def band(self) -> tuple[float, float]:
        """95 % interval of the mean change, % of `before`: the standard error is what gives p."""
        change, freedom = self.after - self.before, self.n - 1
        error = abs(change) / float(t.ppf(1.0 - self.p / 2.0, freedom))
        half = float(t.ppf(0.975, freedom)) * error
        low, high = (100.0 * (change + each) / self.before for each in (-half, half))
        return low, high


class PublishedQuantity(Table):
    """A quantity of an experiment.

    Attributes
    ----------
    value : of the paper, or where the paper only says more or less, a size that is not judged.
    band : lowest and highest mean over people.
    kind : `interval` of 95 %, from `paired`; `sign`; or `assumed` where the band is a part of the
        paper's figure.
    """

    name: str
    device: str
    measure: Literal[
        "device_ankle", "own_ankle", "own_work", "work_ankle", "work_knee", "com_work",
        "swing_hip", "sound_stance", "sound_impulse",
    ]  # fmt: skip
    value: float
    band: tuple[float, float]
    kind: Literal["interval", "sign", "assumed"]
    source: str
    paired: Paired | None = None

    @property
    def middle(self) -> float:
        """The paper's value."""
        return self.value


class _File(Table):
    quantities: Annotated[tuple[PublishedQuantity, ...], Field(min_length=1)]


def quantities(file: str = "experiments") -> tuple[PublishedQuantity, ...]:
    """All quantities of a `file`: `experiments`, or `experiments_above_knee`."""
    path = Path(__file__).with_name(f"{file}.toml")
    return _File.model_validate(read_toml(path, ConfigurationError)).quantities


def within(quantity: PublishedQuantity, values: Sequence[float]) -> bool:
    """Whether the mean of people's `values` is in a quantity's band."""
    low, high = quantity.band
    return low <= float(np.mean(values)) <= high


def condition(name: str) -> Device:
    """The device of an experiment: a shipped one, or `elastic`, a spring of 50 Nm/rad."""
    if name != "elastic":
        return shipped_device(name)
    device = shipped_device("ankle_spring")
    (hinge,) = device.hinges
    soft = hinge.model_copy(update={"spring": Spring(stiffness=50.0, pulls="down")})
    return device.model_copy(update={"name": "elastic", "hinges": (soft,)})


def com_work_rate(walk: DeviceWalk, configuration: Configuration) -> float:
    """W, positive work that both legs do on the centre of mass, each by itself (Donelan, Kram and
    Kuo 2002), over whole right gait cycles.
    """
    rollout = walk.rollout
    rows = find_cycles(rollout, configuration).rows()
    velocity = np.gradient(rollout.centre_of_mass, rollout.time, axis=0)[rows]
    power = np.einsum("tsi,ti->ts", rollout.ground_reaction[rows], velocity)
    return float(np.maximum(power, 0.0).sum(axis=1).mean())


def _changed(now: float, before: float) -> float:
    return 100.0 * (now / before - 1.0)


def measured(
    measure: str,
    now: WalkCurves,
    before: WalkCurves,
    rates: tuple[float, float],
    load: float,
    fitted: Side = "right",
) -> float:
    """The `measure` of an experiment, from the curves `now` and `before`, with and without the
    device, and the work rates on the centre of mass with and without (`rates`, W). `load` is the
    device's, kg; `fitted` is the side of a device that is on one, and the other is the sound one.
    """
    ankle = "ankle_angle"
    if measure == "device_ankle":
        return float(np.abs(now.mean_of_sides(now.device, ankle)).max())
    if measure == "own_ankle":
        lowest = [each.mean_of_sides(each.own, ankle).min() for each in (now, before)]
        return _changed(*lowest)
    if measure == "own_work":
        return _changed(*(sum(each.work.values()) for each in (now, before)))
    if measure in ("work_ankle", "work_knee"):
        joint = ankle if measure == "work_ankle" else "knee_angle"
        return _changed(
            *(each.work[joint, "right"] + each.work[joint, "left"] for each in (now, before))
        )
    if measure == "com_work":
        return (rates[0] - rates[1]) / load
    if measure == "swing_hip":
        swing = [each.mean_of_sides(each.own, JOINTS[0])[STANCE:] for each in (now, before)]
        return _changed(*(float(np.abs(each).max()) for each in swing))
    sound: Side = "left" if fitted == "right" else "right"
    if measure == "sound_stance":
        return 100.0 * (now.stance[sound] - now.stance[fitted])
    impulse = {s: float(now.forces[s].mean()) * now.stride_time[s] for s in (sound, fitted)}
    return 200.0 * (impulse[sound] - impulse[fitted]) / (impulse[sound] + impulse[fitted])


def effects(
    person: Wearer, *, samples: int, effort: float = EFFORT, file: str = "experiments"
) -> dict[str, dict[str, float]]:
    """Every quantity for one `person`, by assumption; those that the person falls in are missing.
    `samples` and `effort` are of each learned adaptation, `file` is that of `quantities`.
    """
    found: dict[str, dict[str, float]] = {name: {} for name in ASSUMED}
    wanted = quantities(file)
    mass = person.task.model.mass
    for name in dict.fromkeys(each.device for each in wanted):
        device = condition(name)
        task = with_devices(person.task, [device])
        environment = DeviceEnvironment(task)
        plain = walk_without(task, person.policy, person.mu, CYCLES)
        before = walk_curves(plain, task.configuration, mass)
        rate = com_work_rate(plain, task.configuration)
        kept = kinematics_kept(environment, plain.rollout)
        learned = adapt(task, person.policy, samples=samples, effort=effort)
        walks = {
            "kinematics kept": kept.walk,
            "moments kept": walk_with(environment, person.policy, mu=person.mu, cycles=CYCLES),
            "learned": walk_with(environment, learned, mu=person.mu, cycles=CYCLES),
        }
        for assumption, walk in walks.items():
            if walk.rollout.fell[0]:
                continue
            try:
                now = walk_curves(walk, task.configuration, mass)
            except RecordError:
                continue
            rates = com_work_rate(walk, task.configuration), rate
            for quantity in wanted:
                if quantity.device == name:
                    found[assumption][quantity.name] = measured(
                        quantity.measure,
                        *(now, before, rates, max(device.mass, 1e-9), device.sides[0]),
                    )
    return found
