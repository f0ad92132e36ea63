"""Many walkers at once in MuJoCo Warp: on every device that there is, the steps of our engine."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_fixtures import task_of_subject

from gaitval.constants import GRAVITY
from gaitval.errors import ConfigurationError
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.simulation.walker import Trajectory, Walker

pytestmark = pytest.mark.slow
COUNT = 6


@pytest.fixture(params=["cpu", "cuda:0"])
def device(request):
    import warp

    if request.param not in [each.alias for each in warp.get_devices()]:
        pytest.skip(f"no {request.param}")
    return request.param


def accelerated_walkers(walkers, device):
    """Loaded here: every worker collects this file, and Warp takes a second and more to load."""
    from gaitval.apps.accelerator.walkers import AcceleratedWalkers

    return AcceleratedWalkers(walkers, device)


@pytest.fixture(scope="module")
def tasks():
    return [task_of_subject("S05"), task_of_subject("S02")]


def standing_at(walker, phase):
    reference = walker.task.reference
    row = round(phase * len(reference.phase))
    walker.reset(reference.positions[row], reference.velocities[row], phase)


def crowd(tasks, seed=3):
    """Walkers of two people, each with a body of its own, from all over the cycle."""
    rng = np.random.default_rng(seed)
    walkers = [Walker(tasks[i % len(tasks)]) for i in range(COUNT)]
    for i, walker in enumerate(walkers):
        walker.set_parameters(nominal_parameters() * rng.uniform(0.95, 1.05, len(PARAMETERS)))
        standing_at(walker, i / COUNT)
    return walkers


def wanted(rng, actions):
    """Offsets, pushes and paces of all walkers."""
    for _ in range(actions):
        yield (
            rng.normal(0.0, 0.03, (COUNT, 25)),
            rng.normal(0.0, 20.0, (COUNT, 6)),
            rng.normal(1.0, 0.05, COUNT),
        )


def test_their_steps_are_those_of_the_compiled_engine(tasks, device):
    """0.3 s of it, to single precision; by then every foot has landed or left the ground."""
    import warp

    alone, together = crowd(tasks), crowd(tasks)
    accelerated = accelerated_walkers(together, device)
    landed = np.zeros((COUNT, 2, 2), dtype=bool)
    for action, (offset, force, pace) in enumerate(wanted(np.random.default_rng(5), 30)):
        for i, walker in enumerate(alone):
            walker.step(offset[i], force[i], pace=pace[i])
            for on in (0, 1):
                landed[i, :, on] |= (walker.mean_ground_reaction[:, 2] > 20.0) == bool(on)
        if action % 2:  # also what is on the device already
            offset, force, pace = (
                warp.array(values, dtype=float, device=device) for values in (offset, force, pace)
            )
        accelerated.advance(offset, force, pace)
        accelerated.leave()
        for ours, theirs in zip(alone, together, strict=True):
            np.testing.assert_allclose(theirs.state[0], ours.state[0], atol=3e-5)
            np.testing.assert_allclose(theirs.state[1], ours.state[1], atol=2e-3)
            assert theirs.phase == pytest.approx(ours.phase, abs=1e-7)
            weight = ours.task.model.mass * GRAVITY
            for name in ("mean_ground_reaction", "mean_moments"):
                np.testing.assert_allclose(
                    getattr(theirs, name), getattr(ours, name), atol=2e-4 * weight
                )
            np.testing.assert_allclose(
                theirs.mean_square_moments, ours.mean_square_moments, rtol=1e-3, atol=0.1
            )
    assert landed.all(axis=2).any(axis=0).all(), "both feet swing and stand"


def test_mujocos_step_with_that_damping_is_ours(tasks):
    """In double precision, with MuJoCo's C step in the place of DART's."""
    from gaitval.apps.accelerator.walkers import _bodies

    walker = Walker(tasks[0])
    peer = Walker(tasks[0], engine="dart")
    peer._outside = _bodies([walker])[0]
    for each in (walker, peer):
        standing_at(each, 0.9)
    rng = np.random.default_rng(7)
    for _ in range(100):
        offset, force = rng.normal(0.0, 0.03, 25), rng.normal(0.0, 20.0, 6)
        for each in (walker, peer):
            each.step(offset, force)
    np.testing.assert_allclose(peer.state, walker.state, atol=1e-9)


def test_without_ground_and_servos_momentum_is_only_gravitys(tasks, device):
    walkers = [Walker(tasks[0]) for _ in range(2)]
    for walker in walkers:
        standing_at(walker, 0.2)
        walker.state[0, 5] += 1.0  # a metre above the ground
        walker._memory[:] = 0.0
    accelerated = accelerated_walkers(walkers, device)
    before = [centre_of_mass_velocity(walker) for walker in walkers]
    none = np.zeros((2, 25))
    pushes = np.zeros((2, 6))
    pushes[1, 3:] = 30.0, -20.0, 10.0
    for _ in range(10):
        accelerated.advance(none, pushes, np.ones(2))
    accelerated.leave()
    seconds = 10 * walkers[0].action_seconds
    for walker, was, push in zip(walkers, before, pushes, strict=True):
        gained = push[3:] / walker.task.model.mass + np.array([0.0, 0.0, -GRAVITY])
        now = centre_of_mass_velocity(walker)
        np.testing.assert_allclose(now - was, gained * seconds, atol=2e-3)
        assert not walker.mean_ground_reaction.any()


def centre_of_mass_velocity(walker):
    """From the places of the centre of mass a millisecond apart."""
    from gaitval.model.tree import centres_of_mass
    from gaitval.simulation.dynamics import integrate

    half = 5e-4
    places = []
    for sign in (-1.0, 1.0):
        state = walker.state.copy()
        integrate(state, np.zeros(31), sign * half)
        places.append(state[0])
    tree = walker.tree
    there = centres_of_mass(tree, np.array(places))
    return (there[1] - there[0]) / (2 * half)


def test_where_it_stopped_a_walker_goes_on_alone(tasks):
    """Its state, offset and contact forces are back: the next action has no jump."""
    alone, together = crowd(tasks), crowd(tasks)
    accelerated = accelerated_walkers(together, "cpu")
    for offset, force, pace in wanted(np.random.default_rng(8), 4):
        for i, walker in enumerate(alone):
            walker.step(offset[i], force[i], pace=pace[i])
        accelerated.advance(offset, force, pace)
    accelerated.leave()
    seen = []
    for walker in (alone[0], together[0]):
        trajectory = Trajectory(walker.steps_per_action)
        walker.step(np.zeros(25), np.zeros(6), trajectory)
        seen.append(trajectory.feet)
    np.testing.assert_allclose(seen[1], seen[0], atol=2e-4 * alone[0].weight)
    accelerated.enter()
    np.testing.assert_allclose(accelerated.states()[0][0], together[0].state[0], atol=1e-6)


def test_another_contact_law_is_refused(tasks):
    configuration = tasks[0].configuration
    contact = configuration.contact.model_copy(update={"law": "cubic"})
    task = replace(tasks[0], configuration=configuration.model_copy(update={"contact": contact}))
    with pytest.raises(ConfigurationError, match=r"contact\.law: Cubic .* only hunt_crossley"):
        accelerated_walkers([Walker(task)], "cpu")
