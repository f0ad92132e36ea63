"""Every contact law there is: chosen by its name, the same in every engine, alone or in lanes."""

from importlib import import_module
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest
from followed_page import section_of
from simulation_fixtures import changed

from gaitval._internal.numba.lanes import WIDTH
from gaitval.configuration import Configuration, ContactSettings
from gaitval.model.tree import tree_arrays
from gaitval.session.opensim.osim import write_osim
from gaitval.study.unread import unread
from gaitval.walk.contact.forces import ground_forces
from gaitval.walk.contact.law import LAWS, contact_law, sphere_force
from gaitval.walk.simulation.side_by_side import SideBySide
from gaitval.walk.simulation.walker import Walker

R = 0.02


def law_of(name):
    return contact_law(ContactSettings(law=name), 0.8)


def force(law, depth, velocity=(0.0, 0.0, 0.0)):
    out = np.full(3, np.nan)
    slopes = sphere_force(law, R, R - depth, np.array(velocity, dtype=float), out)
    return out, slopes


SOME = [
    pytest.param(name, marks=() if name == "hunt_crossley" else pytest.mark.slow) for name in LAWS
]
"""The law of the settings; the others, for which the engines are compiled anew, in CI."""


def test_the_configuration_names_every_law():
    assert set(get_args(ContactSettings.model_fields["law"].annotation)) == LAWS.keys()


def test_laws_read_settings_that_exist_and_none_has_anothers():
    read = [name for law in LAWS.values() for name in law().settings]
    assert len(read) == len(set(read))
    assert set(read) < ContactSettings.model_fields.keys()


@pytest.mark.parametrize("name", LAWS)
def test_each_setting_of_a_law_changes_its_force(name):
    """So none is a setting without effect, and none acts through its place in a row."""
    moving = 0.01, (0.05, -0.025, -0.2)
    before = force(law_of(name), *moving)[0]
    for setting in LAWS[name]().settings:
        value = 0.7 * getattr(ContactSettings(), setting)
        law = contact_law(ContactSettings(**{"law": name, setting: value}), 0.8)
        assert np.abs(force(law, *moving)[0] - before).max() > 1e-3 * before[2], setting
    for other in set(LAWS) - {name}:
        values = {key: 0.7 * getattr(ContactSettings(), key) for key in LAWS[other]().settings}
        np.testing.assert_array_equal(
            force(contact_law(ContactSettings(**{"law": name} | values), 0.8), *moving)[0], before
        )


@pytest.mark.parametrize("name", LAWS)
def test_friction_brakes_and_is_never_more_than_the_coefficient_times_the_load(name):
    contact = ContactSettings(law=name, viscous_friction=0.0)
    law = contact_law(contact, 0.6)
    for seed in range(20):
        # slow enough across the ground that no smoothing pulls at the foot
        velocity = np.random.default_rng(seed).uniform(-1.0, 1.0, 3) * [1.0, 1.0, 0.25]
        out, slopes = force(law, 0.008, velocity)
        assert out[:2] @ velocity[:2] <= 0.0
        assert np.hypot(*out[:2]) <= 0.6 * abs(out[2]) * (1 + 1e-9)
        assert min(slopes) >= 0.0


@pytest.mark.parametrize("name", LAWS)
def test_the_static_force_carries_a_resting_sphere(name):
    """But for the smoothing, a few per cent at these depths."""
    law, depth = law_of(name), np.array([0.005, 0.01, 0.02])
    seen = [force(law, each)[0][2] for each in depth]
    np.testing.assert_allclose(law.static_force(np.full(3, R), depth), seen, rtol=0.4)
    np.testing.assert_allclose(law.static_force(np.full(1, R), depth[2:]), seen[2:], rtol=0.03)


def walked(task, engine, actions=20):
    walker = Walker(task, engine=engine)
    reference = task.reference
    walker.reset(reference.positions[0], reference.velocities[0], 0.0)
    for _ in range(actions):
        walker.step(np.zeros(25), np.zeros(6))
    return walker


@pytest.mark.parametrize("name", SOME)
def test_it_walks_in_dart_as_in_the_compiled_engine(task, name):
    """A fifth of a second from the reference: rounding grows, but the walks are the same."""
    with_law = changed(task, contact={"law": name})
    ours, darts = (walked(with_law, engine) for engine in ("compiled", "dart"))
    np.testing.assert_allclose(ours.state[0], darts.state[0], atol=1e-6)
    carried = ours.mean_ground_reaction[:, 2].sum() / ours.weight
    assert 0.2 < carried < 3.0


@pytest.mark.slow  # compiles an engine for every law
def test_laws_walk_apart(task):
    """The law of the settings is the one that acts."""
    states = [walked(changed(task, contact={"law": name}), "compiled").state[0] for name in LAWS]
    assert np.abs(states[0] - states[1]).max() > 1e-4


@pytest.mark.parametrize("name", SOME)
def test_eight_side_by_side_walk_as_each_alone(task, name):
    tasks = changed(task, contact={"law": name})
    alone, rows = [], np.arange(WIDTH) * len(task.reference.phase) // WIDTH
    for row in rows:
        walker = Walker(tasks)
        walker.reset(
            task.reference.positions[row], task.reference.velocities[row], float(row) / 1024
        )
        alone.append(walker)
    beside = SideBySide(alone)
    arrays = beside.arrays
    arrays.pace[:] = 1.0
    for lane, walker in enumerate(alone):
        arrays.walkers.state[..., lane] = walker.state
        arrays.walkers.memory[..., lane] = walker._memory
        arrays.phase[0, lane] = walker.phase
    for _ in range(5):
        beside.advance()
        for walker in alone:
            walker.step(np.zeros(25), np.zeros(6))
    for lane, walker in enumerate(alone):
        np.testing.assert_array_equal(arrays.walkers.state[..., lane], walker.state)


def test_one_law_for_all_that_walk_side_by_side(task):
    walkers = [Walker(changed(task, contact={"law": name})) for name in LAWS]
    with pytest.raises(AssertionError, match="one contact law"):
        SideBySide([walkers[0]] * (WIDTH - 1) + [walkers[1]])


@pytest.mark.parametrize("name", LAWS)
def test_opensims_file_has_the_forces_that_opensim_knows(task, name, tmp_path):
    path = tmp_path / "model.osim"
    write_osim(path, task.model, (), ContactSettings(law=name), 0.8)
    known = law_of(name).opensim()
    assert ("SmoothSphereHalfSpaceForce" in path.read_text()) == (known is not None)
    assert "<ContactSphere " in path.read_text()


def test_a_run_says_which_settings_its_law_does_not_read():
    configuration = Configuration(contact=ContactSettings(law="cubic", stiffness=2e6))
    messages = [line for line in unread(configuration, (), "general") if "stiffness" in line]
    assert messages == [
        "contact.stiffness = 2000000.0 has no effect: nothing in this run reads it, it is of "
        "another contact law."
    ]


HEADER = """
from typing import NamedTuple

from gaitval._internal.numba.compiled import njit_borrowing
from gaitval._internal.numba.lanes import sqrt, where

SLIP = 0.05

"""


def test_the_law_of_the_documentation_acts_on_the_feet(task, tmp_path, monkeypatch):
    """One file is its force; nothing in the engines names a law."""
    page = section_of("extend.md#choose-or-add-a-contact-law")
    code = [line for line in page.splitlines() if line.startswith(" " * 8) or not line]
    text = HEADER + "\n".join(line[8:] for line in code)
    (tmp_path / "linear.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    # numba's index of what is compiled names the type, which nobody can import after this test
    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile.save", lambda *_: None)
    linear = import_module("linear").Linear
    law = linear.of(SimpleNamespace(linear_stiffness=2e4, linear_dissipation=0.0), 5.0)
    out = np.empty(3)
    sphere_force(law, R, R - 0.01, np.array([0.1, 0.0, 0.0]), out)
    assert out == pytest.approx([-5.0 * 200.0 * 0.1 / np.hypot(0.1, 0.05), 0.0, 200.0])
    q, feet = np.zeros(31), np.zeros((2, 6))
    model = task.model
    sole = min(s.position[2] - s.radius for s in model.spheres if s.segment == "foot_r")
    q[5] = model.leg_length - sole - 0.01
    ground_forces(
        tree_arrays(model), law, q, np.zeros(31), np.zeros(2), np.zeros((12, 3)), np.zeros(31), feet
    )
    assert feet[:, 2] == pytest.approx(6 * 2e4 * 0.01, rel=1e-9)
