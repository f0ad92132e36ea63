"""How likely positions are under assignments that differ from one by a few markers.

What changes is small: the markers that leave their places are taken out of the normal distribution
of all by the blocks of its precision, and those that come are added by their conditional
distribution (Bishop 2006, Pattern Recognition and Machine Learning, eq. 2.81 and 2.82). The result
is that of the whole distribution, for a tenth of the work.
"""

from typing import Final

import numpy as np
from scipy.linalg import cho_solve

from gaitval.arrays import Array, Index
from gaitval.scaling.markers.body import Population

LOG_2PI: Final = float(np.log(2.0 * np.pi))


class Nearby:
    """Log densities of `points` (N, 3) near the assignment `chosen` (N,) to the places of `people`,
    whose covariance is factored in `factor`, with `off` the distances from their means.
    """

    def __init__(
        self,
        points: Array,
        people: Population,
        chosen: Index,
        factor: tuple[Array, bool],
        off: Array,
    ) -> None:
        self.points = points
        self.people = people
        self.chosen = chosen
        who = np.flatnonzero(chosen >= 0)
        count = len(people.sites)
        self.at = np.full(len(chosen), -1)
        self.at[who] = np.arange(len(who))
        self.shared = people.shared[:-1, :-1]
        cross = self.shared.reshape(count, 3, count, 3)[:, :, chosen[who], :]
        cross = cross.reshape(3 * count, len(off))
        self.precision = cho_solve(factor, np.eye(len(off)), check_finite=False)
        self.weighted = self.precision @ off
        self.gain = cross @ self.precision
        self.expected = cross @ self.weighted
        self.left = self.shared - self.gain @ cross.T
        self.density = float(
            -0.5 * off @ self.weighted - np.log(np.diag(factor[0])).sum() - 0.5 * len(off) * LOG_2PI
        )

    def log_density(self, changed: Index) -> float:
        """That of the points on places, in another assignment."""
        moved = np.flatnonzero(changed != self.chosen)
        leaves = _rows(self.at[moved[self.chosen[moved] >= 0]])
        comes = moved[changed[moved] >= 0]
        found = self.density
        if len(leaves):
            block = np.linalg.inv(self.precision[leaves[:, None], leaves])
            pull = self.weighted[leaves]
            found += 0.5 * float(pull @ block @ pull + np.linalg.slogdet(block)[1])
            found += 0.5 * len(leaves) * LOG_2PI
        if len(comes):
            places = changed[comes]
            rows = _rows(places)
            apart = (self.points[comes] - self.people.mean[places]).ravel() - self.expected[rows]
            spread = self.left[rows[:, None], rows]
            for i, own in enumerate(self.people.own[places]):
                spread[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += own
            if len(leaves):
                gain = self.gain[rows[:, None], leaves]
                apart = apart + gain @ (block @ pull)
                spread = spread + gain @ block @ gain.T
            found -= 0.5 * float(apart @ np.linalg.solve(spread, apart))
            found -= 0.5 * float(np.linalg.slogdet(spread)[1]) + 0.5 * len(rows) * LOG_2PI
        return found

    def everywhere(self, marker: int) -> Array:
        """(K,) log density of one marker on each place, given those of all others."""
        count = len(self.people.sites)
        index = np.arange(count)
        spread = self.left.reshape(count, 3, count, 3)[index, :, index, :] + self.people.own
        apart = self.points[marker] - self.people.mean - self.expected.reshape(count, 3)
        if self.at[marker] >= 0:
            leaves = slice(3 * self.at[marker], 3 * self.at[marker] + 3)
            block = np.linalg.inv(self.precision[leaves, leaves])
            gain = self.gain[:, leaves].reshape(count, 3, 3)
            apart = apart + gain @ (block @ self.weighted[leaves])
            spread = spread + gain @ block @ gain.transpose(0, 2, 1)
        weighted = np.linalg.solve(spread, apart[:, :, None])[:, :, 0]
        exponent = -0.5 * np.einsum("ki,ki->k", apart, weighted)
        return np.asarray(exponent - 0.5 * np.linalg.slogdet(spread)[1] - 1.5 * LOG_2PI)


def _rows(of: Index) -> Index:
    """Rows of the coordinates of some points."""
    return np.asarray((3 * of[:, None] + np.arange(3)).ravel())
