"""The posterior of a body from a record whose errors are shared by many of its values.

The identification's own noise model (`identification.body_fit`) has errors that are new in every
joint and harmonic. What misleads it is not new in every one: soft tissue that turns with the hip
makes the whole curve of the hip, and of the knee, smaller by one share; a belt that runs 1 % faster
than it shows moves the foot back 1 % faster in every instant. Read as independent errors these are
impossible, so the fit makes legs of them, a centimetre for 2.5 %. Here each is one more unknown
with a prior, found together with motion and body, and integrated out of the posterior of the body.
The residuals' covariance is then that of the noise model plus J S Jᵀ, with J the derivative by
these unknowns and S their prior.

Of soft tissue the SDs of this table are what a study sees of one segment or of one joint; both
descriptions at once are wider than any study, so each has `SHARED.narrower` of its SD.

| unknown | SD | source |
|---|---|---|
| thigh's skin, share of the hip's excursion | -3 ± 6 % | [1], [2] |
| thigh's skin, share of the knee's excursion | 2 % | [3] |
| shank's skin, share of the knee's excursion | 3 % | [2], [4] |
| foot's skin, share of the ankle's excursion | 6 % | [5] |
| hip's, knee's, ankle's excursion alone | -2 ± 5, -1 ± 4, -2 ± 5 % | as solvers leave it |
| each of these, right less left | 40 % of its size | chosen |
| speed of the belt | 1.25 % | [6] |
| left leg longer, right one shorter | 0.5 % | 6.5 mm between the legs [7] |
| left hip centre forward, up | 5 mm | what of Harrington's (2007) 5-13 mm is of one side |
| heel's, forefoot's contact forward | 10 mm | a shoe's heel and rocker |

Those of skin and excursions are studies' SDs, of which the fit takes `SHARED.narrower`: two
descriptions of the same skin at once are wider than any study's.

1. Fiorentino et al. 2020, J Biomech 108:109890: markers underestimate the hip's range.
2. Ancillao et al. 2021 (CAMS-Knee data): clusters turn by up to 10 and 7°.
3. Bonci et al. 2014, J Biomech 47:2354: artefacts of the thigh are linear in hip and knee angle.
4. Benoit et al. 2006, Gait Posture 24:152: errors of the knee to 4.4° of 60°.
5. PMC8085108 (dual fluoroscopy): ankle angles up to 7° too small.
6. Willwacher et al. 2021, Sci Rep 11: belts run at 98 to 103 % of the speed that was set.
7. Knutson 2005, Chiropr Osteopat 13:11: legs differ by 5 mm in the mean.
"""

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, solve_triangular

from gaitval._internal.numba.one_thread import one_thread
from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES
from gaitval.identification.body_fit import BodyFit, BodyPosterior
from gaitval.identification.legs import LegDifference, causes
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import PARAMETERS
from gaitval.model.tree import COORDINATE_COUNT, Tree
from gaitval.walk.contact.law import ContactLaw
from gaitval.walk.reference.dynamic_fit import (
    Linearised,
    Problem,
    Solution,
    linear_terms,
    linearised,
    normal_equations,
    weighted_laws,
)

_FEET: Final = [SEGMENTS.index(f"foot_{side}") for side in "rl"]


@dataclass(frozen=True)
class SharedErrors:
    """Spreads of the errors that plates and legs share, and how far the search for them goes."""

    forward: int = 3
    """Coordinate of the pelvis's travel."""
    own: float = 0.4
    """Size of the difference between the sides of an error of soft tissue, of the common one."""
    belt: float = 0.0125
    left_leg: float = 0.005
    left_hip: float = 0.005
    sole: float = 0.010
    """SDs; see above."""
    narrower: float = 0.6
    """Factor on the SDs of `SKIN`, so that a hip's excursion is known to 4.7 % instead of 7.8 %.
    The records of the ten built-in people are likelier with it (docs/what-we-tried.md), as are legs
    of 38 harsh people of seed 424242, whose intervals still hold."""
    trust: float = 0.6
    """Share of a record's information that counts. A likelihood that is wrong in its model says
    more than it knows; raised to a power below 1 it says less. Chosen on people of
    `experiments/harsher_people.py` of commit 60ee3cba."""
    largest_deviance: float = 300.0
    """Of minus twice the log posterior at the mode. The ten built-in people have 67 to 176, 196
    harsh ones 99 to 225; beyond this the record contradicts the model, and nothing is updated."""
    stuck: float = 0.5
    """Of minus twice the log posterior; see `Shared.left`."""
    near: int = 2
    away: float = 0.3
    """Pairs of points, and how many posterior SDs they lie from the mode, see `_covariance`."""
    steps: int = 30
    gain: float = 1e-5
    most_damping: float = 1e4


SHARED: Final = SharedErrors()

SKIN: Final[Mapping[str, tuple[float, float, str, Mapping[str, float]]]] = {
    "thigh's skin by hip": (-0.03, 0.06, "hip_flexion", {"hip_flexion": 1.0, "knee_angle": 1.0}),
    "thigh's skin by knee": (0.0, 0.02, "knee_angle", {"hip_flexion": 1.0, "knee_angle": 1.0}),
    "shank's skin by knee": (0.0, 0.03, "knee_angle", {"knee_angle": 1.0, "ankle_angle": 1.0}),
    "foot's skin by ankle": (0.0, 0.06, "ankle_angle", {"ankle_angle": 1.0}),
    "hip's excursion": (-0.02, 0.05, "hip_flexion", {"hip_flexion": 1.0}),
    "knee's excursion": (-0.01, 0.04, "knee_angle", {"knee_angle": 1.0}),
    "ankle's excursion": (-0.02, 0.05, "ankle_angle", {"ankle_angle": 1.0}),
}
"""Mean and SD of the share, whose excursion, and which angles it is added to. A thigh that seems
turned forward bends hip and knee; a shank that seems turned back bends the knee and the ankle."""
SOLE_ENDS: Final = ("heel forward", "forefoot forward")
BODY_ERRORS: Final = ("left leg", "left hip forward", "left hip up", *SOLE_ENDS)
"""Unknowns that change the body instead of the record; the last ones."""
NAMES: Final = (
    *(f"{name}, {which}" for name in SKIN for which in ("both", "right less left")),
    "belt",
    *BODY_ERRORS,
)
"""Unknowns, in their order among `Shared.values`."""
_SIZES: Final = np.array(
    [*(SHARED.narrower * size for _, sd, _, _ in SKIN.values() for size in (sd, SHARED.own * sd)),
     SHARED.belt, SHARED.left_leg, SHARED.left_hip, SHARED.left_hip, SHARED.sole, SHARED.sole]
)  # fmt: skip
_MEANS: Final = np.array(
    [
        *(
            mean
            for each, sd, _, _ in SKIN.values()
            for mean in (each / (SHARED.narrower * sd), 0.0)
        ),
        *(0.0 for _ in ("belt", *BODY_ERRORS)),
    ]
)
"""Prior means in SDs."""


@dataclass(frozen=True)
class Shared:
    """What was found with shared errors among the unknowns.

    Attributes
    ----------
    posterior : of mu, with motion, laboratory's faults and shared errors integrated out.
    values, sd : (K,) of `NAMES`, shares and m, posterior.
    solution : motion and the fit's own numbers at the mode.
    cost : sum of squares there, with the priors.
    shift, joint : (16,) and (16, 16), posterior mean less prior mean of mu and of the sole's ends,
        and their covariance, in prior SDs.
    legs : by how much the left one is longer.
    steps : Gauss-Newton steps that were taken.
    left : by how much another step would lower the cost if all were linear; large where the steps
        ended too early.

    Of what the record says `SHARED.trust` counts, in all but `solution`, `cost` and `left`; nothing
    if it does not fit (`fits`).
    """

    posterior: BodyPosterior
    values: Array
    sd: Array
    solution: Solution
    cost: float
    shift: Array
    joint: Array
    legs: LegDifference
    steps: int
    left: float

    @property
    def fits(self) -> bool:
        """Whether the record fits the model well enough to say anything of the body."""
        return self.cost <= SHARED.largest_deviance


class SharedFit:
    """The fit of motion and body to a record together with its shared errors.

    Parameters
    ----------
    fit : of the record.
    sizes : (K,) SDs of the shared errors in the order of `NAMES`; 0 leaves one out.
    offset : (16,) in prior SDs, of mu and of the sole's ends, by which the prior's mean is moved
        for what models and laboratories get wrong on everybody; see `offsets`.
    """

    def __init__(
        self, fit: BodyFit, sizes: Array | None = None, offset: Array | None = None
    ) -> None:
        self.sizes = _SIZES if sizes is None else np.asarray(sizes, dtype=float)
        self._means = _MEANS.copy()
        self._laboratory = offset is not None and bool(np.any(offset))
        if offset is not None:
            fit = _moved(fit, offset[: len(PARAMETERS)])
            self._means[-len(SOLE_ENDS) :] += offset[len(PARAMETERS) :]
        self.fit, plain = fit, fit.problem
        self._plain, self._count = plain, len(plain.prior)
        tree = plain.bodies(np.zeros(self._count))[0]
        on_foot = np.isin(tree.sphere_segment, _FEET)
        self._heel = on_foot & (tree.sphere_position[:, 0] < 0.0)
        self._skin = _patterns(plain, self.sizes[: 2 * len(SKIN)])
        self._speed = float(plain.path[1][:, SHARED.forward].mean()) * self.sizes[2 * len(SKIN)]
        lever = np.zeros((*plain.lever.shape[:2], self._count + len(NAMES)))
        lever[..., : self._count] = plain.lever
        last = self._count + len(NAMES)
        self._problem = plain._replace(
            bodies=self._body,
            varied=(*plain.varied, *range(last - len(BODY_ERRORS), last)),
            lever=lever,
            prior=np.concatenate([plain.prior, np.ones(len(NAMES))]),
        )

    def _body(self, common: Array) -> tuple[Tree, ContactLaw]:
        """The body with legs that differ."""
        tree, law = self._plain.bodies(common[: self._count])
        errors = (self.sizes * (common[self._count :] + self._means))[-len(BODY_ERRORS) :]
        leg, forward, up, heel, forefoot = errors
        joints, spheres = tree.joint_position.copy(), tree.sphere_position.copy()
        spheres[:, 0] += np.where(self._heel, heel, forefoot)
        for side, sign in (("l", 1.0), ("r", -1.0)):
            for name in ("shank", "foot"):
                joints[SEGMENTS.index(f"{name}_{side}"), 2] *= 1.0 + sign * leg
        joints[SEGMENTS.index("thigh_l")] += [forward, 0.0, up]
        return tree._replace(joint_position=joints, sphere_position=spheres), law

    def _at(self, common: Array) -> Problem:
        """The problem whose record is freed of the shared errors in `common`."""
        values = common[self._count :] + self._means
        wrong = np.tensordot(values[: 2 * len(SKIN)], self._skin, axes=1)  # (31, n)
        path = [
            part - series @ wrong.T
            for part, series in zip(self._plain.path, self._plain.series, strict=True)
        ]
        path[1] = path[1].copy()
        path[1][:, SHARED.forward] -= self._speed * values[2 * len(SKIN)]
        return self._problem._replace(path=(path[0], path[1], path[2]))

    def _linearised(self, problem: Problem, change: Array, common: Array) -> Linearised:
        """With the derivatives by errors of angles and belt: minus those by the motion."""
        laws = linearised(problem, change, common, 1.0)
        slope, lever = laws.slope, laws.lever
        for order, series in enumerate(problem.series):
            part = slope[:, :, order * COORDINATE_COUNT : (order + 1) * COORDINATE_COUNT]
            moved = np.einsum("tn,kdn->tdk", series, self._skin, optimize=True)
            lever[:, :, self._count : self._count + 2 * len(SKIN)] -= part @ moved
        lever[:, :, self._count + 2 * len(SKIN)] -= (
            slope[:, :, COORDINATE_COUNT + SHARED.forward] * self._speed
        )
        return laws

    def _cost(self, change: Array, common: Array) -> float:
        problem = self._at(common)
        residual, _ = weighted_laws(problem, change, common, 1.0)
        linear, prior = linear_terms(problem, change), problem.prior * common
        return float(np.sum(residual**2) + np.sum(linear**2) + np.sum(prior**2))

    @one_thread()
    def solve(self, start: Solution) -> Shared:
        """The most likely motion, body and shared errors, and their covariance, from `start`, a
        solution of `fit` with the body free or held.
        """
        change, common = start.change, np.concatenate([start.common, np.zeros(len(NAMES))])
        size, cost, damping, steps = change.size, self._cost(change, common), 1e-4, 0
        while steps < SHARED.steps:
            steps += 1
            problem = self._at(common)
            laws = self._linearised(problem, change, common)
            matrix, gradient = normal_equations(problem, change, common, laws)
            before = cost
            while damping < SHARED.most_damping:
                damped = matrix.copy()
                damped.flat[:: len(damped) + 1] *= 1.0 + damping
                try:
                    step = cho_solve(
                        cho_factor(damped, overwrite_a=True, check_finite=False), gradient
                    )
                except LinAlgError:
                    damping *= 10.0
                    continue
                tried = change - step[:size].reshape(change.shape), common - step[size:]
                tried_cost = self._cost(*tried)
                if tried_cost < cost:
                    (change, common), cost = tried, tried_cost
                    damping = max(0.2 * damping, 1e-8)
                    break
                damping = max(8.0 * damping, 1e-6)
            if before - cost < SHARED.gain * cost:
                break
        return self._found(change, common, cost, steps)

    def _covariance(self, change: Array, common: Array) -> tuple[Array, float]:
        """Of `common`, as the mean of Laplace's at the mode and at points near it.

        A sole that begins to touch an instant sooner changes the slopes at that instant only, and
        with them the SD of a leg by up to a third in one point of eight. Also what another step
        would gain at the mode.
        """
        random = np.random.default_rng(0)
        place = np.concatenate([change.ravel(), common])
        found, away = [], np.zeros_like(place)
        for index in range(1 + 2 * SHARED.near):
            at = place + (0.0 if index == 0 else (-1.0) ** index) * away
            parts = at[: change.size].reshape(change.shape), at[change.size :]
            problem = self._at(parts[1])
            laws = self._linearised(problem, *parts)
            matrix, gradient = normal_equations(problem, *parts, laws)
            root = np.linalg.cholesky(matrix)
            columns = solve_triangular(
                root, np.eye(len(matrix))[:, -len(common) :], lower=True, check_finite=False
            )
            found.append(columns.T @ columns)
            if index == 0:
                own = root
                down = solve_triangular(root, gradient, lower=True, check_finite=False)
                left = float(down @ down)
            if index % 2 == 0:
                drawn = random.standard_normal(len(place))
                away = SHARED.away * solve_triangular(own.T, drawn, lower=False, check_finite=False)
        return np.asarray(np.mean(found, axis=0)), left

    def _found(self, change: Array, common: Array, cost: float, steps: int) -> Shared:
        (covariance, left), wanted = self._covariance(change, common), len(common)
        own = slice(None, self._count)
        mode = Solution(change, common[own], covariance[own, own], cost)
        common, covariance = tempered(
            common,
            covariance,
            self._problem.prior,
            SHARED.trust if cost <= SHARED.largest_deviance else 0.0,
        )
        solution = Solution(change, common[own], covariance[own, own], cost)
        legs = np.zeros(wanted)
        tree, _ = self.fit.problem.bodies(common[own])
        length = -sum(
            tree.joint_position[SEGMENTS.index(f"{name}_{side}"), 2] / 2.0
            for name in ("shank", "foot") for side in "rl"
        )  # fmt: skip
        for name, each in (("left leg", 2.0 * length), ("left hip up", -1.0)):
            index = NAMES.index(name) - len(NAMES)
            legs[index] = each * self.sizes[index]
        sd = np.sqrt(np.diag(covariance))[self._count :]
        mu = self.fit.near(solution, self.fit.prior_mean + np.inf).common == np.inf
        both = [*np.flatnonzero(mu), *range(wanted - len(SOLE_ENDS), wanted)]
        return Shared(
            posterior=self.fit.posterior(solution),
            values=self.sizes * (common[self._count :] + self._means),
            sd=self.sizes * sd,
            solution=mode,
            cost=cost,
            shift=common[both],
            joint=covariance[np.ix_(both, both)],
            legs=LegDifference(
                float(legs @ common),
                float(np.sqrt(legs @ covariance @ legs)),
                float(np.sqrt(legs @ legs)),
                causes(
                    _extensions(self._plain),
                    length,
                    self._laboratory,
                    fitted=np.sqrt(2.0) * self.fit.angle_offset,
                ),
            ),
            steps=steps,
            left=left,
        )


def tempered(common: Array, covariance: Array, prior: Array, trust: float) -> tuple[Array, Array]:
    """Mean (K,) and `covariance` (K, K) of unknowns about a prior mean of 0 and of the precision
    `prior`² (K,), with the share `trust` of what the data say.
    """
    before = np.diag(prior**2)
    after = np.linalg.inv(covariance)
    kept = np.linalg.inv(before + trust * (after - before))
    return kept @ (trust * (after @ common)), (kept + kept.T) / 2


def _extensions(problem: Problem) -> dict[str, float]:
    """Least flexion of each knee as recorded, rad."""
    return {s: float(problem.path[0][:, COORDINATES.index(f"knee_angle_{s}")].min()) for s in "rl"}


def _moved(fit: BodyFit, offset: Array) -> BodyFit:
    """The fit with its prior's mean moved by `offset` (14,) SDs."""
    moved = copy(fit)
    moved.prior_mean = fit.prior_mean + fit.prior_sd * offset
    moved.problem = fit.problem._replace(bodies=moved.body)
    return moved


def _patterns(problem: Problem, sizes: Array) -> Array:
    """(2 S, 31, n) by which each unknown of soft tissue, at one SD, adds to the recorded angles."""
    series = problem.series[0]
    # Series of the recorded coordinates: mean of the cosines' and sines' products, their means off.
    recorded = np.linalg.lstsq(series, problem.path[0], rcond=None)[0].T
    recorded[:, 0] = 0.0
    found = np.zeros((len(sizes), *recorded.shape))
    for index, (_, _, driver, targets) in enumerate(SKIN.values()):
        for side, sign in (("r", 1.0), ("l", -1.0)):
            excursion = recorded[COORDINATES.index(f"{driver}_{side}")]
            for target, factor in targets.items():
                row = COORDINATES.index(f"{target}_{side}")
                found[2 * index, row] += factor * sizes[2 * index] * excursion
                # Half of the difference on either side.
                found[2 * index + 1, row] += 0.5 * sign * factor * sizes[2 * index + 1] * excursion
    return found


@one_thread()
def identified(fit: BodyFit, fixed_body: Solution, offset: Array | None = None) -> Shared:
    """What `fit` finds from `fixed_body`, its solution with the body as scaled; `offset` of the
    prior's mean as in `SharedFit`. If the steps ended early, `SHARED.stuck`, they begin again from
    the mode without shared errors, and the likelier of the two is taken.
    """
    shared = SharedFit(fit, offset=offset)
    found = shared.solve(fixed_body)
    if found.left > SHARED.stuck:
        found = min((found, shared.solve(shared.fit.mode(fixed_body))), key=lambda each: each.cost)
    return found
