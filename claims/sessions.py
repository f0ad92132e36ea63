"""Whether a change between two sessions is found, and how often one is seen where none is.

A recording is split in halves: cycles by turns, at random, or the first and the second half of
the trial. The halves are two sessions with the same markers. A change is planted in one curve of
one half: 3 degrees of a sagittal angle of hip, knee or ankle, or .15 Nm/kg of its moment, either
side and sign, all over the cycle (an offset) or over a part of 15 to 30 % of it (a bump). It is
found where the test of all curves of the person calls that curve changed, at the planted place.
False alarms are counted without a plant: of a person, if any of their curves is called changed
anywhere.

Five recordings: one is real throughout, 15 and 16 cycles of a person on a treadmill at .49 m/s
(WBDS01), slow and so with twice the spread of free walking. Of a second person 11 real cycles of
the right side over ground are known (Falisse 2019, of whose trials the publication has angles and
moments). Recordings of three others (Stanford, two; the sample) have 3 or 4 cycles, too few to be
halved: 16 cycles are drawn with their own means and their own standard deviations at each point,
and the smoothness and correlation of all curves of WBDS01's cycles. They are told apart below.

Re-measuring: two sessions of the virtual sample person in which nothing changed but that markers
were put on again (`claims.measurement.bands.drawn`), and how often a curve, and a person, is said
to have changed by more than that.
"""

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.stats import beta

import claims
from claims import Claim
from claims.measurement.bands import SEED, drawn
from claims.measurement.faults import SAMPLE, _imported, _read
from claims.recordings.public import listed
from experiments.healthy_cases import curves_of
from gaitval.arrays import Array
from gaitval.errors import GaitvalError
from gaitval.measurement.measured import measurement_of
from gaitval.measurement.sources import NINETY
from gaitval.metrics.cycle_changes import differing_curves
from gaitval.metrics.single_case import RANK, group_of, left_out_scores, modified_t
from gaitval.session.session import Import

SIZES: Final = {"angles": 3.0, "moments": 0.15}
JOINTS: Final = ("hip_flexion", "knee_angle", "ankle_angle")
PLANTS: Final = 25
"""Of each recording, kind of curve and shape."""
NOTHING: Final = 50
"""Halves without a plant, of each recording."""
PERMUTATIONS: Final = 500
STANFORD: Final = "stanfordnmbl+balance-exo-sim/results/experiments"
FALISSE: Final = "antoinefalisse+3dpredictsim/ExperimentalData/ExperimentalData.mat"
CYCLES: Final = 16
PAIRS: Final = 10
"""Pairs of sessions with markers put on again."""

_Cycles = dict[str, Array]


def interval(found: int, of: int) -> tuple[float, float]:
    """Of 95 % (Clopper and Pearson), per cent."""
    low = float(beta.ppf(0.025, found, of - found + 1)) if found else 0.0
    high = float(beta.ppf(0.975, found + 1, of - found)) if found < of else 1.0
    return 100.0 * low, 100.0 * high


def cycles_of(found: Import) -> _Cycles:
    """Cycles in deg, Nm/kg and % of body weight, as an import stores them."""
    cycles = {f"angles/{n}": np.degrees(np.asarray(c.curves)) for n, c in found.angles.items()}
    cycles |= {f"moments/{n}": np.asarray(c.curves) for n, c in found.moments.items()}
    for side, force in found.forces.items():
        for axis, name in enumerate(("forward", "medial", "vertical")):
            cycles[f"forces/{name}_{side[0]}"] = 100.0 * np.asarray(force.curves)[:, :, axis]
    return cycles


def falisse(public: Path) -> _Cycles:
    """The right side of subject 1, who weighs 62 kg."""
    from scipy.io import loadmat

    data = loadmat(public / FALISSE, squeeze_me=True, struct_as_record=False)["ExperimentalData"]
    kinds = (("angles", data.Q.subject1.Qs, 1.0), ("moments", data.Torques.subject1, 62.0))
    return {
        f"{kind}/{name}_r": np.apply_along_axis(
            lambda curve: np.interp(np.linspace(0, 99, 101), np.arange(100), curve),
            1,
            table.all[:, i, :].T / unit,
        )
        for kind, table, unit in kinds
        for i, name in enumerate(table.colheaders)
        if name in (*JOINTS, "hip_adduction", "hip_rotation", "subtalar_angle")
        or (kind == "angles" and name in ("pelvis_tilt", "pelvis_list", "pelvis_rotation"))
    }


def drawn_cycles(own: Mapping[str, Array], like: Mapping[str, Array], seed: int) -> _Cycles:
    """`CYCLES` cycles with the means and standard deviations of `own`, and the correlations that
    the deviations of `like` have over the cycle and between curves of a side.
    """
    random, found = np.random.default_rng(seed), {}
    for side in "rl":
        names = [n for n in own if n in like and n[-1] == side]
        weights = {
            count: random.standard_normal((CYCLES, count)) / np.sqrt(count - 1)
            for count in {len(like[name]) for name in names}
        }
        for name in names:
            model = like[name] - like[name].mean(axis=0)
            spread = own[name].std(axis=0, ddof=1) if len(own[name]) > 1 else None
            unit = model / np.maximum(model.std(axis=0, ddof=1), 1e-9)
            size = model.std(axis=0, ddof=1) if spread is None else spread
            found[name] = own[name].mean(axis=0) + weights[len(model)] @ unit * size
    return found


def recordings(given: claims.Given) -> Iterator[tuple[str, bool, _Cycles]]:
    """Name, whether all cycles are real, and the cycles."""
    with tempfile.TemporaryDirectory() as folder:
        known = {each["name"]: each for each in listed()}

        def read(recording: Mapping[str, Any]) -> _Cycles:
            return cycles_of(_imported(*_read(dict(recording), given.public, Path(folder))))

        treadmill = read({k: v for k, v in known["WBDS01 treadmill"].items() if k != "functional"})
        yield "WBDS01", True, treadmill
        yield "Falisse, subject 1", True, falisse(given.public)
        for number, mass, height in (("01", 72.84, 1.75), ("04", 80.3, 1.85)):
            base = given.public / STANFORD / f"subject{number}"
            walk = base / "walk2" / "expdata"
            own = read(
                {
                    "static": str(base / "static/expdata/marker_trajectories.trc"),
                    "trials": [str(walk / "marker_trajectories.trc")],
                    "forces": [str(walk / "ground_reaction_unfiltered.mot")],
                    "mass": mass, "height": height, "sex": "M",
                }
            )  # fmt: skip
            yield f"Stanford {number}", False, drawn_cycles(own, treadmill, int(number))
        yield "sample", False, drawn_cycles(read(SAMPLE), treadmill, 5)


def halves(cycles: Mapping[str, Array], how: str, seed: int = 0) -> tuple[_Cycles, _Cycles]:
    """Two sets of cycles: "by turns", "at random" or "first and second"."""
    first, second = {}, {}
    for name, values in cycles.items():
        count, at = len(values), np.arange(len(values))
        if how == "by turns":
            chosen = at % 2 == 0
        elif how == "first and second":
            chosen = at < count // 2
        else:
            # all curves of a side that have as many cycles are split alike
            random = np.random.default_rng([seed, count, name[-1] == "r"])
            chosen = random.permutation(count) < count // 2
        first[name], second[name] = values[chosen], values[~chosen]
    return first, second


def plant(random: np.random.Generator, shape: str) -> Array:
    """(101,) a change of size 1."""
    if shape == "offset":
        return np.ones(101)
    middle, half = random.integers(101), random.uniform(7.5, 15.0)
    away = np.abs((np.arange(101) - middle + 50) % 100 - 50)
    return 0.5 * (1.0 + np.cos(np.pi * np.minimum(away / half, 1.0)))


def found_of(cycles: Mapping[str, Array], kind: str, shape: str) -> int:
    """Planted changes that are found, of `PLANTS`."""
    names = sorted(n for n in cycles if n[:-2] in {f"{kind}/{joint}" for joint in JOINTS})
    hits = 0
    for seed in range(PLANTS):
        random = np.random.default_rng(seed)
        before, after = halves(cycles, "at random", seed)
        name, size = names[random.integers(len(names))], plant(random, shape)
        after[name] = after[name] + random.choice((-1.0, 1.0)) * SIZES[kind] * size
        test = differing_curves(before, after, permutations=PERMUTATIONS)
        inside = np.zeros(101, dtype=bool)
        for each in test.curves[name].regions:
            inside[each.first : each.last + 1] = True
        hits += bool((inside & (size > 0.5)).any())
    return hits


@claims.measured("data", "public")
def planted(given: claims.Given) -> list[Claim]:
    """Planted changes between halves of five recordings that are found, and false alarms."""
    rows: list[Claim] = []
    hits: dict[tuple[str, str], list[int]] = {}
    alarms, curves_alarmed, curves_all, people, drifted = 0, 0, 0, 0, []
    for name, real, cycles in recordings(given):
        for kind in SIZES:
            for shape in ("offset", "bump"):
                found = found_of(cycles, kind, shape)
                hits.setdefault((kind, shape), []).append(found)
                low, high = interval(found, PLANTS)
                said = f"{name}, {'real' if real else 'drawn'}, {kind}, {shape}"
                print(f"{said}: {found} of {PLANTS} "
                      f"({low:.0f}–{high:.0f} %)", flush=True)  # fmt: skip
        mine = 0
        for seed in range(NOTHING):
            test = differing_curves(*halves(cycles, "at random", seed), permutations=PERMUTATIONS)
            called = sum(bool(each.regions) for each in test.curves.values())
            mine, curves_alarmed = mine + bool(called), curves_alarmed + called
            curves_all += len(test.curves)
        alarms, people = alarms + mine, people + NOTHING
        print(f"{name}: {mine} of {NOTHING} halves without a change are alarms", flush=True)
        for how in ("by turns", "first and second"):
            test = differing_curves(*halves(cycles, how), permutations=2000)
            called_so = sorted(n for n, each in test.curves.items() if each.regions)
            print(f"{name}, {how}: {called_so or 'nothing'}", flush=True)
            if how == "first and second" and real:
                drifted.append(bool(called_so))
    for (kind, shape), counts in hits.items():
        total = PLANTS * len(counts)
        low, high = interval(sum(counts), total)
        size = "3 degrees" if kind == "angles" else ".15 Nm/kg"
        what = f"planted changes of {size}, {shape}, found in halves of five recordings"
        rows.append(Claim(f"{what} ({low:.0f}–{high:.0f})", 100 * sum(counts) / total, "%", total))
    low, high = interval(alarms, people)
    what = f"halves without a change in which any curve of the person is called changed ({low:.1f}–{high:.1f})"  # noqa: E501
    rows.append(Claim(what, 100 * alarms / people, "%", people))
    what = "curves of halves without a change that are called changed"
    rows.append(Claim(what, 100 * curves_alarmed / curves_all, "%", curves_all))
    what = "real trials whose first and second half are called different"
    rows.append(Claim(what, 100 * float(np.mean(drifted)), "%", len(drifted)))
    return rows


@claims.measured()
def again(_: claims.Given) -> list[Claim]:
    """Sessions of a virtual person that differ by the placing of markers: called changed."""
    sessions = []
    with tempfile.TemporaryDirectory() as folder:
        request, session = _read(SAMPLE, Path(folder), Path(folder))
        right = _imported(request, session)
        for draw in range(2 * PAIRS):
            try:
                seen = _imported(request, drawn(session, right, SEED + draw))
                if seen.measurement is not None and measurement_of(seen).bands is not None:
                    sessions.append(seen)
            except GaitvalError as error:
                print(draw, "refused:", str(error)[:100], flush=True)
    beyond, points, all_points, outside, curves, pairs = 0, 0, 0, 0, 0, 0
    for one, other in zip(sessions[::2], sessions[1::2], strict=False):
        two = [measurement_of(each).bands for each in (one, other)]
        assert two[0] is not None
        assert two[1] is not None
        factor, called = max(each.at_once for each in two if each is not None), 0
        for kind, of, others in (
            ("angle", one.angles, other.angles),
            ("moment", one.moments, other.moments),
        ):
            for name in of.keys() & others.keys():
                column = f"{kind}_{name}"
                half = np.hypot(two[0].again[column], two[1].again[column])
                off = np.abs(of[name].mean - others[name].mean)
                points, all_points = points + int((off <= half).sum()), all_points + len(off)
                called += bool((off > half * factor / NINETY).any())
                curves += 1
        outside, beyond, pairs = outside + called, beyond + bool(called), pairs + 1
        print(f"pair {pairs}: {called} curves beyond", flush=True)
    low, high = interval(beyond, pairs)
    what = "pairs of sessions with markers put on again: person called changed "
    return [
        Claim(f"{what}({low:.0f}–{high:.0f})", 100 * beyond / pairs, "%", pairs),
        Claim("the same, curves called changed", 100 * outside / curves, "%", curves),
        Claim(
            "the same, points inside the band of 90 %", 100 * points / all_points, "%", all_points
        ),
    ]  # fmt: skip


@claims.measured("data")
def healthy(given: claims.Given) -> list[Claim]:
    """Healthy adults, each left out, and patients, that are out of the ordinary."""
    curves = curves_of(given.data)
    alarms = 0
    for i, person in enumerate(curves):
        rest = np.delete(curves, i, axis=0)
        threshold = np.sort(left_out_scores(rest))[-RANK]
        size = np.abs(modified_t(person, *group_of(rest), len(rest))).max()
        alarms += bool(size > threshold)
    low, high = interval(alarms, len(curves))
    what = f"healthy adults, each left out, called out of the ordinary ({low:.1f}–{high:.1f})"
    rows = [Claim(what, 100 * alarms / len(curves), "%", len(curves))]
    threshold = np.sort(left_out_scores(curves))[-RANK]
    for group, name in (
        ("parkinson_off", "people with Parkinson's disease off medication"),
        ("transfemoral_amputee", "above-knee amputees"),
    ):
        people = curves_of(given.data, group)
        sizes = np.array(
            [np.abs(modified_t(each, *group_of(curves), len(curves))).max() for each in people]
        )
        share = 100 * float(np.mean(sizes > threshold))
        rows.append(Claim(f"{name} called out of the ordinary", share, "%", len(people)))
    return rows
