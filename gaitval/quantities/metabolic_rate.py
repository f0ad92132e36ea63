"""What walking costs: metabolic rate, from the muscles and from the joints alone.

Two models side by side, for nobody's muscles are measured. That of the muscles
(`gaitval.kinetics.musculature.metabolics`) has heat and work of forty muscles a leg; that of the
joints has heat by the size of their moments and work by their power, as Kim and Roberts (2015) Int
J Numer Meth Biomed Eng e02721 and Roberts et al. (2016) PLoS ONE 11:e0168070 have it, with the
efficiencies of Margaria (1968) and two numbers of our own (`HEAT`, `RETURNED`): their tables could
not be read.

Each side's figures are those of a person both of whose legs are like that one; the person's are the
mean of both sides.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.cycle_curves import Curves
from gaitval.kinetics.musculature.gait import MuscleGait
from gaitval.kinetics.musculature.metabolics import METABOLISM, MODELS
from gaitval.quantities.joint_power import JOINTS, joint_power
from gaitval.quantities.quantity import (
    Figures,
    FigureTable,
    Found,
    OverTime,
    Quantity,
    StrideTimes,
)

EFFICIENCY: Final[Mapping[str, float]] = {"positive": 0.25, "negative": 1.2}
"""Of positive work that no negative work has paid for, and of negative work that does not come
back: Margaria (1968) Int Z Angew Physiol 25:339-351, as its public implementation has it; 0.2 to
0.3 in laboratories (Afschrift et al. 2025, PLoS Comput Biol, abstract, who find models of muscles
at 0.58)."""
HEAT: Final = 0.268
"""W/kg for each Nm/kg of the size of the moments of hip, knee and ankle, sagittal."""
RETURNED: Final = 0.614
"""Of their negative power, what comes back as positive: tendons give it back, and muscles of two
joints pass it on. Work that lifts the body or a load, or that a device does, was never stored; so
it costs, or saves, more than the same positive power of level walking. Downhill, where a leg
absorbs more than it does, the rest is braked, not stored: what returns is a share of the smaller of
both.

Heat and what returns are of forty people of another laboratory, of whom no figure is shipped (Bovi
et al. 2011, Gait Posture 33:6, twenty adults and twenty young people, ten conditions of 0.84 to
1.95 m/s), whose rates are taken to be what `expected_rate` says. RMS of the ten 0.34 W/kg
(`experiments/joint_metabolics.py`). So the level of this model says nothing new about level
walking; what it says of a slope, a load, a device or the speed of the least cost is a prediction.
"""

CENTRAL: Final = "bhargava"
"""The model of muscles that stands for them: of seven, it and one more followed measured rates of
people best over speeds and slopes, r 0.95 (Koelewijn et al. 2019, PLoS ONE 14:e0222037)."""

TITLES: Final[Mapping[str, str]] = {
    "bhargava": "Bhargava 2004",
    "umberger": "Umberger 2010",
    "uchida": "Uchida 2016",
}

_BODY: Final = "body"


def expected_rate(speed: float) -> float:
    """Gross metabolic rate, W/kg, that is expected of level walking at `speed` m/s, up to 1.96: the
    load carriage equation, 1.44 + 1.94 v^0.43 + 0.24 v^4, Looney et al. (2019) Med Sci Sports Exerc
    51:1954 (the equation as three public programs have it).

    Of published equations it is the one that measured people bear out: of 35 adults at 0.75 to 1.75
    m/s, none of whom it was made from, it is 0 % off (95 %: -4 to 4), the mean of it and of that of
    the American College of Sports Medicine 6 % too low (2 to 10), the latter alone 12 % (8 to 16).
    At 1.0 to 1.5 m/s, for which both are meant, it is 2 % off (-3 to 7), the mean 3 % too low (-2
    to 8), the latter 8 % (4 to 13) (`experiments/level_rates.py` of commit 60ee3cba).
    """
    return float(1.44 + 1.94 * speed**0.43 + 0.24 * speed**4)


def _figures(rates: Mapping[str, float]) -> Figures:
    """Of the mean rates of both legs, W/kg, by name with side."""
    return {
        "gross": {name: METABOLISM.rest + rate for name, rate in rates.items()},
        "net": dict(rates),
    }


def leg_rate(size: Array, positive: Array, negative: Array) -> Array:
    """Metabolic rate (T,) W/kg or W of a leg over whole cycles, of the sizes of its joints' moments
    and their positive and negative power (the latter not negative), summed over its joints.
    """
    absorbed, own = float(np.mean(negative)), float(np.mean(positive))
    back = RETURNED * min(1.0, own / absorbed) if absorbed > 0.0 else RETURNED
    paid, lost = positive - back * negative, (1.0 - back) * negative
    return np.asarray(HEAT * size + paid / EFFICIENCY["positive"] + lost / EFFICIENCY["negative"])


def joint_rates(curves: Curves, stride_time: StrideTimes) -> Found | None:
    """Metabolic rate of each leg by the model of the joints, W/kg (101,), from the `curves` of a
    walk (n, 101) or a record (101,); None without a cycle, or where a joint was not measured.
    """
    power = joint_power(curves, stride_time)
    if power is None:
        return None
    found: dict[str, Array] = {}
    for side, time in stride_time.items():
        size, positive, negative = np.zeros((3, 101))
        for joint in JOINTS:
            name = f"{joint}_{side}"
            moment = np.atleast_2d(curves.moments[name])
            rate = np.gradient(
                np.atleast_2d(curves.angles[name]), 0.01 * (time or np.nan), axis=1, edge_order=2
            )
            size += np.abs(moment).mean(axis=0)
            positive += np.clip(moment * rate, 0.0, None).mean(axis=0)
            negative += np.clip(-moment * rate, 0.0, None).mean(axis=0)
        found[f"leg_{side}"] = leg_rate(size, positive, negative)
    return Found(found, _of_legs(found))


def _of_legs(curves: Mapping[str, Array]) -> Figures:
    """Figures of curves by "name_side": those of a name "leg" are called `_BODY`."""
    return _figures(
        {
            name.replace("leg_", f"{_BODY}_"): 2.0 * float(curve[:-1].mean())
            for name, curve in curves.items()
            if np.isfinite(curve).all()
        }
    )


def muscle_rates(muscles: MuscleGait) -> Found | None:
    """Metabolic rate of the muscles of each leg by each of `MODELS`, W/kg (101,), and of the body;
    None without a whole cycle, or where a prosthesis has a part of the leg.
    """
    curves = {
        f"{model}_{side[0]}": leg.metabolic[model]
        for side, leg in muscles.legs.items()
        if leg.present.all()
        for model in MODELS
        if model in leg.metabolic
    }
    return Found(curves, _of_legs(curves)) if curves else None


def _over_time(motion: OverTime) -> dict[str, Array]:
    """W, of each leg."""
    found = {}
    for side in "rl":
        names = [f"{joint}_{side}" for joint in JOINTS]
        power = np.stack([motion.power(name) for name in names])
        found[f"leg_{side}"] = leg_rate(
            np.abs([motion.moment(name) for name in names]).sum(axis=0),
            np.clip(power, 0.0, None).sum(axis=0),
            np.clip(-power, 0.0, None).sum(axis=0),
        )
    return found


_LEFT_OUT: Final = (
    "Trunk, arms, breathing and co-contraction are left out; 1.2 W/kg of rest is added to the "
    "gross rate. A difference between two walks of a person is more credible than a level."
)

METABOLIC_MUSCLES: Final = Quantity(
    name="metabolic_muscles",
    title="Metabolic rate, from muscles",
    axis="metabolic rate",
    unit="W/kg",
    note="Heat and work of the muscles of both legs, by three published models. The table has the "
    f"whole body. {_LEFT_OUT}",
    needs=("angles", "moments"),
    curves=dict(TITLES),
    of_muscles=muscle_rates,
    figures={"gross": "W/kg", "net": "W/kg", "per_metre": "J/kg/m"},
    figures_of=_of_legs,
    per_metre={"gross": "per_metre"},
    tables=(
        FigureTable(
            "Gross metabolic rate, from muscles",
            "W/kg",
            2,
            tuple((model, "gross", name) for name, model in TITLES.items()),
            of_body=True,
        ),
        FigureTable(
            "Gross metabolic cost, from muscles",
            "J/kg/m",
            2,
            ((TITLES[CENTRAL], "per_metre", CENTRAL),),
            of_body=True,
        ),
    ),
    shown="nothing",
)

METABOLIC_JOINTS: Final = Quantity(
    name="metabolic_joints",
    title="Metabolic rate, from joints",
    axis="metabolic rate",
    unit="W/kg",
    note="Metabolic rate = heat in proportion to the sagittal moments of hip, knee and ankle + "
    "(positive power − what returns of the negative) / 0.25 + the rest of the negative / 1.2. The "
    "table has the whole body. Heat and what returns were found so that other people’s level "
    "walking costs what a published equation says. For this rate alone, hip moments of the walk "
    "and of the record are about the walker’s hip centres. "
    f"{_LEFT_OUT}",
    needs=("angles", "moments"),
    curves={"leg": "Metabolic rate of a leg, from joints"},
    of_curves=joint_rates,
    figures={"gross": "W/kg", "net": "W/kg", "per_metre": "J/kg/m"},
    figures_of=_of_legs,
    per_metre={"gross": "per_metre"},
    tables=(
        FigureTable(
            "Metabolic rate, from joints",
            "W/kg",
            2,
            (("Gross", "gross", _BODY), ("Net", "net", _BODY)),
            of_body=True,
        ),
        FigureTable(
            "Metabolic cost, from joints",
            "J/kg/m",
            2,
            (("Gross", "per_metre", _BODY),),
            of_body=True,
        ),
    ),
    of_time=_over_time,
    time_unit="W",
    shown="figures",
    of_person=True,
)

__all__ = ["METABOLIC_JOINTS", "METABOLIC_MUSCLES", "expected_rate", "joint_rates", "muscle_rates"]
