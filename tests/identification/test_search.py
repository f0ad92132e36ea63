"""CMA-ES: it finds what was planted, and ends by its rule."""

import numpy as np
import pytest

from gaitval.configuration import IdentificationSettings
from gaitval.identification.search import search

SIZE = 12


def bowl(planted):
    """The sum of squares about a point, narrow in some directions."""
    widths = np.linspace(0.4, 1.0, SIZE)

    def evaluate(points):
        return [float(np.sum(((each - planted) / widths) ** 2)) for each in points]

    return evaluate


def find(evaluate, *, seed=0, generations=400, **options):
    settings = IdentificationSettings(generations=generations)
    return search(evaluate, SIZE, settings=settings, seed=seed, **options)


def planted(seed=0):
    return np.random.default_rng(seed).normal(0.0, 1.0, SIZE)


@pytest.mark.parametrize("seed", [0, 1])
def test_it_finds_the_minimum_and_says_that_it_has_converged(seed):
    found = find(bowl(planted(seed)), seed=seed)
    np.testing.assert_allclose(found.best, planted(seed), atol=0.08)
    assert found.converged
    assert len(found.history) < 200
    assert [row.generation for row in found.history] == list(range(1, len(found.history) + 1))
    assert found.history[-1].best < 0.05


def test_a_search_that_is_cut_short_has_not_converged():
    found = find(bowl(planted()), generations=5)
    assert not found.converged
    assert len(found.history) == 5


def test_it_starts_at_the_prior_with_the_papers_population():
    seen = []

    def evaluate(points):
        seen.extend(points)
        return [0.0] * len(points)

    find(evaluate, generations=1)
    assert len(seen) == 8
    # eight draws with SD 0.5: their mean is 0.18 away at one standard error
    assert np.abs(np.mean(seen, axis=0)).max() < 0.7


def test_one_seed_gives_one_search_and_another_a_different_one():
    first, again, other = (find(bowl(planted()), seed=s, generations=5).best for s in (0, 0, 1))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
