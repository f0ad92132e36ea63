"""The posterior of the body parameters mu, from a record and how the body was measured.

A candidate body must be able to walk as recorded: with its feet on the ground where the treadmill
takes them, carried by the contact law, without a force on the pelvis. Bodies differ in how far a
motion of theirs must depart from the recorded curves. So the motion and mu are found together, by
the fit that makes reference motions (`walk.reference.dynamic_fit`), with mu among its unknowns and
deviations weighed by a noise model (`NoiseSettings`): the reference is rebuilt for every body that
is tried. No policy has a part in it; the errors of a walker from its reference are larger than what
a body parameter changes.

The result is the mode of the posterior, and its covariance from the normal equations at the mode
(Laplace's approximation), with the motion and the laboratory's faults integrated out.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval._internal.numba.one_thread import one_thread
from gaitval.arrays import Array, Flags
from gaitval.configuration import ContactSettings, NoiseSettings
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, SIDES
from gaitval.gait.plate_correction import SHIFT_SIGNS
from gaitval.gait.record import GaitRecord
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.model.tree import ROOT_DOFS, Tree, tree_arrays
from gaitval.walk.contact.law import ContactLaw, contact_law
from gaitval.walk.reference.dynamic_fit import (
    DYNAMIC_FIT,
    INFERENCE,
    Problem,
    Solution,
    fit_problem,
    solve_problem,
    with_softer_friction,
)
from gaitval.walk.reference.motion import FEED_FORWARD, MOTION, ReferenceMotion, build_reference
from gaitval.walk.reference.walking_laws import FOOT, FOOT_NUMBERS


@dataclass(frozen=True)
class FitSettings:
    """Sizes of the fit of a body."""

    plates: int = 2
    """First numbers of `Solution.common`: shifts of the plates; then the lean of the trunk."""
    fixed: float = 1e6
    """1 / prior SD of a number that is held."""
    mode_gain: float = 1e-5
    """Relative decrease of the sum of squares at which a mode is found, to hundredths of an SD."""


FIT: Final = FitSettings()

BODY: Final = FIT.plates + 1
"""First of the numbers that are mu, in units of the prior's SD."""
NUISANCES: Final = BODY + len(PARAMETERS)
"""First of the errors of the laboratory's joint centres, in units of their SD."""
_CENTRES: Final = tuple(
    (name, side)
    for side in SIDES
    for name in ("hip_flexion", "knee_angle", "ankle_angle", "hip_adduction")
)
"""Moments about a joint centre that the laboratory has in the wrong place."""
_ANGLES: Final = ("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle")
"""Coordinates of the reference that are recorded angles, without their side."""
_SHOWN: Final = slice(2, len(PARAMETERS))
"""Parameters that the fit looks for. Passive damping is a part of the net joint moments that are
recorded, and friction does not matter to a foot that does not slip. The record determines neither,
and the fit must not seem to, by way of the smoothing of the contact law."""


@dataclass(frozen=True)
class BodyPosterior:
    """Gaussian approximation of the posterior of mu; arrays in the order of `PARAMETERS`.

    Attributes
    ----------
    mean : (14,) mode.
    covariance : (14, 14).
    prior_mean, prior_sd : (14,).
    plates : (2,) m, shifts of the right and left plate at the mode.
    """

    mean: Array
    covariance: Array
    prior_mean: Array
    prior_sd: Array
    plates: Array

    @property
    def sd(self) -> Array:
        """(14,) standard deviations."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def contraction(self) -> Array:
        """(14,) posterior SD / prior SD."""
        return np.asarray(self.sd / self.prior_sd)


class BodyFit:
    """The joint fit of motion and mu to one record.

    Parameters
    ----------
    record : with moments and forces.
    model : as scaled.
    contact : the contact law.
    noise : also of the plates, about the shifts that the record was corrected for.
    prior_sd : (14,) of mu about the nominal parameters.
    """

    def __init__(
        self,
        record: GaitRecord,
        model: BodyModel,
        contact: ContactSettings,
        noise: NoiseSettings,
        *,
        prior_sd: Array,
    ) -> None:
        # The walker's friction has minima a hair apart, between which bodies would be compared.
        contact = with_softer_friction(contact)
        self.reference = build_reference(record, model, contact)
        self.prior_mean, self.prior_sd = nominal_parameters(), np.asarray(prior_sd, dtype=float)
        self._model, self._contact, self._noise = model, contact, noise
        self.angle_offset: float = noise.angle_offset
        self.problem = self._problem(record)

    def body(self, common: Array) -> tuple[Tree, ContactLaw]:
        """The body of a solution's `common`, and the ground under it."""
        mu = self.mu(common)
        body = tree_arrays(apply_parameters(self._model, mu))
        return body, contact_law(self._contact, float(mu[1]))

    def mu(self, common: Array) -> Array:
        """The parameters (14,) among a solution's `common`."""
        return self.prior_mean + self.prior_sd * common[BODY:NUISANCES]

    def _problem(self, record: GaitRecord) -> Problem:
        noise, model = self._noise, self._model
        plain = fit_problem(self.reference, record, model, self._contact, INFERENCE, noise.plate)
        count = NUISANCES + len(_CENTRES)
        # `common` is longer here than in the plain fit: plates and lean, then mu, joint centres.
        lever = np.zeros((*plain.lever.shape[:2], count))
        lever[..., :BODY] = plain.lever[..., :BODY]
        weights = _law_weights(plain.weight, model.mass, noise)
        for index, (name, side) in enumerate(_CENTRES):
            row = COORDINATES.index(f"{name}_{side[0]}")
            # A joint centre that is out of place by a length changes the moment about it by the
            # vertical force times this length.
            vertical = plain.target[:, FOOT + FOOT_NUMBERS * SIDES.index(side) + 2]
            sign = SHIFT_SIGNS.get(name, 1.0)
            lever[:, row, NUISANCES + index] = sign * noise.joint_centre * vertical
        penalty, miss = _angle_terms(self.reference, plain, noise)
        # mu and joint centres are in units of their prior SD, so their prior is 1.
        prior = np.ones(count)
        prior[:BODY] = plain.prior[:BODY]
        return plain._replace(
            bodies=self.body,
            # Only these change the body. Damping and friction keep their columns, which stay zero,
            # so that the prior alone determines them.
            varied=tuple(range(BODY, NUISANCES)[_SHOWN]),
            lever=lever,
            weight=weights,
            penalty=penalty,
            miss=miss,
            prior=prior,
        )

    def solve(
        self,
        *,
        fixed: Array | None = None,
        start: Solution | None = None,
        smallest_gain: float = 1e-4,
        with_covariance: bool = True,
    ) -> Solution:
        """The most likely motion and mu, from a `start` nearby, with mu `fixed` (14,) if it is held
        instead of found. The steps end at a relative decrease of the sum of squares of
        `smallest_gain`. `with_covariance` is as for `solve_problem`.
        """
        problem = self.problem
        begin = None if start is None else (start.change.copy(), start.common.copy())
        prior = problem.prior.copy()
        if fixed is not None:
            # The held mu is added to the body that is built, and the unknowns that are mu are held
            # at zero by a narrow prior: the equations keep their size.
            unit = np.zeros(len(prior))
            unit[BODY:NUISANCES] = (fixed - self.prior_mean) / self.prior_sd
            if begin is not None:
                begin[1][BODY:NUISANCES] = 0.0
            whole = problem.bodies
            problem = problem._replace(bodies=lambda common: whole(common + unit), varied=())
            prior[BODY:NUISANCES] = FIT.fixed
        return solve_problem(
            problem._replace(prior=prior), start=begin, smallest_gain=smallest_gain,
            with_covariance=with_covariance,
        )  # fmt: skip

    def as_scaled(self, near: ReferenceMotion | None = None) -> Solution:
        """The most likely motion of the body as scaled, from the reference of the record on this
        body, if that is `near`: in a third of the steps to a minimum that is as likely on the whole
        (docs/speed.md). None: from a standstill. It has no covariance: mu is held.
        """
        start = None
        if near is not None:
            start = Solution(near.change, np.zeros(len(self.problem.prior)), np.empty(0), np.inf)
        return self.solve(fixed=self.prior_mean, start=start, with_covariance=False)

    def mode(self, start: Solution) -> Solution:
        """The most likely of what the fit finds from `start`."""
        return self.solve(start=start, smallest_gain=FIT.mode_gain)

    @staticmethod
    def looked_for() -> Flags:
        """(14,) which parameters the fit can say anything about."""
        found = np.zeros(len(PARAMETERS), dtype=bool)
        found[_SHOWN] = True
        return found

    def near(self, solution: Solution, mu: Array) -> Solution:
        """The solution with another mu (14,), to start from."""
        common = solution.common.copy()
        common[BODY:NUISANCES] = (mu - self.prior_mean) / self.prior_sd
        return solution._replace(common=common)

    @one_thread()
    def posterior(self, solution: Solution | None = None) -> BodyPosterior:
        """The posterior of mu around the mode `solution`, which is computed if not given."""
        found = solution or self.solve()
        part = slice(BODY, NUISANCES)
        return BodyPosterior(
            mean=self.mu(found.common),
            covariance=found.covariance[part, part] * np.outer(self.prior_sd, self.prior_sd),
            prior_mean=self.prior_mean,
            prior_sd=self.prior_sd,
            plates=found.common[: FIT.plates],
        )


def _law_weights(plain: Array, mass: float, noise: NoiseSettings) -> Array:
    """Weights (T, 52) of the laws' numbers: those of Newton's laws and of the trunk stay, those of
    moments and forces are the noise model's.
    """
    weights, weight = plain.copy(), mass * GRAVITY
    # The 160 instants of a curve share smooth errors: they count as `independent` measurements.
    norm = np.sqrt(noise.independent / DYNAMIC_FIT.instants)
    for i, side in enumerate(SIDES):
        place = FOOT + FOOT_NUMBERS * i
        sizes = np.array([noise.forward_force, noise.medial_force, noise.vertical_force])
        weights[:, place : place + 3] = norm / (sizes * weight)
        for name in FEED_FORWARD:
            row = COORDINATES.index(f"{name}_{side[0]}")
            size = noise.adduction_moment if name == "hip_adduction" else noise.moment
            weights[:, row] = norm / (size * mass)
    return weights


def angle_sd(noise: NoiseSettings) -> Array:
    """Standard deviation (1 + 2 H,) rad of a measured angle's error over the cycle, of the mean,
    the cosines and the sines: an offset (`angle_offset` of `noise`), and a waveform of the RMS
    `angle`, rad, whose harmonics fall off with the square of their number beyond `angle_harmonics`.
    """
    harmonic = np.arange(1, MOTION.harmonics + 1)
    size = np.minimum(1.0, (noise.angle_harmonics / harmonic) ** 2)
    # A harmonic's cosine and sine with SD s contribute s² to the mean square: ½ s² each.
    size *= noise.angle / np.sqrt(np.sum(size**2))
    return np.concatenate([[noise.angle_offset], size, size])


def _angle_terms(
    reference: ReferenceMotion, plain: Problem, noise: NoiseSettings
) -> tuple[Array, Array]:
    """Penalties of the recorded angles by harmonic, instead of by instant; see `Problem`. The mean
    place of the pelvis is free.
    """
    series = plain.series[0]
    instants, terms = series.shape
    assert terms <= instants
    penalty, miss = plain.penalty.copy(), plain.miss.copy()
    # By harmonic, because errors of markers are smooth: independent errors at 160 instants would
    # pretend to far more information than the record has.
    whiten = np.diag(1.0 / angle_sd(noise))
    names = (name.rpartition("_")[0] for name in ACTUATED)
    recorded = [*range(3), *(ROOT_DOFS + i for i, name in enumerate(names) if name in _ANGLES)]
    for k in recorded:
        penalty[k], miss[k] = 0.0, 0.0
        penalty[k, :terms] = whiten
        if k >= ROOT_DOFS:
            miss[k, 0] = whiten[0, 0] * reference.offsets[k - ROOT_DOFS]
    # Where the pelvis is on the whole follows from the body, not from the one that was scaled.
    for k in range(3, ROOT_DOFS):
        penalty[k, :instants] -= penalty[k, :instants].mean(axis=0)
    return penalty, miss
