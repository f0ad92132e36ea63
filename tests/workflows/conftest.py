"""What tests of whole commands have in common."""

from collections.abc import Iterator

import pytest
from html_page import only_quick_tests, unpainted, whole_pages, without_figures


@pytest.fixture(scope="module", autouse=True)
def _words_alone(request: pytest.FixtureRequest) -> Iterator[None]:
    """Without the slow tests, pages come without figures: these tests read words and numbers, and
    those of `tests/reporting` look at the figures. With them, as in CI, everything is drawn, for a
    recording that lacks something may have no curve where a figure wants one; but it is painted
    only where GAITVAL_WHOLE_PAGES is set, since that is half of the time of an import."""
    with pytest.MonkeyPatch.context() as patch:
        if only_quick_tests(request.config):
            without_figures(patch)
        elif not whole_pages():
            unpainted(patch)
        yield
