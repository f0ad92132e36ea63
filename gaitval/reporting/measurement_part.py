"""What the page of an import asks of what stands above it."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:  # it loads matplotlib
    from gaitval.reporting.page import Draw


class MeasurementPart(Protocol):
    """A part of the page with a `template` of its own, which reads the rest of it."""

    @property
    def template(self) -> str:
        """As `page.write_page` takes it."""

    def drawings(self, extensor_positive: bool = False) -> "Mapping[str, Draw]":
        """The figures of the part, with moments drawn either way round."""
