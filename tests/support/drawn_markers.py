"""Markers of a drawn person, for tests of `gaitval markers`."""

import numpy as np

from gaitval.mocap.recording import Recording
from gaitval.scaling.markers.body import populations

LEGS = [
    "R.ASIS",
    "L.ASIS",
    "R.PSIS",
    "L.PSIS",
    "R.Trochanter",
    "L.Trochanter",
    "R.Knee",
    "L.Knee",
    "R.Knee.Medial",
    "L.Knee.Medial",
    "R.Tuberosity",
    "L.Tuberosity",
    "R.Ankle",
    "L.Ankle",
    "R.Ankle.Medial",
    "L.Ankle.Medial",
    "R.Heel",
    "L.Heel",
    "R.MT1",
    "L.MT1",
    "R.MT5",
    "L.MT5",
]
NAMES = dict(
    zip(
        LEGS,
        [
            "RASI",
            "LASI",
            "RPSI",
            "LPSI",
            "RGT",
            "LGT",
            "RKNE",
            "LKNE",
            "RKNM",
            "LKNM",
            "RTT",
            "LTT",
            "RANK",
            "LANK",
            "RMED",
            "LMED",
            "RHEE",
            "LHEE",
            "RFMH",
            "LFMH",
            "RVMH",
            "LVMH",
        ],
        strict=True,
    )
)
"""Names as laboratories write them."""


def drawn_person(random: np.random.Generator, *, named: bool = True) -> Recording:
    """Markers on the legs of a person who stands still for a second; y is up."""
    people = populations()["arms hang"]
    index = [[site.label for site in people.sites].index(label) for label in LEGS]
    # Half a standard deviation beside the mean, all in a random direction of the distribution.
    shared = people.shared[:-1, :-1].reshape(len(people.sites), 3, len(people.sites), 3)
    covariance = shared[index][:, :, index].reshape(3 * len(index), -1)
    values, vectors = np.linalg.eigh(covariance)
    drawn = vectors @ (np.sqrt(np.maximum(values, 0)) * random.standard_normal(len(values)))
    own = np.array([np.diag(people.own[k]) for k in index])
    points = people.mean[index] + 0.5 * drawn.reshape(-1, 3)
    points += 0.5 * np.sqrt(own) * random.standard_normal(points.shape)
    turn = np.radians(35.0)
    yaw = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    up_is_y = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    points = points @ yaw.T @ up_is_y.T + [2.0, 0.3, -1.0]
    markers = np.repeat(points[None], 100, axis=0)
    markers += 0.0005 * random.standard_normal(markers.shape)
    names = [NAMES[label] if named else f"M{k}" for k, label in enumerate(LEGS)]
    return Recording(
        source="drawn",
        axes="laboratory",
        marker_rate=100.0,
        names=tuple(names),
        markers=markers,
    )
