"""What the paper says of each of its figures, and whether our data say the same."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.stats import permutation_test

from experiments.paper.data import IDENTIFIED, RL, WINTER, PaperCurves
from experiments.paper.drawings import JOINTS
from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.metrics.comparison import multiple_correlation, rms
from gaitval.metrics.norms import healthy_bands
from gaitval.metrics.push_recovery import Trace
from gaitval.metrics.results import PlacedFoot
from gaitval.reporting.balance_figure import kept_distance

_Verdict = Literal["agrees", "agrees in part", "does not agree", "cannot be judged"]
_Stored = Mapping[str, Any]

NEARER = 0.05
"""Smallest share by which an error must fall to be called lower: about the SD between seeds."""
SEEN = 1.0
"""deg: the width of a line in figure 3, which spans 60° in 3 cm."""


@dataclass(frozen=True)
class Statement:
    """One statement of the paper.

    Attributes
    ----------
    paper : what it says.
    found : what our data say, in numbers.
    verdict : whether that is the same.
    """

    paper: str
    found: str
    verdict: _Verdict


def judged(true: Sequence[bool]) -> _Verdict:
    """All, some or none of several conditions."""
    return "agrees" if all(true) else "agrees in part" if any(true) else "does not agree"


def model(dof: int) -> list[Statement]:
    """Figure 1: the number of coordinates."""
    return [
        Statement(
            "A 31-DoF humanoid with 25 actuated joints and a floating base.",
            f"{dof} coordinates, {len(ACTUATED)} of them actuated.",
            judged([dof == 31, len(COORDINATES) == 31, len(ACTUATED) == 25]),
        )
    ]


def errors(found: Mapping[str, Any]) -> list[Statement]:
    """Figure 2: identification lowers the RMSE."""
    claims = []
    for body, walks in found.items():
        parts, lower = [], []
        for kind in ("angles", "moments", "forces"):
            before, after = (np.array([w[kind] for w in walks[name]]) for name in (RL, IDENTIFIED))
            gain = 1.0 - after.mean() / before.mean()
            paired = permutation_test([before - after], np.mean, permutation_type="samples")
            p = paired.pvalue
            lower.append(bool(gain > 0.0 and p <= 0.05))
            parts.append(f"{kind} {100 * gain:+.1f} % (p = {p:.2f})")
        seeds = len(walks[RL])
        claims.append(
            Statement(
                "The additional optimisation step has a clear effect on the RMSE.",
                f"Body scaled by {body}: lower by {', '.join(parts)}; {seeds} seeds, exact paired "
                f"test. RL alone is within {np.mean([w['angles'] for w in walks[RL]]):.1f}° of the "
                "record already, so that little is left to gain.",
                judged(lower),
            )
        )
    return claims


def angles(walks: Mapping[str, PaperCurves], record: _Stored) -> list[Statement]:
    """Figure 3: identification brings angles nearer, the ankle's most."""
    change, parts = {}, []
    for joint, title in JOINTS.items():
        before, after = (
            np.mean(
                [
                    rms(walks[name]["angles"][f"{joint}_{s}"].mean(axis=0) - record[f"{joint}_{s}"])
                    for s in "rl"
                ]
            )
            for name in (RL, IDENTIFIED)
        )
        change[joint] = 1.0 - after / before
        parts.append(f"{title.lower()} {before:.2f}° → {after:.2f}°")
    found = f"RMSE, mean of both sides: {', '.join(parts)}."
    best = max(change, key=lambda joint: change[joint])
    return [
        _rows_apart(walks),
        Statement(
            "After identification the joint angles match better.",
            found,
            judged([each > NEARER for each in change.values()]),
        ),
        Statement(
            "The ankle in particular matches more closely.",
            f"The {JOINTS[best].lower()} gains most ({100 * change[best]:+.0f} %); the ankle "
            f"{100 * change['ankle_angle']:+.0f} %.",
            judged([best == "ankle_angle" and change[best] > NEARER]),
        ),
    ]


def _rows_apart(walks: Mapping[str, PaperCurves]) -> Statement:
    """Whether somebody who looks at both rows of figure 3, of the right leg, sees a difference: a
    mean that leaves the band of the other walk's cycles somewhere.
    """
    parts, apart = [], []
    for joint, title in JOINTS.items():
        one, other = (walks[name]["angles"][f"{joint}_r"] for name in (RL, IDENTIFIED))
        off = np.abs(one.mean(axis=0) - other.mean(axis=0))
        band = np.maximum(one.std(axis=0, ddof=1), other.std(axis=0, ddof=1))
        outside = np.mean(off > 2.0 * band)
        apart.append(bool(outside > 0.0 and off.max() > SEEN))
        parts.append(
            f"{title.lower()} {rms(off):.2f}° (RMS), {off.max():.2f}° at most, "
            f"beyond two SD between cycles in {100 * outside:.0f} % of the cycle"
        )
    message = "" if any(apart) else " The rows cannot be told apart by eye."
    return Statement(
        "Before identification the ankle is noticeably different.",
        f"The two rows differ by: {'; '.join(parts)}. Seen is what is beyond both {SEEN:g}° and "
        f"two SD.{message}",
        judged([apart[list(JOINTS).index("ankle_angle")]]),
    )


def torque_loop(curves: Mapping[str, tuple[Array, Array]]) -> list[Statement]:
    """Figure 4: marked points and direction of the loop."""
    claims = []
    walk = curves["simulated"]
    half = {kind: healthy_bands()[kind]["hip_flexion"][1] for kind in ("angles", "moments")}
    for name in [each for each in curves if each not in ("simulated", "record")]:
        other, parts, near = curves[name], [], []
        for percent in (0, 50, 100):
            off = [walk[i][percent] - other[i][percent] for i in (0, 1)]
            spread = [half[kind][percent] for kind in ("angles", "moments")]
            near.append(all(abs(o) <= 2.0 * s for o, s in zip(off, spread, strict=True)))
            parts.append(f"{percent} %: {off[0]:+.0f}°, {off[1]:+.2f} Nm/kg")
        claims.append(
            Statement(
                "The points at 0, 50 and 100 % of the cycle match Winter’s fairly well.",
                f"Simulated less {name}: {'; '.join(parts)}. Fairly well: within 2 SD between "
                "healthy people (Schwartz 2008) at that point."
                + (" Winter’s hip angle is between thigh and trunk, ours between thigh and pelvis, "
                   "whose tilt is added." if name == WINTER else ""),
                judged(near),
            )
        )  # fmt: skip
    turns = {name: _area(*curve) for name, curve in curves.items()}
    sense = {each > 0.0 for each in turns.values()}
    claims.append(
        Statement(
            "The arrows of both loops run the same way.",
            "Net work of the hip, the area of the loop: "
            + ", ".join(f"{name} {each:+.2f} J/kg" for name, each in turns.items())
            + "; positive is energy generated.",
            judged([len(sense) == 1]),
        )
    )
    if WINTER not in curves:
        claims.append(
            Statement(
                "The loop is compared with Winter’s person.",
                "Winter’s tables carry no licence and are not shipped; give --data with "
                "normative/Winter_Appendix_data.xlsx. Compared with published means instead.",
                "cannot be judged",
            )
        )
    return claims


def _area(angle: Array, moment: Array) -> float:
    """Work over the loop, J/kg."""
    closed = np.append(np.deg2rad(angle), np.deg2rad(angle[0]))
    heights = np.append(moment, moment[0])
    return float(np.sum(0.5 * (heights[1:] + heights[:-1]) * np.diff(closed)))


def against_record(
    metrics: _Stored, walk: PaperCurves, kind: str, names: Mapping[str, str]
) -> Statement:
    """Figures 5 and 6: RMSE against the project's limits."""
    measure = {"moments": "moment_rmse", "forces": "force_rmse"}[kind]
    limits = {
        row["target"]: row["tolerance"]
        for row in metrics["tolerances"]
        if row["measure"] == measure and row["citation"] == "gaitval"
    }
    record, unit = metrics["record"]["curves"][kind], metrics["units"][kind]
    parts, met = [], []
    for name, title in names.items():
        found = []
        for side in "rl":
            key = f"{name}_{side}"
            error = rms(walk[kind][key].mean(axis=0) - np.array(record[key]))
            met.append(error <= limits[key])
            found.append(f"{error:.2f}")
        parts.append(f"{title.lower()} {' and '.join(found)} (limit {limits[f'{name}_r']:g})")
    paper = {
        "moments": "The joint moments generated by the policy are comparable to the record.",
        "forces": "Tangential and vertical ground reaction are comparable to the record.",
    }[kind]
    return Statement(paper, f"RMSE right and left, {unit}: {'; '.join(parts)}.", judged(met))


def knees(runs: Mapping[str, _Stored]) -> list[Statement]:
    """Figure 7a: people differ, and their walkers do alike."""
    measured = np.array(
        [run["record"]["curves"]["angles"]["knee_angle_r"] for run in runs.values()]
    )
    walk = np.array(
        [
            run["walks"][run["final"]]["curves"]["angles"]["knee_angle_r"]["mean"]
            for run in runs.values()
        ]
    )
    distances = np.sqrt(np.mean((walk[:, None] - measured[None]) ** 2, axis=2))
    own = np.diag(distances)
    told_apart = int(np.sum(distances.argmin(axis=1) == np.arange(len(runs))))
    others = distances[~np.eye(len(runs), dtype=bool)]
    peak = walk.max(axis=1) - measured.max(axis=1)
    bias, around = peak.mean(), 1.96 * peak.std(ddof=1)  # Bland and Altman 1986, Lancet 327:307
    alike = [multiple_correlation(list(pair)) or 0.0 for pair in zip(walk, measured, strict=True)]
    return [
        Statement(
            "The knee’s course varies between people, with speed and build.",
            f"Measured peaks from {measured.max(axis=1).min():.0f} to "
            f"{measured.max(axis=1).max():.0f}°; two people’s curves are "
            f"{_between(measured):.1f}° apart on average (RMS).",
            judged([_between(measured) > own.mean()]),
        ),
        Statement(
            "The simulated angles match well and capture these differences.",
            f"RMSE from {own.min():.1f} to {own.max():.1f}°, against other people’s curves "
            f"{others.mean():.1f}°; {told_apart} of {len(runs)} walkers are nearest to their own "
            f"person; multiple correlation {min(alike):.3f} to {max(alike):.3f}.",
            judged([told_apart == len(runs), bool(own.max() < others.mean())]),
        ),
        Statement(
            "(Not in the paper.) No systematic error over the people.",
            f"{len(runs)} people: peak flexion, simulated less measured (Bland and Altman): "
            f"{bias:+.1f}°, 95 % limits {bias - around:.1f} to {bias + around:.1f}°.",
            judged([bool(bias - around <= 0.0 <= bias + around)]),
        ),
    ]


def _between(curves: Array) -> float:
    """Mean RMS difference of two people's curves."""
    first, second = np.triu_indices(len(curves), 1)
    return float(np.sqrt(np.mean((curves[first] - curves[second]) ** 2, axis=1)).mean())


def pushes(runs: Mapping[str, _Stored], subject: str, traces: Sequence[Trace]) -> list[Statement]:
    """Figure 7b: which phase is the hardest, and whether velocity returns."""
    phases = runs[subject]["push_recovery"]["phases"]
    forces = np.array([run["push_recovery"]["largest"] for run in runs.values()]).mean(axis=2)
    of_one = np.array(runs[subject]["push_recovery"]["largest"]).mean(axis=1)
    hardest = {name: phases[int(row.argmin())] for name, row in zip(runs, forces, strict=True)}
    late = sum(phase >= 0.75 for phase in hardest.values())
    means = ", ".join(f"{100 * p:g} %: {f:.0f} N" for p, f in zip(phases, of_one, strict=True))
    force = runs[subject]["push_recovery"]["force"]
    kept, parts = [], []
    for trace in traces:
        before = trace.velocity[trace.cycles < 0.0, 0].mean()
        later = trace.velocity[(trace.cycles >= 3.0) & (trace.cycles < 4.0), 0]
        left = later.mean() - before if len(later) and not trace.fell else np.nan
        first = trace.velocity[(trace.cycles >= 0.0) & (trace.cycles < 1.0), 0].mean() - before
        kept.append(bool(abs(left) < 0.5 * abs(first)))
        parts.append(f"{100 * trace.push.phase:g} %: {first:+.2f}, then {left:+.2f}")
    return [
        Statement(
            "The policy is least effective at recovering when it is pushed late in swing.",
            f"{subject}, largest push survived, mean of all directions: {means}. Over all "
            f"{len(runs)} walkers the hardest phase is late swing of the right leg in {late}, "
            f"a heel strike (0 or 50 %) in {sum(p in (0.0, 0.5) for p in hardest.values())}.",
            judged([late > len(runs) / 2]),
        ),
        Statement(
            "The velocity of the centre of mass shows the recovery over five cycles.",
            f"Pushed ahead with {force:g} N; change of the mean forward velocity, "
            f"m/s, in the cycle of the push and in the fourth: {'; '.join(parts)}.",
            judged(kept),
        ),
    ]


def placement(placed: Mapping[str, Sequence[PlacedFoot]]) -> list[Statement]:
    """Beside figure 7b: the law of foot placement after pushes to the side."""
    kept = {name: kept_distance(each) for name, each in placed.items()}
    found = {name: each for name, each in kept.items() if each is not None}
    parts = [
        f"{name}: {each['within']:.1f} cm with a foot that is moved by up to {each['shift']:.0f} cm"
        for name, each in found.items()
    ]
    return [
        Statement(
            "Its pushes follow studies of how people balance (Hof et al. 2010; Wang and Srinivasan "
            "2014), by whose findings it wants to validate its results: the foot keeps its "
            "distance from the extrapolated centre of mass, and the ankle corrects 2 cm.",
            f"Largest change of that distance: {'; '.join(parts)}.",
            judged([each["within"] <= each["people"] for each in found.values()]),
        )
    ]


def counted(claims: Sequence[Statement]) -> str:
    """The verdict on a figure: the worst of its claims' that could be judged."""
    verdicts = {claim.verdict for claim in claims if claim.verdict != "cannot be judged"}
    if verdicts == {"agrees"}:
        return "agrees"
    return "does not agree" if verdicts == {"does not agree"} else "agrees in part"
