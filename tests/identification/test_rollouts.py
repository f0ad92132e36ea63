"""The paper's identification: bodies that walk at once, and a search that lowers epsilon."""

from pathlib import Path

import numpy as np
import pytest

from gaitval.configuration import load_configuration
from gaitval.identification.prior import prior_sd
from gaitval.identification.rollouts import FALLEN, BodyWalks, identified_by_rollouts
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.policy.storage import load_start
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject

GENERAL = Path(__file__).parents[2] / "reports" / "general"
CONFIGURATION = load_configuration()


def walks_of(name):
    """Of the general policy, against this subject's record."""
    subject = load_subject(name)
    policy = load_start(GENERAL, CONFIGURATION.environment)
    return BodyWalks(subject.record(), scale_subject(subject).model, policy, CONFIGURATION)


@pytest.mark.slow  # walks eight bodies twice
def test_bodies_in_one_group_walk_as_each_does_alone():
    walks = walks_of("S05")
    longer = nominal_parameters()
    longer[PARAMETERS.index("thigh_length")] = 1.01  # with 1.03 it falls
    together = walks([nominal_parameters(), longer])
    assert together[0] != together[1]
    np.testing.assert_allclose(walks([longer]), together[1:], rtol=1e-6)
    assert walks.count == 3
    assert all(0.05 < each < 1.0 for each in together)


@pytest.mark.slow  # three generations of eight walks
def test_a_search_of_a_few_generations_is_no_worse_than_its_first_body():
    settings = CONFIGURATION.identification.model_copy(update={"generations": 3})
    seen: list[float] = []
    found = identified_by_rollouts(
        walks_of("S05"), prior_sd(load_subject("S05")), settings, seed=1,
        on_generation=lambda _, best: seen.append(best),
    )  # fmt: skip
    assert len(seen) == 3
    assert found.walks == 3 * 8 + 2
    assert not found.searched.converged
    np.testing.assert_array_equal(found.mu[:2], nominal_parameters()[:2])


class _Fallen:
    """Walks that all end on the ground."""

    count = 0

    def __call__(self, mus):
        return [FALLEN for _ in mus]


def test_where_every_body_falls_the_body_stays_as_scaled():
    settings = load_configuration(settings=["identification.generations=3"]).identification
    found = identified_by_rollouts(_Fallen(), np.full(14, 0.02), settings)
    np.testing.assert_array_equal(found.mu, nominal_parameters())
    assert found.epsilon == found.before == FALLEN
