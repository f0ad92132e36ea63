"""What each fault does to forces and moments, against the fault itself."""

from types import SimpleNamespace

import numpy as np
import pytest

from gaitval.session.measurement.balance import (
    GroundWrenches,
    _drift,
    _plate_effects,
    _Row,
    newton,
)

MIDDLE = np.array([0.3, 0.2, 0.0])
WEIGHT = 700.0
SMALL = 1e-5


def wrench():
    """Force N and moment Nm about the origin of a plate under a foot."""
    found = np.random.default_rng(3).standard_normal((5, 6))
    found[:, 2] += WEIGHT
    return found


def about(change):
    """A fault that changes (T, 6) force and moment about the plate's middle."""

    def planted(right, size):
        f, m = right[:, :3], right[:, 3:] - np.cross(MIDDLE, right[:, :3])
        f, m = change(f.copy(), m.copy(), size)
        return np.hstack([f, m + np.cross(MIDDLE, f)])

    return planted


def times(*factors):
    """Of force and moment, (6,) shares of the size."""
    of = np.array(factors)
    return lambda f, m, size: (f * (1 + size * of[:3]), m * (1 + size * of[3:]))


def turned(f, m, size):
    turn = np.array([[np.cos(size), -np.sin(size), 0], [np.sin(size), np.cos(size), 0], [0, 0, 1]])
    return f @ turn.T, m @ turn.T


def moved(axis):
    return lambda f, m, size: (f, m + np.cross(size * np.eye(3)[axis], f))


def crossed(axis):
    return lambda f, m, size: (f + size * f[:, 2:] * np.eye(3)[axis], m)


def offset(axis):
    return lambda f, m, size: (f + size * WEIGHT * np.eye(3)[axis], m)


PLANTED = {
    "gain": times(1, 1, 1, 1, 1, 1),
    "vertical gain": times(0, 0, 1, 0, 0, 0),
    "fore-aft gain": times(1, 0, 0, 0, 0, 0),
    "moment gain": times(0, 0, 0, 1, 1, 0),
    "rotation": turned,
    "place x": moved(0),
    "place y": moved(1),
    "cross-talk x": crossed(0),
    "cross-talk y": crossed(1),
    "offset x": offset(0),
    "offset y": offset(1),
    "offset z": offset(2),
}
WHOLE = {
    "mirrored moment": times(0, 0, 0, -2, 0, 0),
    "fore-aft sign": times(-2, 0, 0, 0, 0, 0),
    "sideways sign": times(0, -2, 0, 0, 0, 0),
}


@pytest.mark.parametrize("name", PLANTED)
def test_a_small_fault_adds_its_effect(name):
    right = wrench()
    added = about(PLANTED[name])(right, SMALL) - right
    effect = np.hstack(_plate_effects(right, MIDDLE, WEIGHT)[name])
    np.testing.assert_allclose(added / SMALL, effect, rtol=1e-3, atol=1e-2)


@pytest.mark.parametrize("name", WHOLE)
def test_a_fault_that_is_there_whole_is_undone_by_its_effect(name):
    right = wrench()
    wrong = about(WHOLE[name])(right, 1.0)
    effect = np.hstack(_plate_effects(wrong, MIDDLE, WEIGHT)[name])
    np.testing.assert_allclose(wrong - effect, right, atol=1e-9)


def test_a_free_moment_of_the_wrong_sign_is_undone_about_the_centre_of_pressure():
    force, free, point = np.array([[30.0, -20.0, WEIGHT]]), 4.0, np.array([[0.4, 0.1, 0.0]])
    wrong, right = (
        np.hstack([force, np.cross(point, force) + np.array([0.0, 0.0, sign * free])])
        for sign in (-1, 1)
    )
    effect = np.hstack(_plate_effects(wrong, MIDDLE, WEIGHT)["free moment sign"])
    np.testing.assert_allclose(wrong - effect, right, atol=1e-9)


def wrenches(seconds, slower=0.0):
    """Two plates; the second is late by some `seconds`, the clock of both slow by a share."""
    time = np.arange(300) / 100.0 * (1.0 - slower)
    each = []
    for phase, by in ((0.0, 0.0), (np.pi, seconds)):
        up = 0.5 * WEIGHT * (1.0 + np.sin(2.0 * np.pi * (time - by) + phase))
        each.append(np.stack([0.1 * up, 0.02 * up, up, 0.1 * up, -0.4 * up, 0.0 * up], axis=1))
    return GroundWrenches(
        feet=np.stack(each, axis=1), on=np.ones((300, 2), bool), valid=np.ones((300, 2), bool),
        plates=np.stack(each), height=0.0, rate=100.0,
    )  # fmt: skip


def test_a_plate_that_alone_is_late_shows_what_its_delay_adds():
    """Two plates, the second late by 5 ms: what Newton's law has too much is that of its effect."""
    plates = SimpleNamespace(plates=[SimpleNamespace(name="1"), SimpleNamespace(name="2")])
    centre, needed = np.tile([0.3, 0.1, 0.9], (300, 1)), np.zeros((300, 6))
    known = centre, needed, plates, [np.zeros(3)] * 2, WEIGHT
    right, _ = newton(wrenches(0.0), *known)
    wrong, effects = newton(wrenches(0.005), *known)
    inside = slice(5, -5)
    assert np.abs(wrong - right)[inside].max() > 0.01
    np.testing.assert_allclose(
        (wrong - right)[inside], 0.005 * effects["plate delay 2"][inside], atol=3e-4
    )


def test_a_slow_clock_of_the_forces_makes_them_later_and_later():
    right, slow = (wrenches(0.0, slower).feet[:, :1] for slower in (0.0, 0.002))
    on = np.ones((300, 1), bool)
    centre = np.tile([0.3, 0.1, 0.9], (300, 1))
    force, moment = right[:, 0, :3], right[:, 0, 3:]
    needed = np.hstack([force, moment - np.cross(centre, force)])
    ground = GroundWrenches(slow, on, on, np.zeros((0, 300, 6)), height=0.0, rate=100.0)
    wrong, effects = newton(ground, centre, needed, SimpleNamespace(plates=[]), [], WEIGHT)
    inside = slice(5, -5)
    assert np.abs(wrong)[inside].max() > 0.01
    # by 1.5 s, the middle, they are late by as much as a delay makes them
    effect = effects["clock"] + 1.495 * effects["delay"]
    np.testing.assert_allclose(wrong[inside], 0.002 * effect[inside], atol=1e-3)


def test_a_drift_is_what_differs_from_stride_to_stride():
    """Two bins of three strides, of which the forces of each come later than those before."""
    pooled = {
        ("force z", "", b): [
            _Row("force z", "", b, 0.0, 0.3 * b + 0.004 * later, ("clock",), np.array([later]))
            for later in (0.0, slope, 2.0 * slope)
        ]
        for b, slope in ((0, 1.5), (1, -0.5))
    }  # fmt: skip
    value, error = _drift(pooled, {"force z": 0.01})
    assert value == pytest.approx(0.004)
    own = 2.0 * 0.01 / np.sqrt(2.0 * (1.5**2 + 0.5**2))
    assert error == pytest.approx(np.hypot(own, 0.0005))
    once = {key: rows[:1] for key, rows in pooled.items()}
    assert _drift(once, {"force z": 0.01}) is None
